"""Segments cut from a record: what was measured in each, and what drove the ship.

How long they are is the record's `timescale`: half a minute for a model ship of three metres.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from shiplog.nomenclature import channels
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.rows.timescale import BIN, NODE_STEP, STEP_ROWS

PER_SEGMENT = ("rows", "y", "used", "driven", "voyage")  # of a Cut


@dataclass(frozen=True)
class Cut:
    """S segments cut from one record.

    rows    [S]            first row of each
    y       [S, B, 6]      what was measured, averaged over bins
    used    [S, B, 6]      bool
    driven  [S, K, A + 3]  actuators, share of the campaign, true wind: at the steps' instants
    voyage  [S]            counts in the record's names
    step                   s between the steps' instants
    water   [2]            velocity of the water along x₀ and y₀ [m/s]; the discrepancy depends on
                           the motion through it
    factors                family of the discrepancy → factor [3] of the forces that depend on its
                           inputs; none where they are as on the nominal voyages
    """

    rows: np.ndarray
    y: np.ndarray
    used: np.ndarray
    driven: np.ndarray
    voyage: np.ndarray
    step: float
    water: np.ndarray = field(default_factory=lambda: np.zeros(2))
    factors: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.rows)

    def pick(self, keep: np.ndarray | slice) -> Cut:
        """Some of the segments."""
        return replace(self, **{name: getattr(self, name)[keep] for name in PER_SEGMENT})

    def joined(self, other: Cut) -> Cut:
        """These segments and others of the same record."""
        both = {n: np.concatenate((getattr(self, n), getattr(other, n))) for n in PER_SEGMENT}
        return replace(self, **both)


@dataclass(frozen=True)
class SegmentGrid:
    """What is the same for every segment: K instants of steps, B bins, J nodes of acceleration."""

    step: float  # s between rows
    rows: int  # of a segment, less one
    instants: int  # K, instants of the integration's steps
    bins: int  # B
    nodes: int  # J, nodes of the acceleration
    bin: float = BIN  # s
    node_step: float = NODE_STEP  # s between nodes of the acceleration
    every: int = STEP_ROWS  # rows to a step

    @property
    def seconds(self) -> float:
        return self.rows * self.step

    @property
    def weights(self) -> np.ndarray:
        """hⱼ(tₖ) = max(0, 1 - |tₖ/Δ - j|) [K, J]: hat functions of the acceleration's nodes, Δ s
        apart, at the instants of the steps."""
        at = np.arange(self.instants) * self.step * self.every / self.node_step
        return np.maximum(1.0 - np.abs(at[:, None] - np.arange(self.nodes)), 0.0)


def grid(record: Record) -> SegmentGrid:
    """Of a record's rows, in its ship's time scale."""
    of = record.timescale
    rows = round(of.seconds / record.step)
    bins, nodes = round(of.seconds / of.bin), round(of.seconds / of.node_step) + 1
    instants = rows // of.step_rows + 1
    return SegmentGrid(record.step, rows, instants, bins, nodes, of.bin, of.node_step, of.step_rows)


def begins(record: Record) -> np.ndarray:
    """Rows at which segments begin: end to end in every unbroken stretch."""
    size = grid(record).rows
    at = np.append(np.flatnonzero(record.starts), len(record))
    found = [np.arange(a, b - size, size) for a, b in pairwise(at) if b - a > size]
    return np.concatenate(found) if found else np.zeros(0, dtype=int)


def cut(record: Record, rows: np.ndarray) -> Cut:
    """The segments that begin at these rows of a record (as recorded, or put right)."""
    y, used = measured(record, rows)
    driven = driving(record, rows)
    return Cut(rows, y, used, driven, record.voyage[rows], record.step * record.timescale.step_rows)


def measured(record: Record, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """State [S, B, 6], averaged over bins, and whether most of a bin was measured; never of a
    channel that is derived from others: p(y, f(y)) = p(y), and it would count twice."""
    g = grid(record)
    whole, ends, per = _bin_sums(record.measured[:, None].astype(float), rows, g)
    measured = whole + ends[:, 1:] > 0.5 * (per + 1)
    used = np.repeat(measured, 6, axis=-1)
    derived = record.profile.sensors.derived
    used[..., [c.name in derived for c in channels.STATE]] = False
    return means_of_bins(record, rows), used


def means_of_bins(record: Record, rows: np.ndarray) -> np.ndarray:
    """y_b = (½ x₀ + x₁ + … + x_{n-1} + ½ xₙ) / n: means of the state over bins [S, B, 6], by the
    trapezium over the n rows that a bin goes on for."""
    whole, ends, per = _bin_sums(record.state, rows, grid(record))
    return (whole + 0.5 * (ends[:, 1:] - ends[:, :-1])) / per


def _bin_sums(
    values: np.ndarray, rows: np.ndarray, g: SegmentGrid
) -> tuple[np.ndarray, np.ndarray, int]:
    """Of a record's rows [n, c]: sums [S, B, c] of each bin without its last row, the rows
    [S, B + 1, c] between bins, and how many rows a bin goes on for."""
    per = round(g.bin / g.step)
    inside = values[rows[:, None] + np.arange(g.bins * per + 1)]
    whole = inside[:, :-1].reshape(len(rows), g.bins, per, values.shape[1]).sum(2)
    return whole, inside[:, ::per], per


def driving(record: Record, rows: np.ndarray) -> np.ndarray:
    """Actuators, share of the campaign and true wind at the steps' instants [S, K, A + 3]."""
    driven = np.concatenate((record.actuator, record.share[:, None], record.true_wind), 1)
    return average_at_instants(record, rows, driven)


def average_at_instants(record: Record, rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Of a record's rows [n, c] those at the steps' instants [S, K, c], each the mean, by the
    trapezium, of the rows about it: what lies between two instants counts."""
    g = grid(record)
    at = rows[:, None] + g.every * np.arange(g.instants)
    firsts, lasts, half = record.firsts[at], record.lasts[at], g.every // 2
    found = np.zeros((*at.shape, values.shape[1]))
    for away in range(-half, half + 1):
        weight = 0.5 if abs(away) == half else 1.0
        found += weight / g.every * values[np.clip(at + away, firsts, lasts)]
    return found
