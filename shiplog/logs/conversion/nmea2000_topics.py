"""NMEA 2000 messages to topics of the contract, each sender by itself.

An engine turns before its gear, and 127488 counts its revolutions without a sign: 127493 says
whether the gear is ahead, astern or in neutral, where the propeller is not driven.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from shiplog.logs.conversion import magnetic
from shiplog.logs.conversion import nmea2000_fields as n2k
from shiplog.logs.conversion.nmea2000_clock import NEAR_NS, BusClock, utc_of
from shiplog.logs.conversion.nmea2000_fields import read_field
from shiplog.logs.conversion.nmea2000_lines import Bus
from shiplog.logs.conversion.nmea_report import compass
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.units import SECOND_NS

DEG = 180.0 / np.pi
RPM = 60.0  # of rev/s
HOLDS_NS = 10 * SECOND_NS  # a gear's position, until the next message
TURNS = {n2k.FORWARD: 1.0, n2k.NEUTRAL: 0.0, n2k.REVERSE: -1.0}  # unknown is no direction
WINDS = {
    n2k.APPARENT: "/wind/apparent", n2k.OF_THE_BOAT: "/wind/true", n2k.OF_THE_WATER: "/wind/true",
    n2k.TO_NORTH: "/wind/true_north", n2k.TO_MAGNETIC_NORTH: "/wind/true_magnetic",
}  # fmt: skip
NO_METHOD = (n2k.NO_FIX, n2k.ESTIMATED, n2k.MANUAL, n2k.SIMULATED)
TWICE = 0.02  # share of its range by which two rudders of one instance may differ: they are one
OFTEN = 2.0  # positions without a time of their own are drafted where they come so much more often


@dataclass(frozen=True)
class Part:
    """The messages of one kind and sender: source address, UTC [n] ns and payloads [n, k]."""

    pgn: int
    source: int
    time: np.ndarray
    payload: np.ndarray

    def of(self, name: str) -> np.ndarray:
        return read_field(self.pgn, name, self.payload)

    def where(self, rows: np.ndarray) -> Part:
        return replace(self, time=self.time[rows], payload=self.payload[rows])


class _Bus:
    """All messages by kind, in UTC."""

    def __init__(self, bus: Bus, clock: BusClock) -> None:
        self.parts: dict[int, list[Part]] = {}
        for (pgn, source), rows in sorted(bus.rows.items()):
            place, _, payload = rows.arrays()
            part = Part(pgn, source, clock.times(place), payload)
            self.parts.setdefault(pgn, []).append(part)

    def each(self, pgn: int) -> list[Part]:
        return self.parts.get(pgn, [])


def topics_of(bus: Bus, clock: BusClock) -> tuple[list[Series], list[Finding]]:
    """The topics, and what there is to say of them."""
    of, findings = _Bus(bus, clock), list[Finding]()
    series = _fixes(of, findings)
    track = _track(series)
    variations = _variations(of)
    series += _headings(of, track, variations, findings)
    series += _courses(of, track, variations)
    series += _plain(of, 127251, "/gyro/rate", "shiplog.Gyro", "yaw_rate_degps", "rate", DEG)
    series += _plain(of, 128259, "/speed/water", "shiplog.WaterSpeed", "through_water_mps", "speed")
    series += _winds(of)
    series += _rudders(of) + _engines(of)
    return sorted(series, key=lambda one: one.topic), findings


def _named(topic: str, source: int, many: int) -> str:
    return topic if many == 1 else f"{topic}/source_{source}"


def _said(part: Part, **more: str) -> dict[str, str]:
    return {"pgn": str(part.pgn), "source": str(part.source), **more}


def _plain(
    of: _Bus, pgn: int, topic: str, schema: str, column: str, name: str, factor: float = 1.0
) -> list[Series]:
    """A topic of one field."""
    found = [(part, part.of(name) * factor) for part in of.each(pgn)]
    valid = [(part, values) for part, values in found if np.isfinite(values).any()]
    return [
        Series(_named(topic, part.source, len(valid)), schema, part.time, {column: values},
               frame_id="nmea2000", metadata=_said(part))
        for part, values in valid
    ]  # fmt: skip


def _fixes(of: _Bus, findings: list[Finding]) -> list[Series]:
    """129029 with the UTC of its fix, 129025 by the bus's clock: blank where the receiver says that
    it has no fix."""
    whole = [part for part in of.each(129029) if np.isfinite(part.of("latitude")).any()]
    rapid = [part for part in of.each(129025) if np.isfinite(part.of("latitude")).any()]
    methods = {part.source: (part.time, np.isin(part.of("method"), NO_METHOD)) for part in whole}
    series = []
    for part in whole:
        none = methods[part.source][1]
        names = ("latitude", "longitude", "altitude")
        columns = {name: np.where(none, np.nan, part.of(name)) for name in names}
        utc = utc_of(part.pgn, part.payload)
        time = np.where((utc >= 0) & (np.abs(utc - part.time) <= NEAR_NS), utc, part.time)
        topic = _named("/gnss/fix", part.source, len(whole))
        series += _fix(topic, part, time, columns, none, findings)
    for part in rapid:
        none = np.zeros(len(part.time), bool)
        if part.source in methods:
            time, bad = methods[part.source]
            none = bad[(np.searchsorted(time, part.time, side="right") - 1).clip(0)]
        columns = {
            name: np.where(none, np.nan, part.of(name)) for name in ("latitude", "longitude")
        }
        topic = _named("/gnss/position", part.source, len(rapid))
        series += _fix(topic, part, part.time, columns, none, findings)
    return _with_primary(series)


def _fix(
    topic: str, part: Part, time: np.ndarray, columns: dict[str, np.ndarray], none: np.ndarray,
    findings: list[Finding],
) -> list[Series]:  # fmt: skip
    if not np.isfinite(columns["latitude"]).any():
        return []
    if none.any():
        sentence = (
            f"{none.sum()} of {len(none)} messages on {topic} are blank: the receiver says that "
            "they are no fix."
        )
        findings.append(Finding("status", topic, sentence, value=float(none.sum())))
    return [
        Series(topic, "foxglove.LocationFix", time, columns, log_time=part.time,
               frame_id="nmea2000", metadata=_said(part))
    ]  # fmt: skip


def _with_primary(series: list[Series]) -> list[Series]:
    """The positions that a draft takes: fixes with their own UTC, unless others are far denser."""
    valid = {one.topic: int(np.isfinite(one.columns["latitude"]).sum()) for one in series}
    fixes = [name for name in valid if name.startswith("/gnss/fix")]
    rapid = [name for name in valid if name.startswith("/gnss/position")]
    best = max(fixes, key=lambda name: valid[name], default="")
    dense = max(rapid, key=lambda name: valid[name], default="")
    if dense and (not best or valid[dense] > OFTEN * valid[best]):
        best = dense
    return [
        replace(one, metadata={**one.metadata, "primary": "1"}) if one.topic == best else one
        for one in series
    ]


def _track(series: list[Series]) -> magnetic.Track:
    fix = next((one for one in series if one.metadata.get("primary")), None)
    if fix is None:
        return magnetic.Track(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
    known = np.isfinite(fix.columns["latitude"])
    return magnetic.Track(
        fix.time[known], fix.columns["latitude"][known], fix.columns["longitude"][known]
    )


def _variations(of: _Bus) -> tuple[np.ndarray, np.ndarray]:
    """Times [m] ns and variations [m] deg of 127258, of its busiest sender."""
    known = []
    for part in of.each(127258):
        values = part.of("variation") * DEG
        there = np.isfinite(values)
        known.append((part.time[there], values[there]))
    none = (np.zeros(0, np.int64), np.zeros(0))
    return max(known, key=lambda one: len(one[0]), default=none)


def _headings(
    of: _Bus, track: magnetic.Track, variations: tuple[np.ndarray, np.ndarray],
    findings: list[Finding],
) -> list[Series]:  # fmt: skip
    """True headings as they are; magnetic ones made true, where a variation is known."""
    true = _split(of.each(127250), n2k.TRUE)
    compasses = _split(of.each(127250), n2k.MAGNETIC)
    series = [
        Series(_named("/gyro", part.source, len(true)), "shiplog.Gyro", part.time,
               {"heading_deg": part.of("heading") * DEG}, frame_id="nmea2000",
               metadata=_said(part))
        for part in true
    ]  # fmt: skip
    base = "/gyro/compass" if true else "/gyro"
    for part in compasses:
        topic = _named(base, part.source, len(compasses))
        names = ("heading", "variation", "deviation")
        readings = np.stack([part.of(name) * DEG for name in names], axis=1)
        made = magnetic.true_heading(part.time, readings, track, variations)
        findings.append(compass(topic, "PGN 127250", made[1] if made else None))
        schema, columns = "shiplog.Compass", {"magnetic_heading_deg": readings[:, 0]}
        said = _said(part)
        if made is not None:
            schema, columns = "shiplog.Gyro", {"heading_deg": made[0]}
            said |= made[1].metadata
        series.append(Series(topic, schema, part.time, columns, frame_id="nmea2000", metadata=said))
    return series


def _split(parts: list[Part], reference: int) -> list[Part]:
    """The messages of one reference that have a heading."""
    chosen = [part.where(part.of("reference") == reference) for part in parts]
    return [part for part in chosen if np.isfinite(part.of("heading")).any()]


def _courses(
    of: _Bus, track: magnetic.Track, variations: tuple[np.ndarray, np.ndarray]
) -> list[Series]:
    """Speed and course over ground; a magnetic course is turned by the variation, or is blank."""
    valid = [part for part in of.each(129026) if np.isfinite(part.of("sog")).any()]
    series = []
    for part in valid:
        course = part.of("cog") * DEG
        turned = part.of("reference") == n2k.MAGNETIC
        if turned.any():
            blank = np.full(len(course), np.nan)
            readings = np.stack((course, blank, blank), axis=1)
            made = magnetic.true_heading(part.time, readings, track, variations)
            course = np.where(turned, blank if made is None else made[0], course)
        columns = {"sog_mps": part.of("sog"), "cog_deg": course}
        series.append(
            Series(_named("/gnss/velocity", part.source, len(valid)), "shiplog.GnssVelocity",
                   part.time, columns, frame_id="nmea2000", metadata=_said(part))
        )  # fmt: skip
    return series


def _winds(of: _Bus) -> list[Series]:
    """Winds by what they refer to: only the apparent one is the wind of a log."""
    found: dict[str, list[Part]] = {}
    for part in of.each(130306):
        reference = part.of("reference")
        for topic in dict.fromkeys(WINDS.values()):
            codes = [code for code, name in WINDS.items() if name == topic]
            mine = part.where(np.isin(reference, codes))
            if len(mine.time) and np.isfinite(mine.of("speed")).any():
                found.setdefault(topic, []).append(mine)
    return [
        Series(_named(topic, part.source, len(parts)), "shiplog.Wind", part.time,
               {"speed_mps": part.of("speed"), "direction_deg": part.of("angle") * DEG},
               frame_id="nmea2000", metadata=_said(part))
        for topic, parts in found.items() for part in parts
    ]  # fmt: skip


def _by_instance(parts: list[Part], valid: Callable[[Part], np.ndarray]) -> Iterator[
    tuple[int, list[Part]]
]:  # fmt: skip
    """Each instance with the senders that have a value of it, the busiest first."""
    found: dict[int, list[Part]] = {}
    for part in parts:
        instances = np.nan_to_num(part.of("instance"), nan=0.0).astype(int)
        for instance in np.unique(instances).tolist():
            mine = part.where(instances == instance)
            if np.isfinite(valid(mine)).any():
                found.setdefault(instance, []).append(mine)
    for instance, several in sorted(found.items()):
        yield instance, sorted(several, key=lambda one: -int(np.isfinite(valid(one)).sum()))


def _rudders(of: _Bus) -> list[Series]:
    """The rudders by instance: positions; what another sender repeats of one is no rudder more.
    Without any position the order, which the draft asks about."""
    name = "angle"
    instances = list(_by_instance(of.each(127245), lambda part: part.of("angle")))
    if not instances:
        name = "order"
        instances = list(_by_instance(of.each(127245), lambda part: part.of("order")))
    series: list[Series] = []
    kept: list[Part] = []
    for instance, parts in instances:
        for part in parts:
            base = "/rudder/main" if len(instances) == 1 else f"/rudder/rudder_{instance}"
            columns = {"angle_deg": part.of(name) * DEG}
            said = _said(part, instance=str(instance))
            if not any(_repeats(part, other) for other in kept):
                kept.append(part)
                said |= {"actuator": "rudder", "unit": "deg", "why": "PGN 127245"}
            if name == "order":
                said["doubt"] = "CHECK: a set-point; 127245 has the order, and no position"
            topic = _named(base, part.source, len(parts))
            series.append(
                Series(topic, "shiplog.Rudder", part.time, columns, frame_id="nmea2000",
                       metadata=said)
            )  # fmt: skip
    return series


def _repeats(one: Part, other: Part) -> bool:
    """Whether two senders report the angle of one rudder."""
    a, b = one.of("angle"), other.of("angle")
    mine, theirs = np.isfinite(a), np.isfinite(b)
    if not mine.any() or not theirs.any() or one.source == other.source:
        return False
    begin = other.time[theirs][0]
    at = (one.time[mine] - begin).astype(float)
    there = (other.time[theirs] - begin).astype(float)
    inside = (at >= there[0]) & (at <= there[-1])
    if not inside.any():
        return False
    off = np.abs(np.interp(at[inside], there, b[theirs]) - a[mine][inside])
    return float(np.median(off)) <= TWICE * max(float(np.ptp(b[theirs])), 1e-3)


def _engines(of: _Bus) -> list[Series]:
    """Revolutions of each engine, negative where its gear is astern, 0 in neutral. Without a gear
    their direction is not known, and the draft asks."""
    gears = dict(_by_instance(of.each(127493), lambda part: part.of("gear")))
    instances = list(_by_instance(of.each(127488), lambda part: part.of("speed")))
    series: list[Series] = []
    for instance, (part, *_) in instances:
        name = "main" if len(instances) == 1 else f"engine_{instance}"
        speed = part.of("speed") * RPM
        direction = _direction(part.time, gears.get(instance, []))
        said = _said(part, instance=str(instance), actuator="propeller", unit="rpm", gear_ratio="1",
                     why="PGN 127488, its direction of 127493")  # fmt: skip
        if direction is None:
            said["doubt"] = (
                "CHECK: ahead or astern? PGN 127488 has no sign, and no 127493 says the gear"
            )
            columns = {"engine_rpm": speed}
        else:
            columns = {"engine_rpm": speed * direction}
        series.append(
            Series(f"/propeller/{name}", "shiplog.Engine", part.time, columns,
                   frame_id="nmea2000", metadata=said)
        )  # fmt: skip
    return series


def _direction(time: np.ndarray, gears: list[Part]) -> np.ndarray | None:
    """1, 0 or -1 [n] of the last message before each time, NaN without one that is near; None
    where no gear ever says its position."""
    for part in gears:
        code = part.of("gear")
        turns = np.full(len(code), np.nan)
        for position, sign in TURNS.items():
            turns[code == position] = sign
        if not np.isfinite(turns).any():
            continue
        at = np.searchsorted(part.time, time, side="right") - 1
        near = (at >= 0) & (time - part.time[at.clip(0)] <= HOLDS_NS)
        return np.where(near, turns[at.clip(0)], np.nan)
    return None
