#!/usr/bin/env bash
# nmea2000 2026.10.3: the stamp of a line in Actisense's ASCII notation, Ahhmmss.ddd, is read as a number
# of seconds and added to the time of decoding: A000057.055 is 57.055 s from now, and A120000.000, noon,
# is 120000 s from now, 33 h 20 min in the future. Two lines a minute apart are 100 s apart, and one
# second from 59 to 00 is 41 s. A guess would be the time of day, with the date of decoding as the same
# library takes for a line of Yacht Devices' notation, or no date at all.
#
# Seen: "A120000.000 is 120000 s from now, A120100.000 120100 s; from A115959.000 to A120000.000 it is
# 4041 s; 12:00:00.000 of Yacht Devices is 12:00:00 of the day of decoding".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'nmea2000==2026.10.3'
"$work/venv/bin/python" - <<'P'
from datetime import datetime

from nmea2000.decoder import NMEA2000Decoder

PAYLOAD = "5BF06621FF0B8A07"  # 129025: 56.0394331 N, 12.6487551 E, from source 3 to all


def read(line: str):
    message = NMEA2000Decoder().decode(line)
    assert [round(field.value, 7) for field in message.fields] == [56.0394331, 12.6487551], message
    return message.timestamp


def ahead(stamp: str) -> float:
    """Seconds from now to what the stamp of a line is read as."""
    now = datetime.now()
    return round((read(f"{stamp} 03FF3 1F801 {PAYLOAD}") - now).total_seconds())


noon, later, before = ahead("A120000.000"), ahead("A120100.000"), ahead("A115959.000")
day = read("12:00:00.000 R 0DF80103 " + " ".join(PAYLOAD[i : i + 2] for i in range(0, 16, 2)))
print(
    f"A120000.000 is {noon} s from now, A120100.000 {later} s; from A115959.000 to A120000.000 it "
    f"is {noon - before} s; 12:00:00.000 of Yacht Devices is {day.time()} of the day of decoding"
)
assert (noon, later, noon - before) == (120000, 120100, 4041), "this has changed"
assert day.time().isoformat() == "12:00:00" and abs((day - datetime.now()).days) <= 1, day
P
