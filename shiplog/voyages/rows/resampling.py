"""Asynchronous topics onto one 10 Hz grid, by measurement time.

Every value between two samples is interpolated between them; where a sample is missing there is
no value: a stale reading is a gap and not data. Interpolating rather than holding matters: holding
an actuator shifts it by half a period, which a diagnosis later reads as a delay of the rudder.
What is sent only when it changes is another thing: an order holds until the next one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shiplog.logs.conversion import bursts
from shiplog.voyages.rows import stamp_steps

RATE_HZ = 10.0
STEP_NS = 100_000_000
EXACT_NS = 1_000  # a sample this close to a grid time is that grid time's own
LEAST_TOLERANCE_S = 0.15
AROUND = 10  # samples on either side of a span that say whether a message is missing in it
MOST_PERIODS = 3.0  # a longer span is a gap whatever the samples around it say
LONGEST_S = 5.0  # between samples of a motion: a helm order is given and met within it
GRAVITY = 9.81  # m/s²
SLOW_FROUDE = 0.2  # of a ship in harbour; at that speed it goes its own length in sqrt(L/g) / 0.2

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

    hold        each value holds until the next sample
    longest_s   s, the longest time between samples that this ship's motion can bear
    step_s      s, in which the stamps count, where that is coarse against the period; else 0
    resolution  the step in which the instrument counts, SI (position in m); 0 where none shows
    burst       what was spread of samples that bore one stamp
    dropped     samples that are not used, since another one has their stamp; of them `foreign` are
                another instrument's
    taken_for_order  its samples show that it is sent when it changes
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
    hold: bool = False
    longest_s: float = math.inf
    step_s: float = 0.0
    burst: bursts.Spread | None = None
    dropped: int = 0
    foreign: int = 0
    taken_for_order: bool = False

    @property
    def sparse(self) -> bool:
        """Its samples are further apart than anything is interpolated over."""
        far = self.taken_for_order or self.period_s > self.tolerance_s
        return not self.hold and len(self.time) > 1 and far

    @property
    def unsure_s(self) -> float:
        """s, by how much the time of a sample can be off, by what its stamps show."""
        return max(self.step_s, self.burst.unsure_s if self.burst else 0.0)

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


def longest_s(length_m: float) -> float:
    """The longest time between two samples [s] of which a straight line says what the ship did:
    the time in which it goes its own length, L / U = sqrt(L / g) / Fn at Fn = 0.2, and 5 s at
    least. A ship of 10 m has 5 s, one of 330 m 29 s."""
    return max(LONGEST_S, math.sqrt(length_m / GRAVITY) / SLOW_FROUDE)


def ordered(
    time: np.ndarray,
    value: np.ndarray,
    tolerance_s: float | None,
    hold: bool = False,
    longest: float = math.inf,
) -> Samples:
    """Sort by measurement time and set blank rows aside. A stamp is blank where each of its rows
    is: one may hold what another instrument measured. Several samples of one stamp are spread over
    the time since the stamp before, as `bursts` has it; what then still shares a time is dropped,
    and counted.

    time [n] ns in the order of arrival, value [n, k]; the tolerance is one and a half periods
    unless given, and a step of the stamps more where they count in coarse ones, but never more
    than `longest` [s]. Only a given one is kept to the letter; of what holds, it is the longest
    time that a value does.
    """
    finite = np.isfinite(value).all(axis=1)
    unmeasured, time, value = np.sort(time[~finite]), time[finite], value[finite]
    blank = unmeasured[np.diff(unmeasured, prepend=-1) > 0] if len(unmeasured) else unmeasured
    blank = blank[~np.isin(blank, time)] if len(blank) else blank
    spread = bursts.spread(time, value)
    order = np.argsort(spread.time, kind="stable")
    time, value = spread.time[order], value[order]
    own = ~(spread.again | spread.foreign)[order]
    own[1:] &= np.diff(time) > 0
    dropped = len(time) - int(own.sum()) - int(spread.again.sum())
    time, value = time[own], value[own]
    period, step = stamp_steps.period_and_step(time, blank)
    if step and stamp_steps.goes_on(time, value):
        period, step = float(np.median(np.diff(time))) * 1e-9, 0.0
    period = period or 1.0 / RATE_HZ
    tolerance = tolerance_s or max(1.5 * period, LEAST_TOLERANCE_S, period + step)
    if tolerance_s is None:
        tolerance = math.inf if hold else min(tolerance, max(longest, LEAST_TOLERANCE_S))
    none = np.zeros(len(time), bool)
    whole = none if tolerance_s or hold else _whole(time, period) & (
        np.diff(time, append=time[-1:]) * 1e-9 <= longest
    )  # fmt: skip
    return Samples(
        time, value, none, whole, blank, period, tolerance, hold=hold, longest_s=longest,
        step_s=step, burst=spread if spread.bursts else None, dropped=dropped,
        foreign=int(spread.foreign.sum()),
    )  # fmt: skip


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


def interpolate_samples(times: np.ndarray, samples: Samples) -> OnGrid:
    """Interpolate between neighbouring samples no further apart than the tolerance, or than their
    stamps' jitter."""
    count, width = len(times), samples.value.shape[1]
    known = samples.time
    if len(known) == 0:
        empty = np.full((count, width), np.nan)
        return OnGrid(
            empty, np.ones(count, bool), _mark_near(times, samples.blank), np.zeros(count, bool)
        )
    if samples.hold:
        return _hold(times, samples)
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
    blank = ~usable & (_mark_near(times, samples.blank) | _next_to_blank(times, samples))
    return OnGrid(value, ~usable & ~blank, blank, spike)


def _next_to_blank(times: np.ndarray, samples: Samples) -> np.ndarray:
    """Which grid times [m] lie between two messages no further apart than the tolerance, of which
    one has no value: nothing was lost there, it was not measured."""
    if len(samples.blank) == 0:
        return np.zeros(len(times), bool)
    came = np.concatenate((samples.time, samples.blank))
    order = np.argsort(came, kind="stable")
    none, came = order >= len(samples.time), came[order]
    right = np.searchsorted(came, times, side="left").clip(1, len(came) - 1)
    left = right - 1
    inside = (came[left] <= times) & (times <= came[right])
    close = (came[right] - came[left]) * 1e-9 <= samples.tolerance_s
    return inside & close & (none[left] | none[right])


def _hold(times: np.ndarray, samples: Samples) -> OnGrid:
    """The value of the last sample before each time, until the next one, or a blank, or the
    tolerance is over. Before the first sample there is none."""
    at = np.searchsorted(samples.time, times + EXACT_NS, side="right") - 1
    last = samples.time[at.clip(0)]
    usable = (at >= 0) & ((times - last) * 1e-9 <= samples.tolerance_s)
    blanked = np.zeros(len(times), bool)
    if len(samples.blank):
        no = np.searchsorted(samples.blank, times + EXACT_NS, side="right") - 1
        blanked = (no >= 0) & (samples.blank[no.clip(0)] > last)
    value = samples.value[at.clip(0)].copy()
    value[~usable | blanked] = np.nan
    return OnGrid(value, ~usable & ~blanked, blanked, np.zeros(len(times), bool))


def _mark_near(times: np.ndarray, marked: np.ndarray) -> np.ndarray:
    """Which grid times have a marked time within one step."""
    if len(marked) == 0:
        return np.zeros(len(times), bool)
    at = np.searchsorted(marked, times)
    before = np.abs(times - marked[(at - 1).clip(0)])
    after = np.abs(times - marked[at.clip(max=len(marked) - 1)])
    return np.minimum(before, after) <= STEP_NS
