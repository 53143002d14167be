"""External forces of known size and time, hidden in a voyage, and voyages without."""

from dataclasses import replace

import afloat
import numpy as np
import pytest

from shiplog.diagnosis.residual import external_forces
from shiplog.diagnosis.residual.external_forces import Stretch

START, END = 70.0, 85.0
NONE = np.zeros(0)


@pytest.fixture(scope="module")
def sailed():
    return afloat.voyage(150.0)


def balance(record):
    return external_forces.balance(
        afloat.linear(record), NONE, afloat.PROCESS_NOISE, record, afloat.MODEL, afloat.THETA
    )


def found(record) -> tuple[Stretch, ...]:
    return external_forces.find(balance(record), record)


def under(sailed, force, noise=1.0):
    """Its record with `force` (X, Y in N, N in N m) on it from START to END."""
    acceleration = np.zeros((len(sailed.time), 3))
    acceleration[(sailed.time >= START) & (sailed.time < END)] = force
    return afloat.record(sailed, afloat.sailed_with(sailed, acceleration), noise)


@pytest.mark.parametrize(
    ("force", "channel"),
    [((12.0, 0.0, 0.0), "surge"), ((-15.0, 0.0, 0.0), "surge"), ((0.0, 60.0, 0.0), "sway"),
     ((0.0, 0.0, -30.0), "yaw_rate")],
    ids=["ahead", "held back", "aside", "turned"],
)  # fmt: skip
def test_an_external_force_is_found_in_time_and_size(sailed, force, channel):
    (stretch,) = found(under(sailed, force))
    assert stretch.voyage == "one"
    assert stretch.channel == channel
    assert stretch.start_s == pytest.approx(START, abs=3.0)
    assert stretch.end_s == pytest.approx(END, abs=3.0)
    assert stretch.peak == pytest.approx(sum(force), rel=0.25)


def test_without_an_external_force_there_is_none(sailed):
    assert found(under(sailed, (0.0, 0.0, 0.0))) == ()


def test_what_the_ship_can_do_itself_is_no_external_force(sailed):
    assert found(under(sailed, (3.0, 0.0, 0.0))) == ()  # full thrust is 4 N


def test_another_ship_under_a_crude_model_has_no_external_force(sailed):
    """The known ship shares no formula with the estimated MMG that it is judged by."""
    assert found(afloat.record(sailed)) == ()


def test_a_force_that_the_nominal_voyages_have_too_is_no_external_one(sailed):
    """What nothing pushed there is an error of the model: only a larger force is external."""

    def excess(force):
        record = under(sailed, force)
        return external_forces.largest_excess(balance(record), record)

    record = under(sailed, (0.0, 60.0, 0.0))

    def held_against(nominal):
        return external_forces.find(balance(record), record, nominal)

    calm, alike = excess((0.0, 0.0, 0.0)), excess((0.0, 70.0, 0.0))
    assert (calm == 0.0).all() and 10.0 < alike[1] < 70.0  # less what the ship can do itself
    assert len(held_against(calm)) == 1
    assert held_against(alike) == ()


def test_a_receiver_that_stands_still_and_catches_up_is_no_hand(sailed):
    """Position held for 3 s; the velocity that was filtered from it falls, and overshoots."""
    record = under(sailed, (0.0, 0.0, 0.0), noise=0.2)
    state, time = record.state.copy(), record.time
    nodes = START + np.array([-1.0, 1.0, 3.0, 4.0, 6.0])
    state[:, 1] += 0.4 * np.interp(time, nodes, [0.0, -1.0, -1.0, 1.0, 0.0])
    stopped = found(replace(record, state=state))
    held = (time >= START) & (time < START + 3.0)
    state[held, 0], state[held, 2] = (state[held, i][0] for i in (0, 2))
    caught_up = found(replace(record, state=state))
    assert len(stopped) == 1
    assert caught_up == ()


def test_full_thrust_is_that_of_the_open_water_diagram(sailed):
    """(1 - t) k₀ ρ D⁴ n² at 12.5 rev/s, by hand: rudders amidships neither add nor brake."""
    p = afloat.COEFFICIENTS
    bollard = (1.0 - p["propeller.t"]) * p["propeller.k0"] * 998.0 * 0.1**4 * 12.5**2
    full = external_forces.largest_own_forces(afloat.record(sailed), afloat.MODEL, afloat.THETA)
    assert full[0] == pytest.approx(bollard, rel=1e-6)


def test_a_ship_in_tow_has_no_full_thrust_to_compare_with(sailed):
    """Its screws never turned: 20 N for ten nodes of 2 s, against 2 N that its hull can do."""
    record = afloat.record(sailed)
    rows = 20 * np.arange(40)
    force = np.zeros((40, 3))
    force[15:25, 0] = 20.0
    weighed = external_forces.Balance(
        rows, force, np.full((40, 3), 0.1), np.full((40, 3), 2.0), np.zeros(3), np.zeros(3)
    )
    (stretch,) = external_forces.find(weighed, record)
    assert (stretch.start_s, stretch.end_s) == (29.0, 49.0)  # half of the peak, between nodes
    assert stretch.sentence.startswith("A force of 20 N ahead for 20 s: pushed")


def test_the_sentence_says_how_much_and_which_way():
    output = Stretch("v", 70.0, 85.0, "sway", -24.0, 600.0)
    assert output.sentence.startswith("A force of 24 N to port (600 % of full thrust) for 15 s")
    assert "Units?" in output.sentence
    assert "Units?" not in Stretch("v", 70.0, 85.0, "sway", -24.0, 299.0).sentence
