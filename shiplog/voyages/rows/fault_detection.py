"""Faults of one log's channels: found, marked and reported with their times; never repaired.

Each threshold follows from the instrument's stated accuracy or from how the channel itself
behaves, so that a coarse instrument is not called faulty for being coarse.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.channels import Quality
from shiplog.voyages.rows import moving
from shiplog.voyages.rows.resampling import STEP_NS

LISTED = 20  # stretches of one kind on one channel that are listed one by one; the rest is counted
FROZEN_S = 3.0  # a value held longer than this is stale, not data
REPORTED_HELD_S = 0.5
SAME_SPAN = 1e-9  # of the span of a channel: values nearer than that are one value
FEWEST_STEPS = 8  # different values that show in what steps an instrument counts
FEWEST_CHANGES = 3  # a value is come to, on the average, where fewer values than that are seen
LATTICE = 0.05  # of a step: how far a difference may be from a whole number of steps
NEXT = 7  # changes on one side of a run of repeats that show in what steps it counts there
MANY = 6.5  # steps: numbers so much larger are near whole multiples of anything
EXACT = 1e-3  # of a step: as near as numbers that were rounded to steps are to whole ones
EVEN, MOST_EVEN = 0.3, 0.8  # of a step, and of the samples: values that a motion spaces evenly
MOST_ON_LATTICE = 0.95  # share of the differences; by chance it would be a tenth
RARE_CHANCE = 1e-6  # chance below which a run of repeats is no accident of a coarse resolution
NEIGHBOURS = 12  # samples on either side of one that say how lively a channel is just then
QUIETER = 0.8  # of their steps: one spike in ten samples makes two large steps of ten
LOUDER = 5.0  # times that step: of normal noise one in 1e9 is so far off the median of five
OFTEN = 1.5  # times for which a value is usually written: a longer run lacks a value
LATE_S = 0.5  # s: a sensor's clock or filter may be so late against another's
SAME_TRAVEL = 0.25  # of a step by the rate: how far rates of different sensors may be apart


def stretches(mask: np.ndarray) -> Iterator[tuple[int, int]]:
    """(first, last) index of each run of True."""
    edge = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    yield from zip(edge[::2].tolist(), (edge[1::2] - 1).tolist(), strict=True)


def spikes(value: np.ndarray, noise: float) -> np.ndarray:
    """Samples far off the median of the five around them (Hampel, 1974), [n, k] → [n].

    A step leaves the median of five untouched, so a manoeuvre or a jump is no spike. What repeats
    counts once: a sample that a faster log wrote several times is one sample, and so is the rest
    before a manoeuvre. A spike stands out of its neighbourhood, too, and not of the whole record
    alone, of which a ship may lie still for most, or a wind blow evenly: it is farther off than
    LOUDER times the step that QUIETER of the steps around it keep below.

    noise: one standard deviation of a sample, its resolution included, in the unit of `value`
    """
    count = len(value)
    first = np.concatenate(([True], (np.diff(value, axis=0) != 0).any(axis=1)))[:count]
    once = np.flatnonzero(first)
    spike = _alone(value[once], noise)
    return spike[np.cumsum(first) - 1] if count else spike


def _alone(value: np.ndarray, noise: float) -> np.ndarray:
    """`spikes` of samples no two neighbours of which are the same."""
    if len(value) < 5:
        return np.zeros(len(value), bool)
    off = np.zeros(len(value))
    off[2:-2] = np.linalg.norm(value[2:-2] - _medians_of_five(value), axis=1)
    typical = 1.4826 * float(np.median(off[2:-2]))
    steps = np.linalg.norm(np.diff(value, axis=0), axis=1)
    step = float(np.median(steps))  # of a free-run motion
    spike = off > max(10.0 * typical, 10.0 * noise, 5.0 * step, 1e-9)
    at = np.flatnonzero(spike)
    spike[at] = off[at] > LOUDER * _usual_steps(steps, at)
    return spike


def _usual_steps(steps: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The step that QUIETER of those around each sample `at` keep below, without the sample's own.

    steps [n - 1] from each of n samples to the next; the two on either side are left out: a spike
    of two samples has them all.
    """
    around = np.concatenate((np.arange(-NEIGHBOURS, -2), np.arange(2, NEIGHBOURS)))
    rows = at[:, None] + around
    near = np.where((rows >= 0) & (rows < len(steps)), steps[rows.clip(0, len(steps) - 1)], np.nan)
    return np.nan_to_num(np.nanquantile(near, QUIETER, axis=1)) if len(at) else np.zeros(0)


def _medians_of_five(value: np.ndarray) -> np.ndarray:
    """Of each value [n, k] and the two before and after it [n - 4, k]: by comparisons alone, a
    tenth of the time and memory of sorting."""
    a, b, c, d, e = (value[i : len(value) - 4 + i] for i in range(5))
    lower = np.maximum(np.minimum(a, b), np.minimum(c, d))
    upper = np.minimum(np.maximum(a, b), np.maximum(c, d))
    return np.maximum(np.minimum(e, lower), np.minimum(np.maximum(e, lower), upper))


def repeats(value: np.ndarray) -> list[tuple[int, int]]:
    """Runs (first, last) of samples that all equal the one before them, [n, k].

    A log at a higher rate than the instrument's writes every value several times: a run no longer
    than OFTEN times the usual one is none.
    """
    if len(value) < 2:
        return []
    same = np.concatenate(([False], (np.diff(value, axis=0) == 0).all(axis=1)))
    changes = np.flatnonzero(~same)
    usual = float(np.median(np.diff(changes))) if len(changes) > 1 else 1.0
    least = 1 if usual < 2.0 else OFTEN * usual - 1.0
    return [(a, b) for a, b in stretches(same) if b - a + 1 > least or least == 1]


def resolution(value: np.ndarray) -> float:
    """The step in which an instrument counts, of values [n, k] the coarsest; 0 where none shows.

    An instrument counts in steps of q where nearly all differences between the values that it took
    are whole multiples of q. Of few different values the changes from one to another have to show
    that it is no slow motion past them.
    """
    found = 0.0
    for column in value.T:
        levels = np.sort(column)
        apart: np.ndarray = levels[1:] - levels[:-1]
        span = float(apart.sum())
        # what rounding of the arithmetic made is no difference
        apart = apart[apart > SAME_SPAN * span]
        if len(apart) < FEWEST_STEPS:  # it hardly moved
            changes = int((np.abs(np.diff(column)) > SAME_SPAN * span).sum())
            if len(apart) == 0 or changes < FEWEST_CHANGES * (len(apart) + 1):
                continue
        step = float(apart.min())
        step = float(np.median(apart[apart < 1.5 * step]))  # rounding averaged away
        off = np.abs(apart / step - np.round(apart / step))
        if np.mean(off < LATTICE) >= MOST_ON_LATTICE and not _even_motion(column, step):
            found = max(found, step)
    return found


def steps_around(value: np.ndarray, runs: list[tuple[int, int]]) -> np.ndarray:
    """The step in which an instrument counts about each run of repeats, 0 where none shows.

    Numbers of three digits count in 0.1 up to 100 and in 1 beyond. The changes of a value [n, k]
    that are next to a run are then whole multiples of one step; what a fault held changes by any
    amount before and after.
    """
    found = np.zeros(len(runs))
    first = np.array([a for a, _ in runs], np.int64)
    for column in value.T:
        changes = np.diff(column)
        at = np.flatnonzero(changes)
        if len(at) < NEXT:
            continue
        near = sliding_window_view(np.abs(changes[at]), NEXT)
        middle = np.searchsorted(at, first)
        for begin in (middle - NEXT, middle):
            run = np.flatnonzero((begin >= 0) & (begin < len(near)))
            size = near[begin[run]]
            step = size.min(axis=1, keepdims=True)
            whole = np.abs(size / step - np.round(size / step)) < LATTICE
            counts = (whole & (size < MANY * step)).all(axis=1)
            found[run[counts]] = np.maximum(found[run[counts]], step[counts, 0])
    return found


def _even_motion(column: np.ndarray, step: float) -> bool:
    """Whether values are a step apart since the ship went as far from each sample to the next."""
    gone = np.abs(np.diff(column)) / step
    exact = float(np.mean(np.abs(gone - np.round(gone)) < EXACT)) > MOST_ON_LATTICE
    others = float(np.mean(np.round(gone) != 1.0))
    if exact and others > 1.0 - MOST_ON_LATTICE:  # no motion is as even as that
        return False
    return float(np.mean(np.abs(gone - 1.0) < EVEN)) > MOST_EVEN


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
    least: float | np.ndarray,
    drift: float = 0.0,
) -> list[tuple[int, int]]:
    """Runs of repeats as grid rows, where the ship moved by more than the instrument would show.

    times [m] ns; sampled [n] ns; travel [m, k]: where the channel should be at each row,
    integrated from its rate (None: no rate is known, and the runs are taken as they are);
    least: the smallest change that is detected, in the channel's unit, or one of each run;
    drift: how fast a rate of zero may be said to move, in that unit per second.
    """
    kept = []
    shown = np.broadcast_to(least, len(runs))
    for (first, last), smallest in zip(runs, shown, strict=True):
        a = int(np.searchsorted(times, sampled[max(first - 1, 0)]))
        b = int(np.searchsorted(times, sampled[last], side="right")) - 1
        if b <= a or a >= len(times):
            continue
        if travel is not None:
            span = float(np.linalg.norm(np.ptp(travel[a : b + 1], axis=0)))
            if span <= smallest + drift * (b - a) * STEP_NS * 1e-9:
                continue
        kept.append((a, b))
    return kept


def steps(value: np.ndarray, noise: float, period: float) -> list[tuple[int, float]]:
    """Samples at which a channel steps to stay there, and by how much: what is left to look at
    where no rate is known. value [n], unwrapped; period: what a full turn is.

    The medians of three samples on either side differ, so that neither a spike nor noise is a step;
    the step itself, beyond those before and after it, is half of that, and stands out of the steps
    around it as a spike does.
    """
    if len(value) < 6:
        return []
    single = np.diff(value)
    single -= period * np.round(single / period)
    before = np.median(np.stack([value[i : len(value) - 5 + i] for i in range(3)]), axis=0)
    after = np.median(np.stack([value[i : len(value) - 5 + i] for i in range(3, 6)]), axis=0)
    apart = after - before
    apart = np.abs(apart - period * np.round(apart / period))
    usual = np.median(np.stack([single[i : len(single) - 4 + i] for i in (0, 1, 3, 4)]), axis=0)
    size = np.abs(single[2:-2] - usual)
    limit = max(12.0 * 1.4826 * float(np.median(np.abs(single))), 8.0 * noise)
    found = np.flatnonzero((size > limit) & (2.0 * apart > size) & (2.0 * size > apart))
    found = found[size[found] > LOUDER * _usual_steps(np.abs(single), found + 3)]
    return [(int(i) + 3, float(size[i])) for i in found]


def jumps(
    gone: np.ndarray,
    rate: np.ndarray,
    usable: np.ndarray,
    noise: float,
    every_rows: int = 1,
    period: float | None = None,
    lively: bool = False,
) -> list[tuple[int, float]]:
    """Rows whose step since the last usable row is not what the rate says, and by how much.

    gone [m, k]: the channel; rate [m, k]: its derivative; usable [m]: rows with a measured value,
    `every_rows` apart where none is missing; period: what a full turn is of a channel that turns.
    The step is compared over everything since the last usable row, so that a value held for a
    while and then caught up is no jump; over a gap the rate is interpolated, and half of that
    travel is allowed as error. lively: of a whole record, in which a ship may lie still for most,
    so that the typical error is none of its motion. Then SAME_TRAVEL of every step is allowed, and
    what the rate changes by within LATE_S, by which sensors may differ in time; and a jump stands
    out of the errors around it, as a spike does.
    """
    step = STEP_NS * 1e-9
    rows = np.flatnonzero(usable)
    if len(rows) < 20:
        return []
    beyond, gone_by, changed_by = (np.zeros((len(rows) - 1, gone.shape[1])) for _ in range(3))
    at, late = np.arange(len(gone)), 2 * round(LATE_S / step) + 1
    for i, column in enumerate(rate.T):
        known = np.interp(at, rows, column[rows])
        expected = np.zeros_like(known)
        np.cumsum(0.5 * (known[1:] + known[:-1]) * step, out=expected[1:])
        beyond[:, i] = np.diff(gone[rows, i] - expected[rows])
        gone_by[:, i] = np.diff(expected[rows])
        changed_by[:, i] = moving.spread(known, late)[rows[1:]]
    if period is not None:
        beyond -= period * np.round(beyond / period)
    error, travel = np.linalg.norm(beyond, axis=1), np.linalg.norm(gone_by, axis=1)
    limit = max(12.0 * 1.4826 * float(np.median(error)), 8.0 * noise)
    lag = np.linalg.norm(changed_by, axis=1) * np.diff(rows) * step
    usual = SAME_TRAVEL * travel + lag if lively else 0.0
    gap = np.where(np.diff(rows) > 1.5 * every_rows, 0.5 * travel, 0.0)
    found = np.flatnonzero(error > limit + np.maximum(gap, usual))
    if lively:
        found = found[error[found] > LOUDER * _usual_steps(error, found)]
    return [(int(rows[i + 1]), float(error[i])) for i in found]


def mark(quality: np.ndarray, intervals: list[tuple[int, int]], flag: Quality) -> None:
    """Set one flag on rows (first, last), in place."""
    for first, last in intervals:
        quality[first : last + 1] |= int(flag)
