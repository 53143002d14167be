"""Faults of one sensor's samples before they are put on the grid: what its own record shows.

First what the instrument can resolve and how much it scatters, then what is beyond that.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from shiplog.ship_profile.profile import Sensors
from shiplog.voyages.rows import fault_detection, noise_estimate
from shiplog.voyages.rows.resampling import STEP_NS, Samples

RATES = ("velocity", "yaw_rate", "wind")  # sensors of a rate: see `noise_estimate`
POLAR = ("sog_cog", "from_bow")  # kinds that count in a speed and in an angle
FASTEST = 100.0  # m/s: no ship moves so fast; a position that does has lost its fix
LONGER = 1.5  # times the rows in which a value is usually written: it stood still
FAST_SHARE = 0.9  # of the speeds: what a course's resolution is taken at


def judge(
    samples: Samples, metric: np.ndarray, raw: np.ndarray, sensors: Sensors, name: str
) -> Samples:
    """Samples with their resolution, their noise, their spikes, and without what is no reading.

    metric [n, k]: the samples' values in SI, a position in m; raw [r, k]: as the instrument gave
    them, in SI, NaN where it gave none. A stated `sigma` or `resolution` counts before an estimate.
    """
    resolution, aside = _resolution(metric, raw, sensors, name)
    noise = sensors.noise(name)
    if noise == 0.0:
        noise = noise_estimate.sigma(samples.time, metric, resolution, name in RATES)
    noise = math.hypot(noise, resolution / math.sqrt(12.0), aside / math.sqrt(12.0))
    samples = replace(samples, resolution=resolution, noise=noise)
    spike = fault_detection.spikes(metric, noise)
    lost = _lost(samples.time, metric, spike)
    if name == "position" and len(metric) > 1:
        lost += [one for one in _elsewhere(samples.time, metric) if one not in lost]
    return _blank(replace(samples, spike=spike), metric, lost)


def _resolution(
    metric: np.ndarray, raw: np.ndarray, sensors: Sensors, name: str
) -> tuple[float, float]:
    """The step of an instrument, and that across it which the step of its angle makes, SI."""
    sensor, kind = getattr(sensors, name), sensors.kind(name)
    stated = sensor.resolution
    if stated is not None and name != "position":
        stated *= abs(sensor.scale()[0][1])
    if kind not in POLAR:
        return (fault_detection.resolution(metric) if stated is None else stated), 0.0
    known = raw[np.isfinite(raw).all(axis=1)]
    if len(known) == 0:
        return stated or 0.0, 0.0
    speed = fault_detection.resolution(known[:, :1]) if stated is None else stated
    turned = fault_detection.resolution(known[:, 1:])
    return speed, turned * float(np.quantile(np.abs(known[:, 0]), FAST_SHARE))


def _lost(time: np.ndarray, metric: np.ndarray, spike: np.ndarray) -> list[tuple[int, int]]:
    """Stretches (first, last) in which a sensor stood still where it cannot have been, for no
    longer than FROZEN_S. What stood still for longer is compared with the other sensors, and is
    taken out of `spike`, in place.

    A receiver that has lost its fix repeats one position, often 0 N 0 E; a compass that starts
    again one heading. Such a stretch stands out like a spike.
    """
    same = _same(metric)
    usual = len(same) / max(int((~same).sum()), 1)  # rows in which a value is written
    found = []
    for first, last in fault_detection.stretches(spike & (same | np.append(same[1:], False))):
        if last - first + 1 <= LONGER * usual:
            continue
        if time[last] - time[first] <= fault_detection.FROZEN_S * 1e9:
            found.append((first, last))
        else:
            spike[first : last + 1] = False
    return found


def _same(metric: np.ndarray) -> np.ndarray:
    """Samples [n] bool that repeat the one before them."""
    return np.concatenate(([False], (np.diff(metric, axis=0) == 0).all(axis=1)))[: len(metric)]


def _elsewhere(time: np.ndarray, metric: np.ndarray) -> list[tuple[int, int]]:
    """Stretches of one repeated position between steps that no ship can make, also at the ends of
    a record: a receiver before its first fix."""
    same, step = _same(metric), np.linalg.norm(np.diff(metric, axis=0), axis=1)
    torn = step > FASTEST * np.maximum(np.diff(time) * 1e-9, 1.0)
    if not torn.any():
        return []
    edges = [0, *(np.flatnonzero(torn) + 1).tolist(), len(metric)]
    parts = list(pairwise(edges))
    longest = max(b - a for a, b in parts)
    return [(a, b - 1) for a, b in parts if 1 < b - a < longest and same[a + 1 : b].all()]


def _blank(samples: Samples, metric: np.ndarray, lost: list[tuple[int, int]]) -> Samples:
    """Without those stretches, whose times become blank from the sample before to the one after."""
    away = np.zeros(len(samples.time), bool)
    for first, last in lost:
        away[first : last + 1] = True
    keep = ~away
    if not lost or keep.sum() < 2:
        return samples
    usual = np.stack([np.interp(np.flatnonzero(away), np.flatnonzero(keep), column[keep])
                      for column in metric.T], axis=1)  # fmt: skip
    farthest = float(np.linalg.norm(metric[away] - usual, axis=1).max())
    period = round(samples.period_s * 1e9)
    blank = [
        np.arange(samples.time[first] - period + 1, samples.time[last] + period, STEP_NS)
        for first, last in lost
    ]
    return replace(
        samples,
        time=samples.time[keep],
        value=samples.value[keep],
        spike=samples.spike[keep],
        whole=_broken(samples.whole, away)[keep],
        blank=np.union1d(samples.blank, np.concatenate(blank)),
        elsewhere=farthest,
    )


def _broken(whole: np.ndarray, away: np.ndarray) -> np.ndarray:
    """Spans from each sample to the next that still lack no message once some are taken out."""
    return whole & ~np.append(away[1:], False)


def differentiated(heading: Samples) -> Samples:
    """The yaw rate [rad/s] at the heading's own samples, of those alone that are no spikes, and
    not across a step; rows between them hold no more."""
    sound = np.flatnonzero(~heading.spike)
    if len(sound) < 2:
        sound = np.arange(len(heading.time))
    time, value = heading.time[sound] * 1e-9, heading.value[sound, 0]
    steps = fault_detection.steps(value, heading.noise, 2.0 * np.pi)
    rate = np.zeros(len(sound))
    edges = [0, *(at for at, _ in steps), len(sound)]
    for first, end in pairwise(edges):
        if end - first > 1:
            rate[first:end] = np.gradient(value[first:end], time[first:end])
    every = np.interp(heading.time * 1e-9, time, rate)
    return replace(heading, value=every[:, None])
