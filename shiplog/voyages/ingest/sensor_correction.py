"""What the sensors say of each other beyond doubt, put right: by the formulas of the diagnosis.

A row that was no data stays as it was. A row whose value would have to come from where nothing was
measured (a late clock, at the end of a stretch or before a gap) becomes a gap.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import replace
from itertools import pairwise

import numpy as np
import polars as pl

from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature import channels, frames, units
from shiplog.nomenclature.channels import Quality
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.ingest.ingest import Voyage, usable
from shiplog.voyages.rows import fault_detection
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.sensors import instrument_faults as faults
from shiplog.voyages.sensors.comparison import Comparison, compare
from shiplog.voyages.sensors.sensor_findings import Estimate

STATE_NAMES = [c.name for c in channels.STATE]
SENSOR_COLUMNS = {"yaw_rate": [5], "position": [0, 2], "velocity": [1, 3]}  # in STATE_NAMES
HEADING_COLUMN = 4
DOUBTFUL = Quality.SPIKE | Quality.FROZEN  # of a channel that the mark does not name

LESS = 0.5  # of a fault may be left once it is corrected

Remedy = Callable[[Record, float], Record]
Key = tuple[str, str]  # kind and channel of an estimate


def _antenna(ahead: float, starboard: float) -> Remedy:
    """The position alone moves: it is against the velocity that the antenna is misplaced."""

    def without(record: Record, size: float) -> Record:
        moved = faults.without_antenna_offset(record, size * ahead, size * starboard)
        state = record.state.copy()
        state[:, SENSOR_COLUMNS["position"]] = moved.state[:, SENSOR_COLUMNS["position"]]
        return replace(record, state=state)

    return without


def _clock(channel: str) -> Remedy:
    return lambda record, late: faults.without_clock_offset(record, channel, late)


REMEDIES: dict[tuple[str, str], Remedy] = {  # in the order of the consistency equations
    ("clock_offset", "yaw_rate"): _clock("yaw_rate"),
    ("clock_offset", "gnss"): _clock("gnss"),
    ("clock_offset", "position"): _clock("position"),
    ("clock_offset", "velocity"): _clock("velocity"),
    ("yaw_rate_bias", "yaw_rate"): faults.without_yaw_rate_bias,
    ("yaw_rate_scale", "yaw_rate"): faults.without_yaw_rate_scale,
    ("heading_offset", "heading"): faults.without_heading_offset,
    ("velocity_scale", "velocity"): faults.without_velocity_scale,
    ("antenna_offset", "position ahead"): _antenna(1.0, 0.0),
    ("antenna_offset", "position starboard"): _antenna(0.0, 1.0),
}


def corrected(voyage: Voyage) -> Voyage:
    """The voyage with what is certain put right; its findings say so. Rows and times stay.

    The comparison is run again on the corrected rows. A correction after which it is no better, or
    after which two channels contradict each other that did not, is undone, and that is said.
    """
    sure = [e for e in voyage.estimates if e.certain]
    undone: dict[tuple[str, str], str] = {}
    table, gaps, kept = voyage.table, [], sure
    while kept:
        table, gaps = put_right(voyage.table, voyage.profile, kept)
        worse = _worse(compare(table, voyage.profile), kept, voyage)
        if not worse:
            break
        undone |= worse
        kept = [e for e in kept if (e.kind, e.channel) not in worse]
    if not kept:
        table, gaps = voyage.table, []
    done = {(e.kind, e.channel) for e in kept}
    asked = {(e.kind, e.channel) for e in voyage.estimates if e.notable and e.question}
    applied = [replace(f, sentence=f.sentence + _said(f, done, undone, asked))
               for f in voyage.report.findings]  # fmt: skip
    usable_s, windows = usable(table, voyage.profile)
    report = replace(voyage.report, findings=(*applied, *gaps), usable_s=usable_s, windows=windows)
    return replace(voyage, table=table, report=report, corrected=tuple(kept))


def _said(
    finding: Finding, done: Set[Key], undone: Mapping[Key, str], asked: Set[Key]
) -> str:  # fmt: skip
    key = finding.kind, finding.channel
    if key in done:
        return " Corrected."
    if key in undone:
        return f" Not corrected: {undone[key]}."
    if key in asked:
        return (
            " Not corrected: that may be a unit in the profile, or lies at the limit of the search."
        )
    return ""


def _worse(after: Comparison, tried: Sequence[Estimate], voyage: Voyage) -> dict[Key, str]:
    """Of corrections, those to take back, each with the reason. Where two channels exclude each
    other now, all are."""
    before = {f.channel for f in voyage.report.contradictions}
    new = [f for f in after.contradictions.findings if f.channel not in before]
    if new:
        why = f"afterwards two channels contradict each other ({new[0].channel})"
        return {(e.kind, e.channel): why for e in tried}
    left = {(e.kind, e.channel): e for e in after.estimates}
    worse = {}
    for e in tried:
        now = left.get((e.kind, e.channel))
        if now is not None and now.notable and abs(now.value - now.none) > LESS * abs(
            e.value - e.none
        ):  # fmt: skip
            worse[e.kind, e.channel] = "the comparison is no better afterwards"
    return worse


def put_right(
    table: pl.DataFrame, profile: Profile, faults: Sequence[Estimate]
) -> tuple[pl.DataFrame, list[Finding]]:
    """A voyage's table without these faults, and the gaps that this leaves."""
    if not faults:
        return table, []
    record, rows = _record(table, profile)
    found = {(e.kind, e.channel): e for e in faults}
    for key, remedy in REMEDIES.items():
        if e := found.get(key):
            size = (e.value - e.none) * units.factor(e.unit)  # zero where there is no fault
            record = remedy(record, size)
    mark = table["quality"].to_numpy().copy()
    before = _state(table)
    state = np.full_like(before, np.nan)
    state[rows[rows >= 0]] = record.state[rows >= 0]
    state[:, HEADING_COLUMN] = frames.wrap(state[:, HEADING_COLUMN])
    good = (mark & int(channels.UNUSABLE)) == 0
    whole, gaps = good.copy(), []
    for name, columns in SENSOR_COLUMNS.items():  # the yaw rate first: a row is reported once
        lost = whole & ~np.isfinite(state[:, columns]).all(axis=1)
        whole &= ~lost
        spans = [fault_detection.seconds(stretch) for stretch in fault_detection.stretches(lost)]
        gaps += fault_detection.findings_of(
            "gap", name, spans, "has no sample once clocks are put right"
        )
    mark[good & ~whole] |= int(Quality.GAP)
    state = np.where(good[:, None], state, before)
    put = [pl.Series(name, column) for name, column in zip(STATE_NAMES, state.T, strict=True)]
    table = table.with_columns(*put, pl.Series("quality", mark))
    return table.with_columns(pl.col(STATE_NAMES).fill_nan(None)), gaps


def _state(table: pl.DataFrame) -> np.ndarray:
    """[n, 6], NaN where there is no value."""
    return table.select(pl.col(STATE_NAMES).fill_null(np.nan)).to_numpy()


def _record(table: pl.DataFrame, profile: Profile) -> tuple[Record, np.ndarray]:
    """The table as the causes read it, every row, and each stretch between two rows of nothing:
    what a clock would have to fetch from beyond is not there. `record.read` would bridge it.

    returns  the record, and for each of its rows the table's; -1 for a row of nothing
    """
    mark = table["quality"].to_numpy()
    jumps = np.flatnonzero((mark & int(Quality.JUMP)) != 0)
    edges = np.unique(np.concatenate(([0], jumps, [table.height])))
    rows = np.concatenate([np.r_[-1, a:b, -1] for a, b in pairwise(edges.tolist())])
    starts = (rows < 0) & (np.concatenate(([-1], rows[:-1])) < 0)
    state = _state(table)[rows]
    state[(rows < 0) | ((mark[rows] & int(DOUBTFUL)) != 0)] = np.nan
    none = np.zeros(len(rows))
    record = Record(
        profile=profile, names=("",), voyage=none.astype(int), time=none, share=none,
        starts=starts, measured=rows >= 0, state=state,
        actuator=np.zeros((len(rows), 0)), wind=np.zeros((len(rows), 2)),
    )  # fmt: skip
    return record, rows
