"""Where a log may hold each channel and each actuator: topics and fields by their names."""

from __future__ import annotations

import re
from dataclasses import dataclass

from shiplog.drafting import words
from shiplog.ship_profile import units_of_channels as profile_units
from shiplog.ship_profile.table_channels import channels_of


@dataclass(frozen=True, slots=True)
class Guess:
    """One way a channel may stand in a log: the fields' names and what they mean."""

    kind: str
    patterns: tuple[str, ...]
    unit: str
    topic: str = ""
    check: str = ""  # what no name can say


ENU = 'CHECK: ROS turns from east; some compasses write "quaternion_ned"'
TURNED = r"(orientation|quaternion|rotation)[._]"
AXES_TO_CHECK = 'CHECK: axes of the ship; or "enu", "ned" of the earth'
NED_TO_CHECK = 'CHECK: to the north and to the east; or "body"'
LINEAR = (r"(twist_)?linear[._]x$", r"(twist_)?linear[._]y$")
EDGED = r"(?<![a-z])({})(?![a-z])"  # short words: `esc` stands in `description`, too
GUESSES = {  # in order of trust, after that of the topics themselves
    "position": (
        Guess("geodetic", (r"lat(itude)?(_deg)?$", r"(lon(gitude)?|lng)(_deg)?$"), "deg"),
        Guess("local", (r"x0?(_m)?$", r"y0?(_m)?$"), "m", r"local|pos|pose|state|ned|odom"),
        Guess("local", (r"north(_m)?$", r"east(_m)?$"), "m"),
    ),
    "velocity": (
        Guess("sog_cog", (r"sog(_\w+)?$|speed(_\w+)?$|spd$",
                          r"cog(_\w+)?$|course(_\w+)?$|gcrs$"), "m/s deg"),
        Guess("body", (r"(surge|ahead)(_\w+)?$", r"(sway|starboard)(_\w+)?$"), "m/s"),
        Guess("ned", (r"(v_?n|north)(_\w+)?$", r"(v_?e|east)(_\w+)?$"), "m/s", r"vel|gnss|gps|ned"),
        Guess("ned", (r"vel_?n(_\w+)?$", r"vel_?e(_\w+)?$"), "m/s"),
        Guess("ned", (r"v_?x$", r"v_?y$"), "m/s", r"position|gps|gnss|ned", NED_TO_CHECK),
        Guess("ned", LINEAR, "m/s", EDGED.format("ned")),
        Guess("enu", LINEAR, "m/s", r"enu|gnss|gps|fix"),
        Guess("enu", LINEAR, "m/s", r"velocity_local", AXES_TO_CHECK),
        Guess("body", LINEAR, "m/s", r"twist|vel|odom", AXES_TO_CHECK),
    ),
    "heading": (
        Guess("angle", (r"(true_?)?(heading|hdg|psi|yaw)(_deg|_rad)?$",), "deg"),
        Guess("quaternion_enu", tuple(TURNED + rf"{axis}$" for axis in "xyzw"), "1", "", ENU),
        Guess("quaternion_enu", (TURNED + "z$", TURNED + "w$"), "1", "", ENU),
    ),
    "yaw_rate": (
        Guess("rate", (r"(yaw_?rate|rot|rate_of_turn)(_\w+)?$",), "deg/s"),
        Guess("rate", (r"angular(_velocity)?[._]z$",), "rad/s"),
    ),
    "wind": (
        Guess("from_bow", (r"speed(_\w+)?$|aws(_\w+)?$", r"(direction|angle)(_\w+)?$|awa(_\w+)?$"),
              "m/s deg", r"wind|anemo"),
    ),
}  # fmt: skip
ACTUATOR_TOPICS = (  # kind, in the topic's name, and the field that holds the value
    ("rudder", r"rudder|" + EDGED.format("steer|steering"),
     r"angle(_\w+)?$|position(_\w+)?$|data$", "deg"),
    ("propeller", r"propeller|" + EDGED.format("props?|shafts?|engines?"),
     r"(speed|rpm|rps|revs)(_\w+)?$|data$", "rps"),
    ("azimuth", r"azimuth|azipod", r"angle(_\w+)?$|data$", "deg"),
    ("thruster", r"thrust(?!_n\b)|motor|actuator|throttle|" + EDGED.format("escs?|pwm"),
     r"(command|speed|rpm|motor_speed|throttle)(_\w+)?$|data$", "1"),
)  # fmt: skip
_NO_VALUE = re.compile(  # topics whose `data` is about an actuator and does not drive the ship
    r"(mode|status|enabled?|alarm|fault|temp\w*|current|voltage|power|torque|force|rate|hours)$"
)
_ROS_SCHEMA = re.compile(
    r"(^|[./])(geometry|nav|sensor|mavros|geographic|tf2)_msgs([./]|$)", re.IGNORECASE
)
_ROS_PATH = re.compile(r"(^|[._])(twist|angular(_velocity)?|linear|pose)[._]", re.IGNORECASE)
_DOWN = re.compile(EDGED.format("ned|frd"))


@dataclass(frozen=True, slots=True)
class Axes:
    """How the fields that were found lie in shiplog's axes."""

    paths: tuple[str, ...]
    sign: tuple[float, ...] = ()  # one for each path; none where all are 1
    check: str = ""


def measures(name: str, kind: str, fields: int) -> tuple[str, ...]:
    """What each of so many fields of a sensor measures."""
    return tuple(profile_units.MEASURE[channel] for channel in channels_of(name, kind, fields))


def first(pattern: str, columns: tuple[str, ...], takes: tuple[str, ...]) -> str | None:
    """The shallowest field whose last name, or whose path's end, matches; none in a unit of
    what is not measured here, as a shaft's `speed_rpm` is none over ground."""
    matching = [
        c for c in columns
        if re.search(rf"(^|\.)({pattern})", c, re.IGNORECASE)
        and (not (unit := words.unit_of(c)) or words.fitting(unit, takes))
    ]  # fmt: skip
    return min(matching, key=lambda c: (c.count("."), len(c))) if matching else None


def drives(kind: str, topic: str, columns: tuple[str, ...]) -> str | None:
    """The field of a topic that holds an actuator's value, if the topic is called as one."""
    in_topic, in_field = next((t, f) for k, t, f, _ in ACTUATOR_TOPICS if k == kind)
    called = words.parted(topic)
    if not re.search(in_topic, called):
        return None
    path = first(in_field, columns, profile_units.DRIVEN[kind])
    return None if path and path.endswith("data") and _NO_VALUE.search(called) else path


def axes(guess: Guess, paths: tuple[str, ...], topic: str, schema: str) -> Axes:
    """Fields in ROS's axes (REP 103: x ahead or east, y to port or north, z up) in ours.

    Rotation about z up is to port, y to port is minus to starboard. Which frame a topic is in
    only its publisher knows: every guess says so.
    """
    called = words.parted(topic)
    ros = bool(_ROS_SCHEMA.search(schema)) or all(_ROS_PATH.search(p) for p in paths)
    if not ros or guess.kind not in ("rate", "body", "local"):
        return Axes(paths)
    down = bool(_DOWN.search(called))
    last = [words.parted(p).rsplit(".", 1)[-1].rsplit("_", 1)[-1] for p in paths]
    if guess.kind == "rate" and last == ["z"]:
        if down:
            return Axes(paths, (), "CHECK: z downwards, of the topic's name; else sign = -1.0")
        return Axes(paths, (-1.0,), "CHECK: ROS has z upwards, and turns to port")
    if guess.kind == "body" and last == ["x", "y"]:
        if down:
            return Axes(paths, (), "CHECK: y to starboard, of the topic's name")
        return Axes(paths, (1.0, -1.0), 'CHECK: ROS has y to port; no sign for "enu"')
    if guess.kind == "local" and last == ["x", "y"]:
        if down:
            return Axes(paths, (), "CHECK: x to the north, of the topic's name")
        return Axes(paths[::-1], (), "CHECK: north, east: ROS has x to the east, y to the north")
    return Axes(paths)


def kind_of(guess: Guess, topic: str) -> tuple[str, str]:
    """The kind that a guess comes to in this topic, and what to check of it."""
    if guess.kind == "quaternion_enu" and _DOWN.search(words.parted(topic)):
        return "quaternion_ned", 'CHECK: of the topic\'s name; ROS has "quaternion_enu" elsewhere'
    return guess.kind, guess.check


def known_unit(path: str, stated: str | None, takes: tuple[str, ...]) -> str | None:
    """The unit that a field's own name says, else what the log says of it, where it fits."""
    own = words.fitting(words.unit_of(path), takes)
    return own or words.fitting(words.spelled(stated) if stated else None, takes)
