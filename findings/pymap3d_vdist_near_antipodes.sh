#!/usr/bin/env bash
# pymap3d 3.2.0: near the opposite point of the Earth vdist is up to 66 km and a quarter circle wrong,
# where its warning says that "precision may be reduced slightly". With one such pair in an array all of
# the distances are lost to a ValueError about an array's truth value. A guess would be metres, as
# elsewhere, or NaN for that pair. pyproj has the true distances, and agrees with pymap3d at 179.3 E.
#
# Seen: "from 0 N 0 E to 0 N 179.5 E: -66009 m, course 90 (true 56); from 30 N 0 E to 30 S 179.5 E:
# -50290 m, course 90 (true 73); to 30.3 S 179.3 E: 0 m, course 136 (true 136); in an array:
# ValueError".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pymap3d==3.2.0' 'pyproj==3.7.2' 'numpy==2.4.6'
"$work/venv/bin/python" - <<'P'
import logging

from pymap3d.vincenty import vdist
from pyproj import Geod

logging.disable(logging.WARNING)
EARTH = Geod(ellps="WGS84")


def compare(north: float, *end: float) -> tuple[int, int, int]:
    """Error of the distance in m, the course and the true one."""
    metres, course = vdist(north, 0.0, *end)
    true_course, _, true_metres = EARTH.inv(0.0, north, end[1], end[0])
    return round(float(metres) - true_metres), round(float(course)), round(true_course % 360.0)


found = [compare(0.0, 0.0, 179.5), compare(30.0, -30.0, 179.5), compare(30.0, -30.3, 179.3)]
try:
    array = str(vdist([59.9, 0.0], [10.7, 0.0], [60.0, 0.0], [10.8, 179.5]))
except ValueError as error:
    array = type(error).__name__
told = [f"{metres} m, course {course} (true {true})" for metres, course, true in found]
print(
    f"from 0 N 0 E to 0 N 179.5 E: {told[0]}; from 30 N 0 E to 30 S 179.5 E: {told[1]}; "
    f"to 30.3 S 179.3 E: {told[2]}; in an array: {array}"
)
assert found[2] == (0, 136, 136), found
assert found[:2] == [(-66009, 90, 56), (-50290, 90, 73)], f"this has changed: {found}"
assert array == "ValueError", f"this has changed: {array}"
P
