"""Faults of one log's channels: found, marked and reported with their times; never repaired.

Each threshold follows from the instrument's stated accuracy or from how the channel itself
behaves, so that a coarse instrument is not called faulty for being coarse.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shiplog.channels import Quality
from shiplog.logs.health_report import Finding
from shiplog.voyages.resampling import STEP_NS

LISTED = 20  # stretches of one kind on one channel that are listed one by one; the rest is counted
FROZEN_S = 3.0  # a value held longer than this is stale, not data
REPORTED_HELD_S = 0.5
SAME_SPAN = 1e-9  # of the span of a channel: values nearer than that are one value
FEWEST_STEPS = 8  # different values that show in what steps an instrument counts
LATTICE = 0.05  # of a step: how far a difference may be from a whole number of steps
MOST_ON_LATTICE = 0.95  # share of the differences; by chance it would be a tenth
RARE_CHANCE = 1e-6  # chance below which a run of repeats is no accident of a coarse resolution


def stretches(mask: np.ndarray) -> Iterator[tuple[int, int]]:
    """(first, last) index of each run of True."""
    edge = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    yield from zip(edge[::2].tolist(), (edge[1::2] - 1).tolist(), strict=True)


def spikes(value: np.ndarray, sigma: float) -> np.ndarray:
    """Samples far off the median of the five around them (Hampel, 1974), [n, k] → [n].

    A step leaves the median of five untouched, so a manoeuvre or a jump is no spike.
    """
    if len(value) < 5:
        return np.zeros(len(value), bool)
    off = np.zeros(len(value))
    off[2:-2] = np.linalg.norm(value[2:-2] - _medians_of_five(value), axis=1)
    typical = 1.4826 * float(np.median(off[2:-2]))
    step = float(np.median(np.linalg.norm(np.diff(value, axis=0), axis=1)))  # of a free-run motion
    return off > max(10.0 * typical, 10.0 * sigma, 5.0 * step, 1e-9)


def _medians_of_five(value: np.ndarray) -> np.ndarray:
    """Of each value [n, k] and the two before and after it [n - 4, k]: by comparisons alone, a
    tenth of the time and memory of sorting."""
    a, b, c, d, e = (value[i : len(value) - 4 + i] for i in range(5))
    lower = np.maximum(np.minimum(a, b), np.minimum(c, d))
    upper = np.minimum(np.maximum(a, b), np.maximum(c, d))
    return np.maximum(np.minimum(e, lower), np.minimum(np.maximum(e, lower), upper))


def repeats(value: np.ndarray) -> list[tuple[int, int]]:
    """Runs (first, last) of samples that all equal the one before them, [n, k]."""
    if len(value) < 2:
        return []
    same = np.concatenate(([False], (np.diff(value, axis=0) == 0).all(axis=1)))
    return list(stretches(same))


def resolution(value: np.ndarray) -> float:
    """The step in which an instrument counts, of values [n, k] the coarsest; 0 where none shows.

    An instrument counts in steps of q where nearly all differences between the values that it took
    are whole multiples of q.
    """
    found = 0.0
    for column in value.T:
        levels = np.sort(column)
        apart: np.ndarray = levels[1:] - levels[:-1]
        span = float(apart.sum())
        # what rounding of the arithmetic made is no difference
        apart = apart[apart > SAME_SPAN * span]
        if len(apart) < FEWEST_STEPS:  # it hardly moved
            continue
        step = float(apart.min())
        step = float(np.median(apart[apart < 1.5 * step]))  # rounding averaged away
        off = np.abs(apart / step - np.round(apart / step))
        if np.mean(off < LATTICE) >= MOST_ON_LATTICE:
            found = max(found, step)
    return found


def improbable(runs: list[tuple[int, int]], count: int) -> list[tuple[int, int]]:
    """Of runs of repeats, those too long to be the resolution's doing.

    Were repeats an accident of share f, a run of n would come by with chance f^n.
    """
    repeated = sum(last - first + 1 for first, last in runs)
    if count == 0 or repeated == 0 or repeated > 0.5 * count:
        return []
    share = repeated / count
    return [
        (a, b) for a, b in runs if (b - a + 1) * np.log(share) < np.log(RARE_CHANCE) and b - a >= 2
    ]


def findings_of(
    kind: str, channel: str, intervals: list[tuple[float, float]], what: str
) -> list[Finding]:
    """One finding a stretch, longest first kept, in order of time; the rest as one count."""
    longest = sorted(intervals, key=lambda i: i[0] - i[1])[:LISTED]
    findings = [
        Finding(
            kind,
            channel,
            f"{channel} {what} for {end - start:.1f} s from {start:.1f} s.",
            start_s=round(start, 3),
            end_s=round(end, 3),
            value=round(end - start, 3),
            unit="s",
        )
        for start, end in sorted(longest)
    ]
    left = len(intervals) - len(longest)
    if left:
        total = sum(b - a for a, b in intervals) - sum(b - a for a, b in longest)
        findings.append(
            Finding(
                kind,
                channel,
                f"{channel} {what} in {left} more stretches, {total:.1f} s in all.",
                value=round(total, 3),
                unit="s",
            )
        )
    return findings


def seconds(indices: tuple[int, int]) -> tuple[float, float]:
    """Grid rows (first, last) as seconds from the first row, the last row's step included."""
    step = STEP_NS * 1e-9
    return indices[0] * step, (indices[1] + 1) * step


def held_on_grid(
    times: np.ndarray,
    sampled: np.ndarray,
    runs: list[tuple[int, int]],
    travel: np.ndarray | None,
    least: float,
    drift: float = 0.0,
) -> list[tuple[int, int]]:
    """Runs of repeats as grid rows, where the ship moved by more than the instrument would show.

    times [m] ns; sampled [n] ns; travel [m, k]: where the channel should be at each row,
    integrated from its rate (None: no rate is known, and the runs are taken as they are);
    least: the smallest change that is detected, in the channel's unit; drift: how fast a rate of
    zero may be said to move, in that unit per second.
    """
    kept = []
    for first, last in runs:
        a = int(np.searchsorted(times, sampled[max(first - 1, 0)]))
        b = int(np.searchsorted(times, sampled[last], side="right")) - 1
        if b <= a or a >= len(times):
            continue
        if travel is not None:
            span = float(np.linalg.norm(np.ptp(travel[a : b + 1], axis=0)))
            if span <= least + drift * (b - a) * STEP_NS * 1e-9:
                continue
        kept.append((a, b))
    return kept


def jumps(
    gone: np.ndarray, rate: np.ndarray, usable: np.ndarray, noise: float, every_rows: int = 1
) -> list[tuple[int, float]]:
    """Rows whose step since the last usable row is not what the rate says, and by how much.

    gone [m, k]: the channel; rate [m, k]: its derivative; usable [m]: rows with a measured value,
    `every_rows` apart where none is missing. The step is compared over everything since the last
    usable row, so that a value held for a while and then caught up is no jump; over a gap the rate
    is interpolated, and half of that travel is allowed as error.
    """
    step = STEP_NS * 1e-9
    rows = np.flatnonzero(usable)
    if len(rows) < 20:
        return []
    at = np.arange(len(gone))
    known = np.stack([np.interp(at, rows, column[rows]) for column in rate.T], axis=1)
    expected = np.zeros_like(known)
    np.cumsum(0.5 * (known[1:] + known[:-1]) * step, axis=0, out=expected[1:])
    error = np.linalg.norm(np.diff(gone[rows] - expected[rows], axis=0), axis=1)
    travel = np.linalg.norm(np.diff(expected[rows], axis=0), axis=1)
    limit = max(12.0 * 1.4826 * float(np.median(error)), 8.0 * noise)
    limits = limit + np.where(np.diff(rows) > 1.5 * every_rows, 0.5 * travel, 0.0)
    return [(int(rows[i + 1]), float(error[i])) for i in np.flatnonzero(error > limits)]


def mark(quality: np.ndarray, intervals: list[tuple[int, int]], flag: Quality) -> None:
    """Set one flag on rows (first, last), in place."""
    for first, last in intervals:
        quality[first : last + 1] |= int(flag)
