"""The UTC in NMEA sentences: which day a time of day belongs to, and which of several clocks count.

A date that jumps back and forth is of two clocks. Times that follow each other are one *track*;
tracks that overlap in the file are clocks side by side, of which the steadiest with most sentences
is the log's. A track that stands still is a placeholder, one that keeps a distance is a receiver of
its own: an old one counts weeks up to 1024 and begins again (IS-GPS-200, 20.3.3.3.1.1).
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from shiplog.logs.conversion.clock import DAY_NS
from shiplog.nomenclature.units import SECOND_NS, YEAR_2000_NS

BACK_NS = 2 * SECOND_NS  # a late sentence of the same clock
AHEAD_NS = 60 * SECOND_NS  # a longer silence ends a track
NEAR_NS = 3600 * SECOND_NS  # from a fix: the clock of a receiver that has lost it still runs
SAME_NS = 2 * SECOND_NS  # times of day that are one, whatever the dates say
ROLLOVER_DAYS = 1024 * 7
MOST_TRACKS = 8  # that are looked at for the next time: noise makes many
STILL = 3  # sentences with one and the same time, and none with another: no clock
OTHER_SHARE = 0.05  # of the log's sentences with UTC: another clock with fewer is a stray


@dataclass(slots=True)
class Times:
    """The sentences with a UTC, in the order of the file."""

    place: array = field(default_factory=partial(array, "q"))  # which sentence of the file
    of_day: array = field(default_factory=partial(array, "q"))  # ns
    day: array = field(default_factory=partial(array, "q"))  # since 1970; -1 without a date
    trusted: array = field(default_factory=partial(array, "b"))  # the receiver has a fix
    sender: array = field(default_factory=partial(array, "i"))


@dataclass(frozen=True, slots=True)
class OtherClock:
    """A clock next to the log's own."""

    senders: tuple[int, ...]
    ahead_ns: int  # of the log's clock
    days: int  # of them, if only the date is wrong; it was put right
    count: int
    still: bool = False  # it does not run


@dataclass(frozen=True, slots=True)
class Resolved:
    """UTC of every sentence that has one.

    utc    [n] ns since 1970; -1 where it is believed in no way
    track  [n] which clock it is by; 0 is the log's
    still  [n] whether it is by a clock that stands still
    """

    place: np.ndarray
    utc: np.ndarray
    track: np.ndarray
    still: np.ndarray
    sender: np.ndarray
    of_day: np.ndarray  # [n] ns, as it stands in the sentence
    given: np.ndarray  # [n] whether the sentence has a date
    dated: bool
    others: tuple[OtherClock, ...]


def resolve(times: Times, received: np.ndarray) -> Resolved:
    """The UTC of each sentence.

    received  [m] ns, receive stamps by the place of a sentence; -1 without one
    """
    place = np.array(times.place, np.int64)
    of_day = np.array(times.of_day, np.int64)
    day = np.array(times.day, np.int64)
    trusted = np.array(times.trusted, bool)
    sender = np.array(times.sender, np.int64)
    dated = np.flatnonzero(trusted & (day >= 0))
    track = np.zeros(len(place), np.int64)
    still = np.zeros(len(place), bool)
    believed = trusted.copy()
    full = np.where(day >= 0, day * DAY_NS + of_day, -1)
    others: list[OtherClock] = []
    if len(dated):
        chosen = _tracks(full[dated])
        own, foreign = _chain(chosen, place[dated], full[dated], received)
        clock = dated[np.isin(chosen, own)]
        for number in foreign:
            at = dated[chosen == number]
            other = _other(full[at], place[at], full[clock], place[clock], sender[at])
            runs = not other.still and len(at) >= OTHER_SHARE * len(clock)
            track[at] = number + 1
            if other.days or not runs:  # its time of day may be right
                day[at] = -1
            if other.still or (not runs and not other.days):
                believed[at] = False
                still[at] = other.still
            if runs or (other.still and other.count >= STILL):
                others.append(other)
    own_day = believed & (day >= 0) & (track == 0)
    utc = _days(of_day, full, believed, own_day)
    _reject_jumps(utc, place, believed, track)
    _take_untrusted(utc, of_day, trusted, track)
    given = np.array(times.day, np.int64) >= 0
    dates = bool(own_day.any())
    return Resolved(place, utc, track, still, sender, of_day, given, dates, tuple(others))


def _tracks(utc: np.ndarray) -> np.ndarray:
    """Which track each time [n] ns belongs to: the one that it follows most closely."""
    last: list[int] = []
    recent: list[int] = []
    chosen = []
    for now in utc.tolist():
        best, least = -1, AHEAD_NS + 1
        for number in recent:
            step = now - last[number]
            if -BACK_NS <= step <= AHEAD_NS and abs(step) < least:
                best, least = number, abs(step)
        if best < 0:
            best = len(last)
            last.append(now)
            recent.append(best)
            if len(recent) > MOST_TRACKS:
                recent.pop(0)
        elif recent[-1] != best:
            recent.remove(best)
            recent.append(best)
        last[best] = max(last[best], now)
        chosen.append(best)
    return np.array(chosen, np.int64)


def _chain(
    chosen: np.ndarray, place: np.ndarray, utc: np.ndarray, received: np.ndarray
) -> tuple[list[int], list[int]]:
    """The tracks that follow each other as the log's clock, and those beside it."""
    count = np.bincount(chosen)
    first = np.full(len(count), np.iinfo(np.int64).max)
    last = np.zeros(len(count), np.int64)
    np.minimum.at(first, chosen, place)
    np.maximum.at(last, chosen, place)
    runs = np.array([n < STILL or np.ptp(utc[chosen == k]) > 0 for k, n in enumerate(count)])

    def rank(number: int) -> tuple:
        at = chosen == number
        stamped = received[place[at]]
        stamped_well = stamped >= YEAR_2000_NS
        off = 0.0
        if stamped_well.any():  # the recorder's date tells clocks apart that differ by years
            off = round(abs(np.median((stamped - utc[at])[stamped_well])) / (30 * DAY_NS))
        size = int(np.log2(count[number]))  # clocks of like rates: the later date is right
        return not runs[number], off, -size, -int(utc[at][0])

    own: list[int] = []
    foreign: list[int] = []
    for number in sorted(range(len(count)), key=rank):
        beside = any(first[number] <= last[k] and first[k] <= last[number] for k in own)
        (foreign if beside or (own and not runs[number]) else own).append(number)
    return own, foreign


def _other(
    utc: np.ndarray, place: np.ndarray, clock: np.ndarray, at: np.ndarray, sender: np.ndarray
) -> OtherClock:
    """What a track of `utc` [n] at `place` [n] is against the log's clock [m] at `at` [m]."""
    before = (np.searchsorted(at, place, side="right") - 1).clip(0)
    ahead = utc - clock[before]
    days = np.rint(ahead / DAY_NS)
    median = int(np.median(ahead))
    same = np.mean(np.abs(ahead - days * DAY_NS) <= SAME_NS) > 0.8
    steady = np.mean(np.abs(ahead - median) <= SAME_NS) > 0.8
    senders = tuple(sorted(set(sender.tolist())))
    only_date = int(np.median(days)) if same and steady else 0
    return OtherClock(senders, median, only_date, len(utc), not steady)


def _days(
    of_day: np.ndarray, full: np.ndarray, believed: np.ndarray, own: np.ndarray
) -> np.ndarray:
    """UTC [n] ns: the dated ones as they are, the others on the day that is nearest to the last.

    Without any date, days count from 1970-01-01."""
    utc = np.where(own, full, -1)
    dated = np.flatnonzero(own)
    start = int(dated[0]) if len(dated) else 0
    times, done = of_day.tolist(), utc.tolist()
    take = believed.tolist()
    last = done[start] if len(dated) else None
    for i in range(start, len(times)):
        if not take[i]:
            continue
        if done[i] < 0:
            done[i] = times[i] if last is None else _nearest(times[i], last)
        last = done[i]
    last = done[start] if len(dated) else None
    for i in range(start - 1, -1, -1):
        if take[i] and last is not None:
            done[i] = last = _nearest(times[i], last)
    return np.array(done, np.int64)


def _nearest(of_day: int, last: int) -> int:
    """The time [ns] with this time of day that is nearest to the last one."""
    day, before = divmod(last, DAY_NS)
    day += (of_day < before - DAY_NS // 2) - (of_day > before + DAY_NS // 2)
    return max(day, 0) * DAY_NS + of_day


def _reject_jumps(
    utc: np.ndarray, place: np.ndarray, believed: np.ndarray, track: np.ndarray
) -> None:
    """Single times of day, in place, that no clock runs through: damaged, or before a fix."""
    at = np.flatnonzero(believed & (utc >= 0))
    if len(at) < 2 * STILL:
        return
    chosen = _tracks(utc[at])
    own, foreign = _chain(chosen, place[at], utc[at], np.full(int(place.max()) + 1, -1))
    count = np.bincount(chosen)
    most = count[own].sum()
    for number in foreign:
        if count[number] < OTHER_SHARE * most or count[number] < STILL:
            utc[at[chosen == number]] = -1
        else:
            fresh = at[chosen == number]
            track[fresh[track[fresh] == 0]] = 1000 + number  # a clock without dates


def _take_untrusted(
    utc: np.ndarray, of_day: np.ndarray, trusted: np.ndarray, track: np.ndarray
) -> None:
    """The clock of a receiver without a fix, in place, where it runs on from one with a fix."""
    sure = np.flatnonzero(trusted & (utc >= 0) & (track == 0))
    if not len(sure):
        return
    for i in np.flatnonzero(~trusted).tolist():
        right = int(np.searchsorted(sure, i))
        low = int(utc[sure[right - 1]]) if right else None
        high = int(utc[sure[right]]) if right < len(sure) else None
        now = _nearest(int(of_day[i]), low if low is not None else int(high or 0))
        after = low is None or now - low >= -BACK_NS
        before = high is None or now - high <= BACK_NS
        near = low is not None and high is not None
        near = near or abs(now - (low if low is not None else int(high or 0))) <= NEAR_NS
        if after and before and near:
            utc[i] = now


def kept(times: Times, keep: np.ndarray) -> Times:
    """Only the sentences of `keep` [n]."""
    return Times(*(
        array(one.typecode, np.array(one)[keep].tolist())
        for one in (times.place, times.of_day, times.day, times.trusted, times.sender)
    ))  # fmt: skip
