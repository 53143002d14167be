"""Clocks whose date cannot be right: they were never set, or set to a day that has not come.

A computer without a battery starts in 1970, a receiver without a fix in January 1980. What such a
clock counts from one message to the next holds all the same.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from datetime import UTC, datetime

import polars as pl

from shiplog.exceptions import listed
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.units import SECOND_NS

DAY_NS = 86_400 * SECOND_NS
EARLIEST_NS = 347_155_200 * SECOND_NS  # 1981: what starts in 1970 or in 1980 was not set
# Of this computer's clock. What is set by hand may be a year ahead, and nothing depends on it; a
# counter of weeks that was taken for one turn later is 19.6 years ahead.
AHEAD_NS = 3 * 365 * DAY_NS
LEAST_NOW_NS = 1_767_225_600 * SECOND_NS  # 2026: a computer that says less is not set itself
CLOCKS = {  # a column of times, and whose they are; the first that can be right is believed
    "stamp": "the messages' own stamps", "log_time": "the recorder's clock",
    "publish_time": "the publishers' clock",
}  # fmt: skip
UNDATED = ("clock", "of the table")  # what `convert` notes of a channel; a table may have no date
MOST_TOPICS = 3  # that are named


def possible(instant: float) -> bool:
    """Whether a log can be of this time [ns since 1970]."""
    now = time.time_ns()
    return instant >= EARLIEST_NS and (now < LEAST_NOW_NS or instant <= now + AHEAD_NS)


def date(instant: float) -> str:
    """The day of a time [ns since 1970]."""
    return f"{datetime.fromtimestamp(instant // SECOND_NS, UTC):%Y-%m-%d}"


def how_far(ns: float) -> str:
    """A length of time in words."""
    days = ns / DAY_NS
    if days <= 1.0:
        return f"{ns / SECOND_NS:.3g} s"
    return f"{days:.3g} days" if days < 1000.0 else f"{days:.0f} days"


def middle(times: pl.Series) -> float | None:
    """The median of times [ns]; None where there is none."""
    return times.quantile(0.5, "linear")


def wrong(frame: pl.DataFrame) -> set[str]:
    """The clocks of a topic that are wrong as a whole."""
    dated = {clock: middle(frame[clock]) for clock in CLOCKS}
    return {
        clock for clock, instant in dated.items() if instant is not None and not possible(instant)
    }


def impossible(
    frames: Mapping[str, pl.DataFrame], noted: Mapping[str, Mapping[str, str]]
) -> list[Finding]:
    """One finding a clock that is wrong as a whole, and one where no clock can be right.

    noted  metadata of the channels, by topic
    """
    key, undated = UNDATED
    groups: dict[tuple[str, str, str], list[str]] = {}
    without: list[str] = []
    for topic, frame in frames.items():
        faulty = wrong(frame)
        right = {c: middle(frame[c]) for c in CLOCKS if c not in faulty}
        known = [(c, date(at)) for c, at in right.items() if at is not None]
        if faulty and not known and noted.get(topic, {}).get(key) != undated:
            without.append(topic)
        for clock in faulty if known else ():
            groups.setdefault((clock, *known[0]), []).append(topic)
    findings = [_compare(*of, topics, frames) for of, topics in sorted(groups.items())]
    return findings + ([_none_right(without, frames)] if without else [])


def _compare(
    clock: str, right: str, day: str, topics: list[str], frames: Mapping[str, pl.DataFrame]
) -> Finding:
    ahead = pl.concat([frames[t].select(pl.col(clock) - pl.col(right)) for t in topics])
    low, median, high = (
        float(ahead.to_series().quantile(q, "nearest") or 0) / SECOND_NS for q in (0.05, 0.5, 0.95)
    )
    sentence = (
        f"Messages on {_named(topics)} are of {_date(clock, topics, frames)} by {CLOCKS[clock]}, "
        f"which cannot be; by {CLOCKS[right]} they are of {day}."
    )
    channel = topics[0] if len(topics) == 1 else "log"
    return Finding("clock_offset", channel, sentence, None, None, median, low, high, "s")


def _none_right(topics: list[str], frames: Mapping[str, pl.DataFrame]) -> Finding:
    known = [c for c in CLOCKS if any(frames[t][c].null_count() < frames[t].height for t in topics)]
    by = ", ".join(f"{_date(clock, topics, frames)} by {CLOCKS[clock]}" for clock in known)
    sentence = (
        f"No clock of the messages on {_named(topics)} can be right: they are of {by}. The time "
        "from one message to the next holds; when the voyage was is not known."
    )
    return Finding("clock_offset", topics[0] if len(topics) == 1 else "log", sentence)


def _date(clock: str, topics: list[str], frames: Mapping[str, pl.DataFrame]) -> str:
    instant = middle(pl.concat([frames[topic][clock] for topic in topics]))
    return "no date" if instant is None else date(instant)


def _named(topics: list[str]) -> str:
    return listed(topics, most=MOST_TOPICS)
