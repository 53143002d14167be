#!/usr/bin/env bash
# smsfusion 1.9.1: its tangent plane, FixedNED, has radii of no ellipsoid: in those of WGS 84's curvature
# the sine of the latitude is not squared. To the north a degree is too short, in Bergen by 15 %; to the
# south it is too long, in Sydney 20 times, and from about 38 S on there is no number. The way there and
# back is wrong by the same, so that a test of both together sees nothing. A guess would be a plane
# that is right to millimetres a kilometre. pymap3d 3.2.0 has the plane right.
#
# Seen: "0.01 degrees north, then east, in m: at 60.39 N 948.4, 522.6 (pymap3d 1114.2, 551.4); at 33.86 S
# 22015.0, 2505.4 (pymap3d 1109.2, 925.4); at 0 N 1105.7, 1113.2 (pymap3d 1105.7, 1113.2); at 45 S nan,
# nan (pymap3d 1111.3, 788.5); there and back 7e-15 degrees".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'smsfusion==1.9.1' 'pymap3d==3.2.0' 'numpy==2.4.6'
"$work/venv/bin/python" -W ignore - <<'P'
import numpy as np
import pymap3d
from smsfusion import FixedNED

STEP = 0.01  # degrees
told, found, right = [], {}, {}
for lat in (60.39, -33.86, 0.0, -45.0):
    plane = FixedNED(lat, 5.32, 0.0)
    found[lat] = plane.to_xyz(lat + STEP, 5.32, 0.0)[0], plane.to_xyz(lat, 5.32 + STEP, 0.0)[1]
    right[lat] = (
        pymap3d.geodetic2ned(lat + STEP, 5.32, 0.0, lat, 5.32, 0.0)[0],
        pymap3d.geodetic2ned(lat, 5.32 + STEP, 0.0, lat, 5.32, 0.0)[1],
    )
    a, b = found[lat], right[lat]
    told.append(f"at {abs(lat):g} {'NS'[lat < 0]} {a[0]:.1f}, {a[1]:.1f} (pymap3d {b[0]:.1f}, {b[1]:.1f})")
plane = FixedNED(60.39, 5.32, 0.0)
back = plane.to_llh(*plane.to_xyz(60.40, 5.33, 0.0))[0] - 60.40
print(f"{STEP} degrees north, then east, in m: {'; '.join(told)}; there and back {back:.0e} degrees")
assert np.allclose(found[0.0], right[0.0], atol=0.1), found
assert abs(back) < 1e-9, back
assert abs(found[60.39][0] - right[60.39][0]) > 50.0, f"this has changed: {found}"
assert found[-33.86][0] > 3000.0 and np.isnan(found[-45.0]).all(), f"this has changed: {found}"
P
