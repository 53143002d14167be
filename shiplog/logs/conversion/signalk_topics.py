"""Signal K paths to topics of the contract: what each says, by source and time."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.logs.conversion import magnetic
from shiplog.logs.conversion.nmea_report import compass
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.units import SECOND_NS

DEG = 180.0 / math.pi
LARGEST = 1e12  # beyond is no value of a ship
BESIDE_NS = SECOND_NS  # a course belongs to a speed of the same source within that
TURN = "turn"  # an angle that counts from 0 to 360 deg
PAIRS = {  # topic: schema, and fields with their path, factor and whether they turn
    "/gnss/velocity": ("shiplog.GnssVelocity", (
        ("sog_mps", "navigation.speedOverGround", 1.0, ""),
        ("cog_deg", "navigation.courseOverGroundTrue", DEG, TURN))),
    "/gyro": ("shiplog.Gyro", (("heading_deg", "navigation.headingTrue", DEG, TURN),)),
    "/gyro/rate": ("shiplog.Gyro", (("yaw_rate_degps", "navigation.rateOfTurn", DEG, ""),)),
    "/speed/water": ("shiplog.WaterSpeed", (
        ("through_water_mps", "navigation.speedThroughWater", 1.0, ""),)),
    "/wind/apparent": ("shiplog.Wind", (
        ("speed_mps", "environment.wind.speedApparent", 1.0, ""),
        ("direction_deg", "environment.wind.angleApparent", DEG, TURN))),
    "/wind/true": ("shiplog.Wind", (
        ("speed_mps", "environment.wind.speedTrue", 1.0, ""),
        ("direction_deg", "environment.wind.angleTrueWater", DEG, TURN))),
    "/wind/true_north": ("shiplog.Wind", (
        ("speed_mps", "environment.wind.speedTrue", 1.0, ""),
        ("direction_deg", "environment.wind.directionTrue", DEG, TURN))),
    "/rudder/main": ("shiplog.Rudder", (("angle_deg", "steering.rudderAngle", DEG, ""),)),
}  # fmt: skip
POSITION, COMPASS_PATH = "navigation.position", "navigation.headingMagnetic"
VARIATION, QUALITY = "navigation.magneticVariation", "navigation.gnss.methodQuality"
ENGINE = re.compile(r"^propulsion\.([^.]+)\.revolutions$")  # Hz, without a sign
GEAR = re.compile(r"^propulsion\.[^.]+\.transmission\.gear$")
TURNS = {"forward": 1.0, "neutral": 0.0, "reverse": -1.0}  # of the propeller, by the gear's word
HOLDS_NS = 10 * SECOND_NS  # a gear's position, until the next delta: servers repeat it
PREFIXES = (POSITION, "navigation.headingTrue", "steering.rudderAngle", "propulsion.*.revolutions")
NO_FIX = ("no gps", "estimated", "manual", "simulator", "error")  # words of methodQuality
USED = {POSITION, COMPASS_PATH, VARIATION, QUALITY}
USED |= {path for _, fields in PAIRS.values() for _, path, _, _ in fields}


@dataclass(slots=True)
class Values:
    """Values of one ship by path and source: times [ns] of both clocks, and what was said."""

    by_path: dict[tuple[str, str], list[tuple[int, int, object]]] = field(default_factory=dict)
    paths: Counter[str] = field(default_factory=Counter)
    used: int = 0

    def add(self, path: str, source: str, time: int, received: int, value: object) -> None:
        self.paths[path] += 1
        if _is_used(path):
            self.used += 1
            self.by_path.setdefault((path, source), []).append((time, received, value))

    def of(self, path: str) -> dict[str, list[tuple[int, int, object]]]:
        return {source: rows for (p, source), rows in self.by_path.items() if p == path}


def unread(values: Values) -> Counter[str]:
    """How many values of other paths there are."""
    return Counter({path: n for path, n in values.paths.items() if not _is_used(path)})


def _is_used(path: str) -> bool:
    return path in USED or bool(ENGINE.match(path) or GEAR.match(path))


def topics_of(values: Values) -> tuple[list[Series], list[Finding]]:
    """The topics of a ship's values, and what there is to say of them."""
    series, findings = _fixes(values)
    for topic, (schema, fields) in PAIRS.items():
        series += _paired(values, topic, schema, fields)
    for path in sorted(values.paths):
        if engine := ENGINE.match(path):
            series += _engines(values, path, engine[1])
    there = {one.topic for one in series}
    made = _compasses(values, "/gyro" if "/gyro" not in there else "/gyro/compass", series)
    return series + made[0], findings + made[1]


def _fixes(values: Values) -> tuple[list[Series], list[Finding]]:
    """Positions, blank where the receiver's own quality says that they are none."""
    found, findings = [], []
    sources = values.of(POSITION)
    for source, rows in sources.items():
        time, received = _times(rows)
        names = ("latitude", "longitude", "altitude")
        columns = {
            name: np.array([_number(v.get(name) if isinstance(v, dict) else None)
                            for _, _, v in rows]) for name in names
        }  # fmt: skip
        bad = _without_fix(values.of(QUALITY).get(source, []), time)
        bad |= (columns["latitude"] == 0.0) & (columns["longitude"] == 0.0)
        for column in columns.values():
            column[bad] = np.nan
        topic = _named("/gnss/fix", source, sources)
        if bad.all():
            continue
        if bad.any():
            sentence = (
                f"{bad.sum()} of {len(bad)} messages on {topic} are blank: the receiver says of "
                "itself that it has no fix."
            )
            findings.append(Finding("status", topic, sentence, value=float(bad.sum())))
        found.append(_series(topic, "foxglove.LocationFix", time, received, columns, source))
    return found, findings


def _without_fix(quality: list[tuple[int, int, object]], time: np.ndarray) -> np.ndarray:
    if not quality:
        return np.zeros(len(time), bool)
    at = np.array([t for t, _, _ in quality], np.int64)
    bad = np.array([any(word in str(v).lower() for word in NO_FIX) for _, _, v in quality])
    before = np.searchsorted(at, time, side="right") - 1
    return np.where(before >= 0, bad[before.clip(0)], False)


def _paired(values: Values, topic: str, schema: str, fields) -> list[Series]:
    """A topic of one or two paths; the second is that of the same source and time, or blank."""
    first = values.of(fields[0][1])
    others = [values.of(path) for _, path, _, _ in fields[1:]]
    if any(not other for other in others):
        return []
    made = []
    for source, rows in first.items():
        time, received = _times(rows)
        columns = {fields[0][0]: _scaled(rows, *fields[0][2:])}
        for (name, _, factor, turns), other in zip(fields[1:], others, strict=True):
            beside = other.get(source) or (next(iter(other.values())) if len(other) == 1 else [])
            columns[name] = _beside(time, beside, _scaled(beside, factor, turns))
        if all(np.isfinite(column).any() for column in columns.values()):
            name = _named(topic, source, first)
            made.append(_series(name, schema, time, received, columns, source))
    return made


def _engines(values: Values, path: str, name: str) -> list[Series]:
    """Revolutions of an engine, negative where its gear is astern, 0 in neutral. Without a gear
    their direction is not known, and the draft asks: an engine turns before its gear, and Signal K
    counts its revolutions without a sign."""
    field_of = (("speed_rps", path, 1.0, ""),)
    gears = values.of(f"propulsion.{name}.transmission.gear")
    made = []
    for one in _paired(values, f"/propeller/{_plain(name)}", "shiplog.Propeller", field_of):
        said = {"actuator": "propeller", "unit": "rev/s", "gear_ratio": "1"}
        source = one.metadata.get("source", "")
        rows = gears.get(source) or next(iter(gears.values()), [])
        direction = _turning(one.time, rows)
        speed = one.columns["speed_rps"]
        if direction is None:
            said["doubt"] = "CHECK: ahead or astern? the log has no propulsion.*.transmission.gear"
        else:
            said["why"] = "its direction is that of propulsion.*.transmission.gear"
            speed = speed * direction
        columns, metadata = {"speed_rps": speed}, {**one.metadata, **said}
        made.append(replace(one, columns=columns, metadata=metadata))
    return made


def _turning(time: np.ndarray, rows: list[tuple[int, int, object]]) -> np.ndarray | None:
    """1, 0 or -1 [n] of the gear's last word before each time, NaN without one that is near; None
    where none is known."""
    words = np.array([TURNS.get(str(v).strip().lower(), np.nan) for _, _, v in rows])
    if not np.isfinite(words).any():
        return None
    at = np.array([t for t, _, _ in rows], np.int64)
    order = np.argsort(at, kind="stable")
    at, words = at[order], words[order]
    last = np.searchsorted(at, time, side="right") - 1
    near = (last >= 0) & (time - at[last.clip(0)] <= HOLDS_NS)
    return np.where(near, words[last.clip(0)], np.nan)


def _compasses(values: Values, topic: str, series: list[Series]) -> tuple[list[Series], list]:
    """Magnetic headings made true, as `magnetic` does."""
    fix = next((one for one in series if one.topic.startswith("/gnss/fix")), None)
    track = magnetic.Track(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
    if fix is not None:
        known = np.isfinite(fix.columns["latitude"])
        track = magnetic.Track(
            fix.time[known], fix.columns["latitude"][known], fix.columns["longitude"][known]
        )
    found, findings = [], []
    sources = values.of(COMPASS_PATH)
    for source, rows in sources.items():
        time, received = _times(rows)
        shown = _scaled(rows, DEG, TURN)
        stated = values.of(VARIATION)
        given = stated.get(source) or next(iter(stated.values()), [])
        variation = _last(time, given, _scaled(given, DEG, ""))
        blank = np.full(len(time), np.nan)
        readings = np.stack((shown, variation, blank), axis=1)
        made = magnetic.true_heading(time, readings, track, (np.zeros(0, np.int64), np.zeros(0)))
        name = _named(topic, source, sources)
        findings.append(compass(name, "headingMagnetic", made[1] if made else None))
        if made is None:
            columns = {"magnetic_heading_deg": shown}
            found.append(_series(name, "shiplog.Compass", time, received, columns, source))
        else:
            one = _series(name, "shiplog.Gyro", time, received, {"heading_deg": made[0]}, source)
            found.append(replace(one, metadata={**one.metadata, **made[1].metadata}))
    return found, findings


def _times(rows: list[tuple[int, int, object]]) -> tuple[np.ndarray, np.ndarray]:
    return (np.array([t for t, _, _ in rows], np.int64),
            np.array([r for _, r, _ in rows], np.int64))  # fmt: skip


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return math.nan
    return float(value) if abs(value) <= LARGEST else math.nan


def _scaled(rows: list[tuple[int, int, object]], factor: float, turns: str) -> np.ndarray:
    values = np.array([_number(v) for _, _, v in rows], float) * factor
    return values % 360.0 if turns else values


def _beside(time: np.ndarray, rows: list, values: np.ndarray) -> np.ndarray:
    """The values [n] nearest to `time` [n], NaN where none is near."""
    if not rows:
        return np.full(len(time), np.nan)
    at = np.array([t for t, _, _ in rows], np.int64)
    order = np.argsort(at, kind="stable")
    at, values = at[order], values[order]
    right = np.searchsorted(at, time).clip(0, len(at) - 1)
    left = (right - 1).clip(0)
    nearest = np.where(np.abs(at[right] - time) <= np.abs(time - at[left]), right, left)
    return np.where(np.abs(at[nearest] - time) <= BESIDE_NS, values[nearest], np.nan)


def _last(time: np.ndarray, rows: list, values: np.ndarray) -> np.ndarray:
    """The last value [n] before each time [n], the first one before that."""
    if not rows:
        return np.full(len(time), np.nan)
    at = np.array([t for t, _, _ in rows], np.int64)
    return values[(np.searchsorted(at, time, side="right") - 1).clip(0)]


def _named(topic: str, source: str, sources: dict) -> str:
    return topic if len(sources) == 1 else f"{topic}/{_plain(source)}"


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_").lower() or "other"


def _series(
    topic: str, schema: str, time: np.ndarray, received: np.ndarray,
    columns: dict[str, np.ndarray], source: str,
) -> Series:  # fmt: skip
    metadata = {"source": source} if source else {}
    return Series(
        topic, schema, time, columns, log_time=received, frame_id="signalk", metadata=metadata
    )
