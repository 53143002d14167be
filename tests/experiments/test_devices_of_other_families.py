"""Actuators that do not do as recorded, lines, tows and fenders of ships of other families, and the
two ships that heel: closed forms, and the published equations written down once more."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from pipelines.experiments.hidden_effects import suites
from pipelines.experiments.other_families import cases, container, devices, naval_vessel, roll
from pipelines.experiments.other_families.disturbance import CALM
from pipelines.experiments.other_families.effects import Effects
from pipelines.experiments.other_families.gear import Fault, gear_of, held, remember, sent
from pipelines.experiments.other_families.instruments import measure
from pipelines.experiments.other_families.lines import (
    Contact,
    Line,
    Tow,
    add_external,
    external,
)
from pipelines.experiments.other_families.voyage import sail

# simulators of the experiments, each compiled; the product has its own tests
pytestmark = pytest.mark.nightly
STILL = {"seed": 0, "wind": CALM, "quiet": True}


def sailed(ship, order, effects=None, seconds=60.0, start=None, **more):
    start = start or (0.0, 0.0, 0.3, ship.speed, 0.0, 0.0)
    return sail(
        ship, round(seconds, 1), **STILL, helm=lambda *_: np.asarray(order, float),
        effects=effects or Effects(), start=start, **more,
    )  # fmt: skip


# --- between order and what acts ------------------------------------------------------------------


def test_a_dead_zone_takes_its_width_off_the_order():
    g = gear_of(1, (Fault(0, dead=2.0),))
    assert [sent(g, 0, x) for x in (-5.0, -2.0, -1.0, 0.0, 1.9, 3.5)] == [-3, 0, 0, 0, 0, 1.5]


def test_backlash_of_a_wave_lags_by_its_half_width_on_either_side():
    """The play operator: A sin t - b on the way up, A sin t + b down, flat for 2b after a turn."""
    g = gear_of(1, (Fault(0, play=1.0),))
    orders = 4.0 * np.sin(np.linspace(0.0, 4.0 * np.pi, 4001))
    shown = []
    for x in orders:
        shown.append(sent(g, 0, x))
        remember(g, np.array([x]))
    shown = np.array(shown)
    up, down = np.diff(shown) > 0.0, np.diff(shown) < 0.0
    assert (shown - orders)[1:][up] == pytest.approx(-1.0)
    assert (shown - orders)[1:][down] == pytest.approx(1.0)
    assert shown.max() == pytest.approx(3.0) and shown.min() == pytest.approx(-3.0)


def test_a_stop_and_a_stretch_where_it_is_stuck():
    g = gear_of(2, (Fault(0, limit=0.2), Fault(1, stuck=3.0, stuck_from=0.3, stuck_until=0.5)))
    assert [held(g, 0, x, False, 0.4) for x in (-1.0, 0.1, 0.3)] == [-0.2, 0.1, 0.2]
    assert held(g, 0, 2.0 * math.pi + 0.1, True, 0.0) == pytest.approx(0.1)  # an azimuth goes round
    assert [held(g, 1, 7.0, False, at) for at in (0.29, 0.3, 0.49, 0.5)] == [7.0, 3.0, 3.0, 7.0]


@pytest.mark.parametrize("family", ["container", "naval_vessel", "shipmmg"])
def test_a_limited_rudder_turns_the_ship_as_a_smaller_order_does_and_records_the_order(family):
    if family == "shipmmg":
        pytest.importorskip("shipmmg")
    ship = cases.FAMILIES[family](3)
    quick = replace(ship, actuators=tuple(
        replace(a, time=0.2, rate=1e6) if a.kind == "rudder" else a for a in ship.actuators
    ))  # fmt: skip
    count = len(ship.rudders)
    power = [0.6 * a.high for a in ship.actuators[count:]]
    faults = tuple(Fault(i, limit=0.2) for i in ship.rudders)
    long = 4.0 * ship.time_unit
    stopped = sailed(quick, [0.5] * count + power, Effects(gear=faults), long)
    small = sailed(quick, [0.2] * count + power, seconds=long)
    free = sailed(quick, [0.5] * count + power, seconds=long)
    apart = np.hypot(stopped.x0 - small.x0, stopped.y0 - small.y0).max()
    assert apart < 0.02 * ship.length  # what is left is how fast each order is reached
    assert np.hypot(free.x0 - small.x0, free.y0 - small.y0).max() > 20.0 * apart
    assert np.array_equal(stopped.actuators, free.actuators)


@pytest.mark.parametrize("family", ["linear_dp", "naval_vessel"])
def test_a_rate_brings_an_order_after_the_time_it_says(family):
    """A thrust that is ordered at once acts as a ramp: after T = n/ρ the ship is as a ship whose
    own unit needs T."""
    ship = cases.FAMILIES[family](3)
    unit = devices.drives(ship)[-1]
    full = ship.actuators[unit].high
    quick = replace(ship, actuators=tuple(replace(a, time=0.2, rate=1e6) for a in ship.actuators))
    seconds = 1.5 * ship.time_unit
    rate = full / seconds
    slow = replace(quick, actuators=tuple(
        replace(a, rate=rate) if i == unit else a for i, a in enumerate(quick.actuators)
    ))  # fmt: skip
    order = np.zeros(len(ship.actuators))
    order[unit] = full
    start = (0.0, 0.0, 0.3, 0.0, 0.0, 0.0)
    fault = Effects(gear=(Fault(unit, rate=rate),))
    one = sailed(quick, order, fault, 2.0 * seconds, start)
    other = sailed(slow, order, None, 2.0 * seconds, start)
    at_once = sailed(quick, order, None, 2.0 * seconds, start)
    assert one.surge == pytest.approx(other.surge, abs=0.02 * np.abs(at_once.surge).max())
    assert np.abs(one.surge - at_once.surge).max() > 0.2 * np.abs(at_once.surge).max()
    assert np.array_equal(one.actuators, at_once.actuators)


def test_a_unit_follows_a_share_of_the_other_one_and_exchanged_units_move_as_ever():
    ship = cases.FAMILIES["catamaran"](3)
    full = ship.actuators[0].high
    coupled = Effects(couple=0.3, couple_from=0, couple_to=1)
    one = sailed(ship, [0.5 * full, 0.2 * full], coupled)
    other = sailed(ship, [0.5 * full, 0.35 * full])
    assert np.hypot(one.x0 - other.x0, one.y0 - other.y0).max() < 0.2 * ship.length
    start = cases.NOMINAL_DAY
    v = sailed(ship, [0.5 * full, 0.2 * full])
    swapped = replace(v, effects=Effects(exchanged=(0, 1)))
    plain, crossed = (
        {s.topic: next(iter(s.columns.values())).mean() for s in measure(w, seed=1, start=start)}
        for w in (v, swapped)
    )
    port, starboard = "/propeller/thruster_port", "/propeller/thruster_starboard"
    assert crossed[port] == pytest.approx(plain[starboard], rel=1e-3)
    assert crossed[starboard] == pytest.approx(plain[port], rel=1e-3)
    assert plain[port] > 1.5 * plain[starboard]


# --- lines, tows and fenders ----------------------------------------------------------------------


def forced(effect, north, east, psi, campaign=0.0, wall=1e9):
    out = np.zeros(3)
    parts = {"line": None, "tow": None, "contact": None} | effect
    add_external(external(**parts, wall_east=wall), north, east, psi, 2.0, campaign, out)
    return out


def test_a_line_pulls_beyond_its_length_and_turns_the_ship_by_where_it_is_fast():
    spring = {"line": Line(100.0, 0.0, 30.0, stiffness=2.0, ahead=5.0)}
    assert forced(spring, 80.0, 0.0, 0.0) == pytest.approx([0, 0, 0])  # slack: 15 m of 30
    # heading east at the origin, fast 5 m ahead: the end is at (0, 5), 100.12 m from the bollard
    far = math.hypot(100.0, 5.0)
    pull = 2.0 * (far - 30.0)
    ahead, starboard = -5.0 / far, -100.0 / far  # to the north is to port
    assert forced(spring, 0.0, 0.0, math.pi / 2) == pytest.approx(
        [pull * ahead, pull * starboard, 5.0 * pull * starboard], abs=1e-5
    )
    winch = {"line": Line(100.0, 0.0, 30.0, constant=7.0)}
    assert forced(winch, 0.0, 0.0, 0.0) == pytest.approx([7.0, 0.0, 0.0], abs=1e-6)


def test_a_tow_turns_slowly_and_a_fender_pushes_off_the_wall():
    tow = {"tow": Tow(10.0, 0.0, 1.0, ahead=-4.0)}
    assert forced(tow, 0, 0, 0.0, campaign=0.5) == pytest.approx(
        [10 * math.cos(0.5), 10 * math.sin(0.5), -40 * math.sin(0.5)]
    )
    fender = {"contact": Contact(100.0, 4.0)}
    # ship's side 1 m off midship: gap of 1 m at y = 48, and 5 m at 44
    assert forced(fender, 0, 48.0, 0.0, wall=50.0) == pytest.approx([0.0, -75.0, 0.0])
    assert forced(fender, 0, 48.0, math.pi / 2, wall=50.0) == pytest.approx([-75.0, 0, 0], abs=1e-9)
    assert forced(fender, 0, 44.0, 0.0, wall=50.0) == pytest.approx([0, 0, 0])


@pytest.mark.parametrize("family", cases.FAMILIES)
def test_a_moored_ship_swings_about_its_bollard_at_the_line_s_length(family):
    """With no power and no weather a towed ship comes to its point, and stays within its line."""
    if family == "shipmmg":
        pytest.importorskip("shipmmg")
    ship = cases.FAMILIES[family](4)
    pull = 0.2 * ship.force_unit
    line = Line(6.0 * ship.length, 0.0, ship.length, stiffness=pull / ship.length)
    v = sailed(
        ship, np.zeros(len(ship.actuators)), Effects(line=line), 40.0 * ship.time_unit,
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    )  # fmt: skip
    to = np.hypot(line.north - v.x0, line.east - v.y0)
    assert to[-1] < 2.0 * ship.length < 5.9 * ship.length < to[0]
    assert np.abs(v.y0).max() < 0.01 * ship.length  # straight to it, bow first


@pytest.mark.parametrize("family", ["linear_dp", "container"])
def test_who_calls_at_the_wall_comes_to_its_fenders_and_not_through_them(family):
    case = cases.draw(5, family=family, cause="contact", size=1.0)
    leg = case.trial[3]
    v = cases.voyage(case, leg)
    gap = case.ship.bank_east - 0.5 * case.ship.body.breadth - v.y0
    assert case.effects.contact is not None
    assert 0.01 < np.mean(gap < case.effects.contact.reach) < 0.4
    assert gap.min() > -0.25 * case.ship.length


# --- what is drawn --------------------------------------------------------------------------------


@pytest.mark.parametrize("family", cases.FAMILIES)
def test_each_device_moves_the_ship_and_its_key_says_where(family):
    if family == "shipmmg":
        pytest.importorskip("shipmmg")
    ship = cases.FAMILIES[family](6)
    offered = devices.offered(ship)
    assert {"actuator_limit:drive", "line:elastic", "contact", "tow:turning"} <= set(offered)
    assert ("actuators_exchanged" in offered) == (len(ship.drives) > 1)
    for name in offered:
        case = cases.draw(6, family=family, cause=name, size=1.0)
        (cause,) = case.causes
        assert cause.name == name.partition(":")[0] and cause.family is None
        assert case.verdict == "named"
        if name.startswith("actuator"):
            units = {a.name for a in ship.actuators}
            assert cause.parameters["actuator"]["value"] in units
        none = cases.draw(6, family=family, cause="none")
        assert repr(case.ship.c) == repr(none.ship.c) and case.trial == none.trial


def test_what_a_ship_cannot_have_is_refused():
    with pytest.raises(ValueError, match="cannot have cause 'actuator_stuck:steering'"):
        cases.draw(1, family="abkowitz", cause="actuator_stuck:steering")
    two = cases.draw(1, family="linear_dp", cause="actuator_limit:drive+actuator_rate:drive")
    assert len(two.effects.gear) == 2


def test_a_third_of_the_block_abroad_is_actuators_lines_and_tows():
    pytest.importorskip("shipmmg")
    planned = suites.plan("devices-abroad").cases
    assert len(planned) == 120 and {p.family for p in planned} == set(cases.FAMILIES)
    single = [p for p in planned if "+" not in str(p.cause)]
    of_devices = [
        p for p in single if str(p.cause).startswith(("actuator", "line", "tow:", "cont"))
    ]
    assert len(of_devices) == 45 and sum(p.cause == "none" for p in planned) == 20
    assert len({p.cause for p in of_devices}) >= 12
    assert sum("+" in str(p.cause) for p in planned) == 15
    assert suites.plan("devices-abroad", None, 30).cases == planned[:30]
    for p in planned:
        cases.draw(p.seed, family=p.family, cause=p.cause, size=p.size)  # each can be made


# --- ships that heel ------------------------------------------------------------------------------


def published_container(u, v, r, phi, p, delta, n):
    """Accelerations of Son & Nomoto's container ship as MSS has them, in SI, written by hand."""
    ell, speed = 175.0, math.hypot(u, v)
    u, v, r, p, n = u / speed, v / speed, r * ell / speed, p * ell / speed, n * ell / speed
    h = container.HULL
    m, mx, my, ix, iz = 0.00792, 0.000238, 0.007049, 0.0000210, 0.000875
    weight = 1025 * 9.81 * 21222 / (1025 * ell**2 * speed**2 / 2)
    v_r = 0.088 * v - 0.156 * r - 0.275 * r**3 + 1.96 * r**2 * v
    u_p = u * ((1 - 0.184) + 1.09 * (v - 0.526 * r) ** 2)
    j = u_p * ell / (n * 6.533)
    k_t = 0.527 - 0.455 * j
    u_r = u_p * 0.921 * math.sqrt(1 + 8 * 0.631 * k_t / (math.pi * j**2))
    attack = delta + math.atan(v_r / u_r)
    f_n = -(6.13 * 1.8219) / (1.8219 + 2.25) * (33.0376 / ell**2) * (u_r**2 + v_r**2)
    f_n *= math.sin(attack)
    thrust = 2 * 6.533**4 / ell**4 * k_t * n * abs(n)
    x = h["x_uu"] * u * u + 0.825 * thrust + h["x_vr"] * v * r + h["x_vv"] * v * v
    x += h["x_rr"] * r * r + h["x_ff"] * phi**2 + 0.71 * f_n * math.sin(delta) + (m + my) * v * r

    def cubic(a):
        return (
            h[f"{a}_v"] * v + h[f"{a}_r"] * r + h[f"{a}_f"] * phi + h[f"{a}_vvv"] * v**3
            + h[f"{a}_rrr"] * r**3 + h[f"{a}_vvr"] * v * v * r + h[f"{a}_vrr"] * v * r * r
            + h[f"{a}_vvf"] * v * v * phi + h[f"{a}_vff"] * v * phi * phi
            + h[f"{a}_rrf"] * r * r * phi + h[f"{a}_rff"] * r * phi * phi
        )  # fmt: skip

    side = 1.237 * f_n * math.cos(delta)
    y = cubic("y") + side - (m + mx) * u * r
    k = cubic("k") + h["k_p"] * p - 0.033 * side + mx * 0.0313 * u * r - weight * (0.3 / ell) * phi
    turn = cubic("n") + h["n_p"] * p + (-0.5 - 0.237 * 0.48) * f_n * math.cos(delta)
    mass = np.array([[m + my, -my * 0.0313, my * 0.05], [-my * 0.0313, ix, 0], [my * 0.05, 0, iz]])
    dv, dp, dr = np.linalg.solve(mass, [y, k, turn])
    a = speed**2 / ell
    return np.array([x / (m + mx) * a, dv * a, dr * a / ell, dp * a / ell])


def test_the_container_ship_turns_as_the_published_equations_do():
    """Ahead at moderate drift; the damping of roll at no speed is not in the source."""
    ship = container.sister(np.random.default_rng(0), 175.0, 0.0)
    state = np.zeros(12)
    for u, v, r, phi, p, delta, n in (
        (7.0, 0.0, 0.0, 0.0, 0.0, 0.1, 1.2),
        (6.0, -0.5, 0.008, -0.05, 0.002, 0.17, 1.1),
        (5.0, 0.6, -0.006, 0.04, -0.001, -0.3, 0.9),
    ):
        assert roll.ahead_share(u, v, 175.0 * r) == 1.0
        state[3:6], state[6:8], state[-2:] = (u, v, r), (delta, n), (phi, p)
        out = np.zeros(4)
        still = ship.c._replace(bilge=0.0)
        ship.forces(still, u, v, r, phi, p, state[6:8], np.ones(1), np.ones(6), 1.0, 0.0, out)
        b = ship.body
        x = out[0] + b.mass * v * r
        y, k, n_ = out[1] - b.mass * u * r, out[3], out[2]
        dv, dp, dr = np.linalg.solve(ship.roll.mass, [y, k, n_])
        expected = published_container(u, v, r, phi, p, delta, n)
        assert [x / (b.mass + b.m_x), dv, dr, dp] == pytest.approx(expected, rel=4e-3, abs=1e-6)


@pytest.mark.parametrize(
    ("module", "length", "inertia", "stiffness"),
    [
        # K_p and the heel's coupling aside: T = 2π √((I_x + J_x)/(Δ GM))
        (container, 175.0, 0.0000210 * 0.5 * 1025 * 175.0**5, 1025 * 9.81 * 21222 * 0.3),
        (naval_vessel, 51.5, 2.3763e6 + 774e3, 357 * 1014 * 9.81 * 1.1),
    ],
)
def test_a_heeled_ship_rolls_with_its_published_period_and_comes_to_rest(
    module, length, inertia, stiffness, monkeypatch
):
    ship = module.sister(np.random.default_rng(0), length, 0.0)
    period = 2.0 * math.pi * math.sqrt(inertia / stiffness)
    inner = roll.advance

    def heeled(*arguments):
        track, first = arguments[7], arguments[8]
        if first == 0:
            track[0, -2] = 0.1
        inner(*arguments)

    monkeypatch.setattr(roll, "advance", heeled)
    v = sailed(
        replace(ship, windage=ship.windage._replace(lateral=0.0)), np.zeros(len(ship.actuators)),
        None, 8.0 * period, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    )  # fmt: skip
    down = np.flatnonzero((v.heel[:-1] > 0.0) & (v.heel[1:] <= 0.0))
    found = np.diff(v.time[down]).mean()
    # sway and yaw go with it: the freed ship rolls a little faster than a pinned one
    assert 0.85 * period < found < 1.01 * period
    peaks = [np.abs(part).max() for part in np.array_split(v.heel, 8)]
    assert all(a > b for a, b in pairwise(peaks))
    assert peaks[-1] < 0.5 * peaks[0]


@pytest.mark.parametrize("family", ["container", "naval_vessel"])
def test_a_turning_ship_heels_inward_first_and_then_outward(family):
    """By its rudder, below the axis of roll; then by what holds the hull against the turn."""
    ship = cases.FAMILIES[family](2)
    order = ship.mixer(0.8, 0.6, 0.0)
    v = sailed(ship, order, None, 12.0 * ship.time_unit, (0, 0, 0, 1.3 * ship.speed, 0, 0))
    assert v.heading[-1] > 1.0  # to starboard
    assert v.heel[: round(3.0 * ship.time_unit)].max() > 0.0
    assert v.heel[-1] < -math.radians(0.2)


@pytest.mark.parametrize("family", ["container", "naval_vessel"])
@pytest.mark.parametrize("seed", range(3))
def test_without_power_a_ship_that_heels_slows_down(family, seed):
    ship = cases.FAMILIES[family](seed)
    rng = np.random.default_rng(seed)
    motion = rng.uniform((-1.0, -0.4, -0.4), (1.3, 0.4, 0.4)) * (
        ship.speed, ship.speed, 1.0 / ship.time_unit
    )  # fmt: skip
    v = sailed(
        ship, np.zeros(len(ship.actuators)), None, 20.0 * ship.time_unit, (0, 0, 1.0, *motion)
    )  # fmt: skip
    b = ship.body
    stored = (b.mass + b.m_x) * v.surge**2 + (b.mass + b.m_y) * v.sway**2
    stored += (b.inertia + b.j_z) * v.yaw_rate**2
    assert stored[-1] < 0.5 * stored[0] and stored.max() < 1.3 * stored[0]
    assert np.abs(v.heel).max() < math.radians(15.0)
