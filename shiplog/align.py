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


@dataclass(frozen=True)
class Samples:
    """One source's samples in the order of their measurement.

    time    [n]     ns, strictly increasing
    value   [n, k]  SI, free of NaN, safe to interpolate (angles unwrapped or as components)
    spike   [n]     samples that are far off both neighbours
    blank   [m]     ns, times at which a message came without a usable value
    """

    time: np.ndarray
    value: np.ndarray
    spike: np.ndarray
    blank: np.ndarray
    period_s: float
    tolerance_s: float


@dataclass(frozen=True)
class OnGrid:
    """A source on the grid: value [m, k] (NaN where there is none) and masks [m]."""

    value: np.ndarray
    gap: np.ndarray
    blank: np.ndarray
    spike: np.ndarray


def ordered(time: np.ndarray, value: np.ndarray, tolerance_s: float | None) -> Samples:
    """Sort by measurement time, drop repeated stamps (the first stays), set blank ones aside.

    time [n] ns, value [n, k]; the tolerance is one and a half median periods unless given.
    """
    order = np.argsort(time, kind="stable")
    time, value = time[order], value[order]
    first = np.ones(len(time), bool)
    first[1:] = np.diff(time) > 0
    time, value = time[first], value[first]
    finite = np.isfinite(value).all(axis=1)
    blank, time, value = time[~finite], time[finite], value[finite]
    period = float(np.median(np.diff(time))) * 1e-9 if len(time) > 1 else 1.0 / RATE_HZ
    tolerance = tolerance_s or max(1.5 * period, LEAST_TOLERANCE_S)
    return Samples(time, value, np.zeros(len(time), bool), blank, period, tolerance)


def grid(start: int, end: int) -> np.ndarray:
    """10 Hz times [m] ns from `start` on, anchored at the first sample of the base sensor."""
    return np.arange(start, end + 1, STEP_NS, dtype=np.int64)


def onto(times: np.ndarray, samples: Samples) -> OnGrid:
    """Interpolate between neighbouring samples no further apart than the tolerance."""
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
    usable = (inside & (span <= samples.tolerance_s * 1e9)) | exact_left | exact_right
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
