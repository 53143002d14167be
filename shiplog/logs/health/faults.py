"""What a log says against itself: losses, disorder, repeats and clocks, each as a sentence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import polars as pl

from shiplog.exceptions import listed
from shiplog.logs.decoding.tables import MOST_STEPS, Order, Tables
from shiplog.logs.health import dates, leap_seconds
from shiplog.logs.health.health_report import Finding
from shiplog.logs.mcap_file.container import Loss
from shiplog.logs.mcap_file.records import LARGEST_MESSAGE
from shiplog.nomenclature.units import SECOND_NS

MOST_TOPICS = 5  # topics of a loss; of a large log it may be hundreds
FEWEST, FEWEST_AGAIN = 20, 5  # messages of a topic, and of them in a stretch that is there twice
TWICE = 1.6  # times the messages of other stretches; two recordings of one instrument have twice
OFFSET = 0.05  # s: closer clocks than this are one clock
CLOCK_PAIRS = (
    ("log_time", "publish_time", "The recorder's clock", "the publishers'"),
    ("publish_time", "stamp", "The publishers' clock", "the messages' own stamps"),
    # where the publish times are of the writing of the file, and no clock of the publishers
    ("log_time", "stamp", "The recorder's clock", "the messages' own stamps"),
)
LATE_WORDS = {  # of a topic that came late, while others did not
    ("log_time", "publish_time"): "recorded {} after they were published",
    ("publish_time", "stamp"): "published {} after the time that they bear",
    ("log_time", "stamp"): "recorded {} after the time that they bear",
}
LATEST_S = 1.5  # of a receiver's latency; 1.06 s have been measured (PCOD of R/V Palmer)
ALIKE = 0.25  # of an offset: what another one differs by, and is the same one
PACE = 0.1  # of the recorder's: publish times that run otherwise are of the writing of a file
LATE_PUBLISH_NS = 60 * SECOND_NS  # nothing is published so long after it was recorded


def losses(
    found: list[Loss], first: int | None, lost: int | None, topics: Mapping[int, str]
) -> list[Finding]:
    """Damage in the file, one finding a stretch: where, from when to when, and on which topics."""
    findings = []
    for loss in found:
        start, end = seconds(loss.start, first), seconds(loss.end, first)
        what = "The chunk at byte" if loss.chunk else "The file at byte"
        sentence = f"{what} {loss.offset} {loss.reason}"
        if loss.kind == "truncated":
            sentence = f"The log is cut off: at byte {loss.offset} it {loss.reason}"
        names = sorted({topics[number] for number in loss.held if number in topics})
        if start is not None and end is not None:
            when = f"from {start:.1f} s to {end:.1f} s"
            if start < end <= 0.0:
                when = f"of {-start:.1f} s before the first message that can be read"
            sentence += f"; {_what(loss, names)} {when}"
            sentence += " are lost" if loss.chunk else " may be lost"
        channel = names[0] if len(names) == 1 else "log"
        findings.append(Finding(loss.kind, channel, sentence + ".", start, end))
    if lost and not found:
        sentence = f"{lost} messages that the log's own statistics count are not in it."
        findings.append(Finding("crc", "log", sentence, value=float(lost)))
    return findings


def _what(loss: Loss, names: list[str]) -> str:
    """What a loss held, as far as the indexes say."""
    count = sum(loss.held.values())
    messages = f"its {count} messages" if count else "its messages" if loss.chunk else "messages"
    return f"{messages} on {listed(names, most=MOST_TOPICS)}" if names else messages


def appended(sections: int) -> list[Finding]:
    """Several logs in one file, as a recorder leaves them that appends."""
    if sections < 2:
        return []
    sentence = f"The file holds {sections} logs, one behind the other; all of them were read."
    return [Finding("out_of_order", "log", sentence, value=float(sections))]


def left_out(orphans: int, tables: Tables) -> list[Finding]:
    """Messages whose bytes arrived whole but that could not be kept."""
    findings = []
    if orphans:
        sentence = f"{orphans} messages belong to channels whose description is lost."
        findings.append(Finding("crc", "log", sentence, value=float(orphans)))
    for counts, what in (
        (tables.failed, "do not fit their schema"),
        (tables.too_large, f"are larger than {LARGEST_MESSAGE >> 20} MB"),
        (tables.too_many, "are more than a log of this size can hold"),
    ):
        for topic, count in counts.items():
            sentence = f"{count} messages on {topic} {what}; left out."
            findings.append(Finding("crc", topic, sentence, value=float(count)))
    return findings


def disorder(
    order: Iterable[tuple[str, Order]], again: Mapping[str, float] | None = None
) -> list[Finding]:
    """Messages written behind a later one of their own channel, and what `restarted` found."""
    again = again or {}
    back = [(topic, o) for topic, o in order if o.back and topic not in again]
    if again:
        size = max(again.values())
        sentence = (
            f"The log's times go back by up to {size:.3g} s on {_topics(again)} while the messages "
            "go on: a recorder that was started again, or whose clock was set."
        )
        return [*disorder(back), Finding("restarted", "log", sentence, value=size, unit="s")]
    if not back:
        return []
    count = sum(o.back for _, o in back)
    largest = max(o.largest for _, o in back) / SECOND_NS
    sentence = (
        f"The log's times step back {count} times on {_topics({topic for topic, _ in back})}, "
        f"by up to {largest:.3g} s; the messages were sorted."
    )
    return [Finding("out_of_order", "log", sentence, value=largest, unit="s")]


def restarted(
    order: Iterable[tuple[str, Order]], frames: Mapping[str, pl.DataFrame]
) -> dict[str, float]:
    """Topics whose messages go on after their log time went back, and by how much [s]: of a
    recorder that was started again, or whose clock was set, while the file stayed the same.

    The times between are then there twice. Messages that were only written late are there once.
    """
    found: dict[str, float] = {}
    for topic, one in order:
        frame = frames.get(topic)
        if not 0 < one.back <= MOST_STEPS or frame is None or frame.height < FEWEST:
            continue
        times = frame["log_time"].to_numpy()
        for before, after, count in one.steps:
            inside = np.searchsorted(times, before, "right") - np.searchsorted(times, after)
            period = (before - one.first) / max(count - 1, 1)
            once = (before - max(after, one.first)) / period if period > 0 else 0.0
            if once >= FEWEST_AGAIN and inside >= TWICE * once:
                found[topic] = max(found.get(topic, 0.0), (before - after) / SECOND_NS)
    return found


def twice(frame: pl.DataFrame) -> set[int]:
    """Log times of the messages that share their stamp with another, and may be the same one."""
    if (frame["stamp"].drop_nulls().diff().drop_nulls() > 0).all():
        return set()
    stamp = pl.col("stamp")
    shared = frame.filter(stamp.is_not_null()).filter(stamp.is_duplicated())
    return set(shared["log_time"].to_list())


def repeats(topic: str, frame: pl.DataFrame, first: int, again: list[int]) -> list[Finding]:
    """Stamps that step back, and messages that came `again` [ns]. Sorted by log time."""
    findings = []
    step = frame["stamp"].drop_nulls().diff()
    back = step.filter(step < 0)
    if len(back):
        largest = -(back.quantile(0.0) or 0.0) / SECOND_NS
        sentence = f"The stamps on {topic} step back {len(back)} times, by up to {largest:.3g} s."
        findings.append(Finding("out_of_order", topic, sentence, value=largest, unit="s"))
    if again:
        start = seconds(min(again), first)
        times = "once" if len(again) == 1 else f"{len(again)} times"
        sentence = f"A message on {topic} came again {times} with the same stamp and content."
        findings.append(
            Finding("duplicate", topic, sentence, start_s=start, value=float(len(again)))
        )
    return findings


def clocks(frames: Mapping[str, pl.DataFrame], reported: Iterable[Finding] = ()) -> list[Finding]:
    """Steady offsets between the recorder's, the publishers' and the messages' own clocks.

    A clock is that of all its topics. Where some are late by no more than a receiver's latency and
    others are not, it is said of their messages and of no clock.

    reported  of the log's clocks already: an offset of that size is not reported again
    """
    findings = []
    known = [f.value for f in reported if f.kind == "clock_offset" and f.value is not None]
    written = {topic for topic, frame in frames.items() if not of_publishers(frame)}
    for ahead, behind, one, other in CLOCK_PAIRS:
        steady: dict[str, float] = {}
        punctual = False
        for topic, frame in frames.items():
            if (topic in written) != ({ahead, behind} == {"log_time", "stamp"}):
                continue
            if len({ahead, behind} & dates.wrong(frame)) == 1:
                continue  # `dates` says so
            median, low, high = spread(frame, ahead, behind)
            if median is not None and abs(median) > OFFSET and high - low <= abs(median):
                steady[topic] = median
            punctual |= median is not None and max(abs(low), abs(high)) <= OFFSET
        for topics in _alike(steady, frames, ahead, behind):
            median, low, high = _pooled(topics, frames, ahead, behind)
            if median is None or any(_same(median, value) for value in known):
                continue
            side = "ahead of" if median > 0 else "behind"
            channel = topics[0] if len(topics) == 1 else "log"
            far = dates.how_far(abs(median) * SECOND_NS)
            when = dates.middle(frames[topics[0]]["log_time"]) or 0.0
            _, scale = leap_seconds.known_difference(median, when)
            sentence = f"{one} is {far} {side} {other} on {_topics(topics)}"
            sentence += f": {scale}." if scale else "."
            if punctual and 0.0 < median <= LATEST_S:
                sentence = (
                    f"The messages on {_topics(topics)} were "
                    f"{LATE_WORDS[ahead, behind].format(far)}, and those on other topics were not: "
                    "they came late, or it is another clock that they were stamped by."
                )
            findings.append(
                Finding("clock_offset", channel, sentence, None, None, median, low, high, "s")
            )
    return findings


def _same(offset: float, other: float) -> bool:
    return abs(offset - other) <= max(OFFSET, ALIKE * abs(other))


def of_publishers(frame: pl.DataFrame) -> bool:
    """Whether a topic's publish times are a clock of its publisher. A writer that stamps "now"
    writes an hour in a second, and years later: these are the times of the writing."""
    both = frame.select("log_time", "publish_time").drop_nulls()
    if both.height < 2:
        return True
    logged, published = (both[name] for name in ("log_time", "publish_time"))
    spans = [float(np.ptp(one.to_numpy())) for one in (logged, published)]
    if float(np.median((published - logged).to_numpy())) < LATE_PUBLISH_NS:
        return True
    return spans[0] > 0 and abs(spans[1] - spans[0]) <= PACE * spans[0]


def spread(frame: pl.DataFrame, ahead: str, behind: str) -> tuple[float | None, float, float]:
    return quantiles(frame.select(pl.col(ahead) - pl.col(behind)).to_series())


def quantiles(difference: pl.Series) -> tuple[float | None, float, float]:
    """Median, 5 % and 95 % points in seconds; None when there is nothing."""
    difference = difference.drop_nulls()
    if difference.is_empty():
        return None, 0.0, 0.0
    low, median, high = (
        float(difference.quantile(q, "nearest") or 0) / SECOND_NS for q in (0.05, 0.5, 0.95)
    )
    return median, low, high


def seconds(time: int | None, first: int | None) -> float | None:
    """Seconds from the first message."""
    return None if time is None or first is None else (time - int(first)) / SECOND_NS


def _pooled(
    topics: list[str], frames: Mapping[str, pl.DataFrame], ahead: str, behind: str
) -> tuple[float | None, float, float]:
    return quantiles(
        pl.concat([frames[t].select(pl.col(ahead) - pl.col(behind)) for t in topics]).to_series()
    )


def _alike(
    medians: dict[str, float], frames: Mapping[str, pl.DataFrame], ahead: str, behind: str
) -> list[list[str]]:
    """Topics that share one offset: all of them if they are steady together, and not far steadier
    each by itself; else in groups."""
    if not medians:
        return []
    median, low, high = _pooled(list(medians), frames, ahead, behind)
    if median is not None and high - low <= abs(median):
        alone = [spread(frames[topic], ahead, behind) for topic in medians]
        if high - low <= max(2.0 * max(b - a for _, a, b in alone), OFFSET):
            return [list(medians)]
    groups: list[list[str]] = []
    start = 0.0
    for topic, offset in sorted(medians.items(), key=lambda item: (item[1], item[0])):
        if not groups or not _same(offset, start):
            groups.append([])
            start = offset
        groups[-1].append(topic)
    return groups


def _topics(names: Iterable[str]) -> str:
    names = sorted(names)
    return listed(names) if len(names) <= dates.MOST_TOPICS else f"{len(names)} topics"
