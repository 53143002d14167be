"""What recorders make of the instruments: seven kinds of files, and the profile that fits each.

Written with other people's libraries or by hand, so that a reader meets files that are not its
own. `write` returns the files to give to `convert` (or to `ingest`, for a log).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import tomli_w
from mcap.writer import Writer

from pipelines.experiments.stored_values.instruments import COLUMNS, GROUPS, Recorded
from pipelines.experiments.stored_values.motion import Motion

TOPICS = {  # of a log that comes from a bridge: topic and fields, in the order of GROUPS' columns
    "position": ("/gnss/fix", ("latitude", "longitude")),
    "velocity": ("/gnss/velocity", ("sog_mps", "cog_deg")),
    "heading": ("/gyro/heading", ("heading_deg",)),
    "yaw_rate": ("/gyro/rate", ("yaw_rate_degps",)),
    "rudder": ("/rudder/main", ("angle_deg",)),
    "rps": ("/propeller/main", ("speed_rps",)),
    "wind": ("/wind/apparent", ("speed_mps", "direction_deg")),
}
UNITS = {"latitude": "deg", "longitude": "deg", "sog": "m/s", "cog": "deg", "heading": "deg",
         "yaw_rate": "deg/s", "rudder": "deg", "rps": "rps", "wind_speed": "m/s",
         "wind_angle": "deg"}  # fmt: skip
SENSORS = ("position", "velocity", "heading", "yaw_rate", "wind")
LOGGED_LATE_S = 0.02  # the recorder's stamp after the instrument's


@dataclass(frozen=True)
class Recorder:
    name: str
    write: Callable[[Path, Recorded, dict[str, Any]], Path]
    topics: dict[str, tuple[str, tuple[str, ...]]]
    stamped: bool = False  # each instrument has its own stamps beside the recorder's
    rows: bool = False  # one table with one column of times
    most_hz: float = 50.0


def profile(motion: Motion, seen: Recorded, recorder: Recorder) -> dict[str, Any]:
    """The profile that a careful user of this recorder writes, as TOML's dictionaries."""
    kind, sensors, actuators = motion.kind, {}, []
    for group, names in GROUPS.items():
        if group not in seen.time:
            continue
        topic, fields = recorder.topics[group]
        where: dict[str, Any] = {"topic": topic}
        units = [UNITS[name] for name in names]
        where |= {"field": next(iter(fields))} if len(fields) == 1 else {"fields": list(fields)}
        where |= {"unit": units[0]} if len(set(units)) == 1 else {"units": units}
        if group in SENSORS:
            sensors[group] = where
        elif group == "rudder":
            actuators.append({"name": "rudder", "kind": "rudder",
                              "position_m": [-0.48 * kind.length, 0.0], **where})  # fmt: skip
        else:
            actuators.append({"name": "rps", "kind": "propeller", "diameter_m": motion.diameter,
                              "position_m": [-0.45 * kind.length, 0.0], **where})  # fmt: skip
    sensors["position"]["kind"] = "geodetic"
    found: dict[str, Any] = {
        "ship": {"name": kind.name, "length_m": kind.length}, "sensors": sensors,
        "actuators": actuators, "site": {"datum": list(motion.datum)},
    }  # fmt: skip
    if recorder.rows:
        columns = {"time": {"channel": "time"}}
        for name in COLUMNS:
            if name in seen.columns:
                columns[name] = {"channel": name, "unit": UNITS[name]}
        found["table"] = columns
    return found


def as_text(content: dict[str, Any]) -> str:
    return tomli_w.dumps(content)


def _ns(seconds: np.ndarray) -> np.ndarray:
    return np.round(seconds * 1e6).astype(np.int64) * 1000


def mcap_json(folder: Path, seen: Recorded, how: dict[str, Any]) -> Path:
    """JSON messages with a stamp of their own; the recorder's is 20 ms later."""
    rows = []
    for group, time in seen.time.items():
        topic, fields = TOPICS[group]
        values = np.stack([seen.columns[name] for name in GROUPS[group]], 1).tolist()
        logged = how.get("logged", {}).get(group, time + LOGGED_LATE_S)
        stamps = _ns(time).tolist()
        for at, stamp, value in zip(_ns(logged).tolist(), stamps, values, strict=True):
            message = {"timestamp": {"sec": stamp // 10**9, "nsec": stamp % 10**9}}
            if how.get("stampless"):
                message = {}
            rows.append((at, topic, message | dict(zip(fields, value, strict=True))))
    rows.sort(key=lambda row: row[:2])
    path = folder / "trip.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        ids = {
            topic: writer.register_channel(
                topic, "json", writer.register_schema(topic[1:], "jsonschema", b"{}")
            )
            for topic in {row[1] for row in rows}
        }
        for at, topic, message in rows:
            writer.add_message(ids[topic], at, json.dumps(message).encode(), at)
        writer.finish()
    return path


def table(seen: Recorded) -> pl.DataFrame:
    """One row a time, for recorders whose instruments share them."""
    time = next(iter(seen.time.values()))
    values = {name: seen.columns[name] for name in COLUMNS if name in seen.columns}
    return pl.DataFrame({"time": time, **values})


def _iso(seconds: np.ndarray) -> pl.Series:
    return pl.Series(_ns(seconds)).cast(pl.Datetime("ns")).dt.strftime("%Y-%m-%dT%H:%M:%S%.6fZ")


def csv(folder: Path, seen: Recorded, how: dict[str, Any]) -> Path:
    """Commas and ISO times; `time` of `how` overrides their text, `lines` the finished lines."""
    rows = table(seen)
    stamps = (
        how["time"](rows["time"].to_numpy()) if "time" in how else _iso(rows["time"].to_numpy())
    )
    rows = rows.with_columns(pl.Series("time", stamps))
    if "rows" in how:
        rows = how["rows"](rows)
    path = folder / "trip.csv"
    text = rows.write_csv(float_precision=9)
    path.write_text(how["lines"](text) if "lines" in how else text, encoding="utf-8")
    return path


def csv_european(folder: Path, seen: Recorded, how: dict[str, Any]) -> Path:
    """Semicolons, decimal commas, Unix seconds."""
    rows = table(seen)
    if "rows" in how:
        rows = how["rows"](rows)
    lines = [";".join(rows.columns)]
    for row in rows.iter_rows():
        lines.append(";".join("" if v is None else f"{v:.8f}".replace(".", ",") for v in row))
    path = folder / "trip.csv"
    path.write_text("\r\n".join(lines) + "\r\n", encoding="latin-1")
    return path


def parquet(folder: Path, seen: Recorded, how: dict[str, Any]) -> Path:
    rows = table(seen)
    rows = rows.with_columns(
        pl.Series("time", _ns(rows["time"].to_numpy())).cast(pl.Datetime("ns", "UTC"))
    )
    if "rows" in how:
        rows = how["rows"](rows)
    path = folder / "trip.parquet"
    rows.write_parquet(path)
    return path


FILES = {group: ("/" + group, GROUPS[group]) for group in GROUPS}


def folder_of_tables(folder: Path, seen: Recorded, how: dict[str, Any]) -> Path:
    """One CSV an instrument, each with its own times."""
    path = folder / "trip"
    path.mkdir()
    for group, time in seen.time.items():
        columns = {name: seen.columns[name] for name in GROUPS[group]}
        pl.DataFrame({"timestamp": _iso(time), **columns}).write_csv(
            path / f"{group}.csv", float_precision=9
        )
    return path


NMEA_TOPICS = TOPICS | {
    "heading": ("/gyro", ("heading_deg",)), "rps": ("/propeller/shaft_1", ("speed_rps",))
}  # fmt: skip


def _sentence(body: str) -> str:
    return f"${body}*{reduce(xor, body.encode()):02X}"


def _angle(value: float, width: int) -> str:
    minutes = round(abs(value) * 60.0, 6)
    return f"{int(minutes // 60):0{width}d}{minutes % 60:09.6f}"


def nmea(folder: Path, seen: Recorded, how: dict[str, Any]) -> Path:
    """A serial line with the receive stamp before each sentence, as multiplexers log it."""
    time = seen.time["heading"]
    received = how["received"](time) if "received" in how else time + LOGGED_LATE_S
    c, lines = seen.columns, []
    for i, unix in enumerate(time.tolist()):
        at = datetime.fromtimestamp(round(unix, 3), UTC)
        when, day = (
            at.strftime("%H%M%S.") + f"{at.microsecond // 10_000:02d}",
            at.strftime("%d%m%y"),
        )
        north, east = "NS"[int(c["latitude"][i] < 0)], "EW"[int(c["longitude"][i] < 0)]
        where = f"{_angle(c['latitude'][i], 2)},{north},{_angle(c['longitude'][i], 3)},{east}"
        moving = f"{c['sog'][i] * 3600 / 1852:.3f},{c['cog'][i]:.2f}"
        burst = [f"GPRMC,{when},A,{where},{moving},{day},,,A",
                 f"HEHDT,{c['heading'][i] % 360.0:.2f},T"]  # fmt: skip
        if "yaw_rate" in c:
            burst.append(f"TIROT,{c['yaw_rate'][i] * 60.0:.2f},A")
        if "rudder" in c:
            burst.append(f"AGRSA,{c['rudder'][i]:.2f},A,,")
        if "rps" in c:
            burst.append(f"ERRPM,S,1,{c['rps'][i] * 60:.2f},,A")
        burst.append(f"WIMWV,{c['wind_angle'][i] % 360.0:.1f},R,{c['wind_speed'][i]:.2f},M,A")
        stamp = round(float(received[i]) * 1000)
        lines += [f"{stamp};N;{_sentence(body)}" for body in burst]
    path = folder / "trip.log"
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


ROS_TOPICS = {
    "position": ("/gnss/fix", ("latitude", "longitude")),
    "velocity": ("/gnss/velocity", ("vector.x", "vector.y")),
    "heading": ("/heading", ("vector.x",)),
    "yaw_rate": ("/rate", ("vector.x",)),
    "rudder": ("/rudder", ("vector.x",)),
    "rps": ("/propeller", ("vector.x",)),
    "wind": ("/wind", ("vector.x", "vector.y")),
}


def ros2(folder: Path, seen: Recorded, how: dict[str, Any]) -> Path:
    """A ROS 2 bag (SQLite): NavSatFix, and Vector3Stamped for all else."""
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as BagWriter
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types, fix, vector = (
        store.types,
        "sensor_msgs/msg/NavSatFix",
        "geometry_msgs/msg/Vector3Stamped",
    )
    path = folder / "trip"
    rows = []
    for group, time in seen.time.items():
        values = np.stack([seen.columns[name] for name in GROUPS[group]], 1)
        stamps = _ns(time).tolist()
        rows += [(at, group, value) for at, value in zip(stamps, values.tolist(), strict=True)]
    rows.sort(key=lambda row: row[:2])
    late = round(LOGGED_LATE_S * 1e9)
    with BagWriter(path, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        lines = {
            group: writer.add_connection(
                ROS_TOPICS[group][0], fix if group == "position" else vector, typestore=store
            )
            for group in seen.time
        }
        for at, group, value in rows:
            stamp = types["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9)
            header = types["std_msgs/msg/Header"](stamp, group)
            if group == "position":
                status = types["sensor_msgs/msg/NavSatStatus"](0, 1)
                message = types[fix](header, status, *value, 0.0, np.zeros(9), 0)
            else:
                x, y = (*value, 0.0)[:2]
                message = types[vector](header, types["geometry_msgs/msg/Vector3"](x, y, 0.0))
            name = fix if group == "position" else vector
            writer.write(lines[group], at + late, store.serialize_cdr(message, name))
    return path


RECORDERS = {
    one.name: one
    for one in (
        Recorder("mcap", mcap_json, TOPICS, stamped=True),
        Recorder("csv", csv, TOPICS, rows=True),
        Recorder("european csv", csv_european, TOPICS, rows=True),
        Recorder("parquet", parquet, TOPICS, rows=True),
        Recorder("folder of tables", folder_of_tables, FILES, stamped=True),
        Recorder("nmea", nmea, NMEA_TOPICS, most_hz=10.0),
        Recorder("ros 2 bag", ros2, ROS_TOPICS, stamped=True),
    )
}
