"""The alarm: the evidence of a change against the threshold of the user's rate of false alarms.

Half of the rate is for a change of a cause of the bank (log Z_n), half for segments that none of
them explains: the least log χ²_s/χ̃² of LASTING in a row. A single one is a hard manoeuvre now and
then, for which a model is wrong, and how wrong a campaign does not show. After an alarm the
evidence that raises the next one begins anew; while it crosses the threshold again within
QUIET_SEGMENTS the alarm stands. What is suspected follows from all segments since the alarm stands
and before it, and another suspect is reported only where it is more probable by SURER nats. An
alarm is a suspicion: it names what fits best of a short bank, and no more.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from shiplog.live import alarm_threshold, change_evidence
from shiplog.live.alarm_threshold import Tail
from shiplog.live.change_evidence import ChangeEvidence, Evidence
from shiplog.live.segment_products import Directions

SHARED = 0.5  # of the rate, for each of the two statistics
LASTING = 3  # segments in a row that no cause explains
QUIET_SEGMENTS = 20  # without a crossing, after which an alarm is over
MOST_SUSPECTS = 3
SURER = 5.0  # nats
UNKNOWN = "unknown"


@dataclass(frozen=True)
class Suspect:
    """A cause, its log Bayes factor against no change, and when it would have begun [ns]."""

    name: str
    log_factor: float
    began: int


@dataclass(frozen=True)
class Alarm:
    """time  ns, the end of the segment with which it was raised
    statistic, threshold   in nats
    suspects               the most probable first; none of what no cause explains
    again                  the alarm stood already, with another suspect
    voyage                 ns, the first row of its voyage; None where a watch did not say
    """

    time: int
    statistic: float
    threshold: float
    suspects: tuple[Suspect, ...]
    unexplained: bool
    again: bool
    voyage: int | None = None


@dataclass(frozen=True)
class Thresholds:
    """c of log Z_n and of the lasting log χ²_s/χ̃², and whether the rate is beyond what was made to
    see it."""

    change: float
    unexplained: float
    extrapolated: bool

    @classmethod
    def of(cls, tails: tuple[Tail, Tail], per_day: float, segment_s: float) -> Thresholds:
        rate = SHARED * alarm_threshold.per_segment(per_day, segment_s)
        change, other = tails
        return cls(change.threshold(rate), other.threshold(rate), change.extrapolated(rate))


@dataclass
class Watcher:
    """The evidence of one watch, segment by segment.

    median    χ̃² of the campaign
    evidence  of all segments since the last alarm was over: what is suspected
    alert     of those since the threshold was crossed last: whether it is crossed again
    ends      ns, of the segments of `evidence`
    quiet     segments since the threshold was crossed last; None where it never was
    named     the suspect that was reported last
    squares   log χ²_s/χ̃² of the last LASTING segments of a voyage
    """

    directions: Directions
    thresholds: Thresholds
    median: float
    evidence: ChangeEvidence = field(init=False)
    alert: ChangeEvidence = field(init=False)
    ends: list[int] = field(default_factory=list)
    quiet: int | None = None
    named: str = ""
    latest: Evidence | None = None
    squares: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.evidence, self.alert = self._empty(), self._empty()

    def _empty(self) -> ChangeEvidence:
        return ChangeEvidence(self.directions.widths, places(self.directions.causes))

    def begin_voyage(self) -> None:
        """Another voyage differs from the one before as voyages do; an alarm that stands stays."""
        self.evidence.restart()
        self.alert.restart()
        self.ends, self.squares = [], []

    @property
    def square(self) -> float:
        """log χ²_s/χ̃² of the last segment."""
        return self.squares[-1] if self.squares else 0.0

    @property
    def lasting(self) -> float:
        """The least log χ²_s/χ̃² of the last LASTING segments."""
        return min(self.squares) if len(self.squares) == LASTING else -math.inf

    @property
    def stands(self) -> bool:
        """Whether an alarm is on."""
        return self.quiet is not None

    def add(self, gram: np.ndarray, end: int) -> Alarm | None:
        """One more segment, of products G_s [1 + C, 1 + C], that ended at a time [ns]."""
        return self.add_product(self.directions.products(gram), end)

    def add_product(self, product: np.ndarray, end: int) -> Alarm | None:
        """The same of H_s [N, N]."""
        square = change_evidence.unexplained(product, self.directions.counts)
        self.squares = [*self.squares, math.log(max(square, 1e-9) / self.median)][-LASTING:]
        weighed = change_evidence.weight(self.evidence.alone(product)) * product
        self.latest = self.evidence.add(weighed)
        most = change_evidence.MOST_PARTS * change_evidence.PART
        self.ends = [*self.ends, end][-most:]
        statistic = self.alert.add(weighed).total if self.stands else self.latest.total
        change = statistic - self.thresholds.change
        other = self.lasting - self.thresholds.unexplained
        if max(change, other) > 0.0:
            return self._crossed(change > 0.0, statistic, end)
        self._calm()
        return None

    def _calm(self) -> None:
        if self.quiet is None:
            return
        self.quiet += 1
        if self.quiet > QUIET_SEGMENTS:  # it is over: what was, is no evidence of what comes
            self.quiet, self.named, self.ends = None, "", []
            self.evidence.restart()

    def _crossed(self, explained: bool, statistic: float, end: int) -> Alarm | None:
        stood, self.quiet = self.stands, 0
        self.alert.restart()
        suspects = self._suspects() if explained or self.named not in ("", UNKNOWN) else ()
        first = suspects[0].name if suspects else UNKNOWN
        if stood and not self._surer(first):
            return None
        self.named = first
        if not explained:
            statistic = self.lasting
        threshold = self.thresholds.change if explained else self.thresholds.unexplained
        return Alarm(end, statistic, threshold, suspects, not explained, stood)

    def _surer(self, first: str) -> bool:
        """Whether another suspect than was reported is more probable by enough."""
        if first in (self.named, UNKNOWN) or self.latest is None:
            return False
        before = self.latest.factors.get(self.named, 0.0)
        return self.latest.factors[first] - before > SURER

    def _suspects(self) -> tuple[Suspect, ...]:
        assert self.latest is not None
        found, seen = [], set()
        for label in self.latest.suspects:
            if (name := label.partition(":")[0]) in seen:
                continue
            seen.add(name)
            back = min(self.latest.began[label], len(self.ends))
            before = self.ends[-back - 1] if back < len(self.ends) else self.ends[0]
            found.append(Suspect(label, self.latest.factors[label], before))
        return tuple(found[:MOST_SUSPECTS])


def places(causes: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Label → places of its numbers among those of all causes, in order."""
    found, at = {}, 0
    for label, columns in causes.items():
        found[label] = np.arange(at, at + len(columns))
        at += len(columns)
    return found


def lasting_squares(logs: np.ndarray) -> np.ndarray:
    """The least log χ²_s/χ̃² of each LASTING segments in a row [S - LASTING + 1], of one voyage's
    [S]."""
    if len(logs) < LASTING:
        return np.zeros(0)
    return np.lib.stride_tricks.sliding_window_view(logs, LASTING).min(1)
