#!/usr/bin/env bash
# ahrs 0.4.0: DCM.to_rpy (and to_angles) has the formula of the transposed matrix. A roll of 10 degrees
# comes back as -10, and of three angles none is right in any order or sign. The quaternion of roll 10,
# pitch 20 and yaw 30 gives them back in its to_angles; its matrix gives others. A guess would be that
# the package's matrix and quaternion of one attitude have the same angles.
#
# Seen: "10 20 30 are 10.0 20.0 30.0 of the quaternion, 1.1 -22.2 -28.5 of its matrix and 10.0 20.0 30.0
# of the transposed; a roll of 10 is -10.0 -0.0 0.0".
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q 'ahrs==0.4.0' 'numpy==2.4.6'
"$work/venv/bin/python" - <<'P'
import numpy as np
from ahrs import DCM, Quaternion


def degrees(angles: np.ndarray) -> list[float]:
    return np.degrees(angles).round(1).tolist()


attitude = Quaternion(rpy=np.radians([10.0, 20.0, 30.0]))
matrix = DCM(q=np.array(attitude))
assert np.allclose(matrix, attitude.to_DCM())
found = [degrees(attitude.to_angles()), degrees(matrix.to_rpy())]
found += [degrees(DCM(np.array(matrix).T).to_rpy()), degrees(DCM(x=np.radians(10.0)).to_rpy())]
own, of_matrix, transposed, roll = (" ".join(map(str, angles)) for angles in found)
print(
    f"10 20 30 are {own} of the quaternion, {of_matrix} of its matrix and {transposed} of the "
    f"transposed; a roll of 10 is {roll}"
)
assert found[0] == found[2] == [10.0, 20.0, 30.0], found
assert found[1] == [1.1, -22.2, -28.5] and found[3] == [-10.0, 0.0, 0.0], f"this has changed: {found}"
P
