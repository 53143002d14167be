"""MAVLink telemetry logs (.tlog) of a ground station: the vehicle's own messages as topics.

A message's time is the vehicle's: `time_boot_ms`, or `time_usec` (since boot or since 1970, by its
size), tied to UTC by SYSTEM_TIME. The receive time comes in bursts and counts only for what has no
other. The vehicle is the system that sends most of its motion; others keep their number.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion import servo_outputs
from shiplog.logs.conversion.boot_clock import BootClock
from shiplog.logs.conversion.mavlink_frames import (
    Messages,
    Telemetry,
    begins_as_telemetry,
    read_frames,
)
from shiplog.logs.conversion.original import Format
from shiplog.logs.conversion.recordings import Recording, library, one_log
from shiplog.logs.conversion.servo_outputs import Output
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.numbers import counted
from shiplog.nomenclature.units import YEAR_2000_NS

WHAT = "a MAVLink telemetry log"
DIALECT = "pymavlink.dialects.v20.ardupilotmega"
RECEIVERS = ("GPS_RAW_INT", "GPS2_RAW")
MOTION = ("ATTITUDE", "GLOBAL_POSITION_INT", *RECEIVERS)
WANTED = frozenset({*MOTION, "SERVO_OUTPUT_RAW", "SYSTEM_TIME", "PARAM_VALUE", "WIND"})
RECORD = {
    "position": "GPS_RAW_INT",
    "heading": "ATTITUDE",
    "actuators": "SERVO_OUTPUT_RAW, and let the ground station read the parameters",
}
E7, CENTI, MILLI = 1e7, 100.0, 1000.0
UNKNOWN_U16, NORTH = 65535, 36000  # none; a heading of 36000 cdeg is north, since 0 is none
FIX_3D = 3
DEG = 180.0 / np.pi
US, MS_US = 1000, 1000
WRAP_US = 1 << 32  # SERVO_OUTPUT_RAW.time_usec has 32 bits
RESTART_MS = 10_000  # the time since boot steps back so far: the vehicle was started again


def is_telemetry(path: Path) -> bool:
    """Whether a file begins with a receive time and a frame, and another one behind it."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return begins_as_telemetry(stream.read(512))


@dataclass
class _Vehicle:
    """One system's messages, and the clock that ties its time since boot to UTC."""

    messages: dict[str, Messages]
    starts: np.ndarray  # receive times [k] µs at which it was started again
    clocks: list[BootClock]

    def boot(self, received: np.ndarray, boot_us: np.ndarray) -> np.ndarray:
        """UTC [n] ns of times since boot."""
        run = np.searchsorted(self.starts, received, side="right")
        ahead = np.array([clock.ahead_ns or 0 for clock in self.clocks], np.int64)
        return boot_us.astype(np.int64) * US + ahead[run]

    def time(self, one: Messages) -> np.ndarray:
        """When messages were measured [n] ns."""
        names = one.rows.dtype.names or ()
        if "time_boot_ms" in names:
            return self.boot(one.received, one.rows["time_boot_ms"].astype(np.int64) * MS_US)
        if "time_usec" not in names:
            return one.received * US
        stamp = one.rows["time_usec"].astype(np.int64)
        if one.rows["time_usec"].dtype.itemsize == 4:
            wrapped = np.cumsum(np.diff(stamp, prepend=stamp[:1]) < -(WRAP_US // 2))
            stamp = stamp + wrapped * WRAP_US
        unix = stamp * US >= YEAR_2000_NS
        return np.where(unix, stamp * US, self.boot(one.received, stamp))


def read_telemetry(path: Path) -> Recording:
    """The topics of a log. Raises LibraryMissing without pymavlink, ChannelMissing where it says
    nothing of a vehicle's motion."""
    dialect = library(DIALECT, "ardupilot", path, WHAT)
    found = read_frames(path, WANTED, dialect)
    systems = _systems(found)
    if not systems:
        raise ChannelMissing(
            f"{path.name} holds no message of a vehicle's motion in "
            f"{counted(found.frames, 'frame')}.",
            hint=f"let the vehicle stream {', '.join(MOTION)} and SERVO_OUTPUT_RAW.",
        )
    series: list[Series] = []
    findings: list[Finding] = []
    for rank, system in enumerate(systems):
        vehicle = _vehicle(found, system)
        begin = "" if rank == 0 else f"/vehicle_{system}"
        mine = _topics(vehicle, path.name, findings if rank == 0 else [])
        series += [_under(one, begin) if begin else one for one in mine]
        if all(clock.ahead_ns is None for clock in vehicle.clocks):
            findings += vehicle.clocks[0].findings(f"The vehicle {system} in {path.name}")
    findings += _said(found, systems)
    lost = _lost(found)
    findings += [Finding("truncated", "log", sentence) for sentence in lost]
    return Recording(sorted(series, key=lambda one: one.topic), findings, lost, RECORD)


FORMAT = Format("MAVLink telemetry logs", is_telemetry, one_log(read_telemetry), voyage=True)


def _under(one: Series, begin: str) -> Series:
    """The topic of another vehicle: nothing of it is the ship's."""
    said = {key: text for key, text in one.metadata.items() if key not in ("actuator", "primary")}
    return Series(begin + one.topic, one.schema, one.time, one.columns, metadata=said)


def _systems(found: Telemetry) -> list[int]:
    """The systems that send a motion, the one with most messages first."""
    senders = [found.messages[name].sender // 256 for name in MOTION if name in found.messages]
    if not senders or not sum(map(len, senders)):
        return []
    systems, counts = np.unique(np.concatenate(senders), return_counts=True)
    return [int(one) for one in systems[np.argsort(-counts, kind="stable")]]


def _vehicle(found: Telemetry, system: int) -> _Vehicle:
    """The messages of its autopilot, the component that sends most of the motion; of a kind that
    this one does not send those of the component that sends most."""
    own: dict[str, Messages] = {}
    moving = np.concatenate([
        found.messages[name].sender for name in MOTION if name in found.messages
    ])  # fmt: skip
    known, often = np.unique(moving[moving // 256 == system], return_counts=True)
    autopilot = known[np.argmax(often)]
    for name, messages in found.messages.items():
        mine = messages.take(np.flatnonzero(messages.sender // 256 == system))
        if len(mine):
            components, counts = np.unique(mine.sender, return_counts=True)
            chosen = autopilot if autopilot in components else components[np.argmax(counts)]
            own[name] = mine.take(np.flatnonzero(mine.sender == chosen))
    received, boot = _since_boot(own)
    starts = received[1:][np.diff(boot) < -RESTART_MS]
    clocks = []
    system_time = own.get("SYSTEM_TIME")
    for run in range(len(starts) + 1):
        if system_time is None:
            clocks.append(BootClock(None))
            continue
        mine = np.searchsorted(starts, system_time.received, side="right") == run
        utc = system_time.rows["time_unix_usec"][mine].astype(np.int64) * US
        boot_us = system_time.rows["time_boot_ms"][mine].astype(np.int64) * MS_US
        clocks.append(BootClock.of(utc, boot_us))
    for run, clock in enumerate(clocks):  # without UTC, by when messages came: bursts are late
        mine = np.searchsorted(starts, received, side="right") == run
        if clock.ahead_ns is None and mine.any():
            late = received[mine] * US - boot[mine] * MS_US * US
            clocks[run] = BootClock(int(np.median(late - late[0])) + int(late[0]))
    return _Vehicle(own, starts, clocks)


def _since_boot(own: Mapping[str, Messages]) -> tuple[np.ndarray, np.ndarray]:
    """(receive time µs, time since boot ms) [n] of every message that has the latter."""
    known = [one for one in own.values() if "time_boot_ms" in (one.rows.dtype.names or ())]
    none = np.zeros(0, np.int64)
    received = np.concatenate([none, *(one.received for one in known)])
    boot = np.concatenate([none, *(one.rows["time_boot_ms"].astype(np.int64) for one in known)])
    order = np.argsort(received, kind="stable")
    return received[order], boot[order]


def _topics(vehicle: _Vehicle, name: str, findings: list[Finding]) -> list[Series]:
    series: list[Series] = []
    for number, kind in enumerate(RECEIVERS, 1):
        if kind in vehicle.messages:
            series += _receiver(vehicle, vehicle.messages[kind], number)
    if (one := vehicle.messages.get("ATTITUDE")) is not None:
        columns = {
            "heading_deg": one.rows["yaw"].astype(float) * DEG % 360.0,
            "yaw_rate_degps": one.rows["yawspeed"].astype(float) * DEG,
        }
        said = {"sensor": "ATTITUDE", "primary": "1"}
        series.append(Series("/gyro", "shiplog.Gyro", vehicle.time(one), columns, metadata=said))
    if (one := vehicle.messages.get("GLOBAL_POSITION_INT")) is not None:
        series += _estimate(vehicle, one)
    if (one := vehicle.messages.get("WIND")) is not None:
        columns = {
            "speed_mps": one.rows["speed"].astype(float),
            "direction_deg": one.rows["direction"].astype(float) % 360.0,
        }
        series.append(Series("/wind/true_north", "shiplog.Wind", vehicle.time(one), columns))
    return series + _driven(vehicle, name, findings)


def _receiver(vehicle: _Vehicle, one: Messages, number: int) -> list[Series]:
    """A GNSS receiver: blank below a fix in three dimensions, and what is 65535."""
    rows = one.rows
    valid = (rows["fix_type"] >= FIX_3D) & ((rows["lat"] != 0) | (rows["lon"] != 0))
    if not valid.any():
        return []

    def known(label: str, divisor: float, blank: int | None = None) -> np.ndarray:
        there = valid if blank is None else valid & (rows[label] != blank)
        return np.where(there, rows[label] / divisor, np.nan)

    end = "" if number == 1 else f"/gps_{number}"
    said = {"sensor": f"GPS {number}", **({"primary": "1"} if number == 1 else {})}
    time = vehicle.time(one)
    place = {
        "latitude": known("lat", E7), "longitude": known("lon", E7), "altitude": known("alt", MILLI)
    }  # fmt: skip
    motion = {
        "sog_mps": known("vel", CENTI, UNKNOWN_U16), "cog_deg": known("cog", CENTI, UNKNOWN_U16)
    }  # fmt: skip
    found = [
        Series(f"/gnss/fix{end}", "foxglove.LocationFix", time, place, metadata=said),
        Series(f"/gnss/velocity{end}", "shiplog.GnssVelocity", time, motion, metadata=said),
    ]
    yaw = rows["yaw"] if "yaw" in (rows.dtype.names or ()) else np.zeros(len(rows), np.uint16)
    turned = valid & (yaw != 0) & (yaw != UNKNOWN_U16)
    if turned.any():
        heading = {"heading_deg": np.where(turned, (yaw % NORTH) / CENTI, np.nan)}
        found.append(
            Series(f"/gnss/heading{end}", "shiplog.Gyro", time, heading,
                   metadata={"sensor": said["sensor"]})
        )  # fmt: skip
    return found


def _estimate(vehicle: _Vehicle, one: Messages) -> list[Series]:
    """Position and velocity that the autopilot estimated."""
    rows, time = one.rows, vehicle.time(one)
    there = (rows["lat"] != 0) | (rows["lon"] != 0)
    place = {
        "latitude": np.where(there, rows["lat"] / E7, np.nan),
        "longitude": np.where(there, rows["lon"] / E7, np.nan),
    }
    speed = {"north_mps": rows["vx"] / CENTI, "east_mps": rows["vy"] / CENTI}
    found = [
        Series("/ekf/position", "foxglove.LocationFix", time, place),
        Series("/ekf/velocity", "shiplog.EarthVelocity", time, speed),
    ]
    known = rows["hdg"] != UNKNOWN_U16
    if known.any() and "ATTITUDE" not in vehicle.messages:
        heading = {"heading_deg": np.where(known, rows["hdg"] / CENTI, np.nan)}
        found.append(Series("/gyro", "shiplog.Gyro", time, heading, metadata={"primary": "1"}))
    return found


def _driven(vehicle: _Vehicle, name: str, findings: list[Finding]) -> list[Series]:
    """The outputs, by the parameters that the ground station read."""
    one = vehicle.messages.get("SERVO_OUTPUT_RAW")
    if one is None:
        return []
    one = one.take(np.flatnonzero(one.rows["port"] == 0))
    time = vehicle.time(one)
    labels = [label for label in one.rows.dtype.names or () if label.startswith("servo")]
    outputs = [
        Output(int(label.removeprefix("servo").removesuffix("_raw")), one.rows[label].astype(float))
        for label in labels
    ]
    series, others = servo_outputs.topics(outputs, time, time, _parameters(vehicle))
    findings += servo_outputs.unused(others, name, bool(series))
    return series


def _parameters(vehicle: _Vehicle) -> Mapping[str, float]:
    one = vehicle.messages.get("PARAM_VALUE")
    if one is None:
        return {}
    names = [raw.decode("latin-1") for raw in one.rows["param_id"].tolist()]
    return dict(zip(names, one.rows["param_value"].astype(float).tolist(), strict=True))


def _said(found: Telemetry, systems: list[int]) -> list[Finding]:
    findings = []
    if found.twice:
        sentence = f"{found.twice} messages came over a second link, too; one of each is used."
        findings.append(Finding("duplicate", "log", sentence, value=float(found.twice)))
    if len(systems) > 1:
        others = ", ".join(f"/vehicle_{one}" for one in systems[1:])
        sentence = (
            f"{len(systems)} vehicles are in the log. The topics are those of system {systems[0]}, "
            f"which sends most; the others are under {others}."
        )
        findings.append(Finding("two_sources", "log", sentence, value=float(len(systems))))
    if found.damaged:
        sentence = f"{counted(found.damaged, 'frame')} with a wrong checksum left out."
        findings.append(Finding("dropped", "log", sentence, value=float(found.damaged)))
    return findings


def _lost(found: Telemetry) -> list[str]:
    lost = []
    if found.cut:
        lost.append(
            f"The end of the file cuts off a frame: {counted(found.frames, 'frame')} before it are "
            f"read, and {counted(found.cut, 'byte')} are not."
        )
    if found.skipped:
        lost.append(f"{counted(found.skipped, 'byte')} between frames are damaged.")
    return lost
