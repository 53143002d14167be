"""NMEA 2000 messages and logs written by the documented layouts: fields as canboat's documentation
has them, lines as candump, canboat, YDWG, Actisense and iKonvert write them."""

import base64
import math
import struct
from collections.abc import Iterator
from datetime import UTC, datetime

from circle_layouts import RATE, SPEED, Voyage

NONE16, NONE8 = 0xFFFF, 0xFF


def _day(unix: float) -> tuple[int, int]:
    """Days since 1970 and units of 0.1 ms since midnight."""
    whole = round(unix * 1e4)
    return whole // 864_000_000, whole % 864_000_000


def angle(radians: float) -> int:
    return round(radians % (2 * math.pi) * 1e4)


def signed(radians: float) -> int:
    return round(radians * 1e4)


def system_time(unix: float) -> bytes:
    return struct.pack("<BBHI", 1, 0xF0, *_day(unix))


def rudder(instance: int, position: float | None, order: float | None = None) -> bytes:
    codes = [0x7FFF if a is None else signed(a) for a in (order, position)]
    return struct.pack("<BBhhH", instance, 0xF8, *codes, NONE16)


def heading(value, magnetic=False, deviation=None, variation=None) -> bytes:
    codes = [0x7FFF if a is None else signed(a) for a in (deviation, variation)]
    return struct.pack("<BHhhB", 1, angle(value), *codes, 0xFC | int(magnetic))


def rate_of_turn(value: float) -> bytes:
    return struct.pack("<BiBH", 1, round(value / 3.125e-8), NONE8, NONE16)


def variation(value: float) -> bytes:
    return struct.pack("<BBHhH", 1, 0xF4, NONE16, signed(value), NONE16)


def engine(instance: int, rpm: float) -> bytes:
    return struct.pack("<BHHbH", instance, round(rpm * 4), NONE16, 0x7F, NONE16)


def gear(instance: int, position: int) -> bytes:
    """0 ahead, 1 neutral, 2 astern, 3 unknown."""
    return struct.pack("<BBHHBB", instance, 0xFC | position, NONE16, NONE16, 0, NONE8)


def position(latitude: float, longitude: float) -> bytes:
    return struct.pack("<ii", round(latitude * 1e7), round(longitude * 1e7))


def course(cog: float, sog: float, magnetic=False) -> bytes:
    return struct.pack("<BBHHH", 1, 0xFC | int(magnetic), angle(cog), round(sog * 100), NONE16)


def gnss(unix: float, latitude: float, longitude: float, method=1) -> bytes:
    day, time = _day(unix)
    degrees = (round(latitude * 1e16), round(longitude * 1e16), 10_000_000)
    return struct.pack("<BHIqqqBBBhhiB", 1, day, time, *degrees, method << 4, 0xFC, 9, 100, 200,
                       4000, 0)  # fmt: skip


def wind(speed: float, direction: float, reference=2) -> bytes:
    return struct.pack("<BHHBH", 1, round(speed * 100), angle(direction), 0xF8 | reference, NONE16)


Message = tuple[float, int, int, bytes]  # Unix s, PGN, source, payload


def circle(v: Voyage | None = None, astern=False) -> Iterator[Message]:
    """The circle: instruments at 10 Hz, the receiver's own time and the gear once a second."""
    v = v or Voyage()
    for i, unix in enumerate(v.unix):
        if i % 10 == 0:
            yield unix, 126992, 3, system_time(unix)
            yield unix, 129029, 3, gnss(unix, v.latitude[i], v.longitude[i])
            yield unix, 127493, 9, gear(0, 2 if astern else 0)
        yield unix, 129025, 3, position(v.latitude[i], v.longitude[i])
        yield unix, 129026, 3, course(v.course[i], SPEED)
        yield unix, 127250, 17, heading(v.heading[i])
        yield unix, 127251, 17, rate_of_turn(RATE)
        yield unix, 127245, 7, rudder(0, math.radians(v.rudder[i]))
        yield unix, 127488, 9, engine(0, 2 * 60 * v.rps[i])  # a gear of 2 : 1
        yield unix, 130306, 5, wind(v.wind_speed[i], math.radians(v.wind_angle[i]))
        yield unix, 127505, 9, b"\x00\x10\x27\xff\xff\xff\xff\xff"  # a tank's level: of no use


def identifier(pgn: int, source: int, priority=3) -> int:
    """29 bits; PGNs with a PDU format below 240 are to an address, and these are to all."""
    addressed = (pgn >> 8 & 0xFF) < 240
    return priority << 26 | (pgn << 8 if not addressed else pgn << 8 | 0xFF00) | source


FAST = {129029}


def frames(messages) -> Iterator[tuple[float, int, bytes]]:
    """Unix s, identifier, up to eight bytes: long messages as fast packets."""
    counter = 0
    for unix, pgn, source, data in messages:
        number = identifier(pgn, source)
        if pgn not in FAST:
            yield unix, number, data
            continue
        counter = (counter + 1) % 8
        parts = [bytes([len(data)]) + data[:6], *(data[k : k + 7] for k in range(6, len(data), 7))]
        for k, part in enumerate(parts):
            yield unix, number, (bytes([counter << 5 | k]) + part).ljust(8, b"\xff")


def _clock(unix: float) -> str:
    when = datetime.fromtimestamp(round(unix * 1000) / 1000, UTC)
    return when.strftime("%H:%M:%S.") + f"{round(unix * 1000) % 1000:03d}"


def _iso(unix: float) -> str:
    when = datetime.fromtimestamp(round(unix * 1000) / 1000, UTC)
    return when.strftime("%Y-%m-%dT%H:%M:%S.") + f"{round(unix * 1000) % 1000:03d}Z"


def candump_l(messages) -> Iterator[str]:
    for unix, number, data in frames(messages):
        yield f"({unix:.6f}) can0 {number:08X}#{data.hex().upper()}"


def candump(messages, stamp=lambda unix: f"({unix:.6f})  ") -> Iterator[str]:
    for unix, number, data in frames(messages):
        yield f" {stamp(unix)}can0  {number:08X}   [{len(data)}]  {data.hex(' ').upper()}"


def candump_deltas(messages) -> Iterator[str]:
    """candump -td: the time since the line before."""
    last = None
    for unix, number, data in frames(messages):
        step = 0.0 if last is None else unix - last
        last = unix
        yield f" ({step:010.6f})  can0  {number:08X}   [{len(data)}]  {data.hex(' ').upper()}"


def canboat(messages) -> Iterator[str]:
    for unix, pgn, source, data in messages:
        yield f"{_iso(unix)},3,{pgn},{source},255,{len(data)}," + ",".join(f"{b:02x}" for b in data)


def canboat_frames(messages) -> Iterator[str]:
    """The same of each frame of the bus, with a hyphen in the stamp."""
    for unix, number, data in frames(messages):
        stamp = _iso(unix).replace("T", "-").removesuffix("Z")
        pgn, source = number >> 8 & 0x3FFFF, number & 0xFF
        yield f"{stamp},3,{pgn},{source},255,{len(data)}," + ",".join(f"{b:02x}" for b in data)


def ydwg(messages) -> Iterator[str]:
    for unix, number, data in frames(messages):
        yield f"{_clock(unix)} R {number:08X} {data.hex(' ').upper()}"


def actisense(messages) -> Iterator[str]:
    for unix, pgn, source, data in messages:
        clock = _clock(unix).replace(":", "")
        yield f"A{clock} {source:02X}FF3 {pgn:05X} {data.hex().upper()}"


def ikonvert(messages) -> Iterator[str]:
    """The gateway's timer, which begins again at 1000 s; here 30 s after the start."""
    first = None
    for unix, pgn, source, data in messages:
        first = unix if first is None else first
        timer = (970.0 + unix - first) % 1000.0
        text = base64.b64encode(data).decode()
        yield f"!PDGY,{pgn},3,{source},255,{timer:.3f},{text}"


NOTATIONS = {
    "candump -L": candump_l, "candump -ta": candump, "candump -td": candump_deltas,
    "canboat": canboat, "canboat of frames": canboat_frames, "YDWG": ydwg, "Actisense": actisense,
    "iKonvert": ikonvert,
}  # fmt: skip


def text(lines) -> str:
    return "".join(line + "\r\n" for line in lines)


def still(unix0: float, seconds: int) -> Iterator[Message]:
    """A ship at rest: a position and the time, once a second."""
    for k in range(seconds):
        yield unix0 + k, 126992, 3, system_time(unix0 + k)
        yield unix0 + k, 129025, 3, position(56.0, 12.0)
