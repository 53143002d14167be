#!/usr/bin/env bash
# shoeboxpy 1.0.0: its models of one box in three and in six degrees of freedom turn differently in the
# plane, and each lacks a part of its own equation. That of three leaves out the Munk moment
# (m_y - m_x) u v, which its matrix C_A has; that of six multiplies the yaw rate by itself where the
# surge velocity belongs, so that the box itself needs no centripetal force, only its added mass does. A
# guess would be one motion from both, as long as the box neither heaves, rolls nor pitches.
#
# Seen: "accelerations in surge, sway and yaw: three 0.0218 -0.0917 0.0000, six 0.0036 -0.0083 -0.0020; by
# Fossen's equations 0.0218 -0.0917 -0.0020".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'shoeboxpy==1.0.0' 'numpy==2.4.6'
"$work/venv/bin/python" - <<'P'
import numpy as np
from shoeboxpy.model3dof import Shoebox as Three
from shoeboxpy.model6dof import Shoebox as Six

SURGE, SWAY, YAW = 0.1, 0.2, 0.1  # added mass and inertia over the box's own
LENGTH, BREADTH, DRAUGHT = 10.0, 3.0, 1.0
u, v, r = 1.0, 0.2, 0.1
box = {"L": LENGTH, "B": BREADTH, "T": DRAUGHT}
added = {"alpha_u": SURGE, "alpha_v": SWAY, "alpha_r": YAW}
three = Three(**box, **added, beta_u=0.0, beta_v=0.0, beta_r=0.0)
six = Six(**box, **added, **{f"beta_{axis}": 0.0 for axis in "uvwpqr"})
_, planar = three.dynamics(np.zeros(3), np.array([u, v, r]), np.zeros(3))
_, whole = six.dynamics(np.zeros(6), np.array([u, v, 0.0, 0.0, 0.0, r]), np.zeros(6), None)
inertia = (LENGTH**2 + BREADTH**2) / 12.0  # over the mass
right = [
    (1.0 + SWAY) * v * r / (1.0 + SURGE),
    -(1.0 + SURGE) * u * r / (1.0 + SWAY),
    -(SWAY - SURGE) * u * v / ((1.0 + YAW) * inertia),
]
found = [planar.tolist(), whole[[0, 1, 5]].tolist()]
told = [" ".join(f"{value:.4f}" for value in values) for values in (*found, right)]
print(
    f"accelerations in surge, sway and yaw: three {told[0]}, six {told[1]}; by Fossen's equations "
    f"{told[2]}"
)
munk = three.C_A(np.array([u, v, r])) @ [u, v, r]
assert np.isclose(-munk[2] / three.M_eff[2, 2], right[2]), munk
assert np.allclose(found[0], [*right[:2], 0.0]), f"this has changed: {found[0]}"
boxless = [SWAY * v * r / (1.0 + SURGE), -SURGE * u * r / (1.0 + SWAY), right[2]]
assert np.allclose(found[1], boxless), f"this has changed: {found[1]}"
P
