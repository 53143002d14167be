#!/usr/bin/env bash
# pynmea2 1.19.0: the minutes of a ZDA sentence's local zone count eastward also where its hours are
# negative: -03,30, Newfoundland's, is read as 2 h 30 min behind UTC. The minutes go from 00 to 59 and
# have the sign of the hours, as the manuals of Trimble and gpsd say, and as the comment of the
# package's own field does. localdatetime is an hour wrong here; to the east it is right.
#
# Seen: "12:00 UTC is 09:30:00-02:30 with -03,30; 17:30:00+05:30 with 05,30".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pynmea2==1.19.0'
"$work/venv/bin/python" - <<'P'
import pynmea2


def local(zone: str) -> str:
    body = f"GPZDA,120000.00,01,06,2026,{zone}"
    sentence = pynmea2.parse(f"${body}*{pynmea2.NMEASentence.checksum(body):02X}", check=True)
    assert (sentence.local_zone, sentence.local_zone_minutes) == tuple(map(int, zone.split(",")))
    return sentence.localdatetime.isoformat().split("T")[1]


west, east = local("-03,30"), local("05,30")
print(f"12:00 UTC is {west} with -03,30; {east} with 05,30")
assert east == "17:30:00+05:30", east
assert west == "09:30:00-02:30", f"this has changed: {west}"
P
