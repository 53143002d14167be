"""The coverage experiment: its own quantities against closed forms, and shares of its tables."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipelines.experiments.manoeuvre_coverage import tables, trials
from pipelines.experiments.manoeuvre_coverage.coefficients import OF_FAMILY
from pipelines.experiments.manoeuvre_coverage.one_ship import FAMILIES
from pipelines.experiments.manoeuvre_coverage.trials import Sailed, Trial
from tests.manoeuvres.exact_ships import Nomoto

LENGTH, TEN = 50.0, math.radians(10.0)


def sailed(trial: Trial, time, state, orders) -> Sailed:
    """As a voyage has it; `state` [n, 6] in the order of channels.STATE."""
    x, u, y, v, psi, r = state.T
    voyage: Any = SimpleNamespace(
        time=time, x0=x, y0=y, heading=psi, surge=u, sway=v, yaw_rate=r,
        ship=SimpleNamespace(length=LENGTH),
    )  # fmt: skip
    return Sailed(trial, voyage, tuple(orders))


@pytest.mark.parametrize("side", (1.0, -1.0), ids=("starboard", "port"))
def test_a_circle_in_a_current(side):
    """Of radius R through the water: advance R, transfer R, diameters 2 R, whatever moves it."""
    radius, speed, drift = 100.0, 5.0, np.array([0.3, -0.2])
    time = np.arange(0.0, 2.6 * 2.0 * math.pi * radius / speed, 0.1)
    psi = 0.7 + side * speed / radius * np.maximum(time - 20.0, 0.0)
    c, s = np.cos(psi), np.sin(psi)
    north, east = speed * c + drift[0], speed * s + drift[1]
    state = np.zeros((len(time), 6))
    for i, rate in ((0, north), (2, east)):
        state[1:, i] = np.cumsum(0.05 * (rate[1:] + rate[:-1]))
    state[:, 1], state[:, 3] = north * c + east * s, east * c - north * s
    state[:, 4], state[:, 5] = psi, np.gradient(psi, time)
    trial = Trial("turn", "turn", side * math.radians(35.0), 0.0, 0.6)
    found = trials.true_quantities(sailed(trial, time, state, [20.0]))
    of_radius = {name: found[name] * LENGTH / radius for name in
                 ("advance", "transfer", "tactical_diameter", "steady_diameter")}  # fmt: skip
    assert of_radius == pytest.approx(
        {"advance": 1.0, "transfer": 1.0, "tactical_diameter": 2.0, "steady_diameter": 2.0},
        rel=2e-3,
    )
    assert found["drift_angle"] == pytest.approx(0.0, abs=0.05)
    assert found["speed_loss"] == pytest.approx(0.0, abs=2e-3)


def test_a_first_order_ships_zigzag():
    ship = Nomoto(0.12, 8.0, TEN, TEN, 5.0, orders=5)
    time, state, _ = ship.sampled(0.1, ship.peak(5)[0] + 5.0)
    trial = Trial("zigzag_10", "zigzag", TEN, TEN, 0.6)
    found = trials.true_quantities(sailed(trial, time, state, ship.orders))
    peaks = [ship.peak(k) for k in (1, 2, 3)]
    for name, peak in zip(("first", "second", "third"), peaks, strict=True):
        over = math.degrees(abs(peak[1]) - TEN)
        assert found[f"{name}_overshoot"] == pytest.approx(over, abs=0.01)
    assert found["check_time"] == pytest.approx(peaks[0][0] - ship.orders[1], abs=0.06)
    assert found["period"] == pytest.approx(peaks[2][0] - peaks[0][0], abs=0.11)
    assert found["initial_turning"] == pytest.approx(5.0 * ship.orders[1] / LENGTH, rel=1e-3)


def test_shares_are_of_each_interval_and_what_has_none_is_counted():
    row = {"trial": "turn", "quantity": "advance", "true": 3.0, "calm": 3.3,
           "measured": [3.0, 2.9, 3.1, ""], "simulated": [3.2, 3.1, 3.4, ""]}  # fmt: skip
    other = {"trial": "turn", "quantity": "drift_angle", "true": 9.0, "calm": 9.0}
    ships = [{"ship": 0, "family": "abkowitz", "changed": "", "quantities": [row, other]}]
    found = tables.quantities(ships)
    held = {(r["what"], r["against"]): r["inside"] for r in found.iter_rows(named=True)}
    assert held == {
        ("measured", "true"): True, ("simulated", "true"): False, ("simulated", "calm"): True,
    }  # fmt: skip
    assert found.filter(what="measured")["width"].item() == pytest.approx(0.2 / 3.0)
    assert tables.missing(ships) == {"measured": 1, "simulated": 1}
    assert tables.share(9, 10) == "90% (55 to 100)"  # Clopper & Pearson's 0.5550 to 0.9975


def test_every_family_has_its_coefficients():
    assert set(OF_FAMILY) == set(FAMILIES)
