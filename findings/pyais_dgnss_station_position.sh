#!/usr/bin/env bash
# pyais 3.3.1: a DGNSS station's position (AIS message 17) is not in degrees as that of each ship is,
# but in minutes, and it is read without its sign: a station to the south or west gets a number that
# is no place. ITU-R M.1371 has 1/10 minute, south and west negative; aiscat 0.68.16 reads the same
# two sentences as the places that they were made of.
#
# Seen: "59.1 N 10.2 E is read as 3546.0 612.0, 12.5 S 5.25 W as 12357.2 25899.4".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pyais==3.3.1' 'aiscat==0.68.16'
"$work/venv/bin/python" - <<'P'
from functools import reduce
from operator import xor

import aiscat
import pyais

STATION = 2734450


def sentence(latitude: float, longitude: float) -> str:
    """The message's bits by the standard, 6 of them a character, as one sentence."""
    fields = [(17, 6), (0, 2), (STATION, 30), (0, 2), (round(longitude * 600), 18)]
    fields += [(round(latitude * 600), 17), (0, 5)]
    bits = "".join(f"{value % 2**width:0{width}b}" for value, width in fields)
    fill = -len(bits) % 6
    bits += "0" * fill
    codes = [int(bits[at : at + 6], 2) for at in range(0, len(bits), 6)]
    payload = "".join(chr(code + (48 if code < 40 else 56)) for code in codes)
    body = f"AIVDM,1,1,,A,{payload},{fill}"
    return f"!{body}*{reduce(xor, body.encode()):02X}"


def read(latitude: float, longitude: float) -> tuple[float, float]:
    other = aiscat.decode(sentence(latitude, longitude))
    assert abs(other["lat"] - latitude) < 1e-4 and abs(other["lon"] - longitude) < 1e-4, other
    found = pyais.decode(sentence(latitude, longitude))
    assert found.mmsi == STATION, found
    return found.lat, found.lon


north, south = read(59.1, 10.2), read(-12.5, -5.25)
print(
    f"59.1 N 10.2 E is read as {north[0]} {north[1]}, 12.5 S 5.25 W as {south[0]} {south[1]}"
)
assert (north, south) == ((3546.0, 612.0), (12357.2, 25899.4)), "this has changed"
P
