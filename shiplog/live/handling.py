"""How far and how fast the actuators are moved, compared with the training voyages.

Of an actuator a over the rows of a segment, with x its position or speed at times k h,

    level  L = max_k |x_k|          no azimuth's angle, which has no level
    pace   R = √(mean_k (x(k h + τ) - x(k h))²),   τ = 1 s

A model's errors are known where its training voyages were sailed. An autopilot that swings two
screws against each other each second, or a telegraph at twice the power, shows errors of the model
that no training voyage has, and they are no change of the ship. So a segment in which L or R of an
actuator is more than BEYOND times the greatest of all segments of the training voyages raises no
alarm and is no evidence. It is reported: what was never measured is not judged.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis.linear import segments
from shiplog.voyages.rows.recording import Record

# Of five simulated campaigns no voyage has a segment beyond 1.17 times the greatest of the others.
BEYOND = 1.25
PACE_S = 1.0  # s, τ: over less the noise of a sensor counts, over more a swing cancels


@dataclass(frozen=True)
class Unlike:
    """An actuator, and how many times the greatest level or pace of the training voyages it has;
    infinitely many where none of them moved it."""

    actuator: str
    faster: bool
    times: float

    @property
    def sentence(self) -> str:
        how = "changes" if self.faster else "goes"
        much = f"{self.times:.1f} times as {'fast' if self.faster else 'far'} as in any"
        if not np.isfinite(self.times):
            much = "and did in no"
        return (
            f"{self.actuator} {how} {much} training voyage. Such a manoeuvre raises no alarm: how "
            "far the model is off in it was never measured."
        )


@dataclass(frozen=True)
class Handling:
    """The greatest level and pace [A] of each actuator in the segments of the training voyages."""

    level: np.ndarray
    pace: np.ndarray

    @classmethod
    def of(cls, record: Record) -> Handling:
        size = segments.grid(record).rows
        each = [moved(record.actuator[at : at + size], record) for at in segments.begins(record)]
        level, pace = (np.stack(one).max(0) for one in zip(*each, strict=True))
        return cls(level, pace)

    def unlike(self, record: Record, at: int) -> list[Unlike]:
        """Actuators that the segment from row `at` moves as no training voyage does."""
        size = segments.grid(record).rows
        level, pace = moved(record.actuator[at : at + size], record)
        return [
            Unlike(actuator.name, faster, x / most if most > 0.0 else np.inf)
            for faster, values, known in ((False, level, self.level), (True, pace, self.pace))
            for actuator, x, most in zip(
                record.profile.actuators, values.tolist(), known.tolist(), strict=True
            )
            if x > BEYOND * most
        ]


def moved(x: np.ndarray, record: Record) -> tuple[np.ndarray, np.ndarray]:
    """Level and pace [A] of rows of actuators [n, A]."""
    apart = max(round(PACE_S / record.step), 1)
    turns = np.array([a.kind == "azimuth" for a in record.profile.actuators], bool)
    level = np.where(turns, 0.0, np.abs(x).max(0))
    return level, np.sqrt(np.square(x[apart:] - x[:-apart]).mean(0))
