#!/usr/bin/env bash
# shipmmg 0.0.11: a ship of the MMG model whose propeller stands still does not answer its rudder: with
# 0 revolutions the flow past the rudder is taken as zero, however fast the ship goes; with a
# thousandth of a revolution a second it is not. The same branch is for a ship at rest, where its
# formula has n^2 D^4 in the place of n D, which is no speed: a flow a thousand times too fast at full
# scale. A guess would be the limit of the formula beside it, for the revolutions or the speed to zero.
#
# Seen: "320 m ship at 7 m/s, 20 degrees of rudder, after 300 s: heading 0.0 at 0 revolutions, 58.9 at
# 0.001; at rest with 1.6: flow past the rudder 7818.9 m/s, at 1e-6 m/s: 5.9 m/s".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'shipmmg==0.0.11' 'numpy==2.4.6' 'scipy==1.17.1'
"$work/venv/bin/python" - <<'P'
import numpy as np
from shipmmg import mmg_3dof as mmg

# The KVLCC2 (Yasukawa and Yoshimura, 2015), 45.7 times the model of 7 m.
L, D, DEPTH, RUDDER, MASS = 320.0, 9.87, 20.8, 112.5, 3.2e8
WATER = 0.5 * 1025.0 * L**2 * DEPTH
basic = mmg.Mmg3DofBasicParams(
    *(L, 58.0, DEPTH, 11.2, D, MASS, MASS * (0.25 * L) ** 2, RUDDER, 0.626, 0.022 * WATER),
    *(0.223 * WATER, 0.011 * WATER * L**2, 2.747, 1.09, 0.387, -0.5 * L, 0.312, -0.464 * L),
    *(0.395, 0.640, -0.710, 0.50, 0.220, 0.40, -0.650),
)
hull = mmg.Mmg3DofManeuveringParams(
    *(0.2931, -0.2753, -0.1385, 0.022, -0.040, 0.002, 0.011, 0.771, -0.315, 0.083, -1.607),
    *(0.379, -0.391, 0.008, -0.137, -0.049, -0.030, -0.294, 0.055, -0.013),
)
time, rudder = np.linspace(0.0, 300.0, 301), np.radians(20.0)


def heading(revolutions: float) -> float:
    angles, all_revolutions = np.full(len(time), rudder), np.full(len(time), revolutions)
    run = mmg.simulate_mmg_3dof(basic, hull, time, angles, all_revolutions, u0=7.0)
    return float(np.degrees(run.sol(time)[5, -1]))


def flow(speed: float) -> float:
    states = [[value] for value in (speed, 0.0, 0.0, rudder, 1.6)]
    found = mmg.get_sub_values_from_simulation_result(*states, basic, hull, return_all_vals=True)
    return float(found[18][0])


stopped, turning, rest, slow = heading(0.0), heading(1e-3), flow(0.0), flow(1e-6)
print(
    f"320 m ship at 7 m/s, 20 degrees of rudder, after 300 s: heading {stopped:.1f} at 0 "
    f"revolutions, {turning:.1f} at 0.001; at rest with 1.6: flow past the rudder {rest:.1f} m/s, "
    f"at 1e-6 m/s: {slow:.1f} m/s"
)
assert turning > 50.0 and 5.0 < slow < 7.0, (turning, slow)
assert abs(stopped) < 1e-6 and rest > 7000.0, f"this has changed: {stopped}, {rest}"
P
