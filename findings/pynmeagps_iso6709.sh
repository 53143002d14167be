#!/usr/bin/env bash
# pynmeagps 1.1.8: llh2iso6709 writes texts that ISO 6709 does not have. A height below zero gets two
# signs, and degrees are not filled up to two digits of latitude and three of longitude. Readers find
# the fields by their width and sign, and the function's own example has +086.5640. A guess would be
# +05.3+004.9-3.2CRSWGS_84/ for a place 3.2 m below the sea's level.
#
# Seen: "5.3 N 4.9 E, -3.2 m: +5.3+4.9--3.2CRSWGS_84/; 0.00001 N: +1e-05+4.9+1CRSWGS_84/; the example:
# +27.5916+86.564+8850CRSWGS_84/".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'pynmeagps==1.1.8'
"$work/venv/bin/python" - <<'P'
from pynmeagps.nmeahelpers import llh2iso6709

assert "+27.5916+086.5640+8850CRSWGS_84/" in llh2iso6709.__doc__
below, near, example = (
    llh2iso6709(5.3, 4.9, -3.2),
    llh2iso6709(0.00001, 4.9, 1),
    llh2iso6709(27.5916, 86.5640, 8850),
)
print(f"5.3 N 4.9 E, -3.2 m: {below}; 0.00001 N: {near}; the example: {example}")
assert below == "+5.3+4.9--3.2CRSWGS_84/", f"this has changed: {below}"
assert near == "+1e-05+4.9+1CRSWGS_84/", f"this has changed: {near}"
assert example == "+27.5916+86.564+8850CRSWGS_84/", f"this has changed: {example}"
P
