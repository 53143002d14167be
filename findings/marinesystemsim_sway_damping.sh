#!/usr/bin/env bash
# MarineSystemSim 0.3: a ship's linear damping in sway and yaw (Yv, Nr) does not slow its drift or its
# turn. The equations of sway and yaw take the heading and the distance east where the yaw rate and
# the sway velocity belong, and multiply the two damping terms. The surge equation has no such slip. A
# guess would be exp(-5) of all three speeds after 5 s, with masses of 1 and dampings of -1.
#
# Seen: "after 5 s: surge 0.006, sway 1.000, yaw 1.000 of the speed at first".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'MarineSystemSim==0.3' 'numpy==2.4.6' 'scipy==1.17.1'
"$work/venv/bin/python" - <<'P'
import numpy as np
from MarineSystemSim.Vessel import Ship


def left(speed: int) -> float:
    """Of one of surge, sway and yaw rate, 1 at first, with no force, after 5 s."""
    ship = Ship()
    ship.m, ship.Iz = 1.0, 1.0
    ship.Xu, ship.Yv, ship.Nr = -1.0, -1.0, -1.0
    state = np.zeros(6)  # north, east, heading and their three speeds in the ship's frame
    state[3 + speed] = 1.0
    ship.x = state
    ship.simulate(dt=0.1, T=5.0)
    return float(ship.x[3 + speed])


surge, sway, yaw = (left(speed) for speed in range(3))
print(f"after 5 s: surge {surge:.3f}, sway {sway:.3f}, yaw {yaw:.3f} of the speed at first")
assert abs(surge - np.exp(-5.0)) < 1e-3, surge
assert (round(sway, 3), round(yaw, 3)) == (1.0, 1.0), f"this has changed: {sway}, {yaw}"
P
