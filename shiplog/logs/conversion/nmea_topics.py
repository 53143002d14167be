"""Which instrument becomes which topic, once all sentences of a log are read."""

from __future__ import annotations

import re
from array import array
from collections import Counter
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from shiplog.logs.conversion import magnetic
from shiplog.logs.conversion.nmea_clock import Clock
from shiplog.logs.conversion.nmea_receivers import (
    Epochs,
    as_one,
    disagree,
    label,
)
from shiplog.logs.conversion.nmea_sentences import (
    COMPASS,
    FIXES,
    INSTEAD,
    MAGNETIC,
    SENTENCE_TOPICS,
    family,
)
from shiplog.logs.conversion.nmea_utc import Resolved
from shiplog.logs.conversion.write import Series

ENOUGH = 0.5  # times the most frequent sentence of a topic: a better one with as many is taken
ONE_AN_EPOCH = 1.2  # sentences in an epoch, of which each is of the receiver before it
COARSE = 0.2  # share of an instrument's sentences that repeat a UTC: it counts in coarse steps
SAME = 0.9  # share of repeated sentences that say the same: they came twice
MOST_SPAN = 1.5  # times the usual period, over which sentences of one time are spread
DISAGREE_M = 5.0  # fixes of two kinds of sentences: digits of a minute and the antenna's motion


@dataclass(slots=True)
class Rows:
    """One kind of sentence of one sender."""

    kind: str  # of SENTENCE_TOPICS
    place: array = field(default_factory=partial(array, "q"))  # which sentence of the file it was
    values: list[tuple[float, ...]] = field(default_factory=list)
    why_not: dict[int, str] = field(default_factory=dict)  # row: why it is no measurement

    def drop(self, gone: np.ndarray) -> None:
        keep = np.flatnonzero(~gone[np.array(self.place, np.int64)])
        new = {int(old): k for k, old in enumerate(keep)}
        self.place = array("q", [self.place[i] for i in keep])
        self.values = [self.values[i] for i in keep]
        self.why_not = {new[i]: why for i, why in self.why_not.items() if i in new}


@dataclass(slots=True)
class Gathered:
    """The facts of a log, by kind and sender.

    form  [n] how each sentence with UTC is written: its fields and their digits
    """

    rows: dict[tuple[str, int], Rows] = field(default_factory=dict)
    form: array = field(default_factory=partial(array, "q"))

    def drop(self, gone: np.ndarray) -> None:
        for rows in self.rows.values():
            rows.drop(gone)

    def valid(self) -> bool:
        return any(len(rows.place) > len(rows.why_not) for rows in self.rows.values())


@dataclass(slots=True)
class Part:
    """The rows of one instrument, with their times.

    time    [n] ns
    values  [n, k], NaN where the instrument says that they are none
    """

    kind: str
    sender: int
    label: int  # of the receivers under this sender, 0 the first
    place: np.ndarray
    time: np.ndarray
    values: np.ndarray
    why_not: dict[int, str]

    @property
    def valid(self) -> int:
        return int(np.isfinite(self.values[:, :2]).any(axis=1).sum())


@dataclass(slots=True)
class Spoken:
    """The topics of a log, and what there is to say of them."""

    series: list[Series] = field(default_factory=list)
    invalid: int = 0
    notes: list[str] = field(default_factory=list)
    blanks: list[tuple[str, str, np.ndarray, int]] = field(default_factory=list)
    compasses: list[tuple[str, str, magnetic.Variation | None]] = field(default_factory=list)
    receivers: list[tuple[str, str]] = field(default_factory=list)  # talker, the second's topic
    apart: list[tuple[str, float]] = field(default_factory=list)  # sentences, metres
    dropped: Counter[str] = field(default_factory=Counter)  # rows without a time, by topic
    repeated: Counter[str] = field(default_factory=Counter)  # rows that came twice


def topics_of(
    gathered: Gathered, resolved: Resolved, clock: Clock, senders: list[tuple[str, str]]
) -> Spoken:
    """The topics: the best sentence of each, one for each instrument.

    senders  talker and source, by number
    """
    spoken = Spoken()
    labels = _receivers(gathered, resolved, senders, spoken)
    parts = [
        part for (_, sender), rows in gathered.rows.items() if rows.place
        for part in _parts(rows, sender, labels.get(sender), clock, spoken)
    ]  # fmt: skip
    parts = [part for part in parts if part.valid]
    variations = [part for part in parts if part.kind == "variation"]
    chosen = _chosen([part for part in parts if part.kind != "variation"])
    fix = max((p for t, p in chosen if t == "/gnss/fix"), key=lambda p: p.valid, default=None)
    track = _track(fix)
    other = (np.zeros(0, np.int64), np.zeros(0))
    if variations:
        most = max(variations, key=lambda part: len(part.time))
        other = most.time, most.values[:, 0]
    by_topic: dict[str, list[Part]] = {}
    for topic, part in chosen:
        by_topic.setdefault(topic, []).append(part)
    for topic, several in sorted(by_topic.items()):
        for name, group in _named(topic, several, senders, spoken):
            spoken.series.append(_series(name, group, clock, track, other, senders, spoken))
    spoken.series.sort(key=lambda one: one.topic)
    return spoken


def _receivers(
    gathered: Gathered, resolved: Resolved, senders: list[tuple[str, str]], spoken: Spoken
) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """Of each sender with two receivers: places of its epochs and which receiver each is of."""
    found: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    for sender in range(len(senders)):
        where, kinds = {}, {}
        for kind in FIXES:
            rows = gathered.rows.get((kind, sender))
            if rows is None:
                continue
            for i, place in enumerate(rows.place):
                if i not in rows.why_not:
                    where[place] = rows.values[i][:2]
                kinds[place] = kind
        if not where:
            continue
        mine = np.flatnonzero((resolved.sender == sender) & (resolved.utc >= 0))
        epochs = _epochs(mine, resolved, gathered.form, where, kinds)
        labels = label(epochs)
        if labels is not None:
            found[sender] = epochs.begin, labels
            continue
        of_kind = [
            _epochs(np.array([i for i in mine if kinds.get(resolved.place[i]) == kind], np.int64),
                    resolved, gathered.form, where, kinds)
            for kind in ("gga", "rmc")
        ]  # fmt: skip
        metres = disagree(*of_kind)
        if metres > DISAGREE_M:
            talker = senders[sender][0]
            spoken.apart.append((f"{talker}GGA and {talker}RMC", metres))
    return found


def _epochs(
    mine: np.ndarray, resolved: Resolved, form: array,
    where: dict[int, tuple[float, ...]], kinds: dict[int, str],
) -> Epochs:  # fmt: skip
    """Sentences [n] of a sender with UTC, those of one time together."""
    begin, row, track, positions = [], [], [], []
    inside: set[str] = set()
    last, dated = -1, -1
    for i in mine.tolist():
        place, of_day = int(resolved.place[i]), int(resolved.of_day[i])
        kind = kinds.get(place, "")
        of = int(resolved.track[i])
        other = bool(resolved.given[i]) and dated >= 0 and of != dated
        if of_day != last or kind in inside or other:
            begin.append(place)
            row.append(i)
            track.append(of)
            positions.append((np.nan, np.nan))
            inside, dated = set(), -1
        inside.add(kind)
        last, dated = of_day, of if resolved.given[i] else dated
        track[-1] = track[-1] or of
        if np.isnan(positions[-1][0]) and place in where:
            positions[-1] = where[place]
    at = np.array(row, np.int64)
    return Epochs(
        np.array(begin, np.int64), resolved.of_day[at], resolved.utc[at], np.array(track, np.int64),
        np.array(positions, float).reshape(-1, 2), np.array(form, np.int64)[at],
    )  # fmt: skip


def _parts(
    rows: Rows, sender: int, labels: tuple[np.ndarray, np.ndarray] | None, clock: Clock,
    spoken: Spoken,
) -> list[Part]:  # fmt: skip
    """The rows of a kind of sentence, by receiver, with their times."""
    place = np.array(rows.place, np.int64)
    _, names = SENTENCE_TOPICS[family(rows.kind)]
    values = np.array(rows.values, float).reshape(len(place), -1)
    of = np.zeros(len(place), np.int64)
    if labels is not None:
        begin, which = labels
        before = np.searchsorted(begin, place, side="right") - 1
        inside = before >= 0
        if inside.any() and inside.sum() <= ONE_AN_EPOCH * len(np.unique(before[inside])):
            of = np.where(inside, which[before.clip(0)], 0)
    blank = np.zeros(len(place), bool)
    blank[list(rows.why_not)] = True
    if rows.kind != "variation" and not blank.all():
        spoken.invalid += int(blank.sum())
    elif blank.all():
        spoken.invalid += len(place)
    values[blank] = np.nan
    parts = []
    for number in np.unique(of).tolist():
        at = np.flatnonzero(of == number)
        time = clock.times(place[at])
        keep, time = _separate_times(time, clock.utc[place[at]] >= 0, values[at])
        spoken.repeated[rows.kind] += int((~keep).sum())
        known = keep & (time >= 0)
        spoken.dropped[rows.kind] += int((keep & (time < 0)).sum())
        at, time = at[known], time[known]
        why = {k: rows.why_not[i] for k, i in enumerate(at.tolist()) if i in rows.why_not}
        parts.append(Part(rows.kind, sender, number, place[at], time, values[at], why))
        assert values.shape[1] == len(names)
    return parts


def _separate_times(
    time: np.ndarray, own: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Which rows [n] are kept, and times [n] ns of which no two are the same.

    Sentences of one UTC, which counts in whole or tens of seconds, lie between it and the next. If
    they only repeat each other while others differ, they came twice, and the first is kept. Those
    of one receive stamp lie between the one before and it.
    """
    keep = np.ones(len(time), bool)
    same = np.concatenate(([False], np.diff(time) == 0)) & (time >= 0)
    if not same.any():
        return keep, time
    equal = np.zeros(len(time), bool)
    equal[1:] = (np.diff(np.nan_to_num(values, nan=-1e9), axis=0) == 0).all(axis=1)
    others = equal[1:][~same[1:]]
    again = same.mean() > COARSE and equal[same].mean() > SAME
    if again and len(others) and others.mean() < 0.5:
        return ~(same & equal), time
    first = np.flatnonzero(~same)
    many = np.diff(first, append=len(time))
    begin = time[first]
    steps = np.diff(begin)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    rank = np.arange(len(time)) - np.repeat(first, many)
    ahead = np.where(steps > 0, np.minimum(steps, MOST_SPAN * usual), usual)
    ahead = np.append(ahead, usual)
    back = np.concatenate(([usual], ahead[:-1]))
    count = np.repeat(many, many)
    forward = np.repeat(ahead, many) * rank / count
    backward = np.repeat(back, many) * (rank + 1 - count) / count
    return keep, time + np.rint(np.where(own, forward, backward)).astype(np.int64)


def _chosen(parts: list[Part]) -> list[tuple[str, Part]]:
    """Topic and part: of the sentences that say the same, the best that comes often enough."""
    count: Counter[str] = Counter()
    for part in parts:
        count[part.kind] += part.valid
    wanted = {kind: kind for kind in count if kind.startswith("/")}
    if "/rudder/port" not in count:  # RSA calls the only rudder the starboard one
        wanted |= dict.fromkeys(count.keys() & {"/rudder/starboard"}, "/rudder/main")
    for topic, kinds in INSTEAD.items():
        most = max((count[kind] for kind in kinds), default=0)
        best = [kind for kind in kinds if count[kind] and count[kind] >= ENOUGH * most][:1]
        wanted |= dict.fromkeys(best, topic)
        if topic == "/gyro" and best and best[0] not in COMPASS:
            compass = [kind for kind in COMPASS if count[kind]][:1]
            wanted |= dict.fromkeys(compass, "/gyro/compass")
    return [(wanted[part.kind], part) for part in parts if part.kind in wanted]


def _named(
    topic: str, parts: list[Part], senders: list[tuple[str, str]], spoken: Spoken
) -> list[tuple[str, list[Part]]]:
    """The names of a topic's instruments: several are told apart by talker, source or number."""
    first = [part for part in parts if part.label == 0]
    by_sender = {part.sender: part for part in first}
    groups = as_one((part.sender, part.time) for part in first)
    talkers = Counter(senders[members[0]][0] for members in groups)
    named = []
    for members in groups:
        talker, source = senders[members[0]]
        name = topic
        if len(groups) > 1:
            by = talker if talkers[talker] == 1 or not source else source
            name = f"{topic}/{_plain(by)}"
            spoken.notes.append(f"several talkers send one sentence; {name} is of {talker}")
        if len(members) > 1:
            both = ", ".join(senders[one][0] for one in members)
            spoken.notes.append(f"{name} is one instrument under several talkers: {both}")
        named.append((name, [by_sender[one] for one in members]))
    taken = Counter(name for name, _ in named)
    for part in (part for part in parts if part.label):
        talker, _ = senders[part.sender]
        name = f"{topic}/{_plain(talker)}_{part.label + 1}"
        if topic == "/gnss/fix":
            spoken.receivers.append((talker, name))
        named.append((name, [part]))
    return [
        (name if taken[name] < 2 else f"{name}_{k + 1}", group)
        for k, (name, group) in enumerate(named)
    ]


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_").lower() or "other"


def _track(fix: Part | None) -> magnetic.Track:
    if fix is None:
        return magnetic.Track(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
    known = np.isfinite(fix.values[:, :2]).all(axis=1)
    return magnetic.Track(fix.time[known], *fix.values[known, :2].T)


def _series(
    name: str, group: list[Part], clock: Clock, track: magnetic.Track,
    other: tuple[np.ndarray, np.ndarray], senders: list[tuple[str, str]], spoken: Spoken,
) -> Series:  # fmt: skip
    """One topic of the rows of one instrument, under whichever talkers they came."""
    place = np.concatenate([part.place for part in group])
    order = np.argsort(place, kind="stable")
    place = place[order]
    time = np.concatenate([part.time for part in group])[order]
    values = np.concatenate([part.values for part in group])[order]
    kind = group[0].kind
    schema, names = SENTENCE_TOPICS[family(kind)]
    metadata = {"sentence": f"{senders[group[0].sender][0]} {kind}"}
    for part in group:
        for why in dict.fromkeys(part.why_not.values()):
            when = part.time[[i for i, w in part.why_not.items() if w == why]]
            spoken.blanks.append((name, why, when, len(time)))
    if kind in MAGNETIC:
        made = magnetic.true_heading(time, values, track, other)
        spoken.compasses.append((name, kind.split("_")[0].upper(), made[1] if made else None))
        if made is None:
            schema, names = "shiplog.Compass", ("magnetic_heading_deg",)
        else:
            values, metadata = made[0][:, None], metadata | made[1].metadata
            names = names[:1]
    received = clock.received[place]
    logged = np.where(received >= 0, received, time)
    columns = dict(zip(names, values.T, strict=False))
    return Series(name, schema, time, columns, log_time=logged, frame_id="nmea", metadata=metadata)
