#!/usr/bin/env bash
# pynmeagps 1.1.8: a position in whole minutes, 5120,N, is read as no position, without a word. NMEA
# 0183 has the decimal point and its fraction as optional where they are not needed, and the package
# reads a time without them. A guess would be 51 1/3 degrees, or an error, which pynmea2 1.19.0 raises.
# With the point alone, 5120., the position is read.
#
# Seen: "5120,N,01030,E: '' '' at 12:00:00; 5120.,N,01030.,E: 51.3333333333 10.5; pynmea2: ValueError".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pynmeagps==1.1.8' 'pynmea2==1.19.0'
"$work/venv/bin/python" - <<'P'
import pynmea2
from pynmeagps import NMEAReader


def sentence(place: str) -> str:
    body = f"GPGLL,{place},120000,A,A"
    return f"${body}*{pynmea2.NMEASentence.checksum(body):02X}"


whole = NMEAReader.parse(sentence("5120,N,01030,E") + "\r\n")
point = NMEAReader.parse(sentence("5120.,N,01030.,E") + "\r\n")
try:
    other = str(pynmea2.parse(sentence("5120,N,01030,E")).latitude)
except ValueError as error:
    other = type(error).__name__
print(
    f"5120,N,01030,E: {whole.lat!r} {whole.lon!r} at {whole.time}; "
    f"5120.,N,01030.,E: {point.lat} {point.lon}; pynmea2: {other}"
)
assert (point.lat, point.lon) == (51.3333333333, 10.5), point
assert (whole.lat, whole.lon, other) == ("", "", "ValueError"), f"this has changed: {whole}"
assert whole.status == "A" and str(whole.time) == "12:00:00", whole
P
