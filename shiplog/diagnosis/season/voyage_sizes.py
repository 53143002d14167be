"""A cause's likelihood in each voyage of a trial, and dates of the voyages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime

import numpy as np

from shiplog.diagnosis.onset import drift
from shiplog.diagnosis.onset.stretch_information import Stretches
from shiplog.diagnosis.season.pooling import Voyages
from shiplog.diagnosis.trial.trial import Trial


def by_voyage(
    trial: Trial,
    information: Stretches,
    starts: Mapping[str, datetime],
    events: Sequence[datetime] = (),
    each: tuple[int, ...] = (),
) -> tuple[Voyages, tuple[str, ...]]:
    """y and M of (17) added over each voyage's stretches, and the voyages' names; those without a
    segment are left out.

    events   at which a level ends and another one begins
    each     how many numbers each cause has, where the information is of several
    """
    record = trial.record
    voyage = record.voyage[trial.rows[information.first]]
    names = np.unique(voyage)
    add = (names[:, None] == voyage).astype(float)
    y = add @ information.y
    M = np.einsum("vb,bpcq,wc->vpwq", add, information.M, add, optimize=True)
    days = np.array([middle_of(trial, int(v), starts) for v in names])
    level = np.zeros(len(names), dtype=int)
    if events and set(record.names) <= set(starts):
        first = min(starts[name] for name in record.names).timestamp()
        at = np.sort([(one.timestamp() - first) / drift.DAY_S for one in events])
        level = np.searchsorted(at, days, side="right")
        level = np.unique(level, return_inverse=True)[1]  # of two events without a voyage between
    return Voyages(y, M, days, level, each), tuple(record.names[v] for v in names)


def middle_of(trial: Trial, voyage: int, starts: Mapping[str, datetime]) -> float:
    """Days from the first voyage's start to the middle of one."""
    rows = np.flatnonzero(trial.record.voyage == voyage)[[0, -1]]
    return float(drift.days_of(trial, rows, starts).mean())
