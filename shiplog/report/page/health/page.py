"""What `ingest` found in voyages: rows, instruments, findings with their seconds, and tracks."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version

import polars as pl

from shiplog.exceptions import ShiplogError, listed
from shiplog.logs.health.health_report import Finding, VoyageReport
from shiplog.nomenclature.channels import STATE
from shiplog.nomenclature.numbers import counted
from shiplog.report.diagnosis.sections.subject import MOST_VOYAGES, dates
from shiplog.report.evaluation import derived
from shiplog.report.figures import picture_data, voyage_tables
from shiplog.report.figures.content import Content
from shiplog.report.figures.picture_data import PictureData
from shiplog.report.page.blocks import (
    Answers,
    Block,
    Fold,
    Gallery,
    Grid,
    Line,
    Page,
    Paragraph,
    Section,
    number,
    seconds,
)
from shiplog.report.page.drawing import gallery
from shiplog.voyages.store.store import Store

MOST_FINDINGS = 60  # rows of a voyage's table; the JSON has them all
MOST_TRACKS = 12
KNOWN = {"status": "not valid by the instrument's own word", "not_available": "not available"}


def of_voyages(store: Store, names: Sequence[str]) -> Page:
    """The health of these voyages of a store. Raises StoreError."""
    reports = {name: store.report(name) for name in names}
    profile = store.profile(names[:1])
    start = [store.origin(name)[0] for name in names]
    serious = [one for one in reports.values() if one.serious]
    findings = sum(len(one.findings) for one in reports.values())
    lost = sum(one.messages_lost or 0 for one in reports.values())
    usable = sum(one.usable_s or 0 for one in reports.values())
    what = "can be used" if not serious else "cannot all be used as they stand"
    shown = listed(names, most=MOST_VOYAGES)
    word, tone = ("sound", "good") if not findings else ("usable", "open")
    if serious or lost:
        word, tone = "look first", "found"
    return Page(
        title=f"{profile.ship.name}: health of {shown}",
        kicker=f"{profile.ship.name}, {profile.ship.length_m:g} m · {shown} · {dates(start)} · "
        f"profile {profile.source or 'of its own'} · shiplog {version('shiplog')}",
        word=word,
        tone=tone,
        claim=f"{counted(len(names), 'voyage')} with {usable} s of 1 Hz rows {what}; "
        f"{counted(findings, 'finding')}, {counted(lost, 'message')} lost.",
        sections=[
            Section("answer", "The answer", _answer(list(reports.values()))),
            Section("where", "Voyages", _voyages(store, names, reports)),
            *[
                Section(f"voyage-{i}", name, _voyage(report))
                for i, (name, report) in enumerate(reports.items(), 1)
            ],
        ],
    )


def _answer(reports: Sequence[VoyageReport]) -> list[Block]:
    clashes = [f for one in reports for f in one.contradictions]
    first: list[Line] = [[f.sentence] for f in clashes[:4]] or [["No two channels exclude each "
                                                                "other."]]  # fmt: skip
    gone = [
        ([f"{one.name}: {one.messages_lost} messages lost."] if one.messages_lost is not None
         else [f"{one.name}: a part of the file is lost; how many messages it held is not known."])
        for one in reports if one.messages_lost != 0
    ]  # fmt: skip
    missing = {n.what: n for one in reports for n in one.not_compared}
    left: list[Line] = [
        [f"{n.what[:1].upper()}{n.what[1:]}: {n.reason}. It would take {n.would_show}."]
        for n in missing.values()
    ]
    kinds = pl.DataFrame({"kind": [f.kind for one in reports for f in one.findings]})
    counts = kinds["kind"].value_counts(sort=True, name="n").rows() if len(kinds) else []
    listed_kinds: list[Line] = [[f"{k.replace('_', ' ')}: {n}"] for k, n in counts[:6]]
    return [Answers([
        ("Do the channels agree?", first),
        ("What was lost?", gone or [["Every message could be read."]]),
        ("What was found?", listed_kinds or [["Nothing."]]),
        ("What could not be compared?", left[:4] or [["Everything could be compared."]]),
    ])]  # fmt: skip


def _voyages(store: Store, names: Sequence[str], reports: dict[str, VoyageReport]) -> list[Block]:
    rows = [
        ([name], [seconds(r.seconds)], [number(r.rows, "", 9)],
         ["-"] if r.usable_s is None else [number(r.usable_s, "s", 9)],
         ["-"] if r.windows is None else [number(r.windows, "", 9)], [number(len(r.findings))])
        for name, r in reports.items()
    ]  # fmt: skip
    head = ("voyage", "length", "rows at 10 Hz", "usable", "windows of 100 s", "findings")
    found: list[Block] = [Grid(head, rows, head[1:])]
    try:
        drawn = content(store, names, reports)
    except ShiplogError as error:  # two ships, or two profiles: the table stands without pictures
        return [*found, Paragraph([f"No pictures: {error}"])]
    found.append(Gallery(gallery(drawn, ("stretches", "wind", "drift"))))
    tracks = [d for name in names[:MOST_TRACKS] for d in gallery(drawn, ("track",), name)]
    if tracks:
        found.append(Gallery(tracks))
    return found


def content(store: Store, names: Sequence[str], reports: dict[str, VoyageReport]) -> Content:
    """What the pictures are drawn from: tracks, conditions, and the findings as stretches."""
    profile = store.profile(names)
    seconds = voyage_tables.Seconds.of(store, names, profile)
    states = (c.name for c in STATE)
    data = PictureData(
        title=profile.ship.name,
        length=profile.ship.length_m,
        breadth=profile.ship.breadth,
        outline=tuple(profile.ship.outline or ()),
        banks=tuple(tuple((x, y) for x, y in bank) for bank in profile.site.banks),
        voyages=seconds.voyages,
        measured=seconds.rows.select("voyage", pl.col("elapsed").alias("time"), *states),
        conditions=voyage_tables.conditions(None, seconds.rows, profile),
    )
    marked = [
        {"voyage": name, "kind": f.kind.replace("_", " "), "start_s": f.start_s,
         "end_s": f.end_s if f.end_s is not None else f.start_s + 1.0}
        for name, report in reports.items()
        for f in report.findings
        if f.start_s is not None
    ]  # fmt: skip
    nothing = {key: [] for key in ("causes", "ranking", "limits", "wrong")}
    return Content(nothing | {"intervals": marked}, picture_data.typed(data))


def _voyage(report: VoyageReport) -> list[Block]:
    found: list[Block] = []
    if report.findings:
        rows = [_finding(f) for f in report.findings[:MOST_FINDINGS]]
        head = ("kind", "channel", "from", "to", "what")
        found.append(Grid(head, rows, head[2:4]))
        if len(report.findings) > MOST_FINDINGS:
            found.append(Paragraph([f"And {len(report.findings) - MOST_FINDINGS} more, in "
                                    "voyage.json."]))  # fmt: skip
    else:
        found.append(Paragraph(["Nothing was found."]))
    rows = [
        ([one.channel.replace("_", " ")], [number(one.rate_hz, "Hz")],
         [number(one.resolution, one.unit)], [number(one.sigma, one.unit)],
         [number(one.clock_s, "s")])
        for one in report.instruments
    ]  # fmt: skip
    if said := derived.of_voyages(report.derived):
        found.append(Paragraph([f"{said[:1].upper()}{said[1:]}."]))
    if rows:
        head = ("instrument", "rate", "resolution", "sigma", "clock")
        found.append(Fold("Instruments", [Grid(head, rows, head[1:])]))
    return found


def _finding(one: Finding) -> tuple[Line, ...]:
    begin: Line = ["-"] if one.start_s is None else [seconds(one.start_s)]
    end: Line = ["-"] if one.end_s is None else [seconds(one.end_s)]
    kind = KNOWN.get(one.kind, one.kind.replace("_", " "))
    return [kind], [one.channel.replace("_", " ")], begin, end, [one.sentence]
