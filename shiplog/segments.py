"""Segments cut from a record: what was measured in each, and what drove the ship.

They last half a minute for a model ship of three metres. `scale` gives another ship's in units of
its own time, the length over the speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from shiplog.record import Record

SECONDS = 30.0
BIN = 2.0  # s that one observation averages
KNOT = 2.0  # s between knots of the acceleration
BINS = 15  # of a segment, whatever it lasts
SHIP_TIME = 7.1  # s, L/U for which the above are made: 5 to 10 s, of 3 m at 0.3 to 0.6 m/s
BIN_LENGTHS = (1.4, 2.0, 4.0, 8.0, 16.0)  # s; segments of 21 to 240 s, rows to a bin are even
NODE_ROWS = 2  # rows of the record to a step of an integration
PER_SEGMENT = ("rows", "y", "used", "driven", "voyage")  # of a Cut


@dataclass(frozen=True)
class Cut:
    """S segments cut from one record.

    rows    [S]            first row of each
    y       [S, B, 6]      what was measured, averaged over bins
    used    [S, B, 6]      bool
    driven  [S, K, A + 3]  actuators, share of the campaign, true wind: at the steps' nodes
    voyage  [S]
    """

    rows: np.ndarray
    y: np.ndarray
    used: np.ndarray
    driven: np.ndarray
    voyage: np.ndarray
    step: float

    def __len__(self) -> int:
        return len(self.rows)

    def pick(self, keep: np.ndarray) -> Cut:
        """Some of the segments."""
        return replace(self, **{name: getattr(self, name)[keep] for name in PER_SEGMENT})

    def beside(self, other: Cut) -> Cut:
        """These segments and others of the same record."""
        both = {n: np.concatenate((getattr(self, n), getattr(other, n))) for n in PER_SEGMENT}
        return replace(self, **both)


@dataclass(frozen=True)
class Scale:
    """How long a ship's segments are [s], what one observation averages, and between knots."""

    seconds: float = SECONDS
    bin: float = BIN
    knot: float = KNOT


def scale(length: float, speed: float) -> Scale:
    """In units of the ship's time L/U: a segment is about 4 of them, as T' = U t/L has it (e.g.
    Yasukawa & Yoshimura 2015), and bins and knots are a fifteenth of that.

    length   m
    speed    root mean square of the nominal voyages [m/s]

    In steps of two, so that a ship of the three-metre class keeps 30 s, 2 s and 2 s; not below
    21 s, where a segment has too little to say beside its own start, nor above 240 s, where small
    errors of a model grow too far for a linearisation.
    """
    time = length / max(speed, 1e-6)
    step = math.floor(math.log2(max(time, 1e-6) / SHIP_TIME) + 0.5)
    wide = BIN_LENGTHS[min(max(step, -1), len(BIN_LENGTHS) - 2) + 1]
    return Scale(BINS * wide, wide, wide)


@dataclass(frozen=True)
class Grid:
    """What is the same for every segment: nodes, bins, knots."""

    step: float  # s between rows
    rows: int  # of a segment, less one
    nodes: int
    bins: int
    knots: int
    bin: float = BIN  # s
    knot: float = KNOT  # s

    @property
    def seconds(self) -> float:
        return self.rows * self.step

    @property
    def weights(self) -> np.ndarray:
        """[K, J] hat functions of the knots at the nodes."""
        at = np.arange(self.nodes) * self.step * NODE_ROWS / self.knot
        return np.maximum(1.0 - np.abs(at[:, None] - np.arange(self.knots)), 0.0)


def grid(record: Record, of: Scale | None = None) -> Grid:
    """Of a record's rows; `of`: the ship's scale, where it is not that of a three-metre ship."""
    of = of or Scale()
    rows = round(of.seconds / record.step)
    bins, knots = round(of.seconds / of.bin), round(of.seconds / of.knot) + 1
    return Grid(record.step, rows, rows // NODE_ROWS + 1, bins, knots, of.bin, of.knot)


def begins(record: Record, g: Grid | None = None) -> np.ndarray:
    """Rows at which segments begin: end to end in every unbroken stretch."""
    size = (g or grid(record)).rows
    at = np.append(np.flatnonzero(record.starts), len(record))
    found = [np.arange(a, b - size, size) for a, b in pairwise(at) if b - a > size]
    return np.concatenate(found) if found else np.zeros(0, dtype=int)


def cut(record: Record, rows: np.ndarray, g: Grid | None = None) -> Cut:
    """The segments that begin at these rows of a record (as recorded, or put right)."""
    y, used = measured(record, rows, g)
    driven = driving(record, rows, g)
    return Cut(rows, y, used, driven, record.voyage[rows], record.step * NODE_ROWS)


def measured(
    record: Record, rows: np.ndarray, g: Grid | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """State [S, B, 6], averaged over bins, and whether it was seen there."""
    g = g or grid(record)
    per = round(g.bin / record.step)
    inside = rows[:, None] + np.arange(g.rows + 1)
    mean = _means(g.bins, per)
    y = np.einsum("br,src->sbc", mean, record.state[inside], optimize=True)
    seen = record.seen[inside].astype(float) @ (mean > 0.0).T / (per + 1) > 0.5
    return y, np.repeat(seen[..., None], 6, axis=-1)


def _means(bins: int, per: int) -> np.ndarray:
    """[B, R] by the trapezium over each bin of so many rows."""
    weight = np.ones(per + 1)
    weight[[0, -1]] = 0.5
    found = np.zeros((bins, bins * per + 1))
    for i in range(bins):
        found[i, i * per : (i + 1) * per + 1] = weight / weight.sum()
    return found


def driving(record: Record, rows: np.ndarray, g: Grid | None = None) -> np.ndarray:
    """Actuators, share of the campaign and true wind at the steps' nodes [S, K, A + 3]."""
    driven = np.concatenate((record.actuator, record.share[:, None], record.true_wind), 1)
    return at_nodes(record, rows, driven, g)


def at_nodes(
    record: Record, rows: np.ndarray, values: np.ndarray, g: Grid | None = None
) -> np.ndarray:
    """Of a record's rows [n, c] those at the steps' nodes [S, K, c], each with a quarter of either
    neighbour: what lies between two nodes counts too."""
    at = rows[:, None] + NODE_ROWS * np.arange((g or grid(record)).nodes)
    before = np.maximum(at - 1, record.firsts[at])
    after = np.minimum(at + 1, record.lasts[at])
    return 0.25 * values[before] + 0.5 * values[at] + 0.25 * values[after]
