#!/usr/bin/env bash
# shipmmg 0.0.11: a rudder angle that is set for a while and taken back can be lost whole. The list of
# angles becomes the rate of a further state, and the solver's own steps, which grow while nothing
# happens, go over the samples in between; the rudder of the result then stays amidships too. With
# max_step the angle is followed. A guess would be that each sample of the list counts, as in a log.
#
# Seen: "20 degrees from 500 to 520 s: rudder of the result 0.0, change of heading 0.0 degrees; with
# max_step=0.1: 20.0 and 60.0; K times the angle times 20 s: 60.0".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'shipmmg==0.0.11' 'numpy==2.4.6' 'scipy==1.17.1'
"$work/venv/bin/python" - <<'P'
import numpy as np
from shipmmg.kt import KTParams, simulate_kt

time = np.linspace(0.0, 1000.0, 1001)
rudder = np.where((time >= 500.0) & (time < 520.0), np.radians(20.0), 0.0)
ship = KTParams(K=0.15, T=60.0)


def run(**options: float) -> tuple[float, float]:
    """The largest rudder angle of the result, and the change of heading, in degrees."""
    rate, angle = simulate_kt(ship, time, rudder, **options).sol(time)
    heading = np.sum((rate[1:] + rate[:-1]) / 2.0 * np.diff(time))
    return float(np.degrees(np.abs(angle).max())), float(np.degrees(heading))


plain, followed = run(), run(max_step=0.1)
print(
    f"20 degrees from 500 to 520 s: rudder of the result {plain[0]:.1f}, change of heading "
    f"{abs(plain[1]):.1f} degrees; with max_step=0.1: {followed[0]:.1f} and {followed[1]:.1f}; K "
    f"times the angle times 20 s: {ship.K * 20.0 * 20.0:.1f}"
)
assert abs(followed[0] - 20.0) < 0.5 and abs(followed[1] - 60.0) < 1.0, followed
assert plain[0] < 1e-6 and abs(plain[1]) < 1e-6, f"this has changed: {plain}"
P
