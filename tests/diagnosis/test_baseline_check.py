"""Whether a plain regression is far better, on ships whose equations are polynomials."""

from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest

from shiplog.diagnosis.verdict import baseline_check
from shiplog.voyages.windows.windows import Windows

VOYAGES = ("one", "two", "three")
DRIFT = 0.05  # m/s² of sway at full rudder


def sailed(voyages) -> Windows:
    """Four windows of 40 s a voyage: sway grows by DRIFT times the rudder, by Euler steps."""
    rng = np.random.default_rng(3)
    count = 4 * len(voyages)
    rudder = np.repeat(rng.uniform(-1.0, 1.0, (count, 8)), 5, axis=1)[..., None]
    state = np.zeros((count, 40, 6))
    state[..., 1] = 0.5
    state[:, 1:, 3] = DRIFT * np.cumsum(rudder[:, :-1, 0], axis=1)
    plan = pl.DataFrame({"voyage": np.repeat(voyages, 4).tolist()})
    return Windows(plan, state, rudder, np.zeros((count, 40, 0)), np.ones((count, 39)))


def run_that(states) -> SimpleNamespace:
    """A run of a physical model that simulates these states of windows."""
    simulator = SimpleNamespace(theta=None, states=lambda cut, theta: states(cut.state.copy()))
    return SimpleNamespace(
        lacks="", judges_itself=True, trained_on=VOYAGES, extended=lambda seed: simulator,
        config=SimpleNamespace(seeds=(0,)),
    )  # fmt: skip


def without_sway(state):
    state[..., 3] = 0.0
    return state


@pytest.fixture
def asked(monkeypatch):
    names = []

    def windows_of(run, store, wanted, profile):
        names.append(list(wanted))
        return sailed(wanted) if wanted else None

    monkeypatch.setattr(baseline_check, "windows_of", windows_of)
    return names


def stored(*names: str) -> SimpleNamespace:
    return SimpleNamespace(there=lambda wanted: [n for n in wanted if n in names])


def test_a_force_that_the_model_does_not_have_is_named_by_its_channel(asked):
    """The regression is exact, but for its ridge and its range: it has none of the error."""
    why = baseline_check.lacking(run_that(without_sway), stored(*VOYAGES), None)
    assert "does not describe this ship's sway force" in why and "has 0% of its error" in why
    assert baseline_check.lacking(run_that(lambda state: state), stored(*VOYAGES), None) == ""


def test_voyages_that_are_no_longer_stored_are_not_asked(asked):
    why = baseline_check.lacking(run_that(without_sway), stored("one", "three"), None)
    assert asked == [["one", "three"]] and "sway" in why


@pytest.mark.parametrize("names", [(), ("two",)], ids=["none", "one"])
def test_fewer_than_two_voyages_say_nothing_of_it(asked, names):
    assert baseline_check.lacking(run_that(without_sway), stored(*names), None) == ""
