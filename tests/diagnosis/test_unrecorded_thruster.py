"""An unrecorded thruster, placed between the places that are tried first."""

import math
from dataclasses import replace
from types import SimpleNamespace

import afloat
import numpy as np
import pytest

from shiplog.diagnosis.hypotheses import unrecorded_thruster
from shiplog.diagnosis.linear import linear_segments, segments
from shiplog.diagnosis.noise import likelihood, raised_noise
from shiplog.diagnosis.noise.on_off import Course


def test_an_unrecorded_thruster_is_placed_where_it_stands(monkeypatch):
    """Its place [m ahead of midship] and force between those that are tried first, from products
    drawn with it: sway and yaw rate accelerated together."""
    rng = np.random.default_rng(5)
    ship, coefficients = afloat.MODEL, dict(zip(afloat.MODEL.names, afloat.THETA, strict=True))
    unit = unrecorded_thruster.accelerations(ship, coefficients, np.array([[0.0, 1.0, 1.1]]))[0]
    nodes, count = 16, 300
    process_noise = replace(afloat.PROCESS_NOISE, intermittent=1.7 * unit)
    z = np.eye(6 + 3 * nodes)[None].repeat(count, 0)  # all of it measured, as well as a node can be
    drawn = np.zeros((count, 6 + 3 * nodes, 1))
    drawn[:, 6:, 0] = rng.multivariate_normal(
        np.zeros(3 * nodes), process_noise.kernel(nodes), count
    )
    sure = 1e12
    weighed = likelihood.Weighed(
        sure * np.swapaxes(drawn, 1, 2) @ drawn, sure * drawn, sure * z, 0.0, nodes
    )
    reference = SimpleNamespace(
        model=SimpleNamespace(stand_in=ship), coefficients=coefficients,
        setting=SimpleNamespace(scale={"length": 3.0}), counts=1.0,
    )  # fmt: skip
    cut = segments.Cut(
        np.arange(count), np.zeros((count, 1, 6)), np.ones((count, 1, 6), dtype=bool),
        np.zeros((count, 1, 1)), np.zeros(count), 0.2,
    )  # fmt: skip
    path = linear_segments.Path(np.zeros((count, 6)), np.zeros((count, 3, nodes)))
    linear = linear_segments.Linear(
        cut, path, np.zeros((count, 1, 6)), np.zeros((count, 1, 6, 6 + 3 * nodes)),
        np.zeros((count, 1, 6, 0)),
    )  # fmt: skip
    monkeypatch.setattr(likelihood, "weighed", lambda *_: weighed)
    left = raised_noise.residual(linear, np.zeros(0), afloat.PROCESS_NOISE, np.ones(count), 1.0)
    found = unrecorded_thruster.estimate_side_force(left, reference)
    assert found.lever == pytest.approx(1.1, abs=0.05)
    assert found.force == pytest.approx(1.7, rel=0.1)
    assert found.gain > 1000.0


def side_force(lever: float, force: float = 1.0) -> unrecorded_thruster.SideForce:
    """Of a ship that 1 N accelerates sideways by 0.01 m/s² and 1 N m turns by 0.02 rad/s²."""
    unit, turning = np.array([0.0, 0.01, 0.02 * lever]), np.array([0.0, 0.0, 0.02])
    return unrecorded_thruster.SideForce(
        0.0, 1.0, lever, force, unit, lasts=2.0, turning=turning, reach=1.5
    )


@pytest.mark.parametrize(
    ("rate", "lever", "force"),
    [(0.8, 1.0, 2.0), (-0.5, 1.0, 2.0), (0.95, None, None)],
    ids=["slow steps", "steps to and fro", "ten steps on at most"],
)
def test_steps_that_shrink_by_one_rate_lead_to_their_limit(rate, lever, force):
    """A place and a logarithm of a force whose distance from 1 m and 2 N is `rate` times that of
    the step before."""

    def at(distance: float) -> unrecorded_thruster.SideForce:
        return side_force(1.0 + distance, 2.0 * math.exp(-distance))

    zero, one, two = at(0.5), at(0.5 * rate), at(0.5 * rate**2)
    found = unrecorded_thruster.extrapolated((zero, one), (one, two))
    if lever is None:
        assert found.lever == pytest.approx(two.lever + 10.0 * (two.lever - one.lever))
        return
    assert (found.lever, found.force) == (pytest.approx(lever), pytest.approx(force))
    assert found.unit == pytest.approx([0.0, 0.01, 0.02 * lever])
    assert found.remainder.intermittent == pytest.approx(tuple(found.unit * found.force))
    assert found.lasts == pytest.approx(2.0)


def test_sizes_of_another_kind_are_not_extrapolated():
    """Of a force that may act at any time, and of one while it is on."""
    always, device = side_force(0.2), replace(side_force(0.4), course=Course(((30, 60),), -9.0))
    assert unrecorded_thruster.extrapolated((always, device), (device, device)) is device
    assert unrecorded_thruster.extrapolated((always, always), (always, device)) is device


def test_extrapolation_goes_no_farther_than_the_ship_reaches():
    """Steps that do not get shorter: ten of them, or to the bow."""
    zero, one, two = side_force(0.1), side_force(0.2), side_force(0.4)
    assert unrecorded_thruster.extrapolated((zero, one), (one, two)).lever == 1.5
    still = side_force(0.2), side_force(0.2)
    assert unrecorded_thruster.extrapolated(still, still).lever == 0.2
