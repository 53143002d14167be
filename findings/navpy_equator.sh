#!/usr/bin/env bash
# navpy 1.0: a place on the equator has no latitude after ecef2lla, as z is divided by itself there, and
# in a track one such place stops the iteration for all: their heights are a decimetre off where the same
# places without it are right to a fifth of a millimetre. lla2ecef, its inverse, knows the equator. A
# guess would be a latitude of 0, and places that do not depend on the others.
#
# Seen: "heights of 20 m at 59.9 N and 33 S: 20.0002 and 20.0002 m; with a place at 0 between them: 20.1007
# and 20.0398 m, and its latitude nan".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'navpy==1.0' 'numpy==2.4.6'
"$work/venv/bin/python" -W ignore::RuntimeWarning - <<'P'
import navpy
import numpy as np


def trip(latitudes: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Latitudes and heights after lla2ecef and ecef2lla, of places at 20 m."""
    count = len(latitudes)
    ecef = navpy.lla2ecef(np.array(latitudes), np.full(count, 10.7), np.full(count, 20.0))
    latitude, _, height = navpy.ecef2lla(ecef)
    return latitude, height


_, apart = trip([59.9, -33.0])
latitude, (north, _, south) = trip([59.9, 0.0, -33.0])
print(
    f"heights of 20 m at 59.9 N and 33 S: {apart[0]:.4f} and {apart[1]:.4f} m; with a place at 0 "
    f"between them: {north:.4f} and {south:.4f} m, and its latitude {latitude[1]}"
)
assert np.abs(apart - 20.0).max() < 1e-3, apart
assert np.isnan(latitude[1]), f"this has changed: {latitude}"
found = round(float(north), 2), round(float(south), 2)
assert found == (20.1, 20.04), f"this has changed: {found}"
P
