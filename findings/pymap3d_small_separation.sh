#!/usr/bin/env bash
# pymap3d 3.2.0: anglesep and anglesep_meeus lose small angles, though the text of the latter says that
# it "is stable all the way to exactly 0 deg". The haversine in it is (1 - cos)/2, which is not: 1.1 m
# on the Earth are 0.8 mm short, 11 cm are 1.6 cm short, and 1 cm is zero. The square of the sine of
# the half angle has no such loss. A guess would be the angle to many digits, as the text says.
#
# Seen: "1e-05 degrees: 9.993e-06; 1e-06: 8.538e-07; 1e-07: 0.000e+00".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pymap3d==3.2.0' 'numpy==2.4.6'
"$work/venv/bin/python" - <<'P'
from math import asin, degrees, radians, sin, sqrt

from pymap3d.haversine import anglesep, anglesep_meeus

assert "stable all the way to exactly 0 deg" in anglesep_meeus.__doc__
angles, told = [], []
for step in (1e-5, 1e-6, 1e-7):
    angles.append(float(anglesep_meeus(10.0, 0.0, 10.0, step)))
    assert anglesep(10.0, 0.0, 10.0, step) == angles[-1]
    other = degrees(2.0 * asin(sqrt(sin(radians(step) / 2.0) ** 2)))
    assert abs(other / step - 1.0) < 1e-12, other
    told.append(f"{step:.0e}" + " degrees" * (step == 1e-5) + f": {angles[-1]:.3e}")
print("; ".join(told))
assert told[0].endswith("9.993e-06") and told[1].endswith("8.538e-07"), f"this has changed: {angles}"
assert angles[2] == 0.0, f"this has changed: {angles}"
P
