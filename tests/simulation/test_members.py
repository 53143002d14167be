"""ν̇ of many members at once is each one's own, and a discrepancy has the size that it was given."""

from dataclasses import replace

import numpy as np
import pytest

from shiplog.models.causes import CATALOGUE
from shiplog.models.mmg import estimated, geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.ship_profile import file as profiles
from shiplog.simulation import discrepancy
from shiplog.simulation.controls import Gear, _steers
from shiplog.simulation.discrepancy import Discrepancy
from shiplog.simulation.members import of_networks, of_physics
from shiplog.simulation.prediction_interval import Band
from shiplog.voyages.rows.recording import Record

COUNT = 7


@pytest.fixture(scope="module")
def ship():
    profile = profiles.load("kvlcc2")
    geometry, main, _ = geometry_of(profile)
    return profile, MMG(geometry), estimated(geometry, main).values


def rows(profile, seed=0):
    rng = np.random.default_rng(seed)
    state = 0.1 * rng.standard_normal((COUNT, 6)) + [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]
    actuator = np.stack((rng.uniform(-0.5, 0.5, COUNT), rng.uniform(5.0, 12.0, COUNT)), -1)
    return state, actuator, np.zeros((COUNT, 2))


def test_each_member_has_its_own_coefficients(ship):
    profile, model, theta = ship
    each = theta * (1.0 + 0.1 * np.random.default_rng(1).standard_normal((COUNT, len(theta))))
    given = rows(profile)
    together = of_physics(model, each)(*given)
    alone = np.stack([
        np.asarray(model.acceleration(each[k], *(part[k] for part in given))) for k in range(COUNT)
    ])  # fmt: skip
    assert together == pytest.approx(alone, rel=1e-10, abs=1e-13)
    one = of_physics(model, theta)(*given)
    assert one == pytest.approx(np.asarray(model.acceleration(theta, *given)), rel=1e-10, abs=1e-13)


def test_more_rows_than_fit_at_a_time_are_the_same(ship, monkeypatch):
    profile, model, theta = ship
    given = rows(profile)
    whole = of_physics(model, theta)(*given)
    monkeypatch.setattr("shiplog.simulation.members.ROWS_AT_A_TIME", 3)
    assert of_physics(model, theta)(*given) == pytest.approx(whole, abs=0.0)


def test_what_no_kernel_is_made_of_is_run_by_jax(ship, by_jax):
    profile, model, theta = ship
    given = rows(profile)
    wanted = np.asarray(model.acceleration(theta, *given))
    assert of_physics(model, theta)(*given) == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_members_of_networks_are_those_of_their_network():
    class Constant:
        def __init__(self, value):
            self.value = value

        def accelerations(self, velocity, actuator, wind):
            return np.full((len(velocity), 3), self.value) + wind[:, :1]

    state = np.zeros((4, 6))
    state[:, 1] = 2.0
    of = of_networks([Constant(1.0), Constant(5.0)], np.array([0, 1, 0, 1]), True)
    found = of(state, np.zeros((4, 2)), np.tile([3.0, 0.0], (4, 1)))
    assert found[:, 0] == pytest.approx([6.0, 10.0, 6.0, 10.0])  # apparent wind 3 + 2 m/s


def test_azimuths_astern_steer_the_other_way():
    for one in profiles.load("milliampere").actuators:
        wanted = -1.0 if one.kind == "azimuth" and one.position_m[0] < 0.0 else 0.0
        assert _steers(one) == wanted


# --- the discrepancy -------------------------------------------------------------------------


def test_a_process_has_its_size_and_its_memory():
    """Var d = s², corr(d(0), d(t)) = e^(-t/τ), whatever the step."""
    of = Discrepancy(np.array([0.5, 2.0, 0.1]), 20.0, 1.0, np.zeros(1))
    rng = np.random.default_rng(0)
    state, actuator = np.zeros((4001, 6)), np.zeros((4001, 1))
    state[:, 1] = 1.0  # q of the training data
    for step in (1.0, 7.0):
        process = of.process(4001, rng)
        drawn = np.stack([process(state, actuator, step) for _ in range(4)])[:, 1:]
        assert drawn.std((0, 1)) == pytest.approx(of.size, rel=0.05)
        first, last = drawn[0, :, 1], drawn[3, :, 1]
        wanted = np.exp(-3.0 * step / 20.0)
        assert np.corrcoef(first, last)[0, 1] == pytest.approx(wanted, abs=0.05)
    assert not process(state, actuator, 1.0)[0].any()  # the model as it stands


def test_it_grows_with_the_pressure_at_hull_and_rudder():
    of = Discrepancy(np.ones(3), 1.0, 4.0, np.array([0.0, 0.5]))
    state = np.zeros((1, 6))
    state[:, 1] = 3.0
    assert of.scale(state, np.array([[0.3, 8.0]])) == pytest.approx((9.0 + 0.5 * 16.0) / 4.0)


def test_it_is_as_large_as_held_out_errors_ask_for():
    """Of ν̇ = d alone, Var u(t) = 2 s² τ² (t/τ - 1 + e^(-t/τ)): integrated, of each channel."""
    wanted = np.array([0.02, 0.01, 0.004])
    state = np.zeros((200, 6))
    state[:, 1] = 1.0
    tau, time = discrepancy.MEMORY * 5.0, np.arange(61.0)
    ratio = time / tau
    grown = np.sqrt(2.0) * tau * np.sqrt(ratio - 1.0 + np.exp(-ratio))
    growth = np.zeros((61, 6))
    growth[:, [1, 3, 5]] = grown[:, None] * wanted
    band = Band(growth, np.full(6, 1.645))

    def none(state, actuator, wind):
        return np.zeros((len(state), 3))

    found = discrepancy.calibrated(
        none, band, state, np.zeros((200, 1)), np.zeros((200, 2)), 1.0, 1, 5.0, np.zeros(1)
    )
    assert found.memory == pytest.approx(tau)
    assert found.size == pytest.approx(wanted, rel=0.3)  # of 64 starts


# --- causes in the steering ------------------------------------------------------------------


@pytest.mark.parametrize("label, number", [("rudder_offset", [0.05]), ("rudder_lag", [2.0]),
                                           ("rudder_delay", [1.3])])  # fmt: skip
def test_the_gear_does_step_by_step_what_a_cause_does_to_a_record(ship, label, number):
    profile = ship[0]
    cause = next(c for c in CATALOGUE if c.label == label)
    if label == "rudder_offset":
        cause = replace(cause, groups=("angle",))
    rng = np.random.default_rng(3)
    step, count = 0.1, 400
    angles = np.repeat(rng.uniform(-0.4, 0.4, 10), 40)
    actuator = np.stack((angles, np.full(count, 10.0)), -1)
    starts = np.zeros(count, dtype=bool)
    starts[0] = True
    record = Record(
        profile, ("a",), np.zeros(count, int), np.arange(count) * step, np.ones(count), starts,
        np.ones(count, dtype=bool), np.zeros((count, 6)), actuator, np.zeros((count, 2)), step,
    )  # fmt: skip
    wanted = cause.read(record, np.array(number)).actuator
    gear = Gear((cause,), {label: np.array(number)}, profile)
    acting = np.concatenate([gear.acting(row[None], step) for row in actuator])
    assert acting[:, 1] == pytest.approx(wanted[:, 1])
    # a lag of held steps begins with the step, of a straight line half a step before it
    within = 0.03 if label == "rudder_lag" else 1e-9
    assert acting[20:, 0] == pytest.approx(wanted[20:, 0], abs=within)
