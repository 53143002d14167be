"""What the simulated ship hides moves it, or bends an instrument, by as much as it says."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from simulated_voyages import STEADY, antenna_path, hold, local, state, topics

from pipelines.experiments import simulated_ship
from pipelines.experiments.simulated_ship import (
    BANK_EAST,
    CALM,
    Effects,
    Ship,
    Wind,
    physics,
    sail,
    write_voyage,
)
from pipelines.experiments.simulated_ship.sample_logs import SEED
from pipelines.experiments.simulated_ship.voyage import PULSE_TIMES

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

pytestmark = pytest.mark.long  # simulated ships of the experiments; the product has its own tests


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
    # more water moves with it: the same force aside, from rest, gets it under way more slowly
    out = np.empty((2, physics.STATES))
    at_rest = np.zeros(physics.STATES)
    at_rest[[0, 2]] = 5.0, -3.0
    force = np.array([2.0, 0.0, 0.0, 0.0])
    for row, hide in zip(out, (Effects(), effects), strict=True):
        h = physics.hidden(hide, (0.0, 1.0), 1.0)
        physics.rates(numbers, h, at_rest, 0.0, 0.0, 0.0, np.zeros(3), np.zeros(2), force, 0.0, row)
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
