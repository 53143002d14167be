#!/usr/bin/env bash
# nmea2000 2026.10.3: the time of day of a System Time or GNSS Position Data message (PGN 126992,
# 129029), which has 0.1 ms, is read without its fraction of a second, though Python's time can hold it:
# ten fixes of one second have one time. In a leap second, which the field has room for, the time is
# 00:00:00 beside the date of the day that ends: a day early. The field's raw_value has both. A guess
# would be 12:00:00.750000, and 23:59:60 as an error or as a time that says so.
#
# Seen: "PGN 126992: 43200.75 s is 12:00:00, raw 43200.75; PGN 129029: 43200.75 s is 12:00:00; leap
# second 86400.5 s of 2016-12-31 is 2016-12-31 00:00:00".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'nmea2000==2026.10.3'
"$work/venv/bin/python" - <<'P'
import struct
from datetime import date

from nmea2000.decoder import NMEA2000Decoder


def read(pgn: int, payload: bytes) -> dict[str, object]:
    text = ",".join(f"{byte:02x}" for byte in payload)
    line = f"2026-06-01-12:00:00.750,3,{pgn},1,255,{len(payload)},{text}"
    message = NMEA2000Decoder().decode(line)
    return {field.id: field for field in message.fields}


def clock(day: date, seconds: float) -> bytes:
    """Days since 1970 and units of 0.1 ms since midnight."""
    return struct.pack("<HI", (day - date(1970, 1, 1)).days, round(seconds * 1e4))


day = date(2026, 6, 1)
system = read(126992, bytes([1, 0xF0]) + clock(day, 43200.75))
place = struct.pack("<qqq", 599 * 10**15, 107 * 10**15, 10**7)  # 59.9 N 10.7 E, 10 m
rest = struct.pack("<BBBhhiB", 0x10, 0xFC, 9, 100, 200, 4000, 0)
fix = read(129029, bytes([1]) + clock(day, 43200.75) + place + rest)
leap = read(126992, bytes([1, 0xF0]) + clock(date(2016, 12, 31), 86400.5))
assert abs(fix["latitude"].value - 59.9) < 1e-9 and system["date"].value == day
times = system["time"].value, fix["time"].value
print(
    f"PGN 126992: 43200.75 s is {times[0]}, raw {system['time'].raw_value}; PGN 129029: 43200.75 s "
    f"is {times[1]}; leap second 86400.5 s of 2016-12-31 is {leap['date'].value} "
    f"{leap['time'].value}"
)
assert [str(time) for time in times] == ["12:00:00"] * 2, f"this has changed: {times}"
assert str(leap["date"].value) == "2016-12-31", f"this has changed: {leap['date'].value}"
assert str(leap["time"].value) == "00:00:00", f"this has changed: {leap['time'].value}"
P
