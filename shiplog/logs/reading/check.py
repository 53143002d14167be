"""The health of a log without a profile: what is readable, lost, late, out of order, missing."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from shiplog.logs.health import faults
from shiplog.logs.health.health_report import Finding, VoyageReport
from shiplog.logs.mcap_file.container import Survey, read_summary
from shiplog.logs.reading.read import Reading, read
from shiplog.nomenclature.units import SECOND_NS

LATE = 0.05  # s: a median delay worth a word
VERY_LATE = 1.0  # s: a single delay worth a word
DROPOUT = 5.0  # periods without a message, and more than
LEAST_GAP = 1.0  # s
MOST_GAPS = 20  # findings on a topic; the rest is summed up
# What a check takes on two cores, for its bar
START_S, BYTES_PER_S, MESSAGES_PER_S = 1.0, 4e8, 6e5
MESSAGE_BYTES = 40  # of a packed sensor message


def check(path: str | Path) -> VoyageReport:
    """What stands in a log and what does not, from all of its topics."""
    return health_of(read(path, {}, others=True))


def health_of(reading: Reading) -> VoyageReport:
    """The same of a log that is read already, all of its topics at least for their times."""
    first = min(_first(frame) for frame in reading.frames.values())
    last = max(int(frame["log_time"][-1]) for frame in reading.frames.values())
    findings = [*reading.health.findings, *_undecodable(reading)]
    for topic, frame in reading.frames.items():
        findings += late(topic, frame)
        findings += dropouts(topic, frame, first)
    return VoyageReport(
        name=reading.contents.path.stem,
        messages_read=reading.health.messages_read,
        messages_lost=reading.health.messages_lost,
        rows=0,  # rows are what `ingest` makes
        seconds=(last - first) / SECOND_NS,
        findings=tuple(findings),
    )


def expected_s(path: Path) -> float:
    """About how long a check takes, by the size of a log and the messages that it says it has."""
    try:
        found = Survey(path, path.stat().st_size)
        with path.open("rb") as stream:
            read_summary(stream, found)
    except OSError:  # the reader says what is wrong with it
        return START_S
    stated = found.statistics
    messages = stated.message_count if stated else found.size / MESSAGE_BYTES
    return START_S + found.size / BYTES_PER_S + messages / MESSAGES_PER_S


def late(topic: str, frame: pl.DataFrame) -> list[Finding]:
    """Messages recorded well after they were measured, by a delay that is not steady.

    A steady delay is a clock offset with a value; this one has only its range and a sentence.
    """
    delay = frame.select(pl.col("log_time") - pl.col("stamp")).to_series()
    median, low, high = faults.quantiles(delay)
    if median is None:
        return []
    most = (delay.quantile(1.0) or 0.0) / SECOND_NS
    if (median <= LATE and most <= VERY_LATE) or (median > LATE and high - low <= median):
        return []
    sentence = (
        f"Messages on {topic} arrive late, and not evenly: {median:.3g} s in the median, "
        f"{most:.3g} s at most."
    )
    return [Finding("clock_offset", topic, sentence, low=low, high=high, unit="s")]


def dropouts(topic: str, frame: pl.DataFrame, first: int) -> list[Finding]:
    """Silences of a topic: longer than a second and than five of its median periods."""
    times_are_stamps = frame["stamp"].null_count() == 0
    times = frame["stamp" if times_are_stamps else "log_time"].sort()
    steps = times.diff()
    period = float(steps.median() or 0)  # type: ignore[arg-type]
    least = max(DROPOUT * period, LEAST_GAP * SECOND_NS)
    ends = (steps > least).arg_true().to_list()
    if not ends or period <= 0:
        return []
    offset = int((frame["log_time"] - frame["stamp"]).median() or 0)  # type: ignore[arg-type]
    offset = offset if times_are_stamps else 0  # reported on the log's own time line
    findings = []
    for end in ends[:MOST_GAPS]:
        start_s, end_s = ((int(times[i]) + offset - first) / SECOND_NS for i in (end - 1, end))
        sentence = f"{topic} is silent for {end_s - start_s:.3g} s from {start_s:.1f} s."
        findings.append(Finding("gap", topic, sentence, start_s, end_s, end_s - start_s, unit="s"))
    if len(ends) > MOST_GAPS:
        rest = ends[MOST_GAPS:]
        total = sum(int(times[i]) - int(times[i - 1]) for i in rest) / SECOND_NS
        sentence = f"{topic} is silent {len(rest)} times more, {total:.3g} s in all."
        findings.append(Finding("gap", topic, sentence, value=total, unit="s"))
    return findings


def _undecodable(reading: Reading) -> list[Finding]:
    return [
        Finding("crc", topic, f"{topic} cannot be decoded: {reason}.")
        for topic, reason in sorted(reading.health.undecodable.items())
    ]


def _first(frame: pl.DataFrame) -> int:
    return int(frame["log_time"][0])
