#!/usr/bin/env bash
# casadi 3.8.2: an interpolant of the kind bspline is zero, with a slope of zero, as soon as its
# argument leaves the table, without a word; the kind linear goes on straight. A propeller's thrust
# coefficient from a table over J = 0 to 1 vanishes at J = -0.001, as when the ship begins to go astern,
# and an optimiser finds no slope that leads back. A guess would be the spline's own polynomial going
# on, the value at the edge, or NaN; and one answer of both kinds.
#
# Seen: "K_T at J of 0, -0.001 and 1.001: linear 0.300, 0.300, 0.050; bspline 0.300, 0.000, 0.000; slope
# at -0.001: linear -0.21, bspline 0.00".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'casadi==3.8.2' 'numpy==2.4.6'
"$work/venv/bin/python" - <<'P'
import casadi as ca
import numpy as np

ADVANCE = np.linspace(0.0, 1.0, 11)
THRUST = 0.30 - 0.20 * ADVANCE - 0.05 * ADVANCE**2
ratio = ca.MX.sym("J")
values, slopes = {}, {}
for kind in ("linear", "bspline"):
    table = ca.interpolant("K_T", kind, [ADVANCE], THRUST)
    slope = ca.Function("slope", [ratio], [ca.jacobian(table(ratio), ratio)])
    values[kind] = [float(table(at)) for at in (0.0, -0.001, 1.001, 0.55)]
    slopes[kind] = float(slope(-0.001))
    assert abs(values[kind][3] - (0.30 - 0.20 * 0.55 - 0.05 * 0.55**2)) < 2e-4, values[kind]
told = [f"{kind} " + ", ".join(f"{value:.3f}" for value in values[kind][:3]) for kind in values]
print(
    f"K_T at J of 0, -0.001 and 1.001: {'; '.join(told)}; slope at -0.001: linear "
    f"{slopes['linear']:.2f}, bspline {slopes['bspline']:.2f}"
)
assert abs(values["linear"][1] - 0.30) < 1e-3 and slopes["linear"] < -0.1, values
found = (*values["bspline"][1:3], slopes["bspline"])
assert found == (0.0, 0.0, 0.0), f"this has changed: {found}"
P
