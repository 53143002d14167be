"""The own ship in `!xxVDO`: what an AIS transponder sends of its ship (ITU-R M.1371-5, 3.3.8.2)."""

from __future__ import annotations

from collections.abc import Iterator

from shiplog.logs.conversion.nmea_sentences import BLANK, KNOT, Cut, Fact

CLASS_A, CLASS_B = (1, 2, 3), (18, 19)  # message types with a position
SPEED_AT = {**dict.fromkeys(CLASS_A, 50), **dict.fromkeys(CLASS_B, 46)}  # bit of the speed's field
NO_SPEED, NO_COURSE, NO_HEADING = 1023, 3600, 511
NO_LONGITUDE, NO_LATITUDE = 181.0, 91.0
BITS = 168
MINUTE = 10_000.0 * 60.0  # positions count in 1/10000 min


def vdo(f: list[str], vouched: bool) -> Iterator[Fact]:
    """Position, speed, course and heading; nothing of a message of another type."""
    if len(f) < 6:
        raise Cut
    if f[0] != "1":  # of several sentences: names and voyage data
        return
    bits = _bits(f[4])
    kind = bits >> (len(f[4]) * 6 - 6)
    if kind not in SPEED_AT:
        return
    if len(f[4]) * 6 < BITS:
        raise Cut
    bits >>= len(f[4]) * 6 - BITS
    at = SPEED_AT[kind]  # speed 10, accuracy 1, longitude 28, latitude 27, course 12, heading 9
    speed, longitude = _part(bits, at, 10), _signed(_part(bits, at + 11, 28), 28) / MINUTE
    latitude = _signed(_part(bits, at + 39, 27), 27) / MINUTE
    course, heading = _part(bits, at + 66, 12), _part(bits, at + 78, 9)
    known = longitude != NO_LONGITUDE and latitude != NO_LATITUDE
    yield Fact("vdo", (latitude, longitude) if known else (BLANK, BLANK))
    sog = BLANK if speed == NO_SPEED else speed / 10.0 * KNOT
    yield Fact("vdo_velocity", (sog, BLANK if course >= NO_COURSE else course / 10.0))
    yield Fact("vdo_heading", (BLANK if heading == NO_HEADING else float(heading),))


def _bits(text: str) -> int:
    """Six bits a character (IEC 61162-1, table of six-bit codes). Raises ValueError."""
    bits = 0
    for letter in text.encode("ascii"):
        value = letter - 48
        value -= 8 if value > 40 else 0
        if not 0 <= value < 64:
            raise ValueError(text)
        bits = bits << 6 | value
    return bits


def _part(bits: int, at: int, width: int) -> int:
    return bits >> (BITS - at - width) & ((1 << width) - 1)


def _signed(value: int, width: int) -> int:
    return value - (1 << width) if value >> (width - 1) else value
