"""Two sensors that exclude each other are found before any fit; sound ones of any ship are not."""

import dataclasses
import json
import math

import numpy as np
import polars as pl
import pytest
import sailing
from commands import call
from known_motion import (
    KNOT,
    METRE,
    Noise,
    actuator,
    measured,
    profile,
    sailed,
    steered,
    swinging,
    table,
)

from shiplog.logs.health.health_report import REASONS, VoyageReport
from shiplog.nomenclature.channels import Quality
from shiplog.voyages.contradictions import gross as contradictions
from shiplog.voyages.contradictions.regression import regress
from shiplog.voyages.contradictions.track import track
from shiplog.voyages.sensors.comparison import compare

R = math.radians
SHIP = swinging(turn=7.0)


def none(t):
    return 0.0 * t


def found(raw, p):
    return contradictions.find(table(raw, p), p).findings


def changed(raw, **how):
    return raw | {name: change(raw[name]) for name, change in how.items()}


def both(change):
    return {"v0": change, "v1": change}


# (what is wrong, the user's profile, what the recorder wrote, channel, reason, line of the profile)
WRONG = [
    ("km/h as m/s", {}, {"v0": lambda v: 3.6 * v}, "velocity", "unit", 'units = ["km/h", "deg"]'),
    ("knots as m/s", {}, {"v0": lambda v: v / KNOT}, "velocity", "unit", 'units = ["kn", "deg"]'),
    ("m/s as knots", {"units": ("kn", "deg")}, {}, "velocity", "unit", 'units = ["m/s", "deg"]'),
    ("mph as m/s", {}, {"v0": lambda v: v / 0.44704}, "velocity", "unit", '["mph", "deg"]'),
    ("ft/s as m/s", {}, {"v0": lambda v: v / 0.3048}, "velocity", "unit", "sign = [0.3048, 1.0]"),
    ("cm/s as m/s", {}, {"v0": lambda v: 100.0 * v}, "velocity", "unit", '["cm/s", "deg"]'),
    ("knots twice", {}, {"v0": lambda v: v * KNOT}, "velocity", "unit", "sign = [1.94"),
    ("components in km/h", {"velocity": "ned"}, both(lambda v: 3.6 * v), "velocity", "unit",
     'unit = "km/h"'),
    ("log in knots", {"velocity": "body"}, both(lambda v: v / KNOT), "velocity", "unit",
     'unit = "kn"'),
    ("course reversed", {}, {"v1": lambda v: v + 180.0}, "velocity", "sign", "[0.0, 180]"),
    ("course mirrored", {}, {"v1": lambda v: -v}, "velocity", "sign", "sign = [1.0, -1.0]"),
    ("course from east", {}, {"v1": lambda v: 90.0 - v}, "velocity", "frame", "offset = [0.0, 90]"),
    ("course + 90", {}, {"v1": lambda v: v + 90.0}, "velocity", "frame", "offset = [0.0, 90]"),
    ("magnetic course", {}, {"v1": lambda v: v - 14.0}, "velocity", "frame", "offset = [0.0, -14]"),
    ("course in radians", {}, {"v1": np.radians}, "velocity", "unit", '["m/s", "rad"]'),
    ("course in degrees", {"units": ("m/s", "rad")}, {}, "velocity", "unit", '["m/s", "deg"]'),
    ("east to port", {"velocity": "ned"}, {"v1": lambda v: -v}, "velocity", "sign", "[1.0, -1.0]"),
    ("log astern", {"velocity": "body"}, both(lambda v: -v), "velocity", "sign", "sign = -1.0"),
    ("heading anticlockwise", {}, {"heading": lambda v: -v % 360}, "heading", "sign",
     "sign = -1.0 on [sensors.heading]"),
    ("heading from east", {}, {"heading": lambda v: (90 - v) % 360}, "heading", "frame",
     "offset = 90 on [sensors.heading]"),
    ("heading in radians", {}, {"heading": np.radians}, "heading", "unit", 'unit = "rad"'),
    ("heading in degrees", {"heading": "rad"}, {}, "heading", "unit", 'unit = "deg"'),
    ("heading astern", {}, {"heading": lambda v: (v + 180) % 360}, "heading", "sign",
     "offset = 180 on [sensors.heading]"),
    ("heading abeam", {}, {"heading": lambda v: (v + 90) % 360}, "heading", "frame", "offset = 90"),
    ("heading still", {}, {"heading": lambda v: 0 * v + 28.6}, "heading", "none known", "[sensors"),
    ("heading turned, own log", {"velocity": "body"}, {"heading": lambda v: (v + 90) % 360},
     "heading", "frame", "offset = 90"),
    ("heading anticlockwise, no gyro", {"rate": False}, {"heading": lambda v: -v % 360}, "heading",
     "sign", "sign = -1.0 on [sensors.heading]"),
    ("heading in radians, own log", {"velocity": "body", "rate": False}, {"heading": np.radians},
     "heading", "unit", 'unit = "rad"'),
    ("heading in degrees, no gyro", {"heading": "rad", "rate": False}, {}, "heading", "unit",
     'unit = "deg"'),
    ("heading still, no gyro", {"rate": False}, {"heading": lambda v: 0 * v + 28.6}, "heading",
     "none known", "never changes"),
    ("heading and gyro to port", {}, {"heading": lambda v: -v % 360, "rate": lambda v: -v},
     "heading", "sign", "sign = -1.0 on [sensors.yaw_rate]"),
    ("gyro to port", {}, {"rate": lambda v: -v}, "yaw_rate", "sign", "sign = -1.0"),
    ("gyro in rad/s", {}, {"rate": np.radians}, "yaw_rate", "unit", 'unit = "rad/s"'),
    ("gyro in deg/min", {}, {"rate": lambda v: 60 * v}, "yaw_rate", "unit", 'unit = "deg/min"'),
    ("gyro called deg/min", {"rate_unit": "deg/min"}, {}, "yaw_rate", "unit", 'unit = "deg/s"'),
    ("gyro silent", {}, {"rate": lambda v: 0 * v}, "yaw_rate", "none known", "more than"),
    ("gyro late", {}, {"rate": lambda v: np.roll(v, 200)}, "yaw_rate", "clock", "20 s after"),
    ("longitude west", {}, {"p1": lambda v: -v}, "position", "sign", "sign = [1.0, -1.0]"),
    ("y to port", {"position": "local"}, {"p1": lambda v: -v}, "position", "sign", "[1.0, -1.0]"),
    ("position stands", {}, {"p0": lambda v: 0 * v + 54, "p1": lambda v: 0 * v + 10}, "position",
     "none known", "more than 50 times"),
    ("velocity silent", {"velocity": "ned"}, both(lambda v: 0 * v), "velocity", "none known",
     "more than 50 times"),
    ("rudder to port", {}, {"rudder": lambda v: -v}, "rudder", "sign", "sign = -1.0 on the act"),
    ("propeller astern", {}, {"propeller": lambda v: -v}, "propeller", "sign", "sign = -1.0 on"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("given", "wrote", "channel", "reason", "line"),
    [one[1:] for one in WRONG], ids=[one[0] for one in WRONG],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_channel_reason_and_line(
    given, wrote, channel, reason, line
):
    p = profile(**given)
    kinds = {name: p.sensors.kind(name) for name in ("velocity", "position")}
    (one,) = found(changed(measured(SHIP, **kinds), **wrote), p)
    assert (one.kind, one.channel, one.reason) == ("contradiction", channel, reason)
    assert line in one.sentence
    assert reason in REASONS
    if one.low is not None and one.high is not None:
        assert one.low <= one.value <= one.high


@pytest.mark.parametrize(
    ("given", "wrote", "value"),
    [
        ({}, {"v0": lambda v: 3.6 * v}, 3.6),
        ({}, {"v0": lambda v: 0.7 * v}, 0.7),
        ({}, {"v1": lambda v: v + 20.0}, 20.0),
        ({"velocity": "body"}, {"heading": lambda v: (v + 40) % 360}, 40.0),
        ({}, {"rate": lambda v: 60.0 * v}, 60.0),
        ({}, {"rate": lambda v: -v}, -1.0),
    ],
)
def test_the_size_lies_in_a_narrow_interval(given, wrote, value):
    p = profile(**given)
    (one,) = found(changed(measured(SHIP, p.sensors.kind("velocity")), **wrote), p)
    assert abs(one.value - value) < one.high - one.low
    assert one.high - one.low < 0.05 * abs(value)


def test_latitude_and_longitude_in_each_others_place_of_either_kind_of_velocity():
    for velocity in ("sog_cog", "body"):
        raw = measured(SHIP, velocity)
        raw["p0"], raw["p1"] = raw["p1"], raw["p0"]
        (one,) = found(raw, profile(velocity))
        assert (one.channel, one.reason) == ("position", "swapped")
        assert "latitude and longitude" in one.sentence


@pytest.mark.parametrize("velocity", ["ned", "enu"])
def test_components_in_each_others_place(velocity):
    raw = measured(SHIP, velocity)
    raw["v0"], raw["v1"] = raw["v1"], raw["v0"]
    (one,) = found(raw, profile(velocity))
    other = {"ned": "enu", "enu": "ned"}[velocity]
    assert one.channel == "velocity" and f'kind = "{other}"' in one.sentence


def drifting():
    """Sway of its own, as wind makes it: not the turning of another point."""
    return dataclasses.replace(SHIP, **_with_sway(0.6 * np.sin(0.05 * SHIP.time)))


def _with_sway(sway):
    c, s = np.cos(SHIP.heading), np.sin(SHIP.heading)
    vn, ve = c * SHIP.surge - s * sway, s * SHIP.surge + c * sway
    return {"sway": sway, "north": np.cumsum(vn) * 0.1, "east": np.cumsum(ve) * 0.1}


@pytest.mark.parametrize(("wrote", "reason"), [
    (lambda raw: raw | {"v1": -raw["v1"]}, "sign"),
    (lambda raw: raw | {"v0": raw["v1"], "v1": raw["v0"]}, "swapped"),
])  # fmt: skip
def test_surge_and_sway(wrote, reason):
    (one,) = found(wrote(measured(drifting(), "body")), profile("body"))
    assert (one.channel, one.reason) == ("velocity", reason)


def test_a_local_position_in_feet_names_both_since_no_third_tells():
    raw = changed(
        measured(SHIP, position="local"), **{p: lambda v: v / 0.3048 for p in ("p0", "p1")}
    )
    (one,) = found(raw, profile(position="local"))
    assert one.reason == "unit" and "velocity or the position" in one.sentence
    assert 'unit = "ft" on [sensors.position]' in one.sentence


def test_a_mirrored_position_in_body_axes_names_the_heading_too():
    raw = changed(measured(SHIP, "body"), p1=lambda v: -v)
    (one,) = found(raw, profile("body"))
    assert one.channel == "position" and "the heading or the position" in one.sentence


def test_a_velocity_half_a_minute_late_is_a_clock():
    raw = changed(measured(SHIP), **both(lambda v: np.roll(v, 300)))
    (one,) = found(raw, profile())
    assert one.reason == "clock" and one.low <= 30.0 <= one.high


TWIN = (
    actuator("port", "thruster", -0.8, -0.4), actuator("starboard", "thruster", -0.8, 0.4),
)  # fmt: skip


def twin():
    """Two thrusters side by side: the one to starboard turns the bow to port. u' and r' follow
    them by the same decay, each in closed form."""
    lag = 3.0

    def answer(t, a, w, p):
        return a * np.sin(w * t + p - math.atan(w * lag)) / math.hypot(1.0, w * lag)

    parts = ((0.25, 0.21, 0.3), (0.2, 0.083, 1.0))  # of the difference
    pace = ((0.2, 0.051, 0.0), (0.15, 0.023, 2.0))  # of the sum

    def force(side):
        def of(t):
            turn = sum(a * np.sin(w * t + p) for a, w, p in parts)
            return 0.5 + sum(a * np.sin(w * t + p) for a, w, p in pace) - side * turn

        return lambda t: np.sign(of(t)) * np.sqrt(np.abs(of(t)))

    return sailed(
        600.0,
        lambda t: 1.2 * sum(answer(t, *one) for one in parts),
        lambda t: 1.5 * (1.0 + 1.5 * sum(answer(t, *one) for one in pace)),
        drives={"port": force(-1.0), "starboard": force(1.0)},
    )


@pytest.mark.parametrize(
    ("wrote", "channels", "words"),
    [
        ({}, [], ""),
        ({"port": lambda n: -n}, ["port"], "sign = -1.0"),
        ({"starboard": lambda n: -n}, ["starboard"], "sign = -1.0"),
    ],
)
def test_a_propeller_of_the_other_hand(wrote, channels, words):
    raw = changed(measured(twin()), **wrote)
    said = found(raw, profile(length=2.0, actuators=TWIN))
    assert [one.channel for one in said] == channels
    assert all(words in one.sentence for one in said)


def test_two_thrusters_exchanged():
    raw = measured(twin())
    raw["port"], raw["starboard"] = raw["starboard"], raw["port"]
    (one,) = found(raw, profile(length=2.0, actuators=TWIN))
    assert one.reason == "swapped" and "port and starboard" in one.sentence


def coarse(raw, kind):
    """Whole degrees, 0.1 kn, five decimals of a degree."""
    raw = dict(raw)
    for name in ("v0", "v1"):
        raw[name] = np.round(raw[name] / KNOT, 1) * KNOT if kind != "sog_cog" else raw[name]
    if kind == "sog_cog":
        raw["v0"], raw["v1"] = np.round(raw["v0"] / KNOT, 1) * KNOT, np.round(raw["v1"]) % 360.0
    return raw | {
        "heading": np.round(raw["heading"]) % 360.0,
        "rate": np.round(raw["rate"], 1),
        "p0": np.round(raw["p0"], 5), "p1": np.round(raw["p1"], 5),
    }  # fmt: skip


def seldom(raw, kind):
    """Once a second, with straight lines between."""
    at = np.arange(len(raw["heading"]))
    keep = at[::10]

    def line(values):
        return np.interp(at, keep, values[keep])

    some = {n: line(v) for n, v in raw.items() if n not in ("heading", "v0", "v1")}
    some["heading"] = np.degrees(line(np.unwrap(np.radians(raw["heading"])))) % 360.0
    if kind == "sog_cog":
        v = raw["v0"] * np.exp(1j * np.radians(raw["v1"]))
        v = np.interp(at, keep, v[keep])
        some |= {"v0": np.abs(v), "v1": np.degrees(np.angle(v)) % 360.0}
    else:
        some |= {"v0": line(raw["v0"]), "v1": line(raw["v1"])}
    return some


def wandering(raw, kind):
    """A position that walks by metres, as a receiver's does at a berth."""
    walk = np.cumsum(np.random.default_rng(5).normal(0, 0.03, (2, len(raw["heading"]))), axis=1)
    return raw | {"p0": raw["p0"] + walk[0] / METRE[0], "p1": raw["p1"] + walk[1] / METRE[1]}


def lagging(raw, kind):
    """A compass damped by four seconds."""
    heading = np.unwrap(np.radians(raw["heading"]))
    for i in range(1, len(heading)):
        heading[i] = heading[i - 1] + 0.025 * (heading[i] - heading[i - 1])
    return raw | {"heading": np.degrees(heading) % 360.0}


def punctual(raw, kind):
    return raw


def late(seconds, *names):
    rows = round(10 * seconds)

    def after(raw, kind):
        return raw | {
            n: np.concatenate((np.repeat(raw[n][:1], rows), raw[n][:-rows])) for n in names
        }

    return after


REST = {"rudder": none, "propeller": none}
AZIMUTH = (actuator("azimuth", "azimuth", unit="rad"), actuator("thruster", "thruster"))


def azimuth_ship(angle, *motion):
    ship = sailed(900.0, *motion)
    ship.drives = {"azimuth": angle + 0.0 * ship.time, "thruster": 5.0 + 0.0 * ship.time}
    return ship


def zigzag(t, psi, r, u):
    return 0.35 * math.copysign(1.0, math.sin(math.tau * t / 60.0))


def course_keeping(t, psi, r, u):
    return max(-0.6, min(0.6, -(psi - 0.7) - 3.0 * r))


def full(t, psi, r, u):
    return 5.0


def crash_stops(t, psi, r, u):
    return 5.0 if t % 300 < 150 else -4.0 if t % 300 < 230 else 0.0


ROLLING = sailed(900.0, lambda t: R(1.5) * np.sin(t * 0.8), lambda t: 0.4 * np.sin(t * 0.9),
                 lambda t: 0.5 * np.sin(t * 0.7 + 1), drives=REST)  # fmt: skip
LYING = sailed(900.0, none, none, drives=REST)
CIRCLE = sailed(600.0, lambda t: R(2.0) + 0 * t, lambda t: 3.0 + 0 * t, lambda t: -0.5 + 0 * t,
                drives={"rudder": lambda t: 0.3 + 0 * t,
                        "propeller": lambda t: 5.0 + 0 * t})  # fmt: skip
STRAIGHT = sailed(600.0, none, lambda t: 3.0 + 0.5 * np.sin(0.01 * t), current=(1.0, 0.5),
                  drives={"rudder": none, "propeller": lambda t: 5.0 + 0 * t})  # fmt: skip
PLANING = sailed(
    300.0, lambda t: R(25) * np.sin(0.21 * t) + R(15) * np.sin(0.087 * t),
    lambda t: 12 + 3 * np.sin(0.05 * t), lambda t: -0.8 * np.sin(0.21 * t),
    drives={"rudder": lambda t: R(20) * np.sin(0.21 * t + 0.2) + R(12) * np.sin(0.087 * t + 0.1),
            "propeller": lambda t: 20 + 3 * np.sin(0.05 * t + 0.1)},
)  # fmt: skip
# North for five minutes, then stopped and turned by a right angle, and astern: west, as a ship
# would sail ahead that turned to port, with a heading that counts the other way.
TURNED_ASTERN = sailed(
    700.0, lambda t: R(0.9) * ((t > 300) & (t < 400)) + R(0.3) * np.sin(0.1 * t),
    lambda t: 2.0 * np.interp(t, [300, 400], [1.0, -1.0]) + 0.2 * np.sin(0.05 * t),
    lambda t: 0.1 * np.sin(0.03 * t),
    drives={"rudder": none, "propeller": lambda t: 5.0 * np.interp(t, [300, 400], [1.0, -1.0])},
)  # fmt: skip
SOUND = {  # ship, its length, instruments, actuators
    "turning": (SHIP, 10.0, punctual, None),
    "coarse": (SHIP, 10.0, coarse, None),
    "once a second": (SHIP, 10.0, seldom, None),
    "once a second, coarse": (SHIP, 10.0, lambda raw, kind: coarse(seldom(raw, kind), kind), None),
    "short": (swinging(seconds=120.0), 10.0, punctual, None),
    "at rest": (LYING, 10.0, wandering, None),
    "at rest, coarse": (LYING, 10.0, coarse, None),
    "alongside in waves": (ROLLING, 20.0, wandering, None),
    "damped compass in waves": (ROLLING, 20.0, lagging, None),
    "damped compass": (SHIP, 10.0, lagging, None),
    "biased gyro": (SHIP, 10.0, lambda raw, kind: raw | {"rate": 0.9 * raw["rate"] + 0.4}, None),
    "tanker, dead slow": (swinging(3600.0, 1.0, 1.0, 330.0), 330.0, punctual, None),
    "tanker, dead slow, coarse": (swinging(3600.0, 1.0, 1.0, 330.0), 330.0, coarse, None),
    "sideways by azimuths": (
        azimuth_ship(1.57, lambda t: R(0.3) * np.sin(0.01 * t), lambda t: 0.1 * np.sin(0.03 * t),
                     lambda t: 1.0 + 0.2 * np.sin(0.02 * t)), 12.0, punctual, AZIMUTH,
    ),
    "on the spot by azimuths": (
        azimuth_ship(0.0, lambda t: R(1.2) * np.sin(0.017 * t + 2), lambda t: np.cos(0.013 * t),
                     lambda t: np.sin(0.013 * t)), 12.0, punctual, AZIMUTH,
    ),
    "double-ended, stern first": (
        azimuth_ship(3.14, lambda t: R(0.8) * np.sin(0.02 * t), lambda t: -5 + np.sin(0.01 * t),
                     lambda t: 0.3 * np.sin(0.02 * t)), 100.0, punctual, AZIMUTH,
    ),
    "towed stern first": (
        sailed(900.0, lambda t: R(0.8) * np.sin(0.03 * t), lambda t: -2 + 0.3 * np.sin(0.02 * t),
               lambda t: 0.2 * np.sin(0.03 * t), drives=REST), 20.0, punctual, None,
    ),
    "in a current": (swinging(turn=7.0, current=(0.0, 2.0)), 10.0, punctual, None),
    "straight in a current": (STRAIGHT, 20.0, punctual, None),
    "steady circle": (CIRCLE, 20.0, punctual, None),
    "circle, late velocity": (CIRCLE, 20.0, late(1.0, "v0", "v1"), None),
    "planing": (PLANING, 6.0, punctual, None),
    "planing, late position": (PLANING, 6.0, late(0.5, "p0", "p1"), None),
    "zigzag": (steered(600.0, zigzag, full), 20.0, punctual, None),
    "course kept in waves": (steered(900.0, course_keeping, full, waves=3.0, wind=0.5), 20.0,
                             punctual, None),
    "crash stops": (steered(900.0, zigzag, crash_stops), 20.0, punctual, None),
    "astern on another course": (TURNED_ASTERN, 20.0, punctual, None),
    "set astern by the stream": (
        steered(900.0, course_keeping, lambda *now: 2.5,
                current=(-3.0 * math.cos(0.7), -3.0 * math.sin(0.7))), 20.0, punctual, None,
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", ["sog_cog", "ned", "body"])
@pytest.mark.parametrize("name", list(SOUND))
def test_a_sound_voyage_has_none(name, kind):
    ship, length, instruments, actuators = SOUND[name]
    raw = instruments(measured(ship, kind), kind)
    for rate in (True, False):
        p = profile(kind, length=length, actuators=actuators, rate=rate)
        assert [one.sentence for one in found(raw, p)] == []


@pytest.mark.parametrize("speed", [0.0, 1.0, 3.0])
def test_a_log_through_the_water_may_differ_by_a_stream(speed):
    ship = swinging(speed=speed, turn=7.0, current=(1.0, 0.6)) if speed else LYING
    c, s = np.cos(ship.heading), np.sin(ship.heading)
    stream = (1.0, 0.6)
    raw = measured(ship, "body")
    raw["v0"], raw["v1"] = (
        raw["v0"] - c * stream[0] - s * stream[1], raw["v1"] + s * stream[0] - c * stream[1],
    )  # fmt: skip
    assert found(raw, profile("body", length=10.0)) == ()


def test_marks_of_other_faults_do_not_hide_it():
    raw = changed(measured(SHIP), rate=lambda v: -v)
    p = profile()
    rows = table(raw, p)
    marks = np.where(np.arange(rows.height) % 3 == 0, int(Quality.LIMITS), 0)
    marks[500:540] = int(Quality.GAP)
    x0 = rows["x0"].to_numpy().copy()
    x0[500:540] = np.nan
    rows = rows.with_columns(quality=marks.astype(np.int32), x0=pl.Series(x0).fill_nan(None))
    (one,) = contradictions.find(rows, p).findings
    assert one.channel == "yaw_rate"


def test_what_contradicts_is_not_fitted():
    p = profile()
    sound = compare(table(measured(SHIP), p), p)
    wrong = compare(table(changed(measured(SHIP), rate=lambda v: -v), p), p)
    assert "yaw_rate" in {e.channel for e in sound.estimates}
    assert "yaw_rate" not in {e.channel for e in wrong.estimates} and wrong.estimates
    assert [f.kind for f in wrong.findings] == ["contradiction"]
    assert "small errors of yaw rate and heading" in {one.what for one in wrong.not_compared}


@pytest.mark.parametrize(("given", "what"), [
    ({"rate": False}, "yaw rate with heading"),
    ({}, "place of the antenna"),
    ({}, "the heading's zero"),
    ({"position": "local"}, "the scale that position and velocity share"),
])  # fmt: skip
def test_what_these_data_cannot_show_is_listed_with_what_would(given, what):
    p = profile(**given)
    raw = measured(SHIP, position=p.sensors.kind("position"))
    left = {one.what: one for one in contradictions.find(table(raw, p), p).not_compared}
    assert what in left and left[what].reason and left[what].would_show


def test_a_ship_at_rest_has_compared_nothing():
    p = profile()
    left = {one.what for one in contradictions.find(table(measured(LYING), p), p).not_compared}
    assert {
        "position with velocity",
        "yaw rate with heading",
        "the sign of rudder, propeller",
    } <= left


def test_of_one_receiver_no_antenna_is_estimated():
    p = profile()
    estimates = compare(table(measured(SHIP), p), p).estimates
    assert "antenna_offset" not in {e.kind for e in estimates}
    body = profile("body")
    estimates = compare(table(measured(SHIP, "body"), body), body).estimates
    assert "antenna_offset" in {e.kind for e in estimates}


def test_the_report_keeps_both():
    p = profile()
    compared = compare(table(changed(measured(SHIP), rate=lambda v: -v), p), p)
    report = VoyageReport("a", 1, 0, 1, 1.0, compared.findings, not_compared=compared.not_compared)
    assert VoyageReport.from_json(report.as_json()) == report
    assert report.serious and [one.channel for one in report.contradictions] == ["yaw_rate"]


def test_the_integral_is_the_trapezoidal_rule_averaged_over_a_second():
    p = profile()
    t = track(table(measured(SHIP), p), p)
    rate = np.sin(0.3 * SHIP.time) + 1j * SHIP.time
    total = np.concatenate(([0.0], np.cumsum(0.05 * (rate[1:] + rate[:-1]))))
    expected = total[: t.bins * 10].reshape(-1, 10).mean(axis=1)
    assert t.integral(rate) == pytest.approx(expected)


def test_the_interval_of_a_regression_holds_the_truth_nine_times_in_ten():
    hits = 0
    for seed in range(200):
        g = np.random.default_rng(seed)
        x = g.normal(size=120) + 1j * g.normal(size=120)
        y = (0.5 + 0.2j) * x + 0.1 * (g.normal(size=120) + 1j * g.normal(size=120))
        fit = regress(y, [x, 1j * x], np.arange(120), [np.inf, np.inf])
        _, low, high = fit.interval(0)
        hits += low < 0.5 < high
    assert 165 <= hits <= 198


def test_two_columns_that_are_one_are_no_regression():
    x = np.linspace(1.0, 2.0, 40)
    assert regress(x, [x, 2.0 * x], np.arange(40), [np.inf, np.inf]) is None
    assert regress(x[:4], [x[:4]], np.arange(4), [np.inf]) is not None
    assert regress(x[:3], [x[:3]], np.arange(3), [np.inf]) is None


def test_more_noise_makes_a_wider_interval():
    widths = []
    for noise in (Noise(), Noise(position=1.0, speed=0.3)):
        raw = changed(measured(SHIP, noise=noise), v0=lambda v: 3.6 * v)
        (one,) = found(raw, profile())
        widths.append(one.high - one.low)
    assert widths[1] > 2.0 * widths[0]


def test_a_command_says_what_contradicts_first_and_what_was_not_compared(tmp_path):
    parts = sailing.series(300.0)
    turned = -parts["/gyro"].columns["rate_degpmin"]
    columns = parts["/gyro"].columns | {"rate_degpmin": turned}
    parts["/gyro"] = dataclasses.replace(parts["/gyro"], columns=columns)
    log = sailing.write(tmp_path / "a.mcap", parts)
    (tmp_path / "ship.toml").write_text(sailing.PROFILE)
    store = tmp_path / "store"
    to = tmp_path / "answer.json"
    words = ["ingest", log, "--profile", tmp_path / "ship.toml", "--store", store, "--json", to]
    code, out, _ = call(*words)
    assert code == 3
    lines = out.splitlines()
    (first,) = [line for line in lines if "contradiction: The yaw rate" in line]
    assert "sign = -1.0 on [sensors.yaw_rate]" in first
    assert any(line.startswith("  could not be compared: ") for line in lines)
    (voyage,) = json.loads(to.read_text())["voyages"]
    stuck = [one for one in voyage["findings"] if one["channel"] == "wind"]  # it is, in this log
    assert {one["kind"] for one in voyage["findings"] if one not in stuck} == {"contradiction"}
    assert all(one["would_show"] for one in voyage["not_compared"])
    assert call("check", log, "--profile", tmp_path / "ship.toml")[0] == 3

    assert call(*words)[0] == 3  # as it was stored
    code, out, _ = call("voyages", "--sensors", "--store", store, "--json", to)
    assert code == 0 and "- contradiction in a: The yaw rate" in out and "- not compared: " in out
    (campaign,) = json.loads(to.read_text())["campaigns"]
    assert [one["voyage"] for one in campaign["contradictions"]] == ["a"]
    assert campaign["not_compared"]
    assert "yaw_rate" not in {one["channel"] for one in campaign["estimates"]}


@pytest.mark.parametrize(("sign", "channels"), [(1.0, []), (-1.0, ["rudder"])])
def test_the_turns_of_steady_circles_are_counted_against_a_rudder_that_is_held(sign, channels):
    raw = changed(measured(CIRCLE), rudder=lambda delta: sign * delta)
    said = found(raw, profile(length=20.0))
    assert [one.channel for one in said] == channels
    assert all("deg against it while it is held, 0 deg with it" in one.sentence for one in said)


def test_a_shaft_that_never_changes_and_counts_astern():
    raw = changed(measured(SHIP), propeller=lambda n: 0.0 * n - 5.0)
    (one,) = found(raw, profile())
    assert (one.channel, one.reason) == ("propeller", "sign")
    assert "driven astern" in one.sentence and "heading by 180 deg" in one.sentence
