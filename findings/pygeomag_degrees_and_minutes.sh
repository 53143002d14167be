#!/usr/bin/env bash
# pygeomag 1.1.0: degrees, minutes and seconds that it made of a place to the south or west do not make
# the place again. The sign stands with the degrees only, and the way back adds the minutes to it; below
# one degree no sign is left. pretty_print_degrees can say 60 minutes, as it rounds last. A guess would
# be the same number after both functions, and 46 degrees 0 minutes.
#
# Seen: "-45.7625 is (-45, 45, 45.0) and back -44.2375; -0.5 is (0, 30, 0.0) and back 0.5; 45.7625 is
# (45, 45, 45.0) and back 45.7625; 45.995 is printed as 45° 60' N".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pygeomag==1.1.0'
"$work/venv/bin/python" - <<'P'
import pygeomag

told, back = [], []
for degrees in (-45.7625, -0.5, 45.7625):
    parts = pygeomag.decimal_degrees_to_degrees_minutes_seconds(degrees)
    back.append(round(pygeomag.degrees_minutes_seconds_to_decimal_degrees(*parts), 9))
    told.append(f"{degrees} is {parts} and back {back[-1]}")
printed = pygeomag.pretty_print_degrees(45.995, is_latitude=True)
print("; ".join(told) + f"; 45.995 is printed as {printed}")
assert back[2] == 45.7625, back
assert back[:2] == [-44.2375, 0.5], f"this has changed: {back}"
assert printed == "45\N{DEGREE SIGN} 60' N", f"this has changed: {printed}"
P
