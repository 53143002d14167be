#!/usr/bin/env bash
# navlib 2.0.0: from 72 N on, all that lies between 0 and 42 E is in UTM zone 31. The grid has the zones
# 31, 33, 35 and 37 there, with borders at 9, 21 and 33 E. The package knows of the exception, so that a
# guess would be that it knows all of it. Longyearbyen gets an easting of another zone's grid, and the
# zone's name with it. utm 0.9.0 has the zones right, and both agree on Norway's zone 32.
#
# Seen: "78.22 N 15.65 E: zone 31, easting 786154 m (utm: 33, 514814 m); 76 N 30 E: zone 31 (utm: 35);
# 73 N 38 E: zone 31 (utm: 37); 60 N 5 E: zone 32 (utm: 32)".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'navlib==2.0.0' 'pyproj==3.7.2' 'numpy==2.4.6' 'utm==0.9.0'
"$work/venv/bin/python" - <<'P'
import utm
from navlib.geo import ll2utm

PLACES = [(78.22, 15.65), (76.0, 30.0), (73.0, 38.0), (60.0, 5.0)]
found = [ll2utm(*place) for place in PLACES]
right = [utm.from_latlon(*place) for place in PLACES]
zones = [(here[2], there[2]) for here, there in zip(found, right, strict=True)]
told = [f"{n:g} N {e:g} E: zone {a} (utm: {b})" for (n, e), (a, b) in zip(PLACES, zones)]
told[0] = (
    f"78.22 N 15.65 E: zone {zones[0][0]}, easting {found[0][0]:.0f} m "
    f"(utm: {zones[0][1]}, {right[0][0]:.0f} m)"
)
print("; ".join(told))
assert [b for _, b in zones] == [33, 35, 37, 32], zones
assert [a for a, _ in zones] == [31, 31, 31, 32], f"this has changed: {zones}"
P
