"""How fast a recorder's own file becomes topics, against the loop of its library, and in how much
memory.

    python -m pipelines.experiments.benchmarks.read_recorder [--mb 100] [--only dataflash]

Both routes read the same made file, each in a process of its own: shiplog every topic, the library
the fields of the same messages in its own loop. Peers: pymavlink, nmea2000, pyulog (their versions
are printed). One route after the other, three times; the least processor time counts.
"""

from __future__ import annotations

import argparse
import importlib
import json
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

import numpy as np

TIMES = 3  # runs of each route
SIZES = {"Q": 8, "B": 1, "b": 1, "H": 2, "h": 2, "I": 4, "i": 4, "f": 4, "L": 4, "C": 2, "c": 2,
         "e": 4, "n": 4, "N": 16, "Z": 64}  # fmt: skip
PACKED = {"L": "i", "C": "H", "c": "h", "e": "i", "n": "4s", "N": "16s", "Z": "64s"}
DATAFLASH = {  # name: number, letters, labels, messages a second, instances
    "GPS": (134, "QBBIHBcLLeffffB",
            "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U", 5, 1),
    "GPA": (135, "QBCCCCfBIHeHH",
            "TimeUS,I,VDop,HAcc,VAcc,SAcc,YAcc,VV,SMS,Delta,AEl,RTCMFU,RTCMFD", 5, 1),
    "ATT": (136, "QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF", 25, 1),
    "IMU": (137, "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", 25, 2),
    "RCOU": (138, "Q" + 14 * "H", "TimeUS," + ",".join(f"C{n}" for n in range(1, 15)), 10, 1),
    "POS": (139, "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt", 10, 1),
    "XKF1": (140, "QBccCfffffffccce",
             "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH", 10, 2),
    "MAG": (145, "QBhhhhhhhhhBI", "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ,H,S", 10, 2),
    "BARO": (146, "QBfffcff", "TimeUS,I,Alt,AltAMSL,Press,Temp,CRt,SMS", 10, 1),
    "CTUN": (147, "Qfffffff", "TimeUS,A,B,C,D,E,F,G", 25, 1),
    "PIDS": (148, "QffffffffB", "TimeUS,T,A,E,P,I,D,F,M,S", 25, 1),
    "VIBE": (149, "QBfffI", "TimeUS,IMU,VibeX,VibeY,VibeZ,Clip", 10, 2),
}  # fmt: skip
OF_A_SHIP = ("GPS", "GPA", "ATT", "IMU", "RCOU", "POS", "XKF1")


def _format(number: int, name: str, letters: str, labels: str) -> bytes:
    length = 3 + sum(SIZES[letter] for letter in letters)
    return b"\xa3\x95\x80" + struct.pack(
        "<BB4s16s64s", number, length, name.encode(), letters.encode(), labels.encode()
    )


def write_dataflash(path: Path, megabytes: float) -> int:
    """One second of messages over and over, each with its time. Returns how many messages."""
    head = _format(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    second, places, offsets, fixes = b"", [], [], []
    for name, (number, letters, labels, rate, instances) in DATAFLASH.items():
        head += _format(number, name, letters, labels)
        kinds = "<" + "".join(PACKED.get(letter, letter) for letter in letters)
        for step in range(rate):
            for instance in range(instances):
                values = [7] * len(letters)
                if labels.split(",")[1] in ("I", "C", "IMU"):
                    values[1] = instance
                if name == "GPS":
                    values[2], values[4], values[7], values[8] = 3, 2200, 560_000_000, 120_000_000
                    fixes.append((len(second) + 3 + 10, step * 1000 // rate))
                places.append(len(second) + 3)
                offsets.append(step * 1_000_000 // rate)
                second += b"\xa3\x95" + bytes([number]) + struct.pack(kinds, *values)
    _tiled(path, head, second, megabytes, [
        *((at, offset + 10_000_000, 1_000_000, "<u8")
          for at, offset in zip(places, offsets, strict=True)),
        *((at, offset, 1000, "<u4") for at, offset in fixes),
    ])  # fmt: skip
    return round(megabytes * 1e6 / len(second)) * len(places)


def dataflash_by_shiplog(path: Path) -> int:
    from shiplog.logs.conversion.dataflash import read_dataflash

    return sum(len(one.time) for one in read_dataflash(path).series)


def dataflash_by_library(path: Path) -> int:
    log = importlib.import_module(LOOPS["dataflash"]).mavlink_connection(str(path))
    columns: dict[str, list] = {name: [] for name in OF_A_SHIP}
    while (message := log.recv_match(type=list(OF_A_SHIP))) is not None:
        kind = message.get_type()
        columns[kind].append([getattr(message, name) for name in message.get_fieldnames()])
    return sum(map(len, columns.values()))


ULOG = {  # topic: fields, samples a second
    "vehicle_gps_position": ("uint64_t timestamp;uint64_t timestamp_sample;double latitude_deg;"
                             "double longitude_deg;uint64_t time_utc_usec;float vel_n_m_s;"
                             "float vel_e_m_s;float heading;uint8_t fix_type", 5),
    "vehicle_attitude": ("uint64_t timestamp;uint64_t timestamp_sample;float[4] q", 50),
    "vehicle_angular_velocity": ("uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz", 50),
    "actuator_motors": ("uint64_t timestamp;uint64_t timestamp_sample;float[12] control", 10),
    "vehicle_imu_status": ("uint64_t timestamp;float[40] values", 10),
    "estimator_states": ("uint64_t timestamp;float[50] states", 10),
    "sensor_baro": ("uint64_t timestamp;float pressure;float temperature", 20),
}  # fmt: skip
PARTS = {"uint64_t": ("<u8", 8), "float": ("<f4", 4), "double": ("<f8", 8), "uint8_t": ("u1", 1)}
BOOT_US, UTC_US = 20_000_000, 1_700_000_000_000_000


def _ulog_message(kind: bytes, body: bytes) -> bytes:
    return struct.pack("<H", len(body)) + kind + body


def write_ulog(path: Path, megabytes: float) -> int:
    """One second of samples over and over, each with its time."""
    head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", BOOT_US) + _ulog_message(b"B", bytes(40))
    for number, (name, (fields, _)) in enumerate(ULOG.items()):
        head += _ulog_message(b"F", f"{name}:{fields}".encode())
        head += _ulog_message(b"A", struct.pack("<BH", 0, number) + name.encode())
    second, stamps, utcs = b"", [], []
    for number, (fields, rate) in enumerate(ULOG.values()):
        for step in range(rate):
            body, begin = struct.pack("<H", number), len(second) + 3
            for text in fields.split(";"):
                kind, label = text.split(" ")
                base, _, count = kind.partition("[")
                if label in ("timestamp", "timestamp_sample"):
                    stamps.append((begin + len(body), step * 1_000_000 // rate))
                elif label == "time_utc_usec":
                    utcs.append((begin + len(body), step * 1_000_000 // rate))
                value = np.full(int(count.rstrip("]") or 1), 3, PARTS[base][0])
                body += value.tobytes()
            second += _ulog_message(b"D", body)
    _tiled(path, head, second, megabytes, [
        *((place, offset + BOOT_US, 1_000_000, "<u8") for place, offset in stamps),
        *((place, offset + UTC_US, 1_000_000, "<u8") for place, offset in utcs),
    ])  # fmt: skip
    return round(megabytes * 1e6 / len(second)) * sum(rate for _, rate in ULOG.values())


def _tiled(
    path: Path, head: bytes, second: bytes, megabytes: float,
    stamps: list[tuple[int, int, int, str]],
) -> None:  # fmt: skip
    """A second of bytes again and again; at each (place, first, step, type) a counter."""
    count = round(megabytes * 1e6 / len(second))
    with path.open("wb") as stream:
        stream.write(head)
        for first in range(0, count, 1000):
            seconds = np.arange(first, min(count, first + 1000))
            block = np.tile(np.frombuffer(second, np.uint8), (len(seconds), 1))
            for place, begin, step, kind in stamps:
                raw = (seconds * step + begin).astype(kind).view(np.uint8)
                size = np.dtype(kind).itemsize
                block[:, place : place + size] = raw.reshape(-1, size)
            stream.write(block.tobytes())


def ulog_by_shiplog(path: Path) -> int:
    from shiplog.logs.conversion.ulog import read_ulog

    return sum(len(one.time) for one in read_ulog(path).series)


def ulog_by_library(path: Path) -> int:
    read = importlib.import_module(LOOPS["ulog"]).ULog
    return sum(len(one.data["timestamp"]) for one in read(str(path)).data_list)


CAN = (  # identifier and payload of a yacht's bus, and how often a second
    (0x09F80103, "00D46021000B2A07", 10), (0x09F80203, "01FC8B6B6400FFFF", 10),
    (0x09F11211, "0110270000FF7FFC", 10), (0x09F11311, "01A0860100FFFFFF", 10),
    (0x09F10D07, "00F8FF7F2C01FFFF", 10), (0x09F20009, "00C05DFFFF7FFFFF", 10),
    (0x09FD0205, "01F401B80BFAFFFF", 10), (0x0DF50B23, "01E8030000FFFFFF", 10),
    (0x19F21409, "01E803FFFFFF01FF", 30), (0x1DF01823, "0102030405060708", 50),
    (0x0DF01003, "01F01A4D00CA9A3B", 1),
)  # fmt: skip


def write_candump(path: Path, megabytes: float) -> int:
    frames = [(k / rate, can, data) for can, data, rate in CAN for k in range(rate)]
    lines = sorted(frames)
    size = sum(len(f"(1700000000.000000) can0 {can:08X}#{data}\n") for _, can, data in lines)
    count = round(megabytes * 1e6 / size)
    with path.open("w") as stream:
        for second in range(count):
            stream.writelines(
                f"({1_700_000_000 + second + at:.6f}) can0 {can:08X}#{data}\n"
                for at, can, data in lines
            )
    return count * len(lines)


def candump_by_shiplog(path: Path) -> int:
    from shiplog.logs.conversion.nmea2000 import read_nmea2000

    return sum(len(one.time) for one in read_nmea2000(path).series)


def candump_by_library(path: Path) -> int:
    decoder = importlib.import_module(LOOPS["candump"]).NMEA2000Decoder()
    columns = []
    with path.open() as stream:
        for line in stream:
            if (message := decoder.decode(line)) is not None:
                columns.append([field.value for field in message.fields])
    return len(columns)


LOOPS = {  # where a library's loop is
    "dataflash": "pymavlink.mavutil", "ulog": "pyulog", "candump": "nmea2000.decoder"
}  # fmt: skip
Route = Callable[[Path], int]
FORMATS: dict[str, tuple[Callable[[Path, float], int], Route, str, Route]] = {
    "dataflash": (write_dataflash, dataflash_by_shiplog, "pymavlink", dataflash_by_library),
    "ulog": (write_ulog, ulog_by_shiplog, "pyulog", ulog_by_library),
    "candump": (write_candump, candump_by_shiplog, "nmea2000", candump_by_library),
}


def measure(name: str, route: str, path: Path) -> dict[str, float]:
    """One route in a process of its own: processor time without imports, and peak memory."""
    module = __spec__.name if __spec__ else __name__
    command = [sys.executable, "-m", module, "--only", name, "--route", route, "--file", str(path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def run_route(name: str, route: str, path: Path) -> None:
    import resource

    _, ours, _, theirs = FORMATS[name]
    if route == "shiplog":  # import times are not the reading's
        from shiplog.logs.conversion import formats  # noqa: F401
    else:
        importlib.import_module(LOOPS[name])
    begin = time.process_time()
    rows = (ours if route == "shiplog" else theirs)(path)
    seconds = time.process_time() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1000.0
    print(json.dumps({"rows": rows, "seconds": seconds, "peak_mb": peak}))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mb", type=float, default=100.0)
    parser.add_argument("--only", choices=FORMATS)
    parser.add_argument("--route", choices=("shiplog", "library"))
    parser.add_argument("--file", type=Path)
    options = parser.parse_args()
    if options.route:
        run_route(options.only, options.route, options.file)
        return
    for name in [options.only] if options.only else FORMATS:
        write, _, library, _ = FORMATS[name]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"made.{name}"
            messages = write(path, options.mb)
            best: dict[str, dict[str, float]] = {}
            for _ in range(TIMES):
                for route in ("shiplog", "library"):
                    found = measure(name, route, path)
                    if route not in best or found["seconds"] < best[route]["seconds"]:
                        best[route] = found
        ours, theirs = best["shiplog"], best["library"]
        print(
            f"{name}: {options.mb:g} MB, {messages} messages; shiplog {ours['seconds']:.2f} s, "
            f"{ours['peak_mb']:.0f} MB; {library} {metadata.version(library)} "
            f"{theirs['seconds']:.2f} s, {theirs['peak_mb']:.0f} MB; "
            f"{theirs['seconds'] / ours['seconds']:.1f} times as fast"
        )


if __name__ == "__main__":
    main()
