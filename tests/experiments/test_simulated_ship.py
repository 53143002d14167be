"""The known ship against closed forms, symmetries and figures that a naval architect expects."""

import ast
import itertools
import json
import math
import tomllib
from dataclasses import replace
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import numpy as np
import pymap3d
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

import shiplog
from pipelines.experiments import simulated_ship
from pipelines.experiments.simulated_ship import (
    BANK_EAST,
    CALM,
    LIMITS,
    Effects,
    Ship,
    Wind,
    cases,
    physics,
    sail,
    varied,
    write_voyage,
)
from pipelines.experiments.simulated_ship import __main__ as command
from pipelines.experiments.simulated_ship.sample_logs import PLANS, SEASONS, SEED, voyages
from pipelines.experiments.simulated_ship.sensors import DATUM, Blemishes
from pipelines.experiments.simulated_ship.ship import ANTENNA
from pipelines.experiments.simulated_ship.voyage import PULSE_TIMES

START = datetime(2025, 10, 7, 1, 0, tzinfo=UTC)
STEADY = Wind(4.0, 0.7, gust=0.0, veer=0.0, wander=0.0)
STATE = ("x0", "surge", "y0", "sway", "heading", "yaw_rate")


def hold(port_deg: float, starboard_deg: float, propeller: float):
    return lambda time, state: (math.radians(port_deg), math.radians(starboard_deg), propeller)


def state(voyage) -> np.ndarray:
    return np.column_stack([getattr(voyage, name) for name in STATE])


def topics(path) -> dict[str, dict[str, np.ndarray]]:
    """Topic -> field -> values, and the times as `t` [s from START]."""
    rows: dict[str, list] = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, proto in reader.iter_decoded_messages():
            rows.setdefault(channel.topic, []).append((message, proto))
    found = {}
    for topic, pairs in rows.items():
        names = [d.name for d in pairs[0][1].DESCRIPTOR.fields if d.type == d.TYPE_DOUBLE]
        scalars = [name for name in names if name != "position_covariance"]
        found[topic] = {n: np.array([getattr(p, n) for _, p in pairs]) for n in scalars}
        zero = int(START.timestamp()) * 10**9
        found[topic]["t"] = np.array([p.timestamp.ToNanoseconds() - zero for _, p in pairs]) / 1e9
        found[topic]["late"] = np.array(
            [m.log_time - p.timestamp.ToNanoseconds() for m, p in pairs]
        )
    return found


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


@pytest.fixture(scope="module")
def sailed():
    return voyages()


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
    seen_by_four = sum(count[:4]) > 0
    assert 0.02 < count[5][~seen_by_four].sum() / count[5].sum() < 0.3


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


# --- what is hidden -----------------------------------------------------------------------------

FORCES = [
    Effects(current_east=0.1), Effects(wind_force=(0.3, 0.0, 0.0)), Effects(fouling=0.5),
    Effects(wind_force=(0.0, 0.3, 0.0)), Effects(wind_force=(0.0, 0.0, 0.3)),
    Effects(cross_flow_drag=0.3), Effects(thrust_loss=0.2), Effects(thrust_drift=-0.3),
    Effects(rudder_force=0.2), Effects(payload=30.0), Effects(payload=30.0, payload_ahead=1.0),
    Effects(rudder_offset_port=0.1), Effects(rudder_offset_starboard=0.1),
    Effects(rudder_lag=1.0), Effects(rudder_delay=1.0), Effects(tether=1.0, tether_north=20.0),
    Effects(propeller_side_force=0.05), Effects(rudder_limit=0.2), Effects(shallow_water=1.0),
    Effects(turbulence=4.0), Effects(side_thrust=4.0),
]  # fmt: skip
INSTRUMENTS = [
    (Effects(heading_offset=math.radians(3)), {"/gyro": "heading_deg"}, 3.0),
    (Effects(yaw_rate_bias=math.radians(0.3)), {"/gyro": "yaw_rate_degps"}, 0.3),
    (Effects(wind_direction_offset=math.radians(9)), {"/wind/apparent": "direction_deg"}, 9.0),
]


@pytest.mark.parametrize("effects", FORCES, ids=str)
def test_each_hidden_force_moves_the_ship_and_no_instrument(effects):
    steer = hold(15, 25, 8)
    kept = {"start": (0, 0.2, 0, 0, 0, 0), "helm": steer, "wind": STEADY, "seed": 1}
    plain, moved = sail(60.0, **kept), sail(60.0, **kept, effects=effects)
    assert np.hypot(moved.x0 - plain.x0, moved.y0 - plain.y0)[-1] > 0.02
    assert np.array_equal(moved.rudder_port, plain.rudder_port)
    assert np.array_equal(moved.propeller, plain.propeller)


def test_a_delayed_rudder_is_a_later_order():
    def at(when):
        return lambda time, _: (0.5, 0.5, 8.0) if time >= when else (0.0, 0.0, 8.0)

    kept = {"start": (0, 0.3, 0, 0, 0, 0), "wind": CALM, "seed": 0}
    delayed = sail(40.0, **kept, helm=at(10.0), effects=Effects(rudder_delay=2.0))
    later = sail(40.0, **kept, helm=at(12.0))
    assert state(delayed) == pytest.approx(state(later), abs=1e-5)
    assert delayed.rudder_port[115] > 0.4 and later.rudder_port[115] == 0.0


def test_thrust_drifts_along_the_campaign():
    effects = Effects(thrust_drift=-0.3)
    kept = {"start": (0,) * 6, "helm": hold(0, 0, 10), "wind": CALM, "seed": 0}
    ends = [
        sail(200.0, **kept, effects=effects, campaign=part).surge[-1]
        for part in ((0.0, 0.1), (0.9, 1.0))
    ]
    assert ends[1] < 0.92 * ends[0] < sail(200.0, **kept).surge[-1]


@pytest.mark.parametrize("cos", [1.0, -1.0], ids=["bank to starboard", "bank to port"])
def test_a_bank_draws_her_in_and_turns_the_leading_end_out(cos):
    """Starboard is east on a northern course; the bow goes out when yaw turns it west."""
    heading = 0.0 if cos > 0 else math.pi

    def gained(surge, east, **hidden):
        kept = {"seed": 0, "wind": CALM, "helm": hold(0, 0, 0)}
        kept["start"] = (0, surge, east, 0, heading, 0)
        far, near = (sail(1.0, **kept, effects=Effects(**hide)) for hide in ({}, hidden))
        return (state(near) - state(far))[-1]

    ahead = gained(0.4, 38.0, bank=1.0)
    assert ahead[2] > 0.004 and cos * ahead[3] > 0.004  # m and m/s, east
    assert cos * ahead[5] < -0.005
    astern = gained(-0.4, 38.0, bank=1.0)
    assert astern[2] > 0.004 and cos * astern[5] > 0.005
    assert np.abs(gained(0.0, 38.0, bank=1.0)).max() == 0.0
    assert np.abs(gained(0.4, -30.0, bank=1.0)).max() < 1e-4
    twice = gained(0.4, 38.0, bank=2.0)[[2, 3, 5]]
    assert twice == pytest.approx(2 * ahead[[2, 3, 5]], rel=0.05)


def test_the_bank_is_bounded_and_fades_to_half_at_its_length():
    ship = Ship()
    numbers = physics.coefficients(ship)
    hidden = physics.hidden(Effects(bank=1.5, bank_length=6.0), (0.0, 1.0), 1.0)
    wall = BANK_EAST - ship.breadth / 2
    touching = 1.5 * 0.15 * 0.5 * 998.0 * ship.length * ship.draught * 0.5**2
    expected = {0.0: 1.0, 6.0: 0.5, 12.0: 1 / 9, -0.2: 1.0, -1.0: 0.0}
    for gap, share in expected.items():
        x, y, n = physics.bank(numbers, hidden, wall - gap, 0.5, 0.0)
        assert (x, y) == (0.0, pytest.approx(share * touching))
        assert n == pytest.approx(-0.25 * ship.length * share * touching, rel=1e-3)
    across = physics.bank(numbers, hidden, wall, 0.5, math.pi / 2)  # bow on: nothing slides along
    assert np.abs(across).max() < 1e-12


def test_a_shoal_adds_drag_and_mass_over_its_crest_and_nothing_far_away():
    ship = Ship()
    numbers = physics.coefficients(ship)
    effects = Effects(
        shallow_water=0.8, shoal_length=4.0, shoal_north=5.0, shoal_east=-3.0, shoal_towards=0.6
    )
    hidden = physics.hidden(effects, (0.0, 1.0), 1.0)
    along, off = np.exp(0.6j), 1j * np.exp(0.6j)
    for where, share in ((0, 1.0), (20 * along, 1.0), (4 * off, 0.5), (-12 * off, 0.1)):
        at = complex(5, -3) + where
        assert physics.shoal(numbers, hidden, at.real, at.imag) == pytest.approx(share)
    plain, crest = (physics.hull(numbers, hidden, 0.0, 0.2, 0.0, s) for s in (0.0, 1.0))
    assert crest[1] == pytest.approx(plain[1] * (1 + 1.2 * 0.8))  # cross-flow
    plain, crest = (physics.hull(numbers, hidden, 0.4, 0.0, 0.0, s) for s in (0.0, 1.0))
    assert crest[0] == pytest.approx(plain[0] * (1 + 0.3 * 0.8))  # resistance

    kept = {"seed": 0, "wind": CALM, "helm": hold(0, 0, 0), "start": (5, 0.4, -3, 0, 0.6, 0)}
    deep = sail(60.0, **kept)
    shallow = sail(60.0, **kept, effects=effects)
    assert shallow.surge[-1] < 0.98 * deep.surge[-1]
    elsewhere = sail(60.0, **kept, effects=replace(effects, shoal_east=2000.0))
    assert state(elsewhere) == pytest.approx(state(deep), abs=1e-5)
    # more water moves with it: the same push aside, from rest, gets it under way more slowly
    out = np.empty((2, 11))
    at_rest = np.zeros(11)
    at_rest[[0, 2]] = 5.0, -3.0
    push = np.array([2.0, 0.0, 0.0, 0.0])
    for row, hide in zip(out, (Effects(), effects), strict=True):
        h = physics.hidden(hide, (0.0, 1.0), 1.0)
        physics.rates(numbers, h, at_rest, 0.0, 0.0, np.zeros(3), np.zeros(2), push, 0.0, row)
    mass = ship.mass + ship.added_sway * np.array([1.0, 1.0 + 0.7 * 0.8])
    inertia = ship.inertia * np.array([1.0, 1.0 + 0.2 * 0.8])
    lever = ship.mass * ship.gravity_ahead
    for row, m, i in zip(out, mass, inertia, strict=True):
        expected = np.linalg.solve([[m, lever], [lever, i]], [2.0, 2.0 * 1.3])
        assert row[[3, 5]] == pytest.approx(expected)


def test_side_thrust_comes_in_pulses_that_turn_the_bow():
    kept = {"seed": 5, "wind": CALM, "helm": hold(0, 0, 0), "start": (0,) * 6}
    plain = sail(600.0, **kept)
    voyage = sail(600.0, **kept, effects=Effects(side_thrust=4.0))
    begins, lengths, forces = map(np.array, zip(*voyage.pulses, strict=True))
    assert len(begins) > 3 and plain.pulses == ()
    assert PULSE_TIMES[0] <= lengths.min() and lengths.max() <= PULSE_TIMES[1]
    assert np.abs(forces).min() >= 1.5 and np.abs(forces).max() <= 4.0
    assert (begins[1:] > begins[:-1] + lengths[:-1]).all()
    assert {-1.0, 1.0} == set(np.sign(forces))
    first = round(10 * begins[0])
    assert np.array_equal(state(voyage)[:first], state(plain)[:first])
    ship, arm = voyage.ship, 1.3
    matrix = [[ship.mass + ship.added_sway, ship.mass * ship.gravity_ahead]] * 2
    matrix[1] = [ship.mass * ship.gravity_ahead, ship.inertia]
    sway, yaw = np.linalg.solve(matrix, [forces[0], arm * forces[0]])
    now = first + 5  # half a second later
    assert voyage.yaw_rate[now] == pytest.approx(0.5 * yaw, rel=0.05)
    assert voyage.sway[now] == pytest.approx(0.5 * sway, rel=0.05)
    weak = sail(600.0, **kept, effects=Effects(side_thrust=1.0))  # the same times, less force
    assert [p[:2] for p in weak.pulses] == [p[:2] for p in voyage.pulses]


def test_turbulence_moves_a_drifting_ship_in_proportion():
    kept = {"wind": CALM, "helm": hold(0, 0, 0), "start": (0,) * 6}
    one, four = (sail(6.0, **kept, seed=2, effects=Effects(turbulence=f)) for f in (1.0, 4.0))
    assert state(four)[-1] == pytest.approx(4 * state(one)[-1], rel=0.1, abs=3e-5)
    ends = [
        [state(sail(60.0, **kept, seed=s, effects=Effects(turbulence=f)))[-1] for s in range(40)]
        for f in (1.0, 6.0)
    ]
    calm, rough = (np.std(end, axis=0)[[1, 3, 5]] for end in ends)
    assert (rough > 2.5 * calm).all()  # less than six times: drag grows too


def test_a_limited_rudder_acts_no_further_than_its_limit():
    kept = {"seed": 0, "wind": CALM, "start": (0, 0.2, 0, 0, 0, 0)}
    limited = sail(
        90.0, **kept, helm=hold(-80, 30, 9), effects=Effects(rudder_limit=math.radians(55))
    )
    shorter = sail(90.0, **kept, helm=hold(-55, 30, 9))
    assert math.degrees(limited.rudder_port[-1]) == pytest.approx(-80)
    assert state(limited)[-1] == pytest.approx(state(shorter)[-1], abs=0.02)
    within = sail(
        90.0, **kept, helm=hold(-55, 30, 9), effects=Effects(rudder_limit=math.radians(56))
    )
    assert np.array_equal(state(within), state(shorter))


def test_an_effect_of_no_strength_is_no_effect_to_the_last_bit():
    kept = {"seed": 9, "wind": Wind(3.0, 1.0)}
    nothing = Effects(
        shoal_length=2.0, shoal_north=4.0, shoal_east=1.0, shoal_towards=2.0, bank_length=30.0,
        tether_north=3.0, payload_ahead=1.0,
    )  # fmt: skip
    assert np.array_equal(state(sail(120.0, **kept)), state(sail(120.0, **kept, effects=nothing)))


def test_the_committed_logs_are_what_she_still_sails(sailed, tmp_path):
    """To a step of resolution: another processor may round the last bit otherwise."""
    folder = Path(simulated_ship.__file__).parents[3] / "sample_logs"
    for number in (0, 6, 10):  # nothing hidden, and something
        plan, voyage = sailed[number]
        write_voyage(tmp_path / "a.mcap", voyage, seed=SEED + number, start=plan.start)
        again, committed = topics(tmp_path / "a.mcap"), topics(folder / f"{plan.name}.mcap")
        for topic, columns in committed.items():
            for name, values in columns.items():
                off = np.abs(again[topic][name] - values)
                assert np.nanmax(np.minimum(off, np.abs(off - 360.0)), initial=0.0) <= 0.07


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Writes a short voyage with something hidden and reads it back."""
    folder = tmp_path_factory.mktemp("logs")

    def log(effects=None, **options):
        voyage = sail(90.0, seed=11, wind=Wind(3.0, 2.0), effects=effects)
        write_voyage(folder / "a.mcap", voyage, seed=2, start=START, **options)
        return voyage, topics(folder / "a.mcap")

    return log


@pytest.mark.parametrize(("effects", "where", "size"), INSTRUMENTS)
def test_a_hidden_instrument_error_is_in_the_log_and_not_in_the_path(logs, effects, where, size):
    plain, clean = logs()
    voyage, faulty = logs(effects)
    assert np.array_equal(state(voyage), state(plain))
    for topic, columns in clean.items():
        for name, values in columns.items():
            difference = faulty[topic][name] - values
            if where.get(topic) == name:
                difference = (difference + 180.0) % 360.0 - 180.0
                assert difference == pytest.approx(size, abs=0.13)
            else:
                assert np.nanmax(np.abs(difference), initial=0.0) == 0.0


def test_hidden_scales_places_and_clocks_reach_the_log(logs):
    voyage, clean = logs()
    _, scaled = logs(Effects(yaw_rate_scale=0.1, wind_speed_scale=0.2))
    true = np.interp(clean["/gyro"]["t"], voyage.time, np.rad2deg(voyage.yaw_rate))
    gained = scaled["/gyro"]["yaw_rate_degps"] - clean["/gyro"]["yaw_rate_degps"]
    assert gained == pytest.approx(0.1 * true, abs=0.01)
    faster = scaled["/wind/apparent"]["speed_mps"] - clean["/wind/apparent"]["speed_mps"]
    true = np.interp(clean["/wind/apparent"]["t"], voyage.time, voyage.wind_speed)
    assert faster == pytest.approx(0.2 * true, abs=0.02)

    _, moved = logs(Effects(antenna_offset=(0.4, -0.1)))
    north, east = (moved_m - m for moved_m, m in zip(local(moved), local(clean), strict=True))
    heading = np.interp(clean["/gnss/fix"]["t"], voyage.time, voyage.heading)
    arm = (north + 1j * east) * np.exp(-1j * heading)
    assert arm.real == pytest.approx(0.4, abs=0.003) and arm.imag == pytest.approx(-0.1, abs=0.003)

    _, late = logs(Effects(clock_offset={"gnss": 0.8}))
    assert np.array_equal(late["/gyro"]["heading_deg"], clean["/gyro"]["heading_deg"])
    shift = np.array(local(late)) - np.array(local(clean))
    cut = slice(20, None)
    time = clean["/gnss/fix"]["t"][cut]
    expected = np.array([
        np.interp(time - 0.8, voyage.time, midship) - np.interp(time, voyage.time, midship)
        for midship in antenna_path(voyage)
    ])  # fmt: skip
    assert shift[:, cut] == pytest.approx(expected, abs=0.003)


def local(found) -> tuple[np.ndarray, np.ndarray]:
    """North and east [m] of the fixes, by pymap3d."""
    fix = found["/gnss/fix"]
    east, north, _ = pymap3d.geodetic2enu(fix["latitude"], fix["longitude"], 0.0, *DATUM, 0.0)
    return north, east


def antenna_path(voyage) -> tuple[np.ndarray, np.ndarray]:
    at = voyage.x0 + 1j * voyage.y0 + complex(*ANTENNA) * np.exp(1j * voyage.heading)
    return at.real, at.imag


# --- instruments and files ----------------------------------------------------------------------


def test_the_instruments_err_as_much_as_they_say(tmp_path):
    voyage = sail(1000.0, seed=21, wind=Wind(3.0, 2.0))
    write_voyage(tmp_path / "a.mcap", voyage, seed=3, start=START)
    found = topics(tmp_path / "a.mcap")

    for measured, true in zip(local(found), antenna_path(voyage), strict=True):
        error = measured - np.interp(found["/gnss/fix"]["t"], voyage.time, true)
        assert np.std(error) == pytest.approx(0.02, rel=0.3)
    velocity = found["/gnss/velocity"]
    truth = [
        np.interp(velocity["t"], voyage.time, np.gradient(path, voyage.time))
        for path in antenna_path(voyage)  # the lever arm's share of the speed comes with the path
    ]
    course = np.deg2rad(velocity["cog_deg"])
    for part, true in zip((np.cos(course), np.sin(course)), truth, strict=True):
        error = velocity["sog_mps"] * part - true
        assert np.std(error) == pytest.approx(0.01, rel=0.2) and abs(np.mean(error)) < 0.002
    gyro = found["/gyro"]
    for name, true, sigma in (("heading_deg", "heading", 0.1), ("yaw_rate_degps", "yaw_rate", 0.1)):
        error = gyro[name] - np.rad2deg(np.interp(gyro["t"], voyage.time, getattr(voyage, true)))
        assert np.std((error + 180) % 360 - 180) == pytest.approx(sigma, rel=0.2)
    wind = found["/wind/apparent"]
    error = wind["speed_mps"] - np.interp(wind["t"], voyage.time, voyage.wind_speed)
    assert np.std(error) == pytest.approx(0.1, rel=0.2)

    rates = {topic: (len(c["t"]) - 1) / (c["t"][-1] - c["t"][0]) for topic, c in found.items()}
    assert rates == {
        "/gnss/fix": pytest.approx(10, rel=1e-3), "/gnss/velocity": pytest.approx(10, rel=1e-3),
        "/gyro": pytest.approx(10, rel=1e-3), "/wind/apparent": pytest.approx(4, rel=1e-3),
        "/rudder/port": pytest.approx(10, rel=1e-3), "/propeller/main": pytest.approx(5, rel=1e-3),
        "/rudder/starboard": pytest.approx(10, rel=1e-3),
    }  # fmt: skip
    for columns in found.values():
        assert columns["late"].min() > 2e6 and columns["late"].max() < 45e6


def test_coloured_noise_is_as_large_and_lasts_longer(tmp_path):
    found = []
    for share in (0.0, 0.7):
        voyage = sail(900.0, seed=21, wind=Wind(3.0, 2.0), effects=Effects(coloured=share))
        write_voyage(tmp_path / "a.mcap", voyage, seed=3, start=START)
        gyro = topics(tmp_path / "a.mcap")["/gyro"]
        true = np.rad2deg(np.interp(gyro["t"], voyage.time, voyage.yaw_rate))
        found.append(gyro["yaw_rate_degps"] - true)
    white, coloured = found
    assert np.std(coloured) == pytest.approx(np.std(white), rel=0.15)
    lasting = [np.corrcoef(error[5:], error[:-5])[0, 1] for error in found]  # half a second
    assert lasting[0] < 0.25 and 0.45 < lasting[1] < 0.8


def test_jittered_clocks_misstamp_and_nothing_else(logs):
    _, clean = logs()
    _, found = logs(Effects(clock_jitter=0.012))
    for topic, columns in found.items():
        off = columns["t"] - clean[topic]["t"]
        assert np.std(off) == pytest.approx(0.012, rel=0.15)
        assert (np.diff(columns["t"]) > 0).all()
        arrived = columns["t"] + columns["late"] / 1e9
        assert arrived == pytest.approx(clean[topic]["t"] + clean[topic]["late"] / 1e9, abs=1e-6)
        for name in set(columns) - {"t", "late"}:
            assert np.array_equal(columns[name], clean[topic][name], equal_nan=True)


def test_blemishes_are_where_they_were_put(logs):
    _, clean = logs()
    _, found = logs(blemishes=Blemishes(dropouts=((30.0, 3.0),), spikes=((60.04, 2.0, -1.0),)))
    for topic in ("/gnss/fix", "/gnss/velocity"):
        gap = np.diff(found[topic]["t"])
        assert gap.max() == pytest.approx(3.1) and np.sum(gap > 0.2) == 1
    kept = np.isin(clean["/gnss/fix"]["t"], found["/gnss/fix"]["t"])
    off = [far - near[kept] for far, near in zip(local(found), local(clean), strict=True)]
    assert np.sum(np.hypot(*off) > 0.01) == 1
    assert [o[np.argmax(np.hypot(*off))] for o in off] == pytest.approx([2.0, -1.0], abs=0.002)


def test_a_log_is_the_same_bytes_again(tmp_path):
    for name in ("a.mcap", "b.mcap"):
        voyage = sail(30.0, seed=1, wind=Wind(2.0, 0.0))
        write_voyage(tmp_path / name, voyage, seed=1, start=START)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_the_profile_is_of_this_ship():
    profile = Path(shiplog.__file__).parent / "profiles" / "esso-vectwin.toml"
    facts = tomllib.loads(profile.read_text())
    ship = Ship()
    assert facts["ship"] == {
        "name": ship.name, "length_m": ship.length, "breadth_m": ship.breadth,
        "draught_m": ship.draught, "mass_kg": ship.mass, "x_g_m": ship.gravity_ahead,
        "block_coefficient": ship.block_coefficient, "frontal_area_m2": ship.frontal_area,
        "lateral_area_m2": ship.lateral_area,
    }  # fmt: skip
    for channel in ("position", "velocity"):
        assert facts["sensors"][channel]["lever_arm_m"] == list(ANTENNA)
    limits = {
        a["name"]: tuple(np.deg2rad(a["limits"]) if a["kind"] == "rudder" else a["limits"])
        for a in facts["actuators"]
    }
    assert limits == {name: pytest.approx(pair) for name, pair in LIMITS.items()}
    assert facts["site"]["datum"] == list(DATUM)


def test_the_sample_logs_are_small_and_complete():
    folder = Path(simulated_ship.__file__).parents[3] / "sample_logs"
    names = {f"{plan.name}.mcap" for plan in (*PLANS, *itertools.chain(*SEASONS.values()))}
    assert {p.name for p in folder.glob("*.mcap")} == names
    assert sum(p.stat().st_size for p in folder.glob("*.mcap")) <= 22_000_000


def test_the_samples_hide_two_things_nothing_and_something_outside_the_catalogue():
    folder = Path(simulated_ship.__file__).parents[3] / "sample_logs"
    key = json.loads((folder / "answers" / "key.json").read_text("utf-8"))
    reported = {voyage: [cause["name"] for cause in causes] for voyage, causes in key.items()}
    wanted = {2: ["current", "clock_offset"], 3: [], 4: ["tether"]}
    assert reported == {f"season{s}_{k}": names for s, names in wanted.items() for k in (1, 2)}
    listing = " ".join(p.name for p in folder.iterdir()) + (folder / "README.md").read_text("utf-8")
    assert not [word for names in reported.values() for word in names if word in listing]


# --- blind cases --------------------------------------------------------------------------------

SAID = {  # the contract's names and units
    "current": {"speed": "m/s", "direction": "deg"},
    "wind_force": {"surge_factor": "1", "sway_factor": "1", "yaw_factor": "1"},
    "shallow_water": {"strength": "1", "length": "m"}, "bank": {"strength": "1", "length": "m"},
    "fouling": {"factor": "1"}, "cross_flow_drag": {"factor": "1"}, "rudder_force": {"factor": "1"},
    "thrust_loss": {"factor": "1"}, "thrust_drift": {"slope": "1"},
    "rudder_offset": {"port": "deg", "starboard": "deg"},
    "payload": {"mass": "kg", "position": "m"},
    "rudder_lag": {"time": "s"}, "rudder_delay": {"time": "s"}, "side_thrust": {"force": "N"},
    "clock_offset": {"time": "s", "channel": ""}, "heading_offset": {"angle": "deg"},
    "wind_direction_offset": {"angle": "deg"}, "yaw_rate_bias": {"value": "deg/s"},
    "yaw_rate_scale": {"value": "1"}, "wind_speed_scale": {"value": "1"},
    "antenna_offset": {"x": "m", "y": "m"},
}  # fmt: skip


def short(case, seconds=20.0):
    """One voyage of each campaign, and a short one."""
    return replace(
        case,
        nominal=(replace(case.nominal[0], seconds=seconds),),
        trial=(replace(case.trial[-1], seconds=seconds),),
    )


def test_two_thousand_draws_have_the_shares_they_should():
    drawn = [cases.draw(seed) for seed in range(2000)]
    outside = sum(case.verdict == "unknown" for case in drawn)
    count = [
        sum(len(case.causes) == n and case.verdict != "unknown" for case in drawn) for n in range(3)
    ]
    for found, share in zip((*count, outside), (0.2, 0.6, 0.1, 0.1), strict=True):
        assert abs(found / 2000 - share) < 4 * math.sqrt(share * (1 - share) / 2000)
    singles = [c.causes[0] for c in drawn if c.verdict == "named" and len(c.causes) == 1]
    every = [cause for case in drawn for cause in case.causes]
    for names, known in ((singles, cases.CATALOGUE), (every, cases.CATALOGUE | cases.OUTSIDE)):
        assert {cause.name for cause in names} == set(known)
    expected = len(singles) / len(cases.CATALOGUE)
    for name in cases.CATALOGUE:
        assert abs(sum(c.name == name for c in singles) - expected) < 4.5 * math.sqrt(expected)
    logs10 = np.log10([cause.size for cause in every])
    assert logs10.min() >= -1.0 and logs10.max() <= 0.0
    assert np.histogram(logs10, 4, (-1, 0))[0] == pytest.approx(len(every) / 4, rel=0.15)
    assert all(len({c.name for c in case.causes}) == len(case.causes) for case in drawn)


@pytest.mark.parametrize("name", [*cases.CATALOGUE, *cases.OUTSIDE])
def test_every_cause_can_be_forced_at_any_size_and_reaches_only_the_trial(name):
    full, half = (cases.draw(12, cause=name, size=size) for size in (1.0, 0.5))
    none = cases.draw(12, cause="none")
    assert [c.name for c in full.causes] == [name] and none.causes == ()
    reported = full.causes[0].parameters
    assert {p: reported[p]["unit"] for p in SAID.get(name, {})} == SAID.get(name, {})
    assert full.verdict == ("named" if name in cases.CATALOGUE else "unknown")
    assert (full.ship, full.laws, full.nominal, full.trial, full.ordinary) == (
        half.ship, half.laws, half.nominal, half.trial, half.ordinary
    ) == (none.ship, none.laws, none.nominal, none.trial, none.ordinary)  # fmt: skip
    assert none.effects == none.ordinary == full.ordinary != half.effects != full.effects

    columns = []
    for case in map(short, (full, none)):
        voyage = cases.voyage(case, replace(case.trial[0], seconds=120.0))
        assert voyage.effects == case.ordinary  # not one of the case's legs: nothing hidden
        sailed = sail(
            120.0, seed=3, wind=STEADY, ship=case.ship, effects=case.effects, campaign=(0.5, 1.0)
        )
        series = simulated_ship.sensors.measure(sailed, seed=1, start=START, blemishes=Blemishes())
        columns.append([values for one in series for values in one.columns.values()])
    assert any(not np.array_equal(a, b) for a, b in zip(*columns, strict=True))


def test_the_sizes_are_those_of_the_table():
    def reported(name, seed):
        parameters = cases.draw(seed, cause=name, size=1.0).causes[0].parameters
        return [value["value"] for value in parameters.values()]

    table = {
        "current": [(0.05, 0.18), (0, 360)], "heading_offset": [(1.2, 6)], "rudder_lag": [(1.2, 5)],
        "antenna_offset": [(0.3, 1.2), (0.05, 0.3)], "rudder_delay": [(0.6, 2.0)],
        "wind_direction_offset": [(8, 25)], "yaw_rate_bias": [(0.1, 0.5)],
        "thrust_loss": [(0.70, 0.92)], "fouling": [(1.25, 2.0)], "thrust_drift": [(0.12, 0.35)],
        "payload": [(20, 55), (0, 1)], "rudder_limit": [(50, 75)], "turbulence": [(4, 9)],
        "cross_flow_drag": [(0.55, 1.45)], "tether": [(0.6, 2.0)],
    }  # fmt: skip
    for name, ranges in table.items():
        for seed in range(20):
            values = np.abs(reported(name, seed)[: len(ranges)])
            assert all(lo <= x <= hi for x, (lo, hi) in zip(values, ranges, strict=True)), name
    either = {math.copysign(1, reported("heading_offset", seed)[0]) for seed in range(20)}
    alone = {(p == 0, s == 0) for p, s in (reported("rudder_offset", seed) for seed in range(40))}
    assert either == {-1, 1} and alone == {(True, False), (False, True), (False, False)}


def test_a_case_is_logs_without_a_trace_and_a_key_elsewhere(tmp_path):
    hidden = short(cases.draw(5, cause="side_thrust+heading_offset", size=1.0), 250.0)
    plain = short(cases.draw(5, cause="none"), 250.0)
    for case, name in ((hidden, "hidden"), (hidden, "again"), (plain, "plain")):
        cases.write(case, tmp_path / name, tmp_path / "keys" / f"{name}.json")
    files = {
        name: {p.name: p.read_bytes() for p in sorted((tmp_path / name).iterdir())}
        for name in ("hidden", "again", "plain")
    }
    assert set(files["hidden"]) == {"nominal_1.mcap", "trial_6.mcap"} == set(files["plain"])
    assert files["hidden"] == files["again"]
    assert files["hidden"]["nominal_1.mcap"] == files["plain"]["nominal_1.mcap"]
    assert files["hidden"]["trial_6.mcap"] != files["plain"]["trial_6.mcap"]
    described = []
    for name in ("hidden", "plain"):
        with open(tmp_path / name / "trial_6.mcap", "rb") as stream:
            reader = make_reader(stream)
            summary = reader.get_summary()
            assert summary is not None
            channels = [(c.topic, c.metadata) for c in summary.channels.values()]
            schemas = [s.data for s in summary.schemas.values()]
            records = [(m.name, m.metadata) for m in reader.iter_metadata()]
            described.append((channels, schemas, records, list(reader.iter_attachments())))
    assert described[0] == described[1]
    assert described[0][2][0][1]["ship"] == Ship().name  # its own name would tell the seed

    key = json.loads((tmp_path / "keys" / "hidden.json").read_text())
    assert [c["name"] for c in key["causes"]] == ["side_thrust", "heading_offset"]
    assert key["verdict"] == "named" and key["affected"] == ["trial_6"]
    pulses = key["causes"][0]["parameters"]["times"]["value"]
    sailed = cases.voyage(hidden, hidden.trial[0])
    assert sailed.pulses and pulses == {"trial_6": [list(pulse) for pulse in sailed.pulses]}
    empty = json.loads((tmp_path / "keys" / "plain.json").read_text())
    assert (empty["verdict"], empty["causes"], empty["affected"]) == ("none", [], [])


def test_a_key_never_lies_with_the_logs(tmp_path):
    case = short(cases.draw(1))
    for inside in ("key.json", "deep/er/key.json", "../logs/key.json"):
        with pytest.raises(ValueError, match="elsewhere"):
            cases.write(case, tmp_path / "logs", tmp_path / "logs" / inside)
    assert not (tmp_path / "logs").exists()
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "mine.mcap").touch()
    with pytest.raises(FileExistsError, match=r"mine\.mcap"):
        cases.write(case, tmp_path / "logs", tmp_path / "key.json")
    for wrong in ("curent", "current+current"):
        with pytest.raises(ValueError, match=r"curent|twice"):
            cases.draw(1, cause=wrong)


def test_campaigns_are_as_long_as_asked_and_the_trial_comes_later():
    long, brief = cases.draw(6), cases.draw(6, seconds=500)
    assert [leg.seconds for leg in long.trial] == [plan.seconds for plan in PLANS]
    assert brief.nominal == long.nominal and sum(leg.seconds for leg in brief.trial) == 500.0
    short = cases.draw(6, seconds=3000)
    assert [sum(leg.seconds for leg in legs) for legs in (short.nominal, short.trial)] == (
        pytest.approx([3003.0, 3003.0])
    )
    assert (short.effects, short.ship) == (long.effects, long.ship)
    for legs in (long.nominal, long.trial, brief.trial, short.nominal):
        assert legs[0].campaign[0] == 0.0 and legs[-1].campaign[1] == 1.0
        assert all(a.campaign[1] == b.campaign[0] for a, b in pairwise(legs))
    assert max(leg.start for leg in long.nominal) < min(leg.start for leg in long.trial)
    assert len({leg.seed for leg in (*long.nominal, *long.trial)}) == 12
    assert cases.draw(6) == long != cases.draw(7)


def test_a_bank_does_not_swallow_her():
    case = cases.draw(0, cause="bank", size=1.0)
    for leg in (case.trial[3], case.trial[4]):
        voyage = cases.voyage(case, leg)
        assert voyage.y0.max() < BANK_EAST - voyage.ship.breadth / 2
        assert np.hypot(voyage.x0, voyage.y0).max() < 50.0


def test_the_command_writes_a_case(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(cases, "DURATIONS", {7000: (15.0,), 500: (5.0, 5.0)})
    folder, key = str(tmp_path / "logs"), str(tmp_path / "key.json")
    command.main(["case", "8", folder, "--key", key, "--cause", "tether", "--seconds", "500"])
    names = {p.name for p in (tmp_path / "logs").iterdir()}
    assert names == {"nominal_1.mcap", "trial_1.mcap", "trial_2.mcap"}
    estimated = json.loads((tmp_path / "key.json").read_text())
    assert estimated["verdict"] == "unknown" and estimated["structure"] == {"family": "position"}
    with pytest.raises(SystemExit):
        command.main(["case", "8", folder, "--key", f"{folder}/key.json"])
    assert "elsewhere" in capsys.readouterr().err


def test_it_shares_no_code_with_shiplog_but_the_writer():
    for source in Path(simulated_ship.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(source.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0
                names = [node.module or ""]
            for name in names:
                assert not name.startswith("shiplog") or name == "shiplog.logs.write", source
