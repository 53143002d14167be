#!/usr/bin/env bash
# navlib 2.0.0: ctd2svel and ctd2salinity say that conductivity is in S/m, but hand it on as mS/cm (1
# S/m is 10 mS/cm). Standard seawater, which has 4.2914 S/m at 15 degrees by the definition of
# practical salinity, comes out as nearly fresh, and sound 37 m/s too slow: 2.5 % of an echo sounder's
# depth. Ten times the conductivity gives the right ones.
#
# Seen: "4.2914 S/m, 15 C, 10 m: salinity 2.9 g/kg, sound 1469.5 m/s; 42.914: 35.2 g/kg, 1506.8 m/s".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'navlib==2.0.0' 'gsw==3.6.23' 'numpy==2.4.6' 'scipy==1.17.1'
"$work/venv/bin/python" - <<'P'
from navlib.environment import ctd2salinity, ctd2svel

assert "S/m" in ctd2svel.__doc__ and "S/m" in ctd2salinity.__doc__


def water(conductivity: float) -> tuple[float, float]:
    """Salinity in g/kg and the speed of sound in m/s, at 15 degrees and 10 m of depth."""
    place = (15.0, -10.0)
    found = ctd2salinity(conductivity, *place), ctd2svel(conductivity, *place)
    return round(float(found[0]), 1), round(float(found[1]), 1)


documented, other = water(4.2914), water(42.914)
print(
    f"4.2914 S/m, 15 C, 10 m: salinity {documented[0]} g/kg, sound {documented[1]} m/s; "
    f"42.914: {other[0]} g/kg, {other[1]} m/s"
)
assert documented == (2.9, 1469.5), f"this has changed: {documented}"
assert other == (35.2, 1506.8), f"this has changed: {other}"
P
