"""Which row of CyberShip Enterprise I's files commands what: docs/evidence/cybership.md.

    python -m pipelines.experiments.measured_ships.cybership DATA/cybership_enterprise1

The files have a matrix without names. Rows 8 to 12 are commands, rows 13 and 14 speeds of the two
Voith Schneider propellers. Accelerations of the smoothed path, averaged over a second, are fitted
by least squares to the commands and to a damping of the second degree:

    (u̇, v̇, ṙ) = Σ_c b_c c + D (u, v, r, u|u|, v|v|, r|r|, v r, u r, 1)

A command acts along the hull where b of u̇ is the largest part, and athwart where that of v̇ is. Its
place follows from the turn: a force X at y to starboard turns by -y X, a force Y at x ahead by x Y.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from shiplog.logs.conversion.matlab import read_matlab
from shiplog.nomenclature.frames import to_body
from shiplog.report.evaluation import tables
from shiplog.voyages.rows import pose_smoother

ROWS = range(8, 13)
X, Y, YAW = 2, 3, 7  # rows of the pose that are used; 2 to 7 are zero where it was lost
SECOND = 20  # samples


def motion(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Velocity and acceleration (u, v, r) [3, n] of the samples that were not lost, and which."""
    sound = (matrix[1:7] != 0.0).any(axis=0)
    time, first = matrix[0][sound], np.arange(int(sound.sum())) == 0
    place = (matrix[X - 1] + 1j * matrix[Y - 1])[sound]
    (path,) = pose_smoother.smooth(time, place, first)
    (turn,) = pose_smoother.smooth(time, np.unwrap(matrix[YAW - 1][sound]), first)
    heading = turn.state[:, 0]
    found = []
    for order in (1, 2):
        earth = np.stack((np.real(path.state[:, order]), np.imag(path.state[:, order])), 1)
        found.append(np.stack((*to_body(earth, heading).T, turn.state[:, order])))
    return found[0], found[1], sound


def effects(matrix: np.ndarray) -> list[tuple[object, ...]]:
    """Row, b of u̇ and v̇ [m/s²] and of ṙ [rad/s²], in a line each; then the shares explained."""
    (u, v, r), acceleration, sound = motion(matrix)
    commands = [matrix[row - 1][sound] for row in ROWS]
    damping = [u, v, r, u * abs(u), v * abs(v), r * abs(r), v * r, u * r, np.ones(len(u))]
    A = np.stack([_seconds(one) for one in (*commands, *damping)], 1)
    b = np.stack([_seconds(one) for one in acceleration], 1)
    solution = np.linalg.lstsq(A, b, rcond=None)[0]
    left = ((b - A @ solution) ** 2).sum(0) / ((b - b.mean(0)) ** 2).sum(0)
    lines: list[tuple[object, ...]] = [
        (f"row {row}", *(f"{value:+.3f}" for value in solution[i])) for i, row in enumerate(ROWS)
    ]
    return [*lines, ("explained", *(f"{1.0 - one:.0%}" for one in left))]


def _seconds(values: np.ndarray) -> np.ndarray:
    """Means over SECOND samples [n / SECOND]."""
    whole = len(values) // SECOND * SECOND
    return values[:whole].reshape(-1, SECOND).mean(1)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    for path in sorted(given.folder.glob("*.mat")):
        matrix = read_matlab(path).frame.to_numpy().T
        head = (path.stem, "surge, m/s2", "sway, m/s2", "yaw, rad/s2")
        print(tables.table(head, effects(matrix)), "", sep="\n")


if __name__ == "__main__":
    main()
