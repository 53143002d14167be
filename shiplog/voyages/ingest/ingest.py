"""One log to one 10 Hz table at midship, with a mark on every row and a finding for every fault.

Value columns are SI, angles in (-π, π]; a value that was not measured is null. The marks are
`channels.Quality`; what they mean for the 1 Hz averages stands in `one_hertz`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import polars as pl

from shiplog.logs.health.health_report import VoyageReport
from shiplog.logs.reading.read import Contents, Reading, read
from shiplog.logs.reading.senders import Senders
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.clocks import clock_contradictions
from shiplog.voyages.contradictions import plausible_measures
from shiplog.voyages.ingest import alignment
from shiplog.voyages.ingest.alignment import Aligned
from shiplog.voyages.rows import one_hertz as tables
from shiplog.voyages.rows import resampling
from shiplog.voyages.samples import fields_read, sampling, two_sources
from shiplog.voyages.sensors import comparison
from shiplog.voyages.sensors.comparison import Comparison, compare
from shiplog.voyages.sensors.sensor_findings import Estimate


@dataclass(frozen=True)
class Voyage:
    """A log as the store takes it."""

    name: str
    profile: Profile
    contents: Contents
    table: pl.DataFrame  # time, the profile's columns, quality
    report: VoyageReport
    datum: tuple[float, float] | None  # latitude, longitude [deg] of x0 = y0 = 0
    estimates: tuple[Estimate, ...]  # what the sensors say of each other
    corrected: tuple[Estimate, ...] | None = None  # of them, what was put right; None: not asked


def ingest(path, profile: Profile) -> Voyage:
    """Read one log through a profile. Raises LogUnreadable, ChannelMissing, ProfileError."""
    sent = two_sources.several(path, profile)
    return build(read(path, fields_read.wanted(profile, sent)), profile, sent)


def build(reading: Reading, profile: Profile, sent: Mapping[str, Senders] | None = None) -> Voyage:
    """Align, reduce to midship, mark. Raises ChannelMissing for a topic or field not there.

    sent  by topic, those who send on it, where there are several
    """
    sampled = sampling.sampled(reading, profile, sent or {})
    reading = replace(reading, frames={})  # as large as the table: gone before the next needs room
    aligned = alignment.aligned(sampled)
    del sampled  # likewise
    table = aligned.table
    compared = _compared(aligned, profile)
    usable_s, windows = usable(table, profile)
    report = VoyageReport(
        name=reading.contents.path.stem,
        messages_read=reading.health.messages_read,
        messages_lost=reading.health.messages_lost,
        rows=table.height,
        seconds=round(aligned.seconds, 3),
        findings=(
            *clock_contradictions.unreported(reading.health.findings, aligned.left_out),
            *aligned.left_out,
            *comparison.without_consequences(aligned.findings, compared.findings),
            *compared.findings,
        ),
        usable_s=usable_s,
        windows=windows,
        instruments=aligned.instruments,
        not_compared=compared.not_compared,
        derived=aligned.derived,
    )
    return Voyage(
        report.name, profile, reading.contents, table, report, aligned.datum, compared.estimates
    )


def usable(table: pl.DataFrame, profile: Profile) -> tuple[int, int]:
    """Seconds and windows of a voyage's 10 Hz rows, as `one_hertz.usable` counts them; no more
    seconds than lie between the first row and the last, although the first average and the last
    one are of half a second each."""
    named = table.lazy().with_columns(voyage=pl.lit(""))
    seconds, windows = tables.usable(tables.resample([named], profile.columns, profile.circular))
    return min(seconds, (table.height - 1) * resampling.STEP_NS // 1_000_000_000), windows


def consistency_of(reading: Reading, profile: Profile, sent: Mapping[str, Senders]) -> Comparison:
    """What the sensors of a log say of themselves and of each other. Raises as `build` does."""
    aligned = alignment.aligned(sampling.sampled(reading, profile, sent))
    compared = _compared(aligned, profile)
    own = [f for f in aligned.left_out if f.kind in ("status", "two_sources", "contradiction")]
    return replace(compared, findings=(*own, *compared.findings))


def _compared(aligned: Aligned, profile: Profile) -> Comparison:
    """Sensors against each other, and then against what ships and winds can do."""
    compared = compare(aligned.table, profile)
    known = {one.channel for one in compared.findings if one.kind == "contradiction"}
    if aligned.misplaced is not None and not known & {"position", "velocity"}:
        compared = replace(compared, findings=(*compared.findings, aligned.misplaced))
    implausible = plausible_measures.of_log(aligned.table, profile, compared.findings)
    return replace(
        compared,
        findings=(*compared.findings, *implausible),
        not_compared=(*compared.not_compared, *plausible_measures.not_compared(profile)),
    )
