"""Clocks that were set, or began anew, while they were recorded: each stamp is held against the
recorder's time next to it, piece by piece.

A message is logged L = log_time - stamp after its stamp: its latency, and what the two clocks
differ by. Where L steps for good, one of the two clocks was set, and the stamps themselves say
which: a clock that is set steps from one message to the next, the other one keeps its pace.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import polars as pl

from shiplog.exceptions import LogUnreadable, listed
from shiplog.logs.conversion.steps_back import COUNTERS
from shiplog.logs.health import dates
from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.nomenclature.units import SECOND_NS
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.clocks import clocks
from shiplog.voyages.clocks.clocks import RECORDER, is_latency

STEP_S = 0.25  # the least step of a clock that is looked for: NTP sets one from 0.128 s on
STEP_NOISES = 8.0  # of the scatter of L about its running median
SIDES = 5  # values on either side of a step, of which three must agree
AROUND = 20  # values on either side that have to stay
STEADY = 0.5  # of the step, between their 10 % and their 90 % points
OWN = 0.3  # of a step: how far what one clock shows of it may be off
FEWEST = 20  # messages that show a step
LEAST_COUNT_NS = 60 * SECOND_NS  # a shorter count cannot be told from a clock that was set
MOST_PIECES = 20  # more often no clock is set: the delay varies


@dataclass(frozen=True)
class Steps:
    """Where one topic's L steps: pieces [first, last) of its messages, L in each [s], and the
    clock that was set."""

    topic: str
    pieces: list[tuple[int, int]]
    late: list[float]
    logged: np.ndarray  # [n] ns, log times of the messages

    @property
    def reference(self) -> float:
        """L of the piece that is right: the least that can be a latency, since a receiver does not
        become faster; else that of the longest piece."""
        can_be = [late for late in self.late if is_latency(late)]
        sizes = [b - a for a, b in self.pieces]
        return min(can_be) if can_be else self.late[int(np.argmax(sizes))]


def put_right(reading: Reading, profile: Profile) -> tuple[Reading, list[Finding]]:
    """The log with the stamps put right of clocks that were set while they were recorded, and of
    messages without a stamp where that was the recorder's."""
    frames, findings = dict(reading.frames), []
    stamped: dict[str, list[str]] = {}
    recorder: list[Steps] = []
    done: set[str] = set()
    for source in clocks.sources_of(profile):
        frame = frames.get(source.topic)
        if (
            frame is None
            or source.topic in done
            or clocks.clock_columns(frame, source)[0] != "stamp"
        ):
            continue
        done.add(source.topic)
        if source.topic in reading.health.restarted:
            continue  # sorted by the recorder's clock, which went back: neither keeps its pace
        own, others = _steps(source.topic, frame)
        if own is not None:
            frames[source.topic], sentence = _stamps_right(frame, own)
            stamped.setdefault(sentence, []).append(source.topic)
        if others is not None:
            recorder.append(others)
    findings += [_said(sentence, topics) for sentence, topics in stamped.items()]
    if recorder:
        steadiest = max(recorder, key=lambda one: len(one.logged))
        findings += _recorder_right(frames, profile, steadiest)
    return replace(reading, frames=frames), findings


def refuse_restarted(reading: Reading, profile: Profile) -> None:
    """Raises LogUnreadable where the clock of a source went back while its messages went on: the
    order in which they were written is the only one that they have, and it is of two recordings."""
    for source in clocks.sources_of(profile):
        frame, back = reading.frames.get(source.topic), reading.health.restarted.get(source.topic)
        if frame is None or back is None:
            continue
        column, _ = clocks.clock_columns(frame, source)
        if column != RECORDER and not _stood_twice(frame, column):
            continue  # only the recorder's clock went back
        raise LogUnreadable(
            f"The times on {source.topic} go back by {dates.how_far(back * SECOND_NS)} while the "
            f"messages of {reading.contents.path.name} go on: a recorder that was started again, "
            "or whose clock was set. Their rows would be shuffled.",
            hint="cut the log there into two, and ingest each by itself; or set another `clock` "
            "for that topic in the profile.",
        )


def _stood_twice(frame: pl.DataFrame, column: str) -> bool:
    """Whether the stamps went back together with the recorder's clock: then a message is logged as
    late after its stamp as before. Where only the recorder's went back, L has two values."""
    times = frame[column].drop_nulls().to_numpy()
    late = (frame[RECORDER] - frame[column]).drop_nulls().to_numpy() / SECOND_NS
    return len(times) > 0 and float(np.subtract(*np.quantile(late, (0.9, 0.1)))) < STEP_S


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


def _steps(topic: str, frame: pl.DataFrame) -> tuple[Steps | None, Steps | None]:
    """The steps of a topic's own clock, and those of the recorder's."""
    both = frame.select("stamp", RECORDER).drop_nulls()
    if both.height < FEWEST:
        return None, None
    stamp, logged = both["stamp"].to_numpy(), both[RECORDER].to_numpy()
    late = (logged - stamp) / SECOND_NS
    if float(np.ptp(late)) < STEP_S:
        return None, None
    found = steps_of(late)
    if not 0 < len(found) < MOST_PIECES:
        return None, None
    step = [np.diff(times) / SECOND_NS for times in (stamp, logged)]
    usual = [float(np.median(one)) for one in step]
    own, recorder = [], []
    for cut, size in found:
        if abs(size) * SECOND_NS > dates.DAY_NS:
            continue  # before it was set at all: `clocks.without_strays` leaves these out
        shown = step[0][cut - 1] - usual[0]
        other = step[1][cut - 1] - usual[1]
        around = np.delete(step[0][max(cut - 6, 0) : cut + 5], cut - 1 - max(cut - 6, 0))
        if abs(shown + size) <= OWN * abs(size) and (around > -abs(size) / 2).all():
            own.append(cut)
        elif abs(other - size) <= OWN * abs(size):
            recorder.append(cut)
    made = []
    for cuts in (own, recorder):
        pieces = list(pairwise([0, *cuts, len(late)]))
        medians = [float(np.median(late[a:b])) for a, b in pieces]
        made.append(Steps(topic, pieces, medians, logged) if cuts else None)
    return made[0], made[1]


def _stamps_right(frame: pl.DataFrame, steps: Steps) -> tuple[pl.DataFrame, str]:
    """The topic with its stamps put right, and what was done."""
    known = frame["stamp"].is_not_null().to_numpy() & frame[RECORDER].is_not_null().to_numpy()
    add = np.zeros(len(known), np.int64)
    shift = np.zeros(int(known.sum()), np.int64)
    parts = []
    for (first, last), late in zip(steps.pieces, steps.late, strict=True):
        wrong = late - steps.reference
        shift[first:last] = round(wrong * SECOND_NS)
        if abs(wrong) > STEP_S:
            parts.append(_size_of_step(wrong))
    add[known] = shift
    step = max((abs(b - a) for a, b in pairwise(steps.late)), default=0.0)
    counter = next(
        (name for name, size in COUNTERS.items()
         if size >= LEAST_COUNT_NS and abs(size / SECOND_NS - step) < STEP_S), "",
    )  # fmt: skip
    what = (
        f"began anew as a count of {counter} does"
        if counter
        else f"was set while it recorded: it was {' and '.join(dict.fromkeys(parts))}"
    )
    return frame.with_columns(pl.col("stamp") + pl.Series(add)), what


def _size_of_step(wrong: float) -> str:
    """By how much a stamp was off that came so much later [s] than its fellows."""
    side = "behind" if wrong > 0 else "ahead"
    return f"{dates.how_far(abs(wrong) * SECOND_NS)} {side} for a time"


def _said(what: str, topics: list[str]) -> Finding:
    kind = "wrapped" if what.startswith("began anew") else "clock_offset"
    sentence = (
        f"The clock of {listed(topics, most=dates.MOST_TOPICS)} {what}. Each stamp was held "
        "against the recorder's time next to it."
    )
    return Finding(kind, topics[0] if len(topics) == 1 else "log", sentence)


def _recorder_right(
    frames: dict[str, pl.DataFrame], profile: Profile, steps: Steps
) -> list[Finding]:
    """Put right the recorder's times of the topics that have no stamps, in place."""
    topics: list[str] = []
    begins = [int(steps.logged[first]) for first, _ in steps.pieces]
    ends = [int(steps.logged[last - 1]) for _, last in steps.pieces]
    edges = np.array([(end + begin) // 2 for end, begin in zip(ends, begins[1:], strict=False)])
    wrong = [round((late - steps.reference) * SECOND_NS) for late in steps.late]
    for source in clocks.sources_of(profile):
        frame = frames.get(source.topic)
        if (
            frame is None
            or source.topic in topics
            or clocks.clock_columns(frame, source)[0] != RECORDER
        ):
            continue
        times = frame[RECORDER].to_numpy()
        moved = times - np.array(wrong)[np.searchsorted(edges, times)]
        frames[source.topic] = frame.with_columns(pl.Series(RECORDER, moved))
        topics.append(source.topic)
    if not topics or max(map(abs, wrong)) < STEP_S * SECOND_NS:
        return []
    size = max(wrong, key=abs) / SECOND_NS
    sentence = (
        f"The recorder's clock was set while it recorded, by {dates.how_far(abs(size) * SECOND_NS)}"
        f", as the stamps on {steps.topic} show: the times of {listed(topics)}, which have no "
        "stamp of their own, were put right."
    )
    return [Finding("clock_offset", "log", sentence, value=round(size, 3), unit="s")]
