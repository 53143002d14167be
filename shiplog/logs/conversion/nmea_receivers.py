"""Two receivers under one name are two, one receiver under two names is one.

Two receivers that share a talker send fixes about each other: merged, each fix lies off the line
between its neighbours by the distance of the antennas; taken apart, it does not. A talker that
changes (GP, then GN, as a receiver finds other satellites), or that a multiplexer gets wrong now
and then, fills the silences of the other and nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from shiplog.nomenclature.units import SECOND_NS

METRES_A_DEGREE = 111_320.0
APART_M = 2.0  # antennas that are nearer are one in what follows
GAIN = (
    4.0  # how much smoother two tracks are than one: a ship that turns is rougher at half the rate
)
SHARE = 0.1  # of the fixes: a second receiver has as many
LEAST = 20  # fixes, that a rhythm shows in
WITHIN = 0.8  # share of the fixes that say how rough a track is
REPEATED = 0.2  # share of fixes that repeat the one before: a receiver slower than its output
FILLS = 0.6  # periods from the nearest sample of the other: a sample in its silence
MOST_FILL = 0.9  # share of the samples that do so


@dataclass(slots=True)
class Epochs:
    """The fixes of one talker: one of each time that it sends."""

    begin: np.ndarray  # [n] place of the first sentence
    of_day: np.ndarray  # [n] ns
    utc: np.ndarray  # [n] ns, -1 where it is not believed
    track: np.ndarray  # [n] which clock
    where: np.ndarray  # [n, 2] deg
    form: np.ndarray  # [n] how the sentence is written: its fields and their digits


def label(epochs: Epochs) -> np.ndarray | None:
    """Which receiver [n] each epoch is of, 0 the one with most; None where there is only one."""
    if len(epochs.begin) < LEAST:
        return None
    clocks = _classes(epochs.track, 3)
    if clocks is not None and _alternate(clocks):
        return _by_size(clocks)
    known = np.asarray(np.isfinite(epochs.where).all(axis=1), bool)
    if known.sum() < LEAST:
        return None
    metres = epochs.where[known] * METRES_A_DEGREE
    metres[:, 1] *= np.cos(np.radians(np.median(epochs.where[known, 0])))
    metres -= metres[0]
    if np.mean((np.diff(metres, axis=0) == 0).all(axis=1)) > REPEATED:
        return None
    time = _ordinal(epochs.utc[known])
    merged = _roughness(metres, time)
    best: tuple[float, np.ndarray] | None = None
    for labels in _labellings(epochs, metres, time, known, merged):
        part = labels[known]
        if not _alternate(part) or min(np.bincount(part)) < SHARE * len(part):
            continue
        apart = max(_roughness(metres[part == k], time[part == k]) for k in np.unique(part))
        gain = merged / max(apart, 1e-3)
        if gain > GAIN and _distance(metres, time, part) > APART_M:
            best = (gain, labels) if best is None or gain > best[0] else best
    return None if best is None else _by_size(best[1])


def _labellings(
    epochs: Epochs, metres: np.ndarray, time: np.ndarray, known: np.ndarray, merged: float
) -> Iterator[np.ndarray]:
    """Ways in which the epochs [n] may be of several receivers."""
    form = _classes(epochs.form, 3)
    if form is not None:
        yield form
    fraction = _classes(np.rint(epochs.of_day % SECOND_NS / 1e6).astype(np.int64), 3)
    if fraction is not None:
        yield fraction
    _, first = np.unique(epochs.of_day, return_index=True)
    again = np.ones(len(epochs.of_day), np.int64)  # of one time of day, the second that comes
    again[first] = 0
    if again.any():
        yield again
    yield np.arange(len(epochs.of_day)) % 2
    if merged > 0.25 * APART_M:
        near = np.zeros(len(epochs.of_day), np.int64)
        near[known] = _two_tracks(metres, time)
        yield near


def _two_tracks(metres: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Which of two tracks [n] each fix continues: a new one begins where a fix is off the first."""
    tracks: list[tuple[float, np.ndarray, np.ndarray]] = []  # time, place and velocity
    labels = []
    for now, here in zip(time.tolist(), metres, strict=True):
        off = [float(np.hypot(*(p + v * (now - t) - here))) for t, p, v in tracks]
        best = int(np.argmin(off)) if off else 0
        if not tracks or (len(tracks) < 2 and off[best] > APART_M):
            best = len(tracks)
            tracks.append((now, here, tracks[0][2] if tracks else np.zeros(2)))
        t, p, v = tracks[best]
        if now > t:
            v = 0.5 * v + 0.5 * (here - p) / (now - t)
        tracks[best] = now, here, v
        labels.append(best)
    return np.array(labels, np.int64)


def _classes(values: np.ndarray, most: int) -> np.ndarray | None:
    """Small whole numbers [n] for the different values; None for one, or for many."""
    _, labels, counts = np.unique(values, return_inverse=True, return_counts=True)
    large = counts >= SHARE * len(values)
    if not 2 <= large.sum() <= most:
        return None
    number = np.where(large, np.cumsum(large) - 1, 0)
    return number[labels]


def _alternate(labels: np.ndarray) -> bool:
    """Whether the labels come about each other, not one after the other."""
    least = int(np.bincount(labels).min())
    return bool(least) and int((np.diff(labels) != 0).sum()) >= least


def _by_size(labels: np.ndarray) -> np.ndarray:
    """The same, 0 the most frequent; of two alike the first."""
    kinds, first, counts = np.unique(labels, return_index=True, return_counts=True)
    like = counts >= 0.9 * counts.max()  # which of two alike begins is chance
    order = sorted(
        range(len(kinds)), key=lambda k: (not like[k], first[k] if like[k] else 0, -counts[k])
    )
    rank = np.zeros(int(kinds.max()) + 1, np.int64)
    for new, k in enumerate(order):
        rank[kinds[k]] = new
    return rank[labels]


def _ordinal(utc: np.ndarray) -> np.ndarray:
    """Seconds [n] for interpolation; the order where the times do not run."""
    seconds = (utc - utc[0]) * 1e-9
    return (
        seconds if (utc >= 0).all() and (np.diff(seconds) >= 0).all() else np.arange(len(utc)) * 1.0
    )


def _roughness(metres: np.ndarray, time: np.ndarray) -> float:
    """Distance [m] of a fix from the line between its neighbours, that 80 % are within: of a
    second receiver with a tenth of the fixes three in ten are beyond."""
    if len(metres) < 3:
        return 0.0
    span = time[2:] - time[:-2]
    share = np.where(span > 0, (time[1:-1] - time[:-2]) / np.where(span > 0, span, 1.0), 0.5)
    line = metres[:-2] + share[:, None] * (metres[2:] - metres[:-2])
    return float(np.quantile(np.linalg.norm(metres[1:-1] - line, axis=1), WITHIN))


def _distance(metres: np.ndarray, time: np.ndarray, labels: np.ndarray) -> float:
    """Median distance [m] of the others' fixes from the track of label 0."""
    one, other = labels == 0, labels != 0
    order = np.argsort(time[one], kind="stable")
    track = [np.interp(time[other], time[one][order], metres[one][order, k]) for k in (0, 1)]
    return float(np.median(np.hypot(*(metres[other].T - np.array(track)))))


def disagree(one: Epochs, other: Epochs) -> float:
    """Median distance [m] of two kinds of sentences at one time of day; 0 where few share it."""
    _, a, b = np.intersect1d(one.of_day, other.of_day, return_indices=True)
    if len(a) < LEAST:
        return 0.0
    north, east = ((one.where[a] - other.where[b]) * METRES_A_DEGREE).T
    east = east * np.cos(np.radians(one.where[a, 0]))
    apart = np.hypot(north, east)
    return float(np.median(apart[np.isfinite(apart)])) if np.isfinite(apart).any() else 0.0


def fills(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether the times [m] of one talker only fill the silences of another's [n], both ns."""
    few, many = sorted((np.sort(one), np.sort(other)), key=len)
    if not len(few):
        return True
    if len(many) < 2:
        return bool(abs(int(many[0]) - int(few[0])) > 0)
    steps = np.diff(many)
    period = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    right = np.searchsorted(many, few).clip(0, len(many) - 1)
    near = np.minimum(np.abs(many[right] - few), np.abs(few - many[(right - 1).clip(0)]))
    return bool(np.mean(near >= FILLS * period) >= MOST_FILL)


def as_one(times: Iterable[tuple[int, np.ndarray]]) -> list[list[int]]:
    """Senders in groups of one instrument each, by the times [n] ns at which they send."""
    groups: list[tuple[list[int], np.ndarray]] = []
    for sender, at in sorted(times, key=lambda item: -len(item[1])):
        for k, (members, before) in enumerate(groups):
            if fills(at, before):
                groups[k] = ([*members, sender], np.sort(np.concatenate((before, at))))
                break
        else:
            groups.append(([sender], at))
    return [members for members, _ in groups]
