"""How fast a recorder's own file becomes topics, against the loop of its library, and in how much
memory.

    python -m pipelines.experiments.benchmarks.read_recorder [--mb 100] [--only dataflash]

Both routes read the same made file, each in a process of its own: shiplog every topic, the library
the fields of the same messages in its own loop. Peers: pymavlink, nmea2000, pyulog (their versions
are printed). One route after the other, three times; the fastest counts.
"""

from __future__ import annotations

import argparse
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
    count = max(1, round(megabytes * 1e6 / len(second)))
    with path.open("wb") as stream:
        stream.write(head)
        for first in range(0, count, 1000):
            seconds = np.arange(first, min(count, first + 1000))
            block = np.tile(np.frombuffer(second, np.uint8), (len(seconds), 1))
            for place, offset in zip(places, offsets, strict=True):
                at = (seconds * 1_000_000 + offset + 10_000_000).astype("<u8")
                block[:, place : place + 8] = at.view(np.uint8).reshape(-1, 8)
            for place, offset in fixes:
                ms = (seconds * 1000 + offset).astype("<u4")
                block[:, place : place + 4] = ms.view(np.uint8).reshape(-1, 4)
            stream.write(block.tobytes())
    return count * len(places)


def dataflash_by_shiplog(path: Path) -> int:
    from shiplog.logs.conversion.dataflash import read_dataflash

    return sum(len(one.time) for one in read_dataflash(path).series)


def dataflash_by_library(path: Path) -> int:
    from pymavlink import mavutil

    log = mavutil.mavlink_connection(str(path))
    columns: dict[str, list] = {name: [] for name in OF_A_SHIP}
    while (message := log.recv_match(type=list(OF_A_SHIP))) is not None:
        kind = message.get_type()
        columns[kind].append([getattr(message, name) for name in message.get_fieldnames()])
    return sum(map(len, columns.values()))


Route = Callable[[Path], int]
FORMATS: dict[str, tuple[Callable[[Path, float], int], Route, str, Route]] = {
    "dataflash": (write_dataflash, dataflash_by_shiplog, "pymavlink", dataflash_by_library),
}


def measure(name: str, route: str, path: Path) -> dict[str, float]:
    """One route in a process of its own: seconds without imports, and peak memory."""
    module = __spec__.name if __spec__ else __name__
    command = [sys.executable, "-m", module, "--only", name, "--route", route, "--file", str(path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def run_route(name: str, route: str, path: Path) -> None:
    import resource

    _, ours, _, theirs = FORMATS[name]
    begin = time.perf_counter()
    rows = (ours if route == "shiplog" else theirs)(path)
    seconds = time.perf_counter() - begin
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
