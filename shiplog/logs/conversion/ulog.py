"""PX4 logs (.ulg): GNSS, attitude, estimate and actuators as topics.

Times are `timestamp_sample`, when something was measured, where it is not 0, else `timestamp`; both
count µs since boot, in a simulation since 1970. UTC is `time_utc_usec` of the receiver. What is
older than the log is the last value before it began, and no sample of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion import servo_outputs
from shiplog.logs.conversion.boot_clock import BootClock
from shiplog.logs.conversion.original import Format
from shiplog.logs.conversion.recordings import Recording, one_log
from shiplog.logs.conversion.servo_outputs import Output
from shiplog.logs.conversion.ulog_messages import MAGIC, ULog, read_messages
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.numbers import counted
from shiplog.nomenclature.units import YEAR_2000_NS

DEG = 180.0 / np.pi
US = 1000
E7 = 1e7
FIX_3D = 3
RECEIVERS = ("vehicle_gps_position", "sensor_gps")  # the one in use, and each by itself
RATES = {"vehicle_angular_velocity": "xyz", "sensor_combined": "gyro_rad"}  # the first there is
WANTED = frozenset({
    *RECEIVERS, *RATES, "vehicle_attitude", "vehicle_local_position", "vehicle_global_position",
    "actuator_motors", "actuator_servos", "actuator_outputs",
})  # fmt: skip
RECORD = {
    "position": "vehicle_gps_position",
    "heading": "vehicle_attitude",
    "actuators": "actuator_motors, or actuator_outputs until 1.12",
}
ANTENNA = ("EKF2_GPS_POS_X", "EKF2_GPS_POS_Y")  # m, ahead and to starboard of the autopilot


def is_ulog(path: Path) -> bool:
    """Whether a file begins as a ULog does."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


@dataclass
class _Log:
    """The samples of a log that are of its time, and the clock that ties them to UTC."""

    ulog: ULog
    clock: BootClock
    old: int = 0

    def rows(self, name: str, *labels: str, instance: int = 0) -> np.ndarray | None:
        """The samples of a topic; None where there is none, or without one of these fields."""
        rows = self.ulog.topics.get((name, instance))
        if rows is None or not set(labels) <= set(rows.dtype.names or ()):
            return None
        own = (rows["timestamp"] > 0) & (rows["timestamp"] >= self.ulog.start_us)
        rows = rows if own.all() else rows[own]
        return rows if len(rows) else None

    def instances(self, name: str) -> list[int]:
        return sorted(number for of, number in self.ulog.topics if of == name)

    def time(self, rows: np.ndarray) -> np.ndarray:
        """When samples were measured [n] ns."""
        return self.clock.utc(_measured_us(rows))


def _measured_us(rows: np.ndarray) -> np.ndarray:
    stamp = rows["timestamp"].astype(np.int64)
    if "timestamp_sample" in (rows.dtype.names or ()):
        sample = rows["timestamp_sample"].astype(np.int64)
        stamp = np.where(sample > 0, sample, stamp)
    return stamp


def read_ulog(path: Path) -> Recording:
    """The topics of a log. Raises ChannelMissing where it says nothing of a vehicle's motion."""
    ulog = read_messages(path, WANTED)
    log = _Log(ulog, BootClock(None))
    log.clock = _clock(log)
    with np.errstate(invalid="ignore"):  # a float that signals NaN
        series = [*_receivers(log), *_attitude(log), *_estimate(log), *_driven(log)]
    if not series:
        raise ChannelMissing(
            f"{path.name} holds no sample of a vehicle's motion in "
            f"{counted(ulog.messages, 'message')}.",
            hint="log " + ", ".join(sorted(WANTED)) + ": SDLOG_PROFILE 0 has them.",
        )
    findings = [] if _is_unix(log) else log.clock.findings(path.name)
    if ulog.dropouts:
        sentence = (
            f"The logger lost samples {len(ulog.dropouts)} times, for {sum(ulog.dropouts)} ms in "
            f"all and {max(ulog.dropouts)} ms at most: the card was too slow."
        )
        findings.append(Finding("dropped", "log", sentence, value=float(len(ulog.dropouts))))
    lost = _lost(ulog)
    findings += [Finding("truncated", "log", sentence) for sentence in lost]
    return Recording(sorted(series, key=lambda one: one.topic), findings, lost, RECORD)


FORMAT = Format("PX4 ULog files", is_ulog, one_log(read_ulog), voyage=True)


def _lost(ulog: ULog) -> list[str]:
    lost = []
    if ulog.cut:
        lost.append(
            f"The end of the file cuts off a message: {counted(ulog.messages, 'whole message')} "
            f"before it are read, and {counted(ulog.cut, 'byte')} are not."
        )
    if ulog.skipped:
        lost.append(f"{counted(ulog.skipped, 'byte')} between whole messages are damaged.")
    return lost


def _is_unix(log: _Log) -> bool:
    return log.ulog.start_us * US >= YEAR_2000_NS


def _clock(log: _Log) -> BootClock:
    """UTC by the receivers; stamps that are Unix time already keep it."""
    if _is_unix(log):
        return BootClock(0)
    utc, boot = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for name in RECEIVERS:
        rows = log.rows(name)
        if rows is None or "time_utc_usec" not in (rows.dtype.names or ()):
            continue
        known = rows[rows["time_utc_usec"] > 0]
        utc.append(known["time_utc_usec"].astype(np.int64) * US)
        boot.append(_measured_us(known))
        if len(known):
            break
    return BootClock.of(np.concatenate(utc), np.concatenate(boot))


def _receivers(log: _Log) -> list[Series]:
    """The receiver in use, and each by itself where there are several."""
    series = []
    used = log.rows(RECEIVERS[0], "fix_type")
    own = log.instances(RECEIVERS[1])
    if used is not None:
        series += _receiver(log, used, "", True)
    for number in own if used is None or len(own) > 1 else ():
        rows = log.rows(RECEIVERS[1], "fix_type", instance=number)
        if rows is not None:
            plain = used is None and number == own[0]
            series += _receiver(log, rows, "" if plain else f"/gps_{number + 1}", plain)
    return series


def _receiver(log: _Log, rows: np.ndarray, end: str, primary: bool) -> list[Series]:
    """Position in deg since 1.14, in 1e-7 deg before; velocity to north and east."""
    names = rows.dtype.names or ()
    valid = rows["fix_type"] >= FIX_3D

    def known(label: str, divisor: float = 1.0) -> np.ndarray:
        return np.where(valid, rows[label].astype(float) / divisor, np.nan)

    if {"latitude_deg", "longitude_deg"} <= set(names):
        place = {"latitude": known("latitude_deg"), "longitude": known("longitude_deg")}
    elif {"lat", "lon"} <= set(names):
        place = {"latitude": known("lat", E7), "longitude": known("lon", E7)}
    else:
        return []
    if not valid.any():
        return []
    said = {"sensor": f"GPS{end}", **({"primary": "1"} if primary else {})} | _antenna(log)
    time = log.time(rows)
    series = [
        Series(f"/gnss/fix{end}", "foxglove.LocationFix", time, place,
               metadata=said | _sigma(rows, "eph", valid)),
    ]  # fmt: skip
    if {"vel_n_m_s", "vel_e_m_s"} <= set(names):
        motion = {"north_mps": known("vel_n_m_s"), "east_mps": known("vel_e_m_s")}
        series.append(
            Series(f"/gnss/velocity{end}", "shiplog.EarthVelocity", time, motion,
                   metadata=said | _sigma(rows, "s_variance_m_s", valid))
        )  # fmt: skip
    if "heading" in names and np.isfinite(rows["heading"]).any():
        heading = {"heading_deg": known("heading") * DEG % 360.0}
        series.append(Series(f"/gnss/heading{end}", "shiplog.Gyro", time, heading))
    return series


def _sigma(rows: np.ndarray, label: str, valid: np.ndarray) -> dict[str, str]:
    """The accuracy that a receiver states of itself, its median."""
    if label not in (rows.dtype.names or ()):
        return {}
    stated = rows[label][valid]
    stated = stated[np.isfinite(stated) & (stated > 0)]
    return {"sigma": f"{float(np.median(stated)):.3g}"} if len(stated) else {}


def _antenna(log: _Log) -> dict[str, str]:
    place = [log.ulog.parameters.get(name) for name in ANTENNA]
    if None in place:
        return {}
    return {
        "lever_arm_m": ",".join(f"{one:g}" for one in place),
        "lever_arm_why": f"{ANTENNA[0]} and _Y: from the autopilot's origin",
    }


def _attitude(log: _Log) -> list[Series]:
    """Heading of the quaternion (w first, ship to north-east-down), turn of the gyro."""
    series = []
    rows = log.rows("vehicle_attitude", "q")
    if rows is not None:
        w, x, y, z = rows["q"].astype(float).T
        heading = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)) * DEG % 360.0
        said = {"sensor": "vehicle_attitude", "primary": "1"}
        columns = {"heading_deg": heading}
        series.append(Series("/gyro", "shiplog.Gyro", log.time(rows), columns, metadata=said))
    for name, label in RATES.items():
        rows = log.rows(name, label)
        if rows is not None:
            columns = {"yaw_rate_degps": rows[label][:, 2].astype(float) * DEG}
            said = {"sensor": name, "primary": "1"}
            series.append(
                Series("/gyro/rate", "shiplog.Gyro", log.time(rows), columns, metadata=said)
            )
            break
    return series


def _estimate(log: _Log) -> list[Series]:
    """What the autopilot estimated; blank while it says that it is not valid."""
    series = []
    rows = log.rows("vehicle_global_position", "lat", "lon")
    if rows is not None:
        place = {"latitude": rows["lat"].astype(float), "longitude": rows["lon"].astype(float)}
        series.append(Series("/ekf/position", "foxglove.LocationFix", log.time(rows), place))
    for topic, schema, labels, flag in (
        ("/ekf/local_position", "shiplog.LocalPosition", {"x0_m": "x", "y0_m": "y"}, "xy_valid"),
        ("/ekf/velocity", "shiplog.EarthVelocity", {"north_mps": "vx", "east_mps": "vy"},
         "v_xy_valid"),
    ):  # fmt: skip
        rows = log.rows("vehicle_local_position", *labels.values(), flag)
        valid = np.zeros(0, bool) if rows is None else rows[flag] != 0  # bool or int8
        if rows is not None and valid.any():
            columns = {
                name: np.where(valid, rows[label].astype(float), np.nan)
                for name, label in labels.items()
            }
            series.append(Series(topic, schema, log.time(rows), columns))
    return series


def _driven(log: _Log) -> list[Series]:
    """Motors and servos from -1 to 1; without them the pulses of the outputs that move."""
    series = _controls(log, "actuator_motors", lambda n: {
        "actuator": "thruster", "unit": "1", "why": f"actuator_motors.control[{n}]",
    }, "/thruster/motor_")  # fmt: skip
    series += _controls(log, "actuator_servos", lambda n: {
        "actuator": "rudder", "unit": "1", "why": f"actuator_servos.control[{n}]",
        "doubt": f"CHECK: what servo {n + 1} turns; actuator_servos does not say",
    }, "/rudder/servo_")  # fmt: skip
    if series:
        return series
    for number in log.instances("actuator_outputs"):
        rows = log.rows("actuator_outputs", "output", instance=number)
        if rows is None:
            continue
        values = rows["output"].astype(float)
        outputs = [
            Output(i + 1 + values.shape[1] * number, values[:, i]) for i in range(values.shape[1])
        ]
        time = log.time(rows)
        series += servo_outputs.topics(outputs, time, time, {})[0]
    return series


def _controls(
    log: _Log, name: str, said: Callable[[int], dict[str, str]], topic: str
) -> list[Series]:
    """The controls that are used: those of others are NaN, of rovers and boats 0 throughout."""
    rows = log.rows(name, "control")
    if rows is None:
        return []
    values = rows["control"].astype(float)
    time = log.time(rows)
    return [
        Series(f"{topic}{n + 1}", "shiplog.Control", time, {"command": values[:, n]},
               metadata=said(n))
        for n in range(values.shape[1])
        if np.isfinite(values[:, n]).any() and np.nanmax(np.abs(values[:, n])) > 0.0
    ]  # fmt: skip
