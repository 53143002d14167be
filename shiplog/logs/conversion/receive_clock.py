"""Receive stamps of a recorder, held against the UTC in the sentences that they stand next to.

A stamp minus the UTC of its sentence is the recorder's error and the receiver's latency together:

    L = received - UTC = error + latency,   0 <= latency < 1.5 s.

A receiver needs 0.1 to 1.1 s from a fix to its sentence, and that is no error of the recorder: the
heading next to it was stamped when it came. So an L between 0 and 1.5 s is latency and moves no
stamp. An error is what latency cannot be: an L below 0 (nothing is received before it is measured),
a larger one, one that drifts, and whole hours of a zone. A recorder whose clock was set while it
recorded has one error before and another one afterwards; each stamp is held against the UTC next
to it, and not against the median of the file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from shiplog.logs import dates
from shiplog.logs.health_report import Finding
from shiplog.units import SECOND_NS

LATEST_S = 1.5  # of a receiver's latency; 1.06 s have been measured (PCOD of R/V Palmer)
EARLY_S = 0.05  # as much before 0 is rounding of the stamps, not a clock
SAID_S = 0.2  # a latency that is worth a word: 2 m at 10 m/s
HOUR_S = 3600.0
STEP_S = 0.25  # the least step of a clock that is looked for: NTP sets one from 0.128 s on
STEP_NOISES = 8.0  # of the scatter of L about its running median
SIDES = 5  # values on either side of a step, of which three must agree
AROUND = 20  # values on either side that have to stay
STEADY = 0.5  # of the step, between their 10 % and their 90 % points
EVIDENCE = 0.7  # of a step must show in the stamps of all lines together
DRIFT_S = 0.3  # over a piece, and four times the scatter: a clock that does not keep its pace
BENT = 0.15  # of a drift: a clock's is a straight line; a step of the latency bends by a quarter
DRIFT_NODE = 64  # values that one point of a drifting clock is the median of
MOST_SWITCHES = 4  # between dates a day apart: more is two sources, of which one has no date


@dataclass(frozen=True)
class ReceiveClock:
    """What the receive stamps of a file are worth.

    wrong      [n] ns, by how much each line's stamp is ahead of UTC: to be subtracted from it
    latency_s  s, from a fix to its sentence in the median; it is not in `wrong`
    unsure_s   s, by how much a stamp that was put right can still be off
    findings   what was put right, and what was not
    """

    wrong: np.ndarray
    latency_s: float = 0.0
    unsure_s: float = 0.0
    findings: tuple[Finding, ...] = field(default=())


def against_utc(
    received: np.ndarray, utc: np.ndarray, kind: np.ndarray | None = None
) -> ReceiveClock:
    """The recorder's clock, from the lines of a file in their order.

    received  [n] ns, the stamp of each line; -1 where it has none
    utc       [n] ns, the UTC in its sentence; -1 in one without
    kind      [n] which sentence of which receiver it is: each has a latency of its own, and the
              steadiest of them is held against the recorder
    """
    received, utc = np.asarray(received, np.int64), np.asarray(utc, np.int64)
    wrong = np.zeros(len(received), np.int64)
    at = np.flatnonzero((received >= 0) & (utc >= 0))
    at = at[_of_one_date(received[at] - utc[at])]
    if kind is not None and len(at):
        at = at[kind[at] == _steadiest(received[at] - utc[at], kind[at])]
    if len(at) == 0:
        return ReceiveClock(wrong)
    late = (received[at] - utc[at]) / SECOND_NS  # s; exact to 1 us over a century
    pieces = _pieces(late, received, at)
    medians = [float(np.median(late[a:b])) for a, b in pieces]
    drifts = [_drift(late[a:b]) for a, b in pieces]
    steady = [k for k, drift in enumerate(drifts) if not drift]
    latency = _latency([pieces[k] for k in steady], [medians[k] for k in steady])
    errors = [_error(m, latency) for m in medians]
    known = np.flatnonzero(received >= 0)
    for k, (a, b) in enumerate(pieces):
        begin = 0 if k == 0 else _boundary(received, at[a - 1], at[a])
        end = len(received) if k == len(pieces) - 1 else _boundary(received, at[b - 1], at[b])
        lines = known[(known >= begin) & (known < end)]
        if drifts[k]:
            course = _course(late[a:b], at[a:b], lines)
            wrong[lines] = np.rint((course - latency) * SECOND_NS).astype(np.int64)
        else:
            wrong[lines] = np.int64(round(errors[k] * SECOND_NS))
    begins = [float(received[at[a]] - received[known[0]]) / SECOND_NS for a, _ in pieces]
    findings = _findings(errors, drifts, begins, latency)
    moved = any(errors) or any(drifts)
    return ReceiveClock(wrong, latency, LATEST_S if moved and not latency else 0.0, findings)


def _steadiest(late: np.ndarray, kind: np.ndarray) -> int:
    """Of the kinds of sentences that come half as often as the most frequent one at least, the one
    whose differences [n] scatter least, and of equals the one that comes first."""
    values, counts = np.unique(kind, return_counts=True)
    often = [int(value) for value in values[2 * counts >= counts.max()]]
    scatter = [float(np.median(np.abs(np.diff(late[kind == k]))) if (kind == k).sum() > 1 else 0)
               for k in often]  # fmt: skip
    soon = [float(np.median(late[kind == k])) for k in often]
    least = min(scatter) + 0.05 * SECOND_NS
    return min((abs(s), k) for k, s, x in zip(often, soon, scatter, strict=True) if x <= least)[1]


def _of_one_date(late: np.ndarray) -> np.ndarray:
    """Which of the differences [n] ns are of a receiver that has a date: where they jump back and
    forth by days, those of the date that is nearest to the recorder's."""
    days = np.rint(late / dates.DAY_NS)
    if len(late) == 0 or (np.diff(days) != 0).sum() <= MOST_SWITCHES:
        return np.ones(len(late), bool)
    values, counts = np.unique(days, return_counts=True)
    often = values[counts >= 0.05 * len(days)]
    return (
        days
        == (often if len(often) else values)[np.argmin(np.abs(often if len(often) else values))]
    )


def steps_of(late: np.ndarray) -> list[tuple[int, float]]:
    """Where differences of two clocks [m] s step for good: the first value after each step, and its
    size [s]. Medians on either side decide; single values do not, nor a delay that comes and
    goes."""
    if len(late) < 2 * SIDES:
        return []
    padded = np.concatenate((np.full(SIDES - 1, late[0]), late, np.full(SIDES - 1, late[-1])))
    medians = np.median(np.lib.stride_tricks.sliding_window_view(padded, SIDES), axis=1)
    before, after = medians[: len(late) - 1], medians[SIDES : SIDES + len(late) - 1]
    centre = medians[SIDES // 2 : SIDES // 2 + len(late)]
    least = max(STEP_S, STEP_NOISES * 1.4826 * float(np.median(np.abs(late - centre))))
    large = np.flatnonzero(np.abs(after - before) > least)
    step = np.abs(np.diff(late))
    found: list[tuple[int, float]] = []
    for group in np.split(large, np.flatnonzero(np.diff(large) > 1) + 1) if len(large) else ():
        cut = int(group[np.argmax(step[group])]) + 1
        size = float(after[cut - 1] - before[cut - 1])
        sides = late[max(cut - AROUND, 0) : cut], late[cut : cut + AROUND]
        if all(_steady(side, size) for side in sides):
            found.append((cut, size))
    return found


def _steady(late: np.ndarray, size: float) -> bool:
    """Whether differences on one side of a step [s] stay: after a delay they go back to nothing."""
    if len(late) < SIDES // 2 + 1:
        return False
    low, high = np.quantile(late, (0.1, 0.9))
    return float(high - low) <= STEADY * abs(size)


def _pieces(late: np.ndarray, received: np.ndarray, at: np.ndarray) -> list[tuple[int, int]]:
    """Stretches [first, last) of the differences [m] s between which the clock was set; not those
    from which on the receiver took longer."""
    cuts = [
        cut
        for cut, size in steps_of(late)
        if not (is_latency(float(np.median(late[max(cut - SIDES, 0) : cut])))
                and is_latency(float(np.median(late[cut : cut + SIDES]))))
        or _shows(received, at[cut - 1], at[cut], size)
    ]  # fmt: skip
    return [(a, b) for a, b in pairwise([0, *cuts, len(late)]) if b > a]


def _shows(received: np.ndarray, first: int, last: int, size: float) -> bool:
    """Whether the stamps of all lines step by `size` [s] between two lines, as a clock does that
    is set, and not only those of the receiver."""
    stamps = received[max(first - 50, 0) : last + 50]
    step = np.diff(stamps[stamps >= 0]) / SECOND_NS
    here = received[first : last + 1]
    there = np.diff(here[here >= 0]) / SECOND_NS
    if len(there) == 0:
        return False
    usual = float(np.quantile(step, 0.9))
    most = float(there.min()) if size < 0 else float(there.max()) - usual
    return most * math.copysign(1.0, size) >= EVIDENCE * abs(size)


def _boundary(received: np.ndarray, first: int, last: int) -> int:
    """The line from which the later clock holds, between two lines with UTC of their own."""
    lines = np.arange(first, last + 1)
    lines = lines[received[lines] >= 0]
    if len(lines) < 2:
        return int(last)
    step = np.diff(received[lines])
    return int(lines[int(np.argmax(np.abs(step - np.median(step)))) + 1])


def is_latency(late: float) -> bool:
    return -EARLY_S <= late <= LATEST_S


def _latency(pieces: list[tuple[int, int]], medians: list[float]) -> float:
    """The receiver's latency [s]: of the longest piece that shows one, else of one whole hours off,
    else unknown, and 0."""
    longest = sorted(range(len(pieces)), key=lambda k: pieces[k][0] - pieces[k][1])
    for k in longest:
        if is_latency(medians[k]):
            return max(min(m for m in medians if is_latency(m)), 0.0)
    for k in longest:
        if _hours(medians[k]):
            return max(medians[k] - _hours(medians[k]), 0.0)
    return 0.0


def _hours(late: float) -> float:
    """The whole hours [s] by which a clock is off that has a receiver's latency on top; else 0."""
    hours = HOUR_S * math.floor((late + EARLY_S) / HOUR_S)
    return hours if is_latency(late - hours) else 0.0


def _error(late: float, latency: float) -> float:
    """s, what of a difference is the recorder's."""
    if is_latency(late):
        return late - latency if late - latency > STEP_S else 0.0
    return _hours(late) or late - latency


def _drift(late: np.ndarray) -> float:
    """s, by how much a clock goes wrong from the first fifth of a piece to its last; 0 where it
    keeps its pace."""
    if len(late) < 5 * SIDES:
        return 0.0
    nodes = np.array([np.median(part) for part in np.array_split(late, 5)])
    gone = float(nodes[-1] - nodes[0])
    bent = float(np.abs(nodes - np.linspace(nodes[0], nodes[-1], 5)).max())
    scatter = float(np.median(np.abs(np.diff(late)))) * 1.05  # 1.4826 / sqrt(2)
    return gone if abs(gone) > max(DRIFT_S, 4.0 * scatter) and bent < BENT * abs(gone) else 0.0


def _course(late: np.ndarray, at: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """The difference [s] at each line of a clock that drifts, between medians along the file."""
    nodes = max(len(late) // DRIFT_NODE, 2)
    parts = np.array_split(np.arange(len(late)), nodes)
    where = [float(np.median(at[part])) for part in parts]
    size = [float(np.median(late[part])) for part in parts]
    slope = [
        (size[1] - size[0]) / (where[1] - where[0]),
        (size[-1] - size[-2]) / (where[-1] - where[-2]),
    ]
    course = np.interp(lines, where, size)
    course += np.where(lines < where[0], slope[0] * (lines - where[0]), 0.0)
    return course + np.where(lines > where[-1], slope[1] * (lines - where[-1]), 0.0)


def _findings(
    errors: list[float], drifts: list[float], begins: list[float], latency: float
) -> tuple[Finding, ...]:
    found: list[Finding] = []
    known = (
        ""
        if latency
        else f" The receiver's own latency, up to {LATEST_S:g} s, is not known here: "
        "by so much the sentences without UTC may be early."
    )
    if any(drifts):
        gone = max(drifts, key=abs)
        sentence = (
            f"The recorder's clock drifts by {gone:+.3g} s against the UTC in the sentences; each "
            f"receive stamp was put right by the UTC next to it.{known}"
        )
        found.append(_offset(sentence, gone, latency))
    elif len(errors) > 1 and len(set(errors)) > 1:
        parts = ", ".join(
            f"{error:+.3g} s from {begin:.1f} s"
            for error, begin in zip(errors, begins, strict=True)
        )
        sentence = (
            f"The recorder's clock was set while it recorded: it was ahead of the UTC in the "
            f"sentences by {parts}; each receive stamp was put right by the UTC next to it.{known}"
        )
        found.append(_offset(sentence, max(errors, key=abs), latency))
    elif any(errors):
        hours = ", whole hours as of a zone" if errors[0] % HOUR_S == 0 else ""
        side = "ahead of" if errors[0] > 0 else "behind"
        sentence = (
            f"The recorder's clock is {dates.how_far(abs(errors[0]) * SECOND_NS)} {side} the UTC "
            f"in the sentences{hours}; the receive stamps were put right by that.{known}"
        )
        found.append(_offset(sentence, errors[0], latency))
    if latency >= SAID_S:
        sentence = (
            f"Sentences of GNSS come {latency:.2g} s after their fix. That is the receiver's "
            "latency and no error of the recorder's clock: sentences without UTC keep their "
            "receive stamps."
        )
        found.append(Finding("clock_offset", "gnss", sentence, value=round(latency, 3), unit="s"))
    return tuple(found)


def _offset(sentence: str, value: float, latency: float) -> Finding:
    unsure = 0.0 if latency else LATEST_S
    low, high = value - unsure, value
    return Finding(
        "clock_offset",
        "log",
        sentence,
        None,
        None,
        round(value, 3),
        round(low, 3),
        round(high, 3),
        "s",
    )
