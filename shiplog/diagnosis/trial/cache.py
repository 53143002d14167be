"""Results that the hypotheses about one trial share. Each is computed again where it is not kept.

Only what `starts` holds is more than a saving of time: a fit of the same causes with the same
remainder begins where an earlier one converged.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from weakref import ref

import numpy as np

from shiplog.diagnosis.linear.linear_segments import Path
from shiplog.diagnosis.linear.measurement_correction import ActuatorColumns, Moved
from shiplog.diagnosis.linear.segments import Cut
from shiplog.diagnosis.noise.part_products import PartPass
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.trial.fitted import Start
from shiplog.machine import memory

Numbers = Mapping[str, np.ndarray]
Read = tuple[Cut, Moved, np.ndarray]  # see `measurement_correction.read`
Key = tuple[tuple[str, ...], Remainder]  # labels of the included causes, and the remainder


@dataclass(frozen=True)
class Total:
    """G [1 + C, 1 + C] of all parts (4), and log|R| (5)."""

    G: np.ndarray
    volume: float


@dataclass
class Cache:
    """What is kept of one trial. A trial and its copies with other weights share one: keys hold
    what they differ in.

    starts    where fits converged, written by `evaluate.resume`
    readings  numbers of sensors' causes, and the trial as read with them: as it is, and as it was
              last; written by `Trial`
    acted     columns of causes that change actuators alone, from one reading to the next. The rest
              is written by `Products`:
    passes    parts of the point that was asked for last, with its weights. A point is known by its
              path, which outlives its linearisation
    first     the same of the first point, for its volumes
    totals    of a point, by λ, weights and shape of the process noise
    volumes   of the first point, the same: log|R|
    voyages   products of each voyage of the last point that they were asked for
    """

    starts: dict[Key, Start] = field(default_factory=dict)
    readings: list[tuple[Numbers, Read]] = field(default_factory=list)
    acted: ActuatorColumns = field(default_factory=ActuatorColumns)
    # no id() of a point: one that is gone leaves its own to the next one
    passes: tuple[ref[Path], bytes, Sequence[PartPass]] | None = None
    first: tuple[ref[Path], bytes, Sequence[PartPass]] | None = None
    totals: list[tuple[ref[Path], tuple, Total]] = field(default_factory=list)
    volumes: dict[tuple, float] = field(default_factory=dict)
    voyages: tuple[ref[Path], tuple, dict[object, np.ndarray]] | None = None

    def release(self) -> None:
        """Let go of what takes most memory, 0.4 MB a segment: it is made again where it is asked
        for."""
        self.passes = self.first = None
        memory.give_back()
