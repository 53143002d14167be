"""When each sentence was measured: by its own UTC, else by its receive stamp, else by its place.

A recorder stamps what it received, r = t + latency + offset of its clock. A sentence with UTC
gives r - UTC. Latency is never negative and seldom above a second, so what is more than that, or
less than nothing, or changes in a step or steadily, is the recorder's clock, and is taken out of
the other sentences' stamps. What may be latency is not.

An operating system hands over its buffer in bursts: several sentences of one instrument bear one
stamp. They were sent since the burst before. Different sentences of one burst are of one epoch,
that of the UTC among them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from shiplog.logs.conversion.clock import DAY_NS
from shiplog.logs.conversion.nmea_utc import ROLLOVER_DAYS, Resolved
from shiplog.logs.health.faults import LATEST_S
from shiplog.nomenclature.units import SECOND_NS, YEAR_2000_NS

LATENCY_NS = int(LATEST_S * SECOND_NS)  # the most that is taken for a receiver's
SMALL_NS = SECOND_NS // 2  # most receivers are faster
EARLY_NS = -SECOND_NS // 10  # a stamp so much before its own UTC is still jitter
STEP_NS = SECOND_NS // 4  # of the recorder's clock, that is told from jitter of the latency
DRIFT_NS = SECOND_NS // 4  # over the log: a clock that nothing sets
ZONE_NS = 900 * SECOND_NS  # offsets of time zones are whole quarters of an hour
AROUND = 5  # UTC times on either side that say whether the clock was set between them
NEAR, SHOWN = 50, 0.7  # lines around in which a clock that is set shows so much of its step
LASTS = 10  # UTC times: so many at least before and after a receiver becomes slower
SMOOTHED = 31  # of them, for a clock that drifts
BITS_PER_S, BITS_A_CHARACTER = 115_200, 10  # the fastest serial line; what is faster was buffered
QUANTA_NS = (SECOND_NS, SECOND_NS // 10)  # steps in which coarse stamps count
RIDES = 0.8  # share of the bursts with a UTC that hold a sentence which belongs to that epoch
SHARED = 0.2  # share of an instrument's sentences that bear another one's stamp, of a buffer
STRAY_NS = 5 * SECOND_NS  # a stamp further from both lines around it
LONGEST = 1.5  # times the usual span of a burst: what is longer is a pause


@dataclass(slots=True)
class Recorder:
    """What was found out of the receive stamps."""

    latency_ns: int | None = None  # of the GNSS receiver; None where it is not known
    offsets: list[tuple[int, int]] = field(default_factory=list)  # (ns it begins, ns ahead)
    drift_ns: int = 0
    weeks: int = 0  # that the receiver's date is back
    shared: int = 0  # sentences in a burst of one instrument, where a buffer made bursts
    burst_ns: int = 0  # the time from one to the next
    days: int = 0  # of stamps without a date: what was added


@dataclass(frozen=True, slots=True)
class Clock:
    """Times of all sentences.

    utc       [n] ns, the sentence's own; -1 without
    received  [n] ns, as stamped, days made good; -1 without
    """

    utc: np.ndarray
    received: np.ndarray
    at: np.ndarray  # [m] places of the reference receiver's UTC times
    known: np.ndarray  # [m] ns
    corrected: np.ndarray  # [n] ns, receive stamps spread and without the clock's offset
    late: np.ndarray  # [n] ns, stamp minus UTC, of the UTC times around
    burst: np.ndarray  # [n] which burst a sentence came in
    spread: np.ndarray  # [n] ns, receive stamps spread over their bursts
    recorder: Recorder

    def times(self, place: np.ndarray) -> np.ndarray:
        """Times [k] ns of one instrument's sentences at `place` [k]; -1 where nothing says any."""
        own = self.utc[place]
        stamped = self.received[place] >= 0
        if stamped.any() and len(self.known) and self._rides(place):
            by_stamp = self._epochs(place)
        else:
            by_stamp = self.corrected[place]
        return np.where(own >= 0, own, np.where(stamped, by_stamp, self._spread_times(place)))

    def _rides(self, place: np.ndarray) -> bool:
        """Whether an instrument's sentences come in the bursts that hold a UTC."""
        bursts = self.burst[self.at]
        return bool(len(bursts)) and np.isin(bursts, self.burst[place]).mean() >= RIDES

    def _epochs(self, place: np.ndarray) -> np.ndarray:
        """Times of sentences that belong to the epoch of the UTC in their burst."""
        of_burst = np.searchsorted(self.burst[self.at], self.burst[place]).clip(0, len(self.at) - 1)
        shared = self.burst[self.at[of_burst]] == self.burst[place]
        alone = np.concatenate(([True], np.diff(self.burst[place]) > 0))
        alone &= np.concatenate((np.diff(self.burst[place]) > 0, [True]))
        by_late = self.spread[place] - self.late[place]
        return np.where(shared & alone, self.known[of_burst], by_late)

    def _spread_times(self, place: np.ndarray) -> np.ndarray:
        """Times [k] ns: spread evenly over the time from the UTC before them to the next. -1 before
        the first UTC."""
        if not len(self.known):
            return np.full(len(place), -1, np.int64)
        before = np.searchsorted(self.at, place, side="right") - 1
        period = int(np.median(np.diff(self.known))) if len(self.known) > 1 else 0
        step = np.diff(self.known, append=self.known[-1] + period)
        first = np.searchsorted(before, before, side="left")  # `before` only grows
        many = np.searchsorted(before, before, side="right") - first
        spread = self.known[before] + step[before] * (np.arange(len(place)) - first) // many
        return np.where(before >= 0, spread, -1)


def clock_of(
    resolved: Resolved,
    received: np.ndarray,
    length: np.ndarray,
    instruments: list[np.ndarray],
    dateless: bool,
) -> Clock:
    """The times of a file's sentences.

    received     [n] ns, -1 without
    length       [n] characters
    instruments  places of each instrument's sentences
    dateless     the stamps have no date
    """
    recorder = Recorder()
    utc = np.full(len(received), -1, np.int64)
    known = resolved.utc >= 0
    utc[resolved.place[known]] = resolved.utc[known]
    at, reference = _fresh(*_reference(resolved))
    received = _filled(received)
    if len(at) and (received[at] >= 0).any():
        stamped = at[received[at] >= 0]
        late = int(np.median(received[stamped] - utc[stamped]))
        if dateless:
            recorder.days = round(late / DAY_NS)
            received = np.where(received >= 0, received - recorder.days * DAY_NS, -1)
        elif weeks := _weeks(late, int(np.median(received[stamped]))):
            recorder.weeks = weeks
            utc = np.where(utc >= 0, utc + weeks * 7 * DAY_NS, -1)
            reference = reference + weeks * 7 * DAY_NS
    burst = _bursts(received, length)
    spread = _spread(received, burst, instruments, recorder)
    late, slower = _late(spread, received, at, reference)
    offset = _offset(late - slower, spread, received, at, reference, resolved, utc, recorder)
    return Clock(utc, received, at, reference, spread - offset, late, burst, spread, recorder)


def _reference(resolved: Resolved) -> tuple[np.ndarray, np.ndarray]:
    """Places and UTC [m] of one receiver's sentences by the log's clock: that of most of them, and
    of several like it the one that is least late."""
    mine = (resolved.track == 0) & (resolved.utc >= 0)
    if not mine.any():
        mine = resolved.utc >= 0
    if not mine.any():
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    place, utc, sender = resolved.place[mine], resolved.utc[mine], resolved.sender[mine]
    count = np.bincount(sender)
    able = np.flatnonzero(count >= 0.5 * count.max())
    if len(able) < 2:
        keep = np.ones(len(place), bool)  # the rest fills in where this one is silent
    else:
        newest = np.maximum.accumulate(utc)
        lag = [float(np.mean((newest - utc)[sender == one])) for one in able]
        together = [np.ptp(place[sender == one]) for one in able]
        overlap = sum(together) > 1.2 * np.ptp(place)
        best = able[int(np.argmin(lag))]
        keep = sender == best if overlap else np.ones(len(place), bool)
    place, utc = place[keep], utc[keep]
    ahead = np.concatenate(([True], np.diff(np.maximum.accumulate(utc)) >= 0))
    ahead &= utc >= np.maximum.accumulate(utc)  # what comes again with an older time is late
    if ahead.sum() < 0.5 * len(utc):  # the clock was set back: each is as good as the next
        ahead[:] = True
    return place[ahead], utc[ahead]


def _fresh(at: np.ndarray, utc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Only the first sentence of each UTC: what follows belongs to the same epoch."""
    if not len(at):
        return at, utc
    new = np.concatenate(([True], np.diff(utc) != 0))
    return at[new], utc[new]


def _filled(received: np.ndarray) -> np.ndarray:
    """Stamps [n] with those between that could not be read, where most lines have one.

    A single one far from both neighbours, which are near each other, has a damaged digit."""
    stamped = received >= 0
    if stamped.all() and len(received) > 2:
        step = np.abs(np.diff(received))
        near = np.abs(received[2:] - received[:-2]) < STRAY_NS
        stamped[1:-1] = ~((step[:-1] > STRAY_NS) & (step[1:] > STRAY_NS) & near)
    if stamped.all() or stamped.sum() < max(2, 0.5 * len(received)):
        return received
    at = np.flatnonzero(stamped)
    base = int(received[at[0]])  # whole nanoseconds of this century do not fit a float
    filled = np.interp(np.arange(len(received)), at, (received[at] - base).astype(float))
    return np.where(stamped, received, base + np.rint(filled).astype(np.int64))


def _weeks(late_ns: int, recorded_ns: int) -> int:
    """Weeks to be added to a receiver's date: whole turns of its counter, or none."""
    if recorded_ns < YEAR_2000_NS:
        return 0
    turns = round(late_ns / (ROLLOVER_DAYS * DAY_NS))
    rest = abs(late_ns - turns * ROLLOVER_DAYS * DAY_NS)
    return 1024 * turns if turns > 0 and rest < DAY_NS else 0


def _bursts(received: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Which burst [n] each sentence came in: those that follow faster than a serial line sends."""
    sent = length * (BITS_A_CHARACTER * SECOND_NS // BITS_PER_S)
    gap = np.diff(received, prepend=received[:1])
    return np.cumsum((gap > sent) | (gap < 0) | (received < 0))


def _spread(
    received: np.ndarray, burst: np.ndarray, instruments: list[np.ndarray], recorder: Recorder
) -> np.ndarray:
    """Receive stamps [n] where several sentences of an instrument bear one: spread over the time
    since the burst before, the last one at the stamp."""
    if not (received >= 0).all() or not len(received):
        return received
    best: tuple[float, np.ndarray] | None = None
    for place in instruments:
        count = np.bincount(burst[place])[burst[place]]
        if len(place) > 2 and np.mean(count > 1) > SHARED:
            many = float(np.median(count))
            if best is None or many > best[0]:
                best = many, place
    if best is None:
        return received
    place = best[1]
    quantum = next((q for q in QUANTA_NS if not (received[place] % q).any()), 0)
    number, first, many = np.unique(burst[place], return_index=True, return_counts=True)
    stamp = received[place[first]]
    since = np.diff(stamp, prepend=stamp[0])
    usual = float(np.median(since[1:] / many[1:])) if len(stamp) > 1 else 0.0
    span = np.minimum(np.where(since > 0, since, np.inf), LONGEST * many * usual)
    span[0] = many[0] * usual
    which = np.searchsorted(number, burst[place])
    rank = np.arange(len(place)) - first[which]
    share = (rank + 1.0 - many[which]) / many[which]  # (-1, 0] of the span before the stamp
    if quantum:  # stamps that were cut to whole seconds: the samples lie behind
        share, span = (rank + 0.5) / many[which], np.full(len(span), float(quantum))
    times = stamp[which] + np.rint(share * span[which]).astype(np.int64)
    recorder.shared, recorder.burst_ns = (
        int(best[0]),
        int(np.median(since[1:] if len(since) > 1 else 0)),
    )
    base = int(times[0])
    between = np.interp(np.arange(len(received)), place, (times - base).astype(float))
    spread = base + np.rint(between).astype(np.int64)
    for mine in instruments:  # those that share stamps as the first one does are spread likewise
        count = np.bincount(burst[mine])[burst[mine]]
        if mine is not place and len(mine) == len(place) and np.median(count) == best[0]:
            spread[mine] = times
    spread[place] = times
    return spread


def _late(
    spread: np.ndarray, received: np.ndarray, at: np.ndarray, utc: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Stamp minus UTC [n] ns at each sentence: the median of the UTC times around it, on its side
    of a step. And how much of it [n] ns is of a receiver that takes longer than it did at best."""
    late, slower = np.zeros(len(spread), np.int64), np.zeros(len(spread), np.int64)
    stamped = received[at] >= 0
    if not stamped.any():
        return late, slower
    at, each = at[stamped], (spread[at] - utc)[stamped]
    begins = _steps(each, at, received)
    edges, longer, before = [*begins, len(each)], 0, each[:0]
    for begin, end in zip(begins, edges[1:], strict=True):
        part = each[begin:end]
        smooth = _running_median(part, SMOOTHED)
        drifts = np.ptp(smooth) > DRIFT_NS
        level = smooth if drifts else np.full(len(part), int(np.median(part)))
        left = 0 if begin == 0 else _where_set(at[begin - 1], at[begin], received)
        right = len(late) if end == len(each) else _where_set(at[end - 1], at[end], received)
        inside = np.arange(left, right)
        base = int(level[0])
        late[left:right] = base + np.rint(
            np.interp(inside, at[begin:end], (level - base).astype(float))
        ).astype(np.int64)
        middle = int(np.median(part))
        if begin and len(before) >= LASTS <= len(part):
            lines = received[max(at[begin - 1] - NEAR, 0) : at[begin] + NEAR]
            there = received[at[begin - 1] : at[begin] + 1]
            if _of_latency(int(np.median(before)), middle, there, lines):
                longer += middle - int(np.median(before))
        before = part
        slower[left:right] = longer
    return late, slower - slower.min()


def _steps(late: np.ndarray, at: np.ndarray, received: np.ndarray) -> list[int]:
    """Where [k] in `late` [m] ns the recorder's clock was set: its level changes and stays."""
    begins = [0]
    if len(late) < 2 * AROUND:
        return begins
    jumps = np.flatnonzero(np.abs(np.diff(late)) > 0.5 * STEP_NS) + 1
    for i in jumps[(jumps >= AROUND) & (jumps <= len(late) - AROUND)].tolist():
        if i < begins[-1] + AROUND and begins[-1]:
            continue
        before = late[max(begins[-1], i - AROUND) : i]
        after = late[i : i + AROUND]
        step = float(np.median(after) - np.median(before))
        jitter = max(
            np.median(np.abs(before - np.median(before))),
            np.median(np.abs(after - np.median(after))),
        )
        if abs(step) > max(STEP_NS, 6.0 * jitter) and abs(late[i] - late[i - 1]) > 0.5 * abs(step):
            begins.append(i)
    return begins


def _of_latency(before: int, after: int, there: np.ndarray, lines: np.ndarray) -> bool:
    """Whether stamp minus UTC [ns] steps since the receiver takes longer, or less long: it may be a
    latency on either side, and the stamps `there` [k] ns, of all lines from the UTC before to that
    after, show no step among `lines` [n] ns, as those of a clock do that is set."""
    step = after - before
    if (
        abs(step) < STEP_NS
        or not EARLY_NS <= min(before, after) <= max(before, after) <= LATENCY_NS
    ):
        return False
    gaps, usual = np.diff(there), float(np.quantile(np.diff(lines), 0.9))
    most = -float(gaps.min()) if step < 0 else float(gaps.max()) - usual
    return most < SHOWN * abs(step)


def _where_set(left: int, right: int, received: np.ndarray) -> int:
    """The first sentence behind the moment, between two places, at which the clock was set."""
    gaps = np.diff(received[left : right + 1])
    usual = np.median(gaps)
    return int(left + 1 + np.argmax(np.abs(gaps - usual)))


def _running_median(values: np.ndarray, width: int) -> np.ndarray:
    if len(values) < width:
        return np.full(len(values), int(np.median(values)))
    half = width // 2
    inside = np.lib.stride_tricks.sliding_window_view(values, width)
    middle = np.median(inside, axis=1).astype(np.int64)
    return np.concatenate((np.full(half, middle[0]), middle, np.full(half, middle[-1])))


def _offset(
    late: np.ndarray, spread: np.ndarray, received: np.ndarray, at: np.ndarray, utc: np.ndarray,
    resolved: Resolved, own: np.ndarray, recorder: Recorder,
) -> np.ndarray:  # fmt: skip
    """How far the recorder's clock is ahead [n] ns at each sentence, without the latency."""
    if not len(at) or not (received[at] >= 0).any():
        return np.zeros(len(late), np.int64)
    least = _least_late(spread, received, resolved, own)
    extra = max(int(np.median(late[at])) - least, 0)  # another receiver is less late than this one
    late = late - extra
    levels = np.unique(late[at])
    recorder.drift_ns = int(np.ptp(late[at])) if len(levels) > 12 else 0
    zone = np.rint(late / ZONE_NS).astype(np.int64) * ZONE_NS
    rest = late - zone
    plausible = (rest >= EARLY_NS) & (rest <= LATENCY_NS)
    latency = None if recorder.drift_ns else _latency(rest[at], plausible[at])
    recorder.latency_ns = None if latency is None else latency + extra
    latency = latency or 0
    offset = np.where(plausible & (np.abs(rest - latency) <= STEP_NS), zone, late - latency)
    if recorder.drift_ns:
        offset = late
    changes = np.flatnonzero(np.diff(offset[at]))
    begins = [0, *(changes + 1)] if len(changes) < 12 else [0]
    recorder.offsets = [(int(utc[i]), int(offset[at[i]])) for i in begins]
    return offset


def _latency(rest: np.ndarray, plausible: np.ndarray) -> int | None:
    """The receiver's latency [ns], of what may be one [m]; None where the clock hides it.

    A small one is believed of any part of the log, a large one of the last: there the clock was
    set, if it was."""
    small = plausible & (rest <= SMALL_NS)
    if small.mean() > 0.1:
        return max(int(rest[small].min()), 0)
    return int(rest[-1]) if plausible[-1] else None


def _least_late(
    spread: np.ndarray, received: np.ndarray, resolved: Resolved, own: np.ndarray
) -> int:
    """Stamp minus UTC [ns] of the receiver that is least late, by the log's clock."""
    medians = []
    for one in np.unique(resolved.sender):
        mine = resolved.place[(resolved.sender == one) & (resolved.utc >= 0)]
        mine = mine[received[mine] >= 0]
        if len(mine) >= AROUND:
            medians.append(int(np.median(spread[mine] - own[mine])))
    inside = [m for m in medians if m >= EARLY_NS]
    return min(inside or medians or [1 << 62])
