#!/usr/bin/env bash
# commonocean-vessel-models 1.0.0: in the ship of three degrees of freedom the rigid body's Coriolis
# matrix has the yaw rate where the surge velocity belongs (m r for m u; Fossen, 2011), so
# that the sway equation has m r^2 instead of m u r. The matrix of the added mass has no such slip. A
# guess would be that a body that turns without any force or added mass goes straight on: at 7 m/s, 2100
# m in 300 s.
#
# Seen: "7 m/s and 0.01 rad/s: sway acceleration -0.0001 m/s2, not -0.07; after 300 s at 10 and 750 m,
# not at 2100 and 0 m".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'commonocean-vessel-models==1.0.0' 'numpy==2.4.6' 'scipy==1.17.1'
"$work/venv/bin/python" - <<'P'
import numpy as np
from scipy.integrate import solve_ivp
from vesselmodels.parameters_vessel_1 import parameters_vessel_1
from vesselmodels.vessel_dynamics_3F import vessel_dynamics_3f

ship = parameters_vessel_1()
ship.x_g = 0.0
for name in ("X_udot", "Y_vdot", "Y_rdot", "N_rdot", "X_u", "Y_v", "Y_r", "N_v", "N_r"):  # no water
    setattr(ship, name, 0.0)


def rates(_: float, state: np.ndarray) -> list[float]:
    return vessel_dynamics_3f(state, [0.0, 0.0, 0.0], ship)


speed, turn = 7.0, 0.01
start = np.array([0.0, 0.0, 0.0, speed, 0.0, turn])  # north, east, heading, surge, sway, yaw rate
sway = rates(0.0, start)[4]
north, east = solve_ivp(rates, (0.0, 300.0), start, rtol=1e-9, atol=1e-9).y[:2, -1]
print(
    f"{speed:g} m/s and {turn:g} rad/s: sway acceleration {sway:.4f} m/s2, not {-speed * turn:.2f}"
    f"; after 300 s at {north:.0f} and {east:.0f} m, not at {speed * 300:.0f} and 0 m"
)
assert abs(sway + turn**2) < 1e-9, f"this has changed: {sway}"
assert abs(north - 10.0) < 1.0 and abs(east - 750.0) < 1.0, f"this has changed: {north}, {east}"
P
