"""The known ship against closed forms, symmetries and figures that a naval architect expects."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from simulated_voyages import STEADY, hold, state

from pipelines.experiments import simulated_ship
from pipelines.experiments.simulated_ship import (
    CALM,
    LIMITS,
    Effects,
    Ship,
    Wind,
    sail,
    varied,
)
from pipelines.experiments.simulated_ship.sample_logs import PLANS

# --- physics -----------------------------------------------------------------------------------


def test_a_coasting_ship_loses_speed_as_quadratic_drag_says():
    """m u' = -k u² gives u = u₀ / (1 + k u₀ t / m); k by hand from hull, propeller, rudder, air."""
    ship, u0 = Ship().symmetrical(), 0.5
    rho, wake = 998.0, 1.0 - ship.wake
    hull = 0.5 * rho * ship.length * ship.draught * ship.resistance_ahead
    standing = -rho * ship.diameter**2 * ship.thrust_2 * wake**2  # N/(m/s)², it brakes
    disc = math.pi / 4 * ship.diameter**2
    far = math.sqrt(wake**2 - 2 * standing / (rho * disc))
    jet = rho * disc * (wake + far) / 2 * far * (1 - ship.deflected)
    friction = rho * ship.rudder_area * ship.outside * ship.friction * (1 - ship.wake / 2) ** 2
    air = 0.5 * 1.225 * ship.frontal_area * (ship.wind_surge + ship.wind_surge_3)
    k = hull + (1 - ship.deduction) * standing + jet + friction + air
    voyage = sail(
        300.0, seed=0, wind=CALM, ship=ship, helm=hold(0, 0, 0), start=(0, u0, 0, 0, 0.3, 0)
    )
    expected = u0 / (1 + k * u0 * voyage.time / (ship.mass + ship.added_surge))
    assert voyage.surge == pytest.approx(expected, rel=1e-8)
    assert np.abs(voyage.sway).max() == np.abs(voyage.yaw_rate).max() == 0.0


def test_a_drifting_ship_ends_up_going_with_the_water():
    effects = Effects(current_north=0.08, current_east=-0.05)
    voyage = sail(3000.0, seed=3, wind=CALM, effects=effects, helm=hold(0, 0, 0))
    velocity = np.gradient(voyage.x0 + 1j * voyage.y0, voyage.time)
    assert abs(velocity[-5] - complex(0.08, -0.05)) < 0.01
    assert abs(velocity[50] - complex(0.08, -0.05)) > 0.05


def test_an_even_current_is_only_another_place_to_look_from():
    """Galilei: a ship without windage sails the same path through the water, carried on."""
    current = complex(0.09, 0.04)
    effects = Effects(current_north=current.real, current_east=current.imag)
    ship = replace(Ship(), frontal_area=0.0, lateral_area=0.0)
    kept = {"seed": 0, "wind": CALM, "ship": ship, "helm": hold(20, 30, 9)}
    still = sail(120.0, **kept, start=(0, 0.3, 0, 0.05, 0.5, 0))
    body = current * np.exp(-0.5j)
    start = (0, 0.3 + body.real, 0, 0.05 + body.imag, 0.5, 0)
    carried = sail(120.0, **kept, effects=effects, start=start)
    assert carried.heading == pytest.approx(still.heading, abs=1e-9)
    assert carried.x0 == pytest.approx(still.x0 + current.real * still.time, abs=1e-7)
    assert carried.y0 == pytest.approx(still.y0 + current.imag * still.time, abs=1e-7)


@pytest.mark.parametrize("seed", range(12))
def test_nothing_gives_a_ship_energy_without_power(seed):
    rng = np.random.default_rng(seed)
    ship = varied(seed)
    u, v, r = rng.uniform((-0.5, -0.3, -0.15), (0.6, 0.3, 0.15))
    voyage = sail(60.0, seed=0, wind=CALM, ship=ship, helm=hold(0, 0, 0), start=(0, u, 0, v, 1, r))
    energy = (
        (ship.mass + ship.added_surge) * voyage.surge**2
        + (ship.mass + ship.added_sway) * voyage.sway**2
        + 2 * ship.mass * ship.gravity_ahead * voyage.sway * voyage.yaw_rate
        + ship.inertia * voyage.yaw_rate**2
    ) / 2
    assert np.diff(energy).max() <= 1e-12
    assert energy[-1] < 0.7 * energy[0]


def test_the_mirrored_ship_sails_the_mirrored_path():
    orders = np.random.default_rng(4).uniform((-105, -35, 0), (35, 105, 12.5), (100, 3))
    ship = Ship().symmetrical()

    def steer(time, _):
        port, starboard, speed = orders[int(time) // 5]
        return math.radians(port), math.radians(starboard), speed

    def mirrored(time, now):
        port, starboard, speed = steer(time, now)
        return -starboard, -port, speed

    one = sail(
        120.0, seed=0, wind=STEADY, ship=ship, helm=steer, start=(1, 0.3, 2, 0.1, 0.4, -0.02)
    )
    other = sail(
        120.0, seed=0, wind=replace(STEADY, direction=-STEADY.direction), ship=ship,
        helm=mirrored, start=(1, 0.3, -2, -0.1, -0.4, 0.02),
    )  # fmt: skip
    assert state(other) == pytest.approx(state(one) * (1, 1, -1, -1, -1, -1), abs=1e-8)
    # and the ship as it is does not: its propeller turns one way only
    asymmetric = sail(60.0, seed=0, wind=CALM, helm=hold(0, 0, 10), start=(0,) * 6)
    assert np.rad2deg(asymmetric.yaw_rate[-1]) > 0.1


def test_halving_the_step_divides_the_error_by_sixteen():
    ends = [
        state(sail(
            40.0, seed=0, wind=STEADY, helm=hold(0, 0, 10), step=step,
            start=(0, 0.3, 0, 0.2, 0.4, 0.02),
        ))[-1]
        for step in (0.1, 0.05, 0.025)
    ]  # fmt: skip
    first, second = (np.linalg.norm(a - b) for a, b in pairwise(ends))
    assert 10 < first / second < 25


def test_the_step_in_use_is_fine_enough_for_an_operators_orders():
    one = sail(200.0, seed=5, wind=STEADY, step=0.02)

    def again(time, _):
        return orders[round(time)]

    orders = _orders(200.0, 5)
    coarse = sail(200.0, seed=5, wind=STEADY, helm=again, step=0.02)
    fine = sail(200.0, seed=5, wind=STEADY, helm=again, step=0.01)
    assert np.array_equal(state(one), state(coarse))
    assert state(coarse) == pytest.approx(state(fine), abs=2e-4)


def _orders(seconds: float, seed: int) -> list:
    """What the operator of this seed orders, second by second."""
    operator = simulated_ship.helm.Operator(np.random.default_rng([seed, 1]))
    orders = []

    def note(time, now):
        orders.append(operator(time, now))
        return orders[-1]

    sail(seconds, seed=seed, wind=STEADY, helm=note)
    return orders


@pytest.mark.parametrize(
    ("orders", "surge", "yaw_rate"),
    [
        ((0, 0, 10), (0.4, 0.6), (-0.5, 0.5)),  # full ahead
        ((35, 35, 10), (0.08, 0.35), (3.0, 6.0)),  # hard to starboard
        ((-35, -35, 10), (0.08, 0.35), (-6.0, -3.0)),
        ((-75, 75, 10), (-0.05, 0.05), (-1.0, 1.0)),  # hover
        ((-105, 105, 10), (-0.35, -0.12), (-1.0, 1.0)),  # bucket astern
    ],
)
def test_speeds_are_those_of_such_a_ship(orders, surge, yaw_rate):
    end = state(sail(240.0, seed=0, wind=CALM, helm=hold(*orders), start=(0,) * 6))[-1]
    assert surge[0] < end[1] < surge[1]
    assert yaw_rate[0] < math.degrees(end[5]) < yaw_rate[1]


def test_a_beam_wind_of_5_mps_drives_her_sideways():
    wind = replace(STEADY, speed=5.0, direction=math.pi / 2)  # from the east, bow north
    end = state(sail(120.0, seed=0, wind=wind, helm=hold(0, 0, 0), start=(0,) * 6))[-1]
    assert -0.4 < end[3] < -0.1


# --- operator, weather, seeds -------------------------------------------------------------------


def test_the_samples_have_the_papers_durations_and_stay_on_the_pond(sailed):
    assert [p.seconds for p in PLANS] == [500.5, 1801.8, 500.5, 1801.8, 1201.2, 1201.2]
    for plan, voyage in sailed:
        assert voyage.time[-1] == pytest.approx(plan.seconds)
        assert np.hypot(voyage.x0, voyage.y0).max() < 50.0
        assert 0.3 < voyage.surge.max() < 0.7
        assert np.abs(np.rad2deg(voyage.yaw_rate)).max() < 8.0


def test_actuators_stay_within_their_limits_and_rates(sailed):
    for _, voyage in sailed:
        for name, (low, high) in LIMITS.items():
            values = getattr(voyage, name)
            assert low - 1e-12 <= values.min() <= values.max() <= high + 1e-12
            if name != "propeller":
                assert np.abs(np.diff(values)).max() <= math.radians(20.0) * 0.1 * 1.001
        assert np.ptp(voyage.rudder_starboard) > 2.0  # the whole range is used
        assert np.ptp(voyage.propeller) > 10.0


def test_the_test_voyage_meets_a_wind_that_the_first_two_never_did(sailed):
    """The paper's bins, 0.25 m/s by 20 deg, at 1 Hz; around 5 m/s from 300 deg."""
    edges = (np.arange(0.0, 15.0, 0.25), np.arange(0.0, 361.0, 20.0))
    count = [
        np.histogram2d(v.wind_speed[::10], np.rad2deg(v.wind_angle[::10]) % 360.0, edges)[0]
        for _, v in sailed
    ]
    around = [int(c[18:22, 14:16].sum()) for c in count]  # 4.5 to 5.5 m/s, 280 to 320 deg
    assert around[0] == around[1] == 0
    assert 10 <= around[2] + around[3] < around[5]
    assert around[4] < around[5]
    unseen = [c[count[0] + count[1] == 0].sum() / c.sum() for c in count]
    assert unseen[4] < unseen[5] and unseen[5] > 0.8
    met_by_four = sum(count[:4]) > 0
    assert 0.02 < count[5][~met_by_four].sum() / count[5].sum() < 0.3


def test_a_seed_is_a_voyage():
    gusty = Wind(3.0, 1.0)
    one, again, other = (sail(60.0, seed=seed, wind=gusty) for seed in (7, 7, 8))
    assert np.array_equal(state(one), state(again))
    assert not np.array_equal(state(one), state(other))
    hidden = sail(60.0, seed=7, wind=gusty, effects=Effects(thrust_loss=0.3))
    assert np.array_equal(hidden.true_wind_speed, one.true_wind_speed)


def test_sisters_differ_by_no_more_than_the_spread():
    ship, sister = Ship(), varied(3, spread=0.08)
    assert sister == varied(3, spread=0.08) != varied(4, spread=0.08)
    assert sister.length == ship.length and sister.diameter == ship.diameter
    assert 0 < abs(sister.cross_flow / ship.cross_flow - 1) <= 0.08
