"""Samples that were stamped when they were handed over: several under one stamp, spread again.

An operating system hands over a serial buffer every half second, a radio a packet every second. All
samples of it then bear one stamp, or stamps some milliseconds apart. The instrument measured them
evenly. With T_k the stamp of burst k, which has m samples, sample j = 1..m of it was measured at

    t_kj = T_(k-1) + (T_k - T_(k-1)) j / m,

over the time since the burst before, and the last one at the stamp. What remains uncertain is how
long the last sample waited: up to one such step, (T_k - T_(k-1)) / m.

Stamps in whole seconds are another thing: a clock that was cut off. Sample j of second T was then
measured at T + (j - 1) / m s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.nomenclature.units import SECOND_NS

AROUND = 100  # steps over which a period is averaged: more than a burst has, and than pauses are
TOGETHER = 0.25  # of the mean period: stamps that are nearer to each other are of one burst,
TOGETHER_NS = SECOND_NS // 20  # and no further apart than a computer needs to hand over the next
BURSTY_SHARE = 0.4  # of the steps: so many are within bursts where bursts are the rule (1/2 of two)
EVEN = (
    1.5  # bursts come every so often: 90 % point over 10 % point of their times and of their size
)
LATE_BURST = 2.5  # median times between bursts: after a longer silence the buffer was not filling
DIFFERING = 0.1  # of how often the value changes between bursts: if it never does within one, the
# samples of a burst are one sample that came several times
ZIGZAG = 4.0  # times the change from burst to burst: the samples of a burst are of two instruments
# Steps of clocks that are cut off; 0.864 s is a day number of five decimals, in doubles to 0.6 us.
CUT_NS = (
    60 * SECOND_NS, 10 * SECOND_NS, SECOND_NS, 864_000_000, SECOND_NS // 10, SECOND_NS // 100,
)  # fmt: skip
ROUNDED_NS = 2_000


@dataclass(frozen=True)
class Spread:
    """Times of samples once the bursts among them are spread.

    time     [n]  ns, in the order in which the stamps were given
    again    [n]  samples that came before with the same stamp and value: they are no others
    foreign  [n]  samples of another instrument under one name: of each stamp, all but the first
    moved         samples whose time is another than their stamp
    bursts        stamps, or groups of stamps, that bore several samples
    each_s        s, time from one burst to the next, in the median
    unsure_s      s, by how much a time can still be off; 0 where nothing was moved
    cut_s         s, the step in which the stamps count where they were cut off, else 0
    """

    time: np.ndarray
    again: np.ndarray
    foreign: np.ndarray
    moved: int = 0
    bursts: int = 0
    each_s: float = 0.0
    unsure_s: float = 0.0
    cut_s: float = 0.0


def spread(stamps: np.ndarray, values: np.ndarray | None = None) -> Spread:
    """One channel's samples, those under one stamp spread over the time since the stamp before.

    stamps  [n] ns, in the order in which the samples were recorded
    values  [n] or [n, k]: tells several samples of a burst from one sample that came again, and
            from those of two instruments; without them, all are taken for samples of their own

    Stamps some milliseconds apart are spread only where such bursts are the rule and come evenly:
    an order that is given ten times in a second and then not for a minute is no burst.
    """
    stamps = np.asarray(stamps, np.int64)
    none = np.zeros(len(stamps), bool)
    if len(stamps) < 3:
        return Spread(stamps, none, none)
    order = np.argsort(stamps, kind="stable")
    time = stamps[order]
    if len(time) and not _may_be_bursty(time):
        return Spread(stamps, none, none)
    value = None if values is None else np.asarray(values, float).reshape(len(time), -1)[order]
    again, foreign = none.copy(), none.copy()
    same = np.concatenate(([False], np.diff(time) == 0))
    if value is not None and same.any():
        again[order], foreign[order] = _not_of_their_own(same, value)
    keep = ~(again | foreign)[order]
    made = time.copy()
    made[keep], facts = _spread(time[keep])
    if not keep.all():  # what is no sample of its own goes with the one before
        made = made[np.maximum.accumulate(np.where(keep, np.arange(len(time)), 0))]
    out = np.empty_like(stamps)
    out[order] = made
    return Spread(out, again, foreign, **facts)


def period_ns(time: np.ndarray) -> float:
    """Mean time between samples [ns] of sorted stamps [n], whatever bursts they come in: the median
    over `AROUND` steps, so that pauses do not count."""
    around = min(AROUND, max(len(time) // 3, 1), len(time) - 1)
    return float(np.median(time[around:] - time[:-around])) / around if around > 0 else 0.0


def _may_be_bursty(time: np.ndarray) -> bool:
    step = np.diff(time)
    return bool((step == 0).any()) or _in_bursts(step, period_ns(time)).mean() >= BURSTY_SHARE


def _in_bursts(step: np.ndarray, period: float) -> np.ndarray:
    return step < min(TOGETHER * period, TOGETHER_NS)


def _not_of_their_own(same: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of sorted samples [n], those that came again and those of a second instrument.

    same  [n] the stamp is that of the sample before
    """
    change = np.concatenate(([0.0], np.nan_to_num(np.linalg.norm(np.diff(value, axis=0), axis=1))))
    after = ~same
    after[0] = False
    none = np.zeros(len(same), bool)
    equal = same & (change == 0.0)
    inner = float((change[same] > 0).mean())
    outer = float((change[after] > 0).mean()) if after.any() else 0.0
    begins = np.flatnonzero(~same)
    if inner > 0 and same.mean() > DIFFERING and len(begins) > 2:
        first = value[begins]
        between = np.linalg.norm(np.diff(first, axis=0), axis=1)
        typical = float(np.nanmedian(between))
        if float(np.nanmedian(change[same])) > ZIGZAG * typical > 0.0:
            return equal, same & ~equal
    rule = same.mean() > DIFFERING and inner >= DIFFERING * outer
    return (none if rule else equal), none


def _spread(time: np.ndarray) -> tuple[np.ndarray, dict]:
    """Sorted stamps [n] spread, and the facts of a `Spread`."""
    step = np.diff(time)
    begins = np.concatenate(([True], step > 0))
    together = _in_bursts(step, period_ns(time))
    if together.mean() >= BURSTY_SHARE and len(time) > 2:
        wide = np.concatenate(([True], ~together))
        if _come_evenly(time, wide):
            begins = wide
    first = np.flatnonzero(begins)
    many = np.diff(np.append(first, len(time)))
    if (many == 1).all() or len(many) < 2:
        return time, {}
    end = time[first + many - 1]
    each = float(np.median(np.diff(end)))
    typical = each / float(np.median(many))
    since = np.diff(end, prepend=end[0] - np.int64(round(typical * many[0])))
    cut = _cut(time, each) if (many > 1).mean() >= 0.5 else 0
    if cut:
        made, late = _over_their_second(time, first, many, cut)
    else:
        per = np.where(since > LATE_BURST * each, np.minimum(since / many, typical), since / many)
        back = np.repeat(many, many) - 1 - (np.arange(len(time)) - np.repeat(first, many))
        made = np.repeat(end, many) - np.rint(back * np.repeat(per, many)).astype(np.int64)
        alone = np.repeat(many == 1, many)
        made[alone] = time[alone]
        late = float(np.median(per[many > 1]))
    return made, {
        "moved": int((made != time).sum()), "bursts": int((many > 1).sum()),
        "each_s": each / SECOND_NS, "unsure_s": late / SECOND_NS, "cut_s": cut / SECOND_NS,
    }  # fmt: skip


def _come_evenly(time: np.ndarray, begins: np.ndarray) -> bool:
    """Whether bursts that begin there come at even times, with as many samples each."""
    first = np.flatnonzero(begins)
    if len(first) < 3:
        return False
    each, many = (
        np.quantile(sizes, (0.1, 0.9)) for sizes in (np.diff(time[first]), np.diff(first))
    )
    return each[1] <= EVEN * each[0] and many[1] <= EVEN * many[0] + 1  # one sample may go over


def _cut(time: np.ndarray, each: float) -> int:
    """The step [ns] in which stamps count that were cut off, if it is their time apart; else 0."""
    for step in CUT_NS:
        on_step = (time + ROUNDED_NS) % step <= 2 * ROUNDED_NS
        if abs(each - step) < 1e-3 * step and on_step.all():
            return step
    return 0


def _over_their_second(
    time: np.ndarray, first: np.ndarray, many: np.ndarray, cut: int
) -> tuple[np.ndarray, float]:
    """Samples over the step that their stamps name; of an incomplete first one, over its end."""
    usual = float(np.median(many))
    per = np.where(many >= usual, cut / many, cut / usual)
    place = np.arange(len(time)) - np.repeat(first, many)
    begin = time.copy()
    if many[0] < usual:
        begin[: many[0]] += np.int64(round(cut - per[0] * many[0]))
    made = begin + np.rint(place * np.repeat(per, many)).astype(np.int64)
    return made, float(np.median(per))
