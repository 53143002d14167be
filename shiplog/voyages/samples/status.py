"""Values that are not valid by the instrument's own word, which stands beside them in a message.

A receiver without a fix sends zeros, its last position or one by dead reckoning, and says so in a
field of its own. What each such field is called and means is in RULES; a value that one of them
refuses is blank. Sources of the meanings: the definitions of sensor_msgs, gps_common, sbg_driver,
novatel_oem7_msgs, ublox_msgs and septentrio_gnss_driver (ROS), of PX4's and MAVLink's messages,
of ArduPilot's logs, and NMEA 0183.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import polars as pl

from shiplog.exceptions import LogUnreadable, listed
from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.ship_profile.profile import Profile, Source
from shiplog.ship_profile.table_channels import NEEDED
from shiplog.voyages.clocks import clocks
from shiplog.voyages.rows.left_out import LeftOut

GNSS = ("position", "velocity")
SENSORS = (*GNSS, "heading", "yaw_rate", "wind")
ALL = (*SENSORS, "actuator")
# s: between a log's first message and its voyage's first row, and a message and the next
START_S = 2.0
FLAG = {0.0, 1.0}
MOST_REASONS = 3  # that a sentence names


@dataclass(frozen=True, slots=True)
class Rule:
    """One field that says whether others are valid.

    names    of the field, in the message's part that the value stands in, or in one above it
    speaks   of these sensors
    bad      its values, and their meaning; texts are compared in capitals
    good     where given, any other number is bad
    bits     where given, the value is bad without this bit
    schema   of the message's type, and `unlike` a type that means something else by it
    fields   that the value's own name has to match
    flag     whether it is one only where nothing but 0 and 1 stands in it
    """

    names: tuple[str, ...]
    speaks: tuple[str, ...]
    bad: Mapping[Any, str] = field(default_factory=dict)
    good: tuple[float, ...] = ()
    bits: int = 0
    schema: str = ""
    unlike: str = r"(?!)"
    fields: str = ""
    flag: bool = False


UBLOX, SBG, SEPTENTRIO = (
    r"ublox|ubx|navpvt",
    r"sbg",
    r"septentrio|pvtgeodetic|pvtcartesian|atteuler",
)
NOVATEL_INS = r"inspva|inspos|insvel|insatt|novatel.*\bins"
NOT_VALID = {0: "not valid", "FALSE": "not valid"}
NO_FIX = {"NO FIX": "no fix", "NO_FIX": "no fix", "NO GPS": "no GNSS", "INVALID": "not valid"}
SOLUTION = dict.fromkeys((
    "INSUFFICIENT_OBS", "NO_CONVERGENCE", "SINGULARITY", "COV_TRACE", "TEST_DIST", "COLD_START",
    "V_H_LIMIT", "VARIANCE", "RESIDUALS", "DELTA_POS", "NEGATIVE_VAR", "INTEGRITY_WARNING",
    "INS_INACTIVE", "INS_ALIGNING", "PENDING", "INVALID_FIX", "UNAUTHORIZED", "INVALID_RATE",
    "DETERMINING_ORIENTATION", "WAITING_INITIALPOS", "WAITING_AZIMUTH", "INITIALIZING_BIASES",
    "MOTION_DETECT",
), "no solution")  # fmt: skip
RULES = (
    Rule(("status.status",), GNSS, {-1: "no fix"}, unlike=f"{SBG}|novatel"),
    Rule(("status.status",), GNSS, {1: "too few observations", 2: "internal error",
                                    3: "height limit"}, schema=SBG),
    Rule(("status.status",), SENSORS, {
        0: "INS inactive", 1: "aligning", 8: "determining orientation", 9: "waiting for a position",
        10: "waiting for an azimuth", 11: "initialising biases", 12: "motion detected",
    }, schema=NOVATEL_INS),
    Rule(("sol_status.status",), SENSORS, good=(0,)),
    Rule(("pos_type.type", "vel_type.type"), SENSORS, {0: "no solution"}),
    Rule(("solution_status", "sol_status", "position_solution_status", "ins_status", "status",
          "velocity_solution_status"), SENSORS, SOLUTION),
    Rule(("position_type", "pos_type"), SENSORS, {"NONE": "no solution"}),
    Rule(("fix_type", "fixType"), GNSS, {0: "no GNSS", 1: "no fix", **NO_FIX}, unlike=UBLOX),
    Rule(("fix_type", "fixType"), GNSS, {0: "no fix", 1: "dead reckoning", 5: "time only"},
         schema=UBLOX),
    Rule(("Status",), GNSS, {0: "no GNSS", 1: "no fix"}, fields=r"(Lat|Lng|Spd|GCrs)$"),
    Rule(("fix", "fix_status", "gps_status"), GNSS, {0: "no fix", "FALSE": "no fix", **NO_FIX}),
    Rule(("fix_quality", "gps_quality", "gps_qual", "quality_indicator"), GNSS,
         {0: "no fix", 6: "dead reckoning", 7: "typed in", 8: "simulator"}),
    Rule(("mode_indicator", "faa_mode", "pos_mode"), SENSORS,
         {"N": "not valid", "E": "dead reckoning", "M": "typed in", "S": "simulator"}),
    Rule(("position_status", "status"), ALL, {"V": "not valid"}),
    Rule(("xy_valid", "lat_lon_valid"), ("position",), NOT_VALID, flag=True),
    Rule(("v_xy_valid", "vel_ned_valid"), ("velocity",), NOT_VALID, flag=True),
    Rule(("dead_reckoning",), ("position",), {1: "dead reckoning"}, flag=True),
    Rule(("valid", "is_valid", "data_valid"), ALL, NOT_VALID, flag=True),
    Rule(("position_valid", "pos_valid", "gps_valid", "fix_valid", "fix_ok", "gnss_fix_ok",
          "gnssFixOK", "gnssFixOk", "status.position_valid"), GNSS, NOT_VALID, flag=True),
    Rule(("velocity_valid", "vel_valid", "speed_valid", "status.velocity_valid"), ("velocity",),
         NOT_VALID, flag=True),
    Rule(("heading_valid", "yaw_valid", "rel_pos_heading_valid", "status.heading_valid",
          "status.attitude_valid"), ("heading",), NOT_VALID, flag=True),
    Rule(("flags",), ("heading",), bits=1 << 8, schema=r"relposned"),
    Rule(("yaw_rate_valid", "rate_valid"), ("yaw_rate",), NOT_VALID, flag=True),
    Rule(("wind_valid",), ("wind",), NOT_VALID, flag=True),
    Rule(("orientation_covariance[0]",), ("heading",), {-1: "no orientation"}),
    Rule(("angular_velocity_covariance[0]",), ("yaw_rate",), {-1: "no angular velocity"}),
    Rule(("error",), SENSORS, good=(0,), schema=SEPTENTRIO),
)  # fmt: skip


def sources(profile: Profile) -> list[tuple[str, Source]]:
    """The sensors under their names, and the actuators."""
    return [*profile.sensors.items(), *(("actuator", one) for one in profile.actuators)]


def paths(name: str, source: Source) -> set[str]:
    """The fields that may say whether a source's values are valid; few of them are there."""
    if source.status == "ignore":
        return set()
    return {
        place + field for rule in _rules(name, source) for field in rule.names
        for place in parents(source)
    }  # fmt: skip


def heeded(reading: Reading, profile: Profile) -> tuple[Reading, list[LeftOut]]:
    """The log with no value where its own message says that it is not valid; and which.

    Raises LogUnreadable where no message of a sensor that is needed is valid.
    """
    frames, refused = dict(reading.frames), []
    for name, source in sources(profile):
        frame = frames.get(source.topic)
        if frame is None or frame.height == 0 or source.status == "ignore":
            continue
        bad, reasons = _bad(frame, name, source, reading)
        if not bad.any():
            continue
        channel = getattr(source, "name", name)
        there = [path for path in source.paths if path in frame.columns]
        nothing = [pl.when(pl.lit(~bad)).then(pl.col(path)).alias(path) for path in there]
        frames[source.topic] = frame.with_columns(nothing)
        times = frame[clocks.clock_columns(frame, source)[0]].filter(bad).drop_nulls().to_numpy()
        why = _why(reasons)
        if bad.all() and name in NEEDED:
            raise _none_valid(channel, source, frame.height, why, reading.contents.path.name)
        refused.append(_left_out(channel, source, times, frame.height, why))
    return replace(reading, frames=frames), refused


def unreported(
    found: Sequence[Finding], reported: Sequence[Finding], profile: Profile
) -> list[Finding]:
    """Findings of the grid without the blank stretches that the log's conversion reported, topic by
    topic, as what the instrument itself calls no measurement."""
    stretches: dict[str, list[tuple[float, float]]] = {}
    for one in reported:
        if one.kind == "status" and one.start_s is not None and one.end_s is not None:
            stretches.setdefault(one.channel, []).append((one.start_s, one.end_s))
    topics = {getattr(source, "name", name): source.topic for name, source in sources(profile)}

    def known(one: Finding) -> bool:
        inside = stretches.get(topics.get(one.channel, ""), ())
        if one.kind != "blank" or not inside:
            return False
        if one.start_s is None or one.end_s is None:
            return True  # what is summed up
        return any(a - START_S <= one.start_s and one.end_s <= b + START_S for a, b in inside)

    return [one for one in found if not known(one)]


def _rules(name: str, source: Source) -> list[Rule]:
    return [
        rule for rule in RULES
        if name in rule.speaks and any(re.search(rule.fields, path) for path in source.paths)
    ]  # fmt: skip


def parents(source: Source) -> list[str]:
    """The parts of a message that hold a source's values, innermost first: `a.b.`, `a.`, ``."""
    names = source.paths[0].split(".")[:-1]
    return ["".join(f"{name}." for name in names[:depth]) for depth in range(len(names), -1, -1)]


def _bad(
    frame: pl.DataFrame, name: str, source: Source, reading: Reading
) -> tuple[pl.Series, Counter[str]]:
    """Which messages [n] are not valid, and why."""
    bad = pl.Series(np.zeros(frame.height, bool))
    reasons: Counter[str] = Counter()
    topic = reading.contents.topics.get(source.topic)
    schema = topic.schema if topic else ""
    for rule in _rules(name, source):
        if not re.search(rule.schema, schema, re.IGNORECASE):
            continue
        if re.search(rule.unlike, schema, re.IGNORECASE):
            continue
        for field_name in rule.names:
            path = next((p + field_name for p in parents(source) if p + field_name in frame), None)
            if path is None or path in source.paths:
                continue
            for value, words, here in _met(frame[path], rule):
                fresh = here & ~bad
                if fresh.any():
                    reasons[f"{path} = {value}, {words}"] += int(fresh.sum())
                    bad = bad | here
    return bad, reasons


def _met(column: pl.Series, rule: Rule) -> list[tuple[str, str, pl.Series]]:
    """(value, its meaning, rows) of each bad value in a column."""
    if column.dtype == pl.String:
        texts = column.str.strip_chars().str.to_uppercase().fill_null("")
        words = [(str(v), w, texts == v) for v, w in rule.bad.items() if isinstance(v, str)]
        column = column.cast(pl.Float64, strict=False)
    elif column.dtype.is_numeric() or column.dtype == pl.Boolean:
        words, column = [], column.cast(pl.Float64)
    else:
        return []
    known = column.is_not_null() & column.is_not_nan()
    if rule.flag and not set(column.filter(known).unique().to_list()) <= FLAG:
        return words
    if rule.bits:
        whole = column.fill_null(0).fill_nan(0).cast(pl.Int64, strict=False).fill_null(0)
        return [("", f"without bit {rule.bits:#x}", known & ((whole // rule.bits) % 2 == 0))]
    numbers = [(v, w) for v, w in rule.bad.items() if not isinstance(v, str)]
    if rule.good:
        others = column.filter(known & ~column.is_in(list(map(float, rule.good)))).unique()
        numbers = [(value, "no solution") for value in others.to_list()]
    return words + [(f"{v:g}", w, (column == v).fill_null(False)) for v, w in numbers]


def _left_out(channel: str, source: Source, times: np.ndarray, count: int, why: str) -> LeftOut:
    """What of a channel is not valid; times [n] ns, of `count` messages."""
    return LeftOut(
        "status", channel, times,
        f"{channel}: {len(times)} of {count} messages on {source.topic} are not valid by their own "
        f"word ({why}), from {{first}} to {{last}}; left out. If that word is wrong, set status = "
        '"ignore" there in the profile.',
        float(len(times)), "messages",
    )  # fmt: skip


def _why(reasons: Counter[str]) -> str:
    named = [reason for reason, _ in reasons.most_common(MOST_REASONS)]
    more = len(reasons) - len(named)
    return "; ".join(named) + (f"; and {more} other reasons" if more else "")


def _none_valid(channel: str, source: Source, count: int, why: str, log: str) -> LogUnreadable:
    return LogUnreadable(
        f"{log}: none of the {count} messages on {source.topic} holds a {channel} that is valid by "
        f"its own word ({why}). Fields read: {listed(source.paths)}.",
        hint="name another topic in the profile. If the values are right all the same, set "
        f'status = "ignore" in [sensors.{channel}].',
    )
