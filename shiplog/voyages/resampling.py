"""Asynchronous topics onto one 10 Hz grid, by measurement time.

Every value between two samples is interpolated between them; where a sample is missing there is
no value: a stale reading is a gap and not data. Interpolating rather than holding matters: holding
an actuator shifts it by half a period, which a diagnosis later reads as a delay of the rudder.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RATE_HZ = 10.0
STEP_NS = 100_000_000
EXACT_NS = 1_000  # a sample this close to a grid time is that grid time's own
LEAST_TOLERANCE_S = 0.15
AROUND = 10  # samples on either side of a span that say whether a message is missing in it
MOST_PERIODS = 3.0  # a longer span is a gap whatever the samples around it say

# A stamp that is far from the others is another clock's: of a receiver before its first fix
# (1970, 1980), of a week counter that rolled over, or of a damaged byte.
STRAY_S = 60.0  # a silence that the recorder may not have heard; shorter ones cost 600 rows
STRAY_PERIODS = 10.0  # of the median: a report every three minutes is no silence
STRAY_SHARE = 0.01  # of the samples: as many across a shorter silence than a day are a voyage's
DAY_S = 86_400.0  # no voyage is silent for so long, whatever any clock says


@dataclass(frozen=True)
class Samples:
    """One source's samples in the order of their measurement.

    time    [n]     ns, strictly increasing
    value   [n, k]  SI, free of NaN, safe to interpolate (angles unwrapped or as components)
    spike   [n]     samples that are far off both neighbours
    whole   [n]     no message is missing before the next sample, however far off its stamp is
    blank   [m]     ns, times at which a message came without a usable value

    resolution  the step in which the instrument counts, SI (position in m); 0 where none shows
    noise       standard deviation of one sample, its resolution included, SI (position in m)
    elsewhere   how far off the farthest reading was of a stretch that was set aside as blank,
                since the sensor stood still where it cannot have been; 0 where there is none
    """

    time: np.ndarray
    value: np.ndarray
    spike: np.ndarray
    whole: np.ndarray
    blank: np.ndarray
    period_s: float
    tolerance_s: float
    resolution: float = 0.0
    noise: float = 0.0
    elsewhere: float = 0.0

    def nearest_rows(self, times: np.ndarray) -> np.ndarray:
        """Grid rows [m] bool that are the nearest to a sample; times [m] ns."""
        near = np.zeros(len(times), bool)
        inside = self.time[(self.time >= times[0]) & (self.time <= times[-1])]
        near[np.rint((inside - times[0]) / STEP_NS).astype(np.int64)] = True
        return near


@dataclass(frozen=True)
class OnGrid:
    """A source on the grid: value [m, k] (NaN where there is none) and masks [m]."""

    value: np.ndarray
    gap: np.ndarray
    blank: np.ndarray
    spike: np.ndarray


def strays(time: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Stamps [n] bool that cannot be of this voyage.

    time, other  [n] ns: by the clock that counts, and by the recorder's or the publisher's

    Silences of a minute and more cut the stamps into groups, and the largest is the voyage's. More
    than a day from it, none belongs. A nearer group of a few samples belongs where the other clock
    tells the same silence: a sensor that fell out and came back for a moment is data. So do a few
    stamps among the voyage's own that the other clock does not confirm.
    """
    count = len(time)
    stray = np.zeros(count, bool)
    if count < 2:
        return stray
    seconds = time * 1e-9  # floats: 0.3 us at most lost, and no step too long for an integer
    order = np.argsort(seconds, kind="stable")
    steps = np.diff(seconds[order])
    groups = np.split(
        order, np.flatnonzero(steps > max(STRAY_S, STRAY_PERIODS * np.median(steps))) + 1
    )
    main = int(np.argmax([len(group) for group in groups]))
    off = seconds - other * 1e-9
    off = np.abs(off - np.median(off[groups[main]])) > STRAY_S
    for side in (groups[main::-1], groups[main:]):
        apart, near = False, side[0]
        for group in side[1:]:
            gaps = (seconds[group].min() - seconds[near].max(),
                    seconds[near].min() - seconds[group].max())  # fmt: skip
            apart = apart or max(gaps) > DAY_S
            few = len(group) < STRAY_SHARE * count
            if apart or (few and off[group].all()):
                stray[group] = True
            else:
                near = group
    alone = off & ~stray
    if 0 < alone.sum() < STRAY_SHARE * count:
        stray |= alone
    return stray


def ordered(time: np.ndarray, value: np.ndarray, tolerance_s: float | None) -> Samples:
    """Sort by measurement time, set blank rows aside, drop repeated stamps (the first stays). A
    stamp is blank where each of its rows is: one may hold what another instrument measured.

    time [n] ns, value [n, k]; the tolerance is one and a half median periods unless given, and
    only a given one is kept to the letter.
    """
    order = np.argsort(time, kind="stable")
    time, value = time[order], value[order]
    finite = np.isfinite(value).all(axis=1)
    unmeasured, time, value = time[~finite], time[finite], value[finite]
    first = np.ones(len(time), bool)
    first[1:] = np.diff(time) > 0
    time, value = time[first], value[first]
    blank = np.setdiff1d(unmeasured, time)
    period = float(np.median(np.diff(time))) * 1e-9 if len(time) > 1 else 1.0 / RATE_HZ
    tolerance = tolerance_s or max(1.5 * period, LEAST_TOLERANCE_S)
    none = np.zeros(len(time), bool)
    whole = none if tolerance_s else _whole(time, period)
    return Samples(time, value, none, whole, blank, period, tolerance)


def _whole(time: np.ndarray, period_s: float) -> np.ndarray:
    """Spans [n] from each sample to the next in which no message is missing, jitter or not.

    A stamp that is off lengthens one span and shortens its neighbour; a lost message delays all
    that follow by a period. So it is the mean of the samples around that tells, not the span: of
    stamps that scatter by 0.03 s at 10 Hz, one span in eight is longer than 0.15 s.
    """
    count = len(time)
    if count < 2:
        return np.zeros(count, bool)
    at = np.arange(count)
    late = (time - time[0]) * 1e-9 - period_s * at  # against a clock that loses nothing
    total = np.concatenate(([0.0], np.cumsum(late)))
    first, last = (at + 1 - AROUND).clip(0), (at + 1 + AROUND).clip(max=count)
    before = (total[at + 1] - total[first]) / (at + 1 - first)
    after = (total[last] - total[at + 1]) / np.maximum(last - at - 1, 1)
    span = np.diff(time, append=time[-1]) * 1e-9
    return (after - before < 0.5 * period_s) & (span < MOST_PERIODS * period_s)


def grid(start: int, end: int) -> np.ndarray:
    """10 Hz times [m] ns from `start` on, anchored at the first sample of the base sensor."""
    return np.arange(start, end + 1, STEP_NS, dtype=np.int64)


def onto(times: np.ndarray, samples: Samples) -> OnGrid:
    """Interpolate between neighbouring samples no further apart than the tolerance, or than their
    stamps' jitter."""
    count, width = len(times), samples.value.shape[1]
    known = samples.time
    if len(known) == 0:
        empty = np.full((count, width), np.nan)
        return OnGrid(
            empty, np.ones(count, bool), _near(times, samples.blank), np.zeros(count, bool)
        )
    right = np.searchsorted(known, times, side="left").clip(0, len(known) - 1)
    left = (right - (known[right] > times)).clip(0)
    span = known[right] - known[left]
    exact_right = np.abs(known[right] - times) <= EXACT_NS
    exact_left = np.abs(known[left] - times) <= EXACT_NS
    inside = (known[left] <= times) & (times <= known[right])
    close = (span <= samples.tolerance_s * 1e9) | samples.whole[left]
    usable = (inside & close) | exact_left | exact_right
    share = np.where(span > 0, (times - known[left]) / np.maximum(span, 1), 0.0).clip(0.0, 1.0)
    share = np.where(exact_left, 0.0, np.where(exact_right, 1.0, share))
    value = samples.value[left] + share[:, None] * (samples.value[right] - samples.value[left])
    value[~usable] = np.nan
    spike = usable & (
        (samples.spike[left] & (share < 1.0)) | (samples.spike[right] & (share > 0.0))
    )
    blank = ~usable & _near(times, samples.blank)
    return OnGrid(value, ~usable & ~blank, blank, spike)


def _near(times: np.ndarray, marked: np.ndarray) -> np.ndarray:
    """Which grid times have a marked time within one step."""
    if len(marked) == 0:
        return np.zeros(len(times), bool)
    at = np.searchsorted(marked, times)
    before = np.abs(times - marked[(at - 1).clip(0)])
    after = np.abs(times - marked[at.clip(max=len(marked) - 1)])
    return np.minimum(before, after) <= STEP_NS
