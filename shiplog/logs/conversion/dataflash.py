"""ArduPilot DataFlash logs (.BIN): GNSS, attitude, EKF, wind and outputs as topics.

Times are UTC of the measurement: a fix's by its own GPS week and ms, all others' by the autopilot's
clock, which `boot_clock` ties to UTC. GPA.SMS is when a fix was measured by that clock; a record's
TimeUS is when it was written, up to 0.2 s later. Receivers, compasses and EKF cores stay apart: the
one in use has the plain name, the others a number.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from shiplog.exceptions import ChannelMissing, listed
from shiplog.logs.conversion import servo_outputs
from shiplog.logs.conversion.boot_clock import BootClock, utc_of_gps
from shiplog.logs.conversion.dataflash_records import DataFlash, Table, read_records
from shiplog.logs.conversion.original import Format
from shiplog.logs.conversion.recordings import Recording, one_log
from shiplog.logs.conversion.servo_outputs import Output
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.numbers import counted

START = b"\xa3\x95"  # the head of the first record, the format of formats
SECONDS = {  # a message, and what older logs call the second and third instrument of it
    "GPS": ("GPS2", "GPSB"), "GPA": ("GPA2", "GPAB"), "IMU": ("IMU2", "IMU3"),
}  # fmt: skip
EKF, CORES = ("XKF1", "NKF1", "EKF1"), ("XKF4", "NKF4")  # the newest that a log has
PULSES = ("RCOU", "RCO2", "RCO3")
WANTED = frozenset({
    *SECONDS, *(name for names in SECONDS.values() for name in names), *EKF, *CORES, *PULSES,
    "ATT", "POS", "WIND", "PARM", "ESC",
})  # fmt: skip
RECORD = {  # what LOG_BITMASK has to hold
    "position": "GPS", "heading": "ATT",
    "actuators": "RCOU, and the parameters SERVOn_FUNCTION (PARM)",
}  # fmt: skip
FIX_3D = 3  # GPS.Status from which position and time are the receiver's
POSITION_KEYS = (
    "GPS{n}_POS_{axis}",
    "GPS_POS{n}_{axis}",
)  # of the antenna, m, since 4.6 and before
DEG = 180.0 / np.pi


def is_dataflash(path: Path) -> bool:
    """Whether a file begins as an ArduPilot log does."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(START)) == START


def read_dataflash(path: Path) -> Recording:
    """The topics of a log. Raises ChannelMissing where it says nothing of a ship's motion."""
    flash = read_records(path, WANTED)
    parameters = _parameters(flash)
    fixes = _receivers(flash)
    clock = _clock(fixes)
    series = _gnss(fixes, clock, parameters) + _attitude(flash, clock) + _ekf(flash, clock)
    series += _wind(flash, clock)
    driven, others = _outputs(flash, clock, parameters)
    series += driven + _motors(flash, clock)
    if not series:
        raise ChannelMissing(
            f"{path.name} holds no position, attitude or output of the autopilot in "
            f"{counted(flash.records, 'record')}; kinds of message that are read: "
            f"{listed(WANTED, most=len(WANTED))}.",
            hint="set LOG_BITMASK so that GPS, ATT, IMU and RCOU are logged.",
        )
    findings = clock.findings(path.name) + _of_status(fixes)
    findings += servo_outputs.unused(others, path.name, bool(driven))
    lost = _lost(flash)
    findings += [Finding("truncated", "log", sentence) for sentence in lost]
    return Recording(sorted(series, key=lambda one: one.topic), findings, lost, RECORD)


FORMAT = Format("ArduPilot DataFlash logs", is_dataflash, one_log(read_dataflash), voyage=True)


def _lost(flash: DataFlash) -> list[str]:
    lost = []
    if flash.cut:
        lost.append(
            f"The end of the file cuts off a record: {counted(flash.records, 'whole record')} "
            f"before it are read, and {counted(flash.cut, 'byte')} are not."
        )
    if flash.skipped:
        lost.append(f"{counted(flash.skipped, 'byte')} between whole records are damaged.")
    return lost


def _parameters(flash: DataFlash) -> dict[str, float]:
    """The autopilot's parameters, each as it was last."""
    table = flash.get("PARM")
    if table is None or not table.has("Name", "Value"):
        return {}
    return dict(zip(table.text("Name"), table.number("Value").tolist(), strict=True))


def _instances(flash: DataFlash, name: str) -> dict[int, Table]:
    """The records of each instrument of a kind, from 0 on."""
    found = {}
    first = flash.get(name)
    if first is not None:
        found |= first.by_instance()
    for number, older in enumerate(SECONDS.get(name, ()), 1):
        table = flash.get(older)
        if table is not None:
            found.setdefault(number, table)
    return found


class _Fixes:
    """A receiver's records: when by both clocks, and whether they are valid."""

    def __init__(self, number: int, table: Table, accuracy: Table | None) -> None:
        again = np.zeros(len(table), bool)  # a fix that was written twice
        again[1:] = table.number("Status")[1:] >= FIX_3D
        for label in ("GMS", "Lat", "Lng", "Spd"):
            again[1:] &= np.diff(table.number(label)) == 0
        once = ~again
        self.number, self.table, self.accuracy = number, table.take(np.flatnonzero(once)), accuracy
        table = self.table
        self.valid = table.number("Status") >= FIX_3D
        self.valid &= (table.number("Lat") != 0.0) | (table.number("Lng") != 0.0)
        milliseconds = table.rows["GMS"] if table.has("GMS") else np.zeros(len(table), np.int64)
        weeks = table.rows["GWk"] if table.has("GWk") else np.zeros(len(table), np.int64)
        self.utc = np.where(self.valid, utc_of_gps(weeks, milliseconds), 0)
        self.logged_us = table.boot_us()
        self.measured_us = self._measured()
        used = table.number("U") if table.has("U") else np.ones(len(table))
        self.used = float(np.mean(used)) if len(table) else 0.0

    def _measured(self) -> np.ndarray:
        """µs since boot of the measurement, which GPA says of the fix that was written with it."""
        table = self.accuracy
        if table is None or not table.has("SMS") or not len(table):
            return self.logged_us
        at = table.boot_us()
        nearest = np.searchsorted(at, self.logged_us).clip(0, len(at) - 1)
        before = (nearest - 1).clip(0)
        closer = np.abs(at[before] - self.logged_us) <= np.abs(at[nearest] - self.logged_us)
        nearest = np.where(closer, before, nearest)
        sampled = table.rows["SMS"][nearest].astype(np.int64) * 1000
        late = self.logged_us - sampled
        return np.where((sampled > 0) & (late >= 0) & (late < 2_000_000), sampled, self.logged_us)

    def known(self, label: str) -> np.ndarray:
        """Values [n] of a field, NaN where the fix is none."""
        return np.where(self.valid, self.table.number(label), np.nan)

    def median_accuracy(self, label: str) -> float:
        """Of a field of GPA [m or m/s]; 0 where it has none."""
        if self.accuracy is None or not self.accuracy.has(label):
            return 0.0
        stated = self.accuracy.number(label)
        return float(np.median(stated[stated > 0])) if (stated > 0).any() else 0.0


def _receivers(flash: DataFlash) -> list[_Fixes]:
    """The receivers, the one in use first."""
    accuracy = _instances(flash, "GPA")
    found = [
        _Fixes(number, table, accuracy.get(number))
        for number, table in _instances(flash, "GPS").items()
    ]
    return sorted(found, key=lambda one: (not one.valid.any(), -one.used, one.number))


def _clock(fixes: list[_Fixes]) -> BootClock:
    """By the receivers that have a valid fix and GPA; without any, by when fixes were written."""
    valid = [one for one in fixes if one.valid.any()]
    stated = [one for one in valid if one.accuracy is not None] or valid
    if not stated:
        return BootClock(None)
    utc = np.concatenate([one.utc[one.valid] for one in stated])
    boot = np.concatenate([one.measured_us[one.valid] for one in stated])
    return BootClock.of(utc, boot)


def _of_status(fixes: list[_Fixes]) -> list[Finding]:
    """Fixes that are none by the receiver's own word, and a clock that is late by their delay."""
    found = []
    for rank, one in enumerate(fixes):
        topic = "/gnss/fix" + ("" if rank == 0 else f"/gps_{one.number + 1}")
        blank = int((~one.valid).sum())
        if blank and one.valid.any():
            sentence = (
                f"{blank} of {len(one.valid)} messages on {topic} are blank: GPS.Status is below "
                f"{FIX_3D}, a fix in three dimensions."
            )
            found.append(Finding("status", topic, sentence, value=float(blank)))
    valid = [one for one in fixes if one.valid.any()]
    if valid and all(one.accuracy is None for one in valid):
        sentence = (
            "No message GPA says when fixes were measured: the autopilot's clock is tied to UTC by "
            "when they were written, and its heading and outputs may be 0.1 to 0.2 s early."
        )
        found.append(Finding("not_available", "log", sentence))
    return found


def _gnss(
    fixes: list[_Fixes], clock: BootClock, parameters: Mapping[str, float]
) -> list[Series]:  # fmt: skip
    series: list[Series] = []
    for rank, one in enumerate(fixes):
        if not one.valid.any():
            continue
        end = "" if rank == 0 else f"/gps_{one.number + 1}"
        time = clock.measured(one.utc, one.measured_us)
        of = {"sensor": f"GPS {one.number + 1}", **({"primary": "1"} if rank == 0 else {})}
        placed = of | _antenna(one.number, parameters)
        place = {"latitude": one.known("Lat"), "longitude": one.known("Lng"),
                 "altitude": one.known("Alt")}  # fmt: skip
        motion = {"sog_mps": one.known("Spd"), "cog_deg": one.known("GCrs")}
        parts = [
            ("/gnss/fix", "foxglove.LocationFix", place,
             placed | _sigma(one.median_accuracy("HAcc"))),
            ("/gnss/velocity", "shiplog.GnssVelocity", motion,
             placed | _sigma(one.median_accuracy("SAcc"))),
        ]  # fmt: skip
        yaw = one.known("Yaw")
        turned = np.where(yaw == 0.0, np.nan, yaw)  # 0 of a receiver with one antenna
        if np.isfinite(turned).any():
            heading = {"heading_deg": turned % 360.0}
            parts.append(("/gnss/heading", "shiplog.Gyro", heading, {"sensor": of["sensor"]}))
        series += [
            Series(topic + end, schema, time, columns, metadata=said)
            for topic, schema, columns, said in parts
        ]
    return series


def _sigma(size: float) -> dict[str, str]:
    return {"sigma": f"{size:.3g}"} if size else {}


def _antenna(number: int, parameters: Mapping[str, float]) -> dict[str, str]:
    """Where an antenna stands, ahead and to starboard of the autopilot's origin."""
    for key in POSITION_KEYS:
        place = [parameters.get(key.format(n=number + 1, axis=axis)) for axis in "XY"]
        if None not in place:
            name = key.format(n=number + 1, axis="X")
            return {
                "lever_arm_m": ",".join(f"{one:g}" for one in place),
                "lever_arm_why": f"{name} and _Y: from the autopilot's origin",
            }
    return {}


def _attitude(flash: DataFlash, clock: BootClock) -> list[Series]:
    """Heading of the autopilot's estimate, and turn of each gyro: ATT in deg, IMU in rad/s."""
    series = []
    table = flash.get("ATT")
    if table is not None and table.has("Yaw"):
        time = clock.utc(table.boot_us())
        heading = table.number("Yaw") % 360.0
        said = {"sensor": "ATT", "primary": "1"}
        series.append(
            Series("/gyro", "shiplog.Gyro", time, {"heading_deg": heading}, metadata=said)
        )
    for rank, (number, gyro) in enumerate(sorted(_instances(flash, "IMU").items())):
        if not gyro.has("GyrZ"):
            continue
        end = "" if rank == 0 else f"/imu_{number + 1}"
        said = {"sensor": f"IMU {number + 1}", **({"primary": "1"} if rank == 0 else {})}
        rate = {"yaw_rate_degps": gyro.number("GyrZ") * DEG}
        series.append(
            Series(f"/gyro/rate{end}", "shiplog.Gyro", clock.utc(gyro.boot_us()), rate,
                   metadata=said)
        )  # fmt: skip
    return series


def _ekf(flash: DataFlash, clock: BootClock) -> list[Series]:
    """Position and velocity that the autopilot estimated, of its primary core."""
    series = []
    table = flash.get("POS")
    if table is not None and table.has("Lat", "Lng"):
        place = {"latitude": table.number("Lat"), "longitude": table.number("Lng")}
        nowhere = (place["latitude"] == 0.0) & (place["longitude"] == 0.0)
        place = {name: np.where(nowhere, np.nan, value) for name, value in place.items()}
        time = clock.utc(table.boot_us())
        series.append(Series("/ekf/position", "foxglove.LocationFix", time, place))
    estimate = next((t for t in map(flash.get, EKF) if t is not None), None)
    if estimate is not None and estimate.has("VN", "VE"):
        cores = estimate.by_instance()
        own = cores.get(_primary(flash), next(iter(cores.values())))
        columns = {"north_mps": own.number("VN"), "east_mps": own.number("VE")}
        time = clock.utc(own.boot_us())
        series.append(Series("/ekf/velocity", "shiplog.EarthVelocity", time, columns))
    return series


def _primary(flash: DataFlash) -> int:
    """The core that the autopilot steered by for the most time."""
    for name in CORES:
        table = flash.get(name)
        if table is not None and table.has("PI"):
            values, counts = np.unique(table.number("PI"), return_counts=True)
            return int(values[np.argmax(counts)])
    return 0


def _wind(flash: DataFlash, clock: BootClock) -> list[Series]:
    """The wind that a windvane measured, from the bow."""
    table = flash.get("WIND")
    if table is None or not table.has("DirApp", "SpdApp"):
        return []
    speed = table.number("SpdApp")
    if not (speed > 0.0).any():
        return []
    columns = {"speed_mps": speed, "direction_deg": table.number("DirApp") % 360.0}
    return [Series("/wind/apparent", "shiplog.Wind", clock.utc(table.boot_us()), columns)]


def _outputs(
    flash: DataFlash, clock: BootClock, parameters: Mapping[str, float]
) -> tuple[list[Series], list[str]]:
    """The pulses of the outputs that drive the ship: C1 to C18, in logs until 2014 Ch1 to Ch8."""
    series: list[Series] = []
    others: list[str] = []
    for name in PULSES:
        table = flash.get(name)
        if table is None:
            continue
        time = clock.utc(table.boot_us())
        labels = [one for one in table.rows.dtype.names or () if one.lstrip("Ch").isdecimal()]
        outputs = [Output(int(one.lstrip("Ch")), table.number(one)) for one in labels]
        found, rest = servo_outputs.topics(outputs, time, time, parameters)
        series += found
        others += rest
    return series, others


def _motors(flash: DataFlash, clock: BootClock) -> list[Series]:
    """Revolutions that motor controllers report; which thruster each turns, no message says."""
    table = flash.get("ESC")
    if table is None or not table.has("RPM"):
        return []
    return [
        Series(f"/motor/esc_{number + 1}", "shiplog.MotorSpeed", clock.utc(one.boot_us()),
               {"rpm": one.number("RPM")})
        for number, one in sorted(table.by_instance().items())
        if (one.number("RPM") != 0.0).any()
    ]  # fmt: skip
