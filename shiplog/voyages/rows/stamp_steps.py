"""In what steps a channel's stamps count, and how often its samples come.

UTC in whole seconds of samples that come every 1.136 s steps by 1, 1, 1, 1, 1, 1, 2 s. No message
is missing in the two seconds, and the period is neither of the two. With q the step of the stamps
and p the period, two stamps are up to p + q apart.
"""

from __future__ import annotations

import numpy as np

from shiplog.logs.conversion import bursts

FEWEST = 20  # steps that show a pattern
LOOKED_AT = 2_000  # steps, of which the number of values is looked at first
SAME_NS = 2_000  # stamps of day numbers in doubles are rounded to 0.6 us
MOST_VALUES = (
    4  # different steps that a period has in stamps that count in coarse ones; 2 are usual
)
LONG = 1.5  # times the median step: a step in which a message may be missing
COVERED = 0.97  # of the steps are among them: the others are messages lost, and pauses
WITHIN = 2.5  # steps of the stamps: between the shortest and the longest; one, or two with jitter
RARE = 0.002  # of the steps: a value that is rarer is no part of the pattern
FEWEST_RARE = 5  # of the rarer value, so that their distances can be compared
EVEN = 2.0  # 90 % point over 10 % point of the distances between the rarer steps: they come evenly;
# of messages lost by chance it is 22, as the exponential distribution has it
COARSE = 0.05  # of the period: finer steps are no more than jitter


def period_and_step(time: np.ndarray, blank: np.ndarray | None = None) -> tuple[float, float]:
    """Period and step of the stamps [s] of samples at strictly increasing times [n] ns: 0, 0 where
    there are less than two, and a step of 0 where the stamps are fine.

    The period is the median time between samples; the mean, where the stamps are coarse. Between
    two samples with a `blank` message [m] ns between them no stamp is coarse: a value is missing.
    """
    if len(time) < 2:
        return 0.0, 0.0
    steps = np.diff(time)
    median = float(np.median(steps)) * 1e-9
    if blank is not None and len(blank):
        steps = steps[np.searchsorted(blank, time[:-1]) == np.searchsorted(blank, time[1:])]
    coarse = _coarse(steps)
    if not coarse:
        return median, 0.0
    return bursts.period_ns(time) * 1e-9, coarse * 1e-9


def goes_on(time: np.ndarray, value: np.ndarray) -> bool:
    """Whether values [n, k] change by more over the long steps of their stamps [n] ns than over the
    steps on either side: then as much time has gone by as the stamps say, and a message is missing.
    Of coarse stamps every sample comes one period after the last, whatever its stamp says.
    """
    steps = np.diff(time)
    typical = float(np.median(steps))
    long = steps > LONG * typical
    at = np.flatnonzero(long[1:-1] & ~long[:-2] & ~long[2:]) + 1
    change = np.linalg.norm(np.diff(value, axis=0), axis=1)
    neighbouring = 0.5 * (change[at - 1] + change[at + 1])
    at, neighbouring = at[neighbouring > 0.0], neighbouring[neighbouring > 0.0]
    if len(at) == 0:
        return False
    times = float(np.median(steps[at])) / typical
    return float(np.median(change[at] / neighbouring)) > 0.5 * (1.0 + times)


def _coarse(steps: np.ndarray) -> float:
    """The step [ns] in which stamps count that lie `steps` [n] ns apart; 0 where they are fine."""
    if len(steps) < FEWEST:
        return 0.0
    few = np.unique(steps[:: max(len(steps) // LOOKED_AT, 1)] // SAME_NS)
    if len(few) > 4 * MOST_VALUES:  # stamps that jitter
        return 0.0
    ordered = np.sort(steps)
    begins = np.concatenate(([True], np.diff(ordered) > SAME_NS))
    first = np.flatnonzero(begins)
    counts = np.diff(np.append(first, len(ordered)))
    often = counts >= max(RARE * len(steps), FEWEST_RARE)
    if not 2 <= often.sum() <= MOST_VALUES or counts[often].sum() < COVERED * len(steps):
        return 0.0
    values, counts = ordered[first[often]], counts[often]
    unit = float(min(values[0], np.diff(values).min()))
    off = np.abs(values / unit - np.rint(values / unit)) * unit
    if unit < COARSE * np.median(steps) or (off > SAME_NS).any():
        return 0.0
    if values[-1] - values[0] > WITHIN * unit:  # messages are missing in the longer ones
        return 0.0
    rarer = np.flatnonzero(np.abs(steps - values[np.argmax(counts)]) > SAME_NS)
    low, high = np.quantile(np.diff(rarer), (0.1, 0.9))
    return unit if high <= EVEN * low + 1.0 else 0.0
