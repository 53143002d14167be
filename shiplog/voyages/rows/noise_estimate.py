"""The noise of an instrument, estimated from what it recorded.

A profile states an instrument's accuracy as `sigma`. Where it does not, the record says how much
neighbouring samples scatter about a smooth motion. The k-th difference of samples y at equal
steps is, of white noise of standard deviation σ about a polynomial of degree k - 1,

    Δᵏy = Σⱼ (-1)ʲ C(k, j) y[i - j],   var Δᵏy = C(2k, k) σ²,

and of a motion of frequency f sampled at fₛ, (2 sin πf/fₛ)ᵏ times its amplitude: each further
difference takes away more of the motion and as much of the noise as the one before. So σ is the
least of

    1.4826 med |Δᵏy| / √C(2k, k),   k = 2 ... 5

with the median instead of the mean square, so that gusts, spikes and jumps do not count (von
Neumann et al., 1941, for k = 1; Gasser, Sroka and Jennen-Steinmetz, 1986, for k = 2; Hampel,
1974, for the median). Where an instrument stood still, at rest or by a fault, its differences are
0 and say nothing: they are left out. An instrument that counts in steps of q adds q/√12.

A filter in the instrument leaves little white noise: σ is then less than its accuracy. What
measures a rate is not taken to be finer than FINEST of what it measures, whatever a filter left.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from statistics import NormalDist

import numpy as np

from shiplog.logs.health.health_report import Instrument
from shiplog.nomenclature import units
from shiplog.ship_profile.profile import FINEST as SMALLEST
from shiplog.ship_profile.profile import Profile

ORDERS = (2, 3, 4, 5)  # of the differences; beyond five the samples are no neighbours any more
FEWEST = 20  # differences of which a median is taken
TO_SIGMA = 1.4826  # standard deviation of a normal distribution over its median absolute value
WHOLE_PERIODS = 1.5  # a longer step is a gap, and no difference is taken across it
RARE = 0.05  # share of the changes that come sooner than an instrument's own period
FINEST = 1e-3  # of the 95 % quantile of a rate: a log's or gyro's scale is hardly known better
NORMAL = NormalDist()  # Φ; of the standard library, since scipy takes half a second to load
DIGITS = 2  # of an estimate: a median of some hundred differences is good to some per cent


def sigma(
    time: np.ndarray, value: np.ndarray, resolution: float = 0.0, rate: bool = False
) -> float:
    """Standard deviation of one sample, in the unit of `value`, the noisiest column's.

    time [n] ns, increasing; value [n, k]; resolution: the step in which the instrument counts;
    rate: whether it measures a velocity or a rate of turn, whose size says what it can resolve.
    Of less than FEWEST differences it is that of the resolution alone, 0 where that is unknown.
    """
    own = own_samples(value)
    columns = value[own].T
    noise = max((_white(time[own], one, resolution, rate) for one in columns), default=0.0)
    return max(noise, resolution / math.sqrt(12.0))


def own_samples(value: np.ndarray) -> np.ndarray:
    """Indices [m] of the samples that the instrument took itself, of the rows [n, k] of a log.

    A log at a higher rate repeats an instrument's value until the next one. The instrument's own
    period is then the least number of rows from one change to the next, but for RARE of them. A
    value that stays for longer counts once a period.
    """
    count = len(value)
    if count < 2:
        return np.arange(count)
    changed = np.flatnonzero((np.diff(value, axis=0) != 0).any(axis=1)) + 1
    if len(changed) < FEWEST:
        return np.arange(count)
    period = int(np.quantile(np.diff(changed), RARE))
    if period < 2:
        return np.arange(count)
    since = np.arange(count) - np.maximum.accumulate(
        np.where(np.isin(np.arange(count), changed), np.arange(count), 0)
    )
    return np.flatnonzero(since % period == 0)


def _white(time: np.ndarray, value: np.ndarray, resolution: float, rate: bool) -> float:
    """σ of the white noise about a smooth motion, [n]; 0 where there is too little to tell."""
    steps = np.diff(time)
    if len(steps) < FEWEST:
        return 0.0
    broken = (steps > WHOLE_PERIODS * np.median(steps)).astype(np.int64)
    moved = (np.diff(value) != 0).astype(np.int64)
    found = []
    for order in ORDERS:
        window = np.ones(order, np.int64)
        whole = np.convolve(broken, window, "valid") == 0
        alive = np.convolve(moved, window, "valid") > 0
        differences = np.abs(np.diff(value, n=order))[whole & alive]
        if len(differences) >= FEWEST:
            scale = math.sqrt(math.comb(2 * order, order))
            found.append(_deviation(differences, resolution) / scale)
    finest = FINEST * float(np.quantile(np.abs(value), 0.95)) if rate else 0.0
    return max(min(found, default=0.0), finest)


def _deviation(size: np.ndarray, resolution: float) -> float:
    """Standard deviation of normal numbers of these sizes [n], by their median.

    The median of what is counted in steps of q is a whole number of steps. There it is the share F
    of the sizes up to the half step above the median, (m + ½) q, that says it: (m + ½) q =
    σ Φ⁻¹(½ + ½ F).
    """
    median = float(np.median(size))
    if resolution == 0.0:
        return TO_SIGMA * median
    edge = (round(median / resolution) + 0.5) * resolution
    share = min(float(np.mean(size < edge)), 1.0 - 0.5 / len(size))
    return edge / NORMAL.inv_cdf(0.5 + 0.5 * share)


def completed(profile: Profile, instruments: Iterable[Instrument]) -> Profile:
    """A profile with the accuracies that `ingest` estimated where it states none: of several
    voyages the median."""
    found: dict[str, list[float]] = {}
    for one in instruments:
        if one.sigma > 0.0 and one.unit in units.TO_SI:
            found.setdefault(one.channel, []).append(one.sigma * units.factor(one.unit))
    known = {}
    for name, sensor in profile.sensors.items():
        if sensor.sigma is None and name in found:
            scale = 1.0 if name == "position" else abs(sensor.scale()[0][1])
            sigma = max(rounded(float(np.median(found[name])) / scale), SMALLEST)
            known[name] = sensor.model_copy(update={"sigma": sigma})
    return profile.model_copy(update={"sensors": profile.sensors.model_copy(update=known)})


def rounded(value: float) -> float:
    """An estimate with the digits that it has."""
    return float(f"{value:.{DIGITS}g}")
