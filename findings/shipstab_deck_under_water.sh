#!/usr/bin/env bash
# shipstab 0.1.0: the righting lever of a ship whose offsets end at its deck is that of a ship whose
# sides go on upwards for ever: the wall-sided formula, up to 60 degrees of heel and without a word when
# the deck's edge goes under; from there a straight line to zero at 90. A barge with half a metre of
# freeboard, which capsizes at 22 degrees, is said to be stable to 90. A guess would be a lever from
# the offsets, or one that ends at the deck's edge.
#
# Seen: "barge of 60 x 10 m, depth 3 m, draught 2.5 m, KG 3 m: lever at 5, 20, 30 and 60 degrees 0.14,
# 0.62, 1.07 and 5.70 m; of its geometry 0.14, 0.04, -0.19 and -0.93 m".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'shipstab==0.1.0' 'numpy==2.4.6' 'scipy==1.17.1'
"$work/venv/bin/python" - <<'P'
import numpy as np
from shipstab.core.hull import Hull
from shipstab.vessel import Vessel

LENGTH, BREADTH, DEPTH, DRAUGHT, KG = 60.0, 10.0, 3.0, 2.5, 3.0
ANGLES = (5.0, 20.0, 30.0, 60.0)
heights = [float(z) for z in np.linspace(0.0, DEPTH, 7)]
offsets = {float(x): dict.fromkeys(heights, BREADTH / 2.0) for x in np.linspace(0.0, LENGTH, 13)}
barge = Vessel("barge", Hull(offsets, LBP=LENGTH)).set_draft(DRAUGHT).set_KG(KG)
barge.set_LCG(LENGTH / 2.0)
found = [barge.intact_stability.GZ_at_angle(angle) for angle in ANGLES]

# The section in small squares: the lowest of them, as many as the draught has, are under water.
side = (np.arange(1000) + 0.5) / 1000.0 * BREADTH - BREADTH / 2.0
up = (np.arange(300) + 0.5) / 300.0 * DEPTH
y, z = (square.ravel() for square in np.meshgrid(side, up))
right = []
for angle in np.radians(ANGLES):
    below = np.argsort(z * np.cos(angle) - y * np.sin(angle))[: round(DRAUGHT / DEPTH * len(y))]
    lever = y[below].mean() * np.cos(angle) + (z[below].mean() - KG) * np.sin(angle)
    right.append(float(lever))


def told(levers: list[float]) -> str:
    return ", ".join(f"{lever:.2f}" for lever in levers[:-1]) + f" and {levers[-1]:.2f} m"


print(
    f"barge of {LENGTH:g} x {BREADTH:g} m, depth {DEPTH:g} m, draught {DRAUGHT:g} m, KG {KG:g} m: "
    f"lever at 5, 20, 30 and 60 degrees {told(found)}; of its geometry {told(right)}"
)
assert abs(found[0] - right[0]) < 0.01 and right[2] < 0.0, (found, right)
rounded = [round(lever, 2) for lever in found]
assert rounded == [0.14, 0.62, 1.07, 5.7], f"this has changed: {rounded}"
P
