"""Times of a table that step back: each step has one explanation, looked for before any sorting.

A row is followed by an earlier one where a counter wraps, where a day or summer time ends, where
the recorder was started again or its clock was set back, or where rows were only written late. In
the first cases the rows go on, and the count with them. A second start is a second voyage. Only
late rows are sorted.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from datetime import UTC, datetime

import numpy as np
import polars as pl

from shiplog.exceptions import ProfileError
from shiplog.logs.health import dates
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.units import SECOND_NS

HOUR_NS, DAY_NS, WEEK_NS = 3600 * SECOND_NS, dates.DAY_NS, 7 * dates.DAY_NS
# Counters by their bits and the tick that they count. What a restart is as likely to be (a minute,
# an hour, a power of ten) is not among them.
BITS = (16, 24, 31, 32)
TICKS = {"ns": 1, "us": 1_000, "10 us": 10_000, "100 us": 100_000, "ms": 1_000_000, "10 ms": 10**7}
COUNTERS = {
    f"2^{bits} {tick}": 2**bits * ns for bits in BITS for tick, ns in TICKS.items()
} | {"a GPS week": WEEK_NS, "a day": DAY_NS}  # fmt: skip
CALENDAR = {
    "1024 weeks": 1024 * WEEK_NS, "a day": DAY_NS, "12 hours": DAY_NS // 2, "an hour": HOUR_NS,
}  # fmt: skip
GOES_ON = 2.5  # median steps: a count that goes on misses no more rows where it begins anew
LEAST_WRAP = 20.0  # median steps: a shorter count than this is not told from rows written late
SEVERAL = 3  # rows on either side that tell a second recording from late rows
BACK = 2.0  # median steps: what goes back by less is jitter of the stamps
COVERED = 0.5  # of the rows that go back: so many stood there before, if it is a second recording
MOST_PARTS = 20  # starts in one file; rows that step back more often are in no order
DISORDER = 0.02  # of the rows: likewise
BACKWARDS = 0.9  # of the steps: a table that begins with its latest row
STARTS_NS = 60 * SECOND_NS  # a counter below this has just been started

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ExplainedTimes:
    """A clock along the rows of a table.

    time      [n] ns, in the order of the rows, counted on where a count began anew
    part      [n] 0, 1, ...: of which start of the recorder a row is
    findings  what was counted on, and what of it concerns which part: (part or None, finding)
    """

    time: np.ndarray
    part: np.ndarray
    findings: tuple[tuple[int | None, Finding], ...] = field(default=())


@dataclass
class _Course:
    """What was found on the way from row to row."""

    time: np.ndarray
    part: np.ndarray
    counts: dict[str, int] = field(default_factory=dict)
    starts: list[tuple[int, int]] = field(default_factory=list)  # first row and step back [ns]


def explain_steps(time: np.ndarray, kind: np.ndarray | None = None) -> ExplainedTimes:
    """The times of a table's rows, each step back explained.

    time    [n] ns, in the order of the file
    kind    [n] which columns a row fills: instruments with rows of their own are one recording

    Raises ProfileError where there are more starts than a recording has.
    """
    time = np.asarray(time, np.int64)
    step = np.diff(time)
    if len(time) < 3 or not ((step < 0).any() or (step >= HOUR_NS).any()):
        return ExplainedTimes(time, np.zeros(len(time), np.int64))
    if (step < 0).sum() > BACKWARDS * (step != 0).sum():
        turned = explain_steps(time[::-1], None if kind is None else kind[::-1])
        return ExplainedTimes(
            turned.time[::-1], turned.part.max() - turned.part[::-1], turned.findings
        )
    ahead = step[step > 0]
    usual = float(np.median(ahead)) if len(ahead) else 0.0
    breaks = _breaks(time, step, usual)
    back = [row for row in breaks if step[row] < 0]
    if len(back) > max(MOST_PARTS, DISORDER * len(time)):  # shuffled, or a block each instrument
        return ExplainedTimes(time, np.zeros(len(time), np.int64))
    course = _Course(time.copy(), np.zeros(len(time), np.int64))
    kind = np.zeros(len(time), np.int64) if kind is None else np.asarray(kind)
    _follow(course, breaks, usual, kind)
    return ExplainedTimes(course.time, course.part, tuple(_findings(course)))


def _breaks(time: np.ndarray, step: np.ndarray, usual: float) -> list[int]:
    """Rows before a step back that is no jitter, or before one ahead that a calendar may have."""
    back = step < -max(BACK * usual, 1.0)
    far = np.zeros(len(step), bool)
    if dates.possible(float(np.median(time))):
        for size in CALENDAR.values():
            far |= (step > size) & (step <= size + GOES_ON * usual)
    return np.flatnonzero(back | far).tolist()


def _follow(course: _Course, breaks: list[int], usual: float, kind: np.ndarray) -> None:
    """From break to break: what the count of the rows after it has to be raised by, or that they
    are a new part."""
    raw, time, part = course.time.copy(), course.time, course.part
    dated = dates.possible(float(np.median(raw)))
    added: list[tuple[str, int]] = []  # what the calendar has added so far
    begins = 0  # first row of the part
    for number, row in enumerate(breaks):
        total = sum(size for _, size in added)
        end = breaks[number + 1] + 1 if number + 1 < len(breaks) else len(raw)
        step = int(raw[row + 1] - raw[row])
        if step > 0:
            _explain_step_ahead(course, added, raw, row, usual, breaks, number)
            continue
        name, size = _count(int(raw[row]), int(raw[row + 1]), usual, dated)
        if size:
            added.append((name, size))
            course.counts[name] = course.counts.get(name, 0) + 1
            time[row + 1 :] = raw[row + 1 :] + total + size
        elif _second_start(time, row, begins, end, kind, usual, dated):
            part[row + 1 :] += 1
            begins = row + 1
            course.starts.append((row + 1, -step))
            if len(course.starts) >= MOST_PARTS:
                raise ProfileError(
                    f"The times go back {len(course.starts)} times while the rows go on, by "
                    f"{dates.how_far(-step)} at row {row + 2}: a recorder is not started so often.",
                    hint='name another column as { channel = "time" } in [table], or cut the '
                    "table where its clock begins again.",
                )


def _explain_step_ahead(
    course: _Course, added: list[tuple[str, int]], raw: np.ndarray, row: int, usual: float,
    breaks: list[int], number: int,
) -> None:  # fmt: skip
    """A step ahead by what the calendar has: the end of one that was counted on, a date that came
    a moment early, or summer time; else a pause, and no fault."""
    step = int(raw[row + 1] - raw[row])
    name, size = next(
        ((n, s) for n, s in CALENDAR.items() if 0 < step - s <= GOES_ON * usual), ("", 0)
    )
    total = sum(one for _, one in added)
    if (name, size) in added:
        added.remove((name, size))
        course.time[row + 1 :] = raw[row + 1 :] + total - size
        return
    following = breaks[number + 1] if number + 1 < len(breaks) else None
    back = 0 if following is None else int(raw[following + 1] - raw[following])
    if following is not None and back < 0 and 0 < back + size <= GOES_ON * usual:
        course.time[row + 1 :] = raw[row + 1 :] + total - size
        added.append((name, -size))  # the step back that follows adds it again
        course.counts[name] = course.counts.get(name, 0) + 1
    elif name == "1024 weeks":
        course.time[: row + 1] += size
        course.counts[name] = course.counts.get(name, 0) + 1
    elif name == "an hour" and _summer_begins(int(raw[row]), usual):
        added.append((name, -size))
        course.time[row + 1 :] = raw[row + 1 :] + total - size
        course.counts["summer time"] = course.counts.get("summer time", 0) + 1


def _count(before: int, after: int, usual: float, dated: bool) -> tuple[str, int]:
    """The count that begins anew between two times [ns], and its size; ("", 0) where none does.

    A counter ends at its size and begins at 0, or at minus half of it; a calendar may go back
    anywhere.
    """
    step, slack = before - after, GOES_ON * usual
    for name, size in (CALENDAR if dated else COUNTERS).items():
        if not 0 < size - step <= slack or size < LEAST_WRAP * usual:
            continue
        origin = 0 if after >= 0 else -size // 2
        if dated or (abs(after - origin) <= slack and abs(before - origin - size) <= slack):
            return name, size
    return "", 0


def _second_start(
    time: np.ndarray, row: int, begins: int, end: int, kind: np.ndarray, usual: float, dated: bool
) -> bool:
    """Whether the rows after `row` are another recording, and not rows of this one written late.

    Late rows fill a hole. Those of another recording have times at which this one has rows of the
    same instruments; or its counter has been started, and does not end where this one begins.
    """
    past = np.flatnonzero(time[row + 1 : end] > time[row])
    was, now = slice(begins, row + 1), slice(row + 1, row + 1 + int(past[0]) if len(past) else end)
    first, until = int(time[row + 1]), int(time[now].max())  # of what goes back
    inside = (time[was] >= first) & (time[was] <= until)
    later = (time[now] >= first) & (time[now] <= until)
    for one in np.unique(kind[now][later]):
        many = int((later & (kind[now] == one)).sum())
        before = int((inside & (kind[was] == one)).sum())
        if many >= SEVERAL and before >= max(COVERED * many, SEVERAL):
            return True
    earliest = int(time[was].min())
    joins = abs(earliest - int(time[row + 1 : end].max())) <= GOES_ON * usual
    return not dated and 0 <= first <= STARTS_NS and first < earliest and not joins


def _summer_begins(before: int, usual: float) -> bool:
    """Whether a time [ns] is the last before clocks are put on: a Sunday of March at a full hour,
    the last one in Europe, the second one in America."""
    next_hour = before + GOES_ON * usual
    if before // HOUR_NS == next_hour // HOUR_NS and before % HOUR_NS:
        return False
    at = datetime.fromtimestamp(next_hour // SECOND_NS, UTC)
    sunday = at.month == 3 and at.weekday() == 6 and (8 <= at.day <= 14 or at.day >= 25)
    return sunday and at.hour in (1, 2, 3)


def _findings(course: _Course) -> list[tuple[int | None, Finding]]:
    found: list[tuple[int | None, Finding]] = []
    for name, count in course.counts.items():
        times = "once" if count == 1 else f"{count} times"
        if name in ("an hour", "summer time", "12 hours"):
            what = "as a clock does when summer time ends" if name == "an hour" else (
                "as a clock does when summer time begins" if name == "summer time"
                else "as a clock of twelve hours does"
            )  # fmt: skip
            step = "ahead by an hour" if name == "summer time" else f"back by {name}"
            sentence = (
                f"The table's times step {step} {times} while the rows go on, {what}: they "
                "were counted on from the first row."
            )
            found.append((None, Finding("clock_offset", "log", sentence, value=float(count))))
            continue
        sentence = (
            f"The table's clock begins anew {times}, as a count of {name} does: it was counted on."
        )
        found.append((None, Finding("wrapped", "log", sentence, value=float(count), unit="times")))
    total = len(course.starts) + 1
    for part in range(total if course.starts else 0):
        row, step = course.starts[max(part - 1, 0)]
        sentence = (
            f"The table's times go back by {dates.how_far(step)} at row {row + 1} of the table "
            "while the rows go on: a recorder that was started again, or whose clock was set. "
            f"This is part {part + 1} of {total}."
        )
        found.append(
            (part, Finding("restarted", "log", sentence, value=step / SECOND_NS, unit="s"))
        )
    return found


def of_one_recording(time: pl.Series, where: str) -> pl.Series:
    """The times [Int64, ns, with nulls] of one topic's table, counted on where a count began anew.

    Raises ProfileError where its recorder was started again: the other topics' tables would have to
    be cut at the same moment.
    """
    known = time.is_not_null().to_numpy()
    course = explain_steps(time.filter(time.is_not_null()).to_numpy())
    for part, finding in course.findings:
        if part is not None:
            raise ProfileError(
                f"{where}: {finding.sentence.rsplit(' This is part', 1)[0]}",
                hint="cut the tables of the folder where the recorder was started again, and "
                "convert each part by itself.",
            )
        log.warning("%s: %s", where, finding.sentence)
    if not course.findings:
        return time
    counted = time.fill_null(0).to_numpy().copy()
    counted[known] = course.time
    return pl.Series(time.name, counted).set(time.is_null(), None)
