"""Recorded time of a trial: its voyages one after another, in the order of their start, without
what lies between them."""

from __future__ import annotations

import numpy as np

from shiplog.voyages.rows.recording import Record


def elapsed(record: Record, rows: np.ndarray) -> np.ndarray:
    """Recorded time from the trial's start at rows of its record [s]."""
    return offsets(record)[record.voyage[rows]] + record.time[rows]


def offsets(record: Record) -> np.ndarray:
    """[V + 1] recorded time at which each voyage begins, and the end of the last one [s]."""
    lengths = [
        float(record.time[record.voyage == v].max(initial=0.0)) for v in range(len(record.names))
    ]
    return np.concatenate(([0.0], np.cumsum(lengths)))
