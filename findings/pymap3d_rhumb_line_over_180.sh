#!/usr/bin/env bash
# pymap3d 3.2.0: loxodrome_inverse does not cross the 180th meridian. From 10 N 179.5 E to 11 N 179.5
# W it goes west around the world, and on the parallel of 10 N it says half of that way. pymap3d's own
# geodesic (vdist) goes east over the meridian. A guess would be the rhumb line that a ship steers,
# which over the meridian of Greenwich is what the function gives.
#
# Seen: "over 180: 39298 km on course 270 to 11 N, 19625 km on 270 along 10 N; geodesics 156 km on 45,
# 110 km on 90; over 0: 156 km on 45".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pymap3d==3.2.0' 'numpy==2.4.6'
"$work/venv/bin/python" - <<'P'
from collections.abc import Callable

from pymap3d.lox import loxodrome_inverse
from pymap3d.vincenty import vdist


def way(method: Callable, west: float, north: float) -> tuple[int, int]:
    """Distance in km and course, a degree to the east from 10 N."""
    east = west + 1.0 if west < 179.0 else west - 359.0
    metres, course = method(10.0, west, north, east)
    return round(float(metres) / 1000.0), round(float(course))


rhumb = [way(loxodrome_inverse, 179.5, north) for north in (11.0, 10.0)]
short = [way(vdist, 179.5, north) for north in (11.0, 10.0)]
at_zero = way(loxodrome_inverse, -0.5, 11.0)
print(
    f"over 180: {rhumb[0][0]} km on course {rhumb[0][1]} to 11 N, {rhumb[1][0]} km on {rhumb[1][1]} "
    f"along 10 N; geodesics {short[0][0]} km on {short[0][1]}, {short[1][0]} km on {short[1][1]}; "
    f"over 0: {at_zero[0]} km on {at_zero[1]}"
)
assert short == [(156, 45), (110, 90)] and at_zero == (156, 45), (short, at_zero)
assert rhumb == [(39298, 270), (19625, 270)], f"this has changed: {rhumb}"
P
