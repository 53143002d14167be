"""The page of a sheet of manoeuvres."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version

from shiplog.exceptions import listed
from shiplog.manoeuvres.criteria import SHIPS
from shiplog.manoeuvres.entry import Entry
from shiplog.manoeuvres.entry import Line as Quantity
from shiplog.manoeuvres.quantity import Estimate
from shiplog.manoeuvres.sheet import Sheet
from shiplog.nomenclature.numbers import counted
from shiplog.report.manoeuvres import drawing
from shiplog.report.manoeuvres.sheet import (
    columns_of,
    conditions,
    head,
    limit,
    met,
    not_applying,
    standing,
    value,
)
from shiplog.report.page.blocks import (
    Block,
    Drawn,
    Fold,
    Gallery,
    Grid,
    Items,
    Line,
    Number,
    Page,
    Paragraph,
    Section,
)

MODELS = ("simulated", "extended")
MOST_DRAWN = 24  # manoeuvres with a picture; the table has them all
TERMS = (
    ("advance, transfer, tactical diameter", "distances along and across the approach at 90 and "
     "180 degrees of heading, from the order, in lengths of the ship"),
    ("overshoot", "the heading's peak minus the heading at which the rudder was ordered back"),
    ("time to check yaw", "from that order to the peak"),
    ("period", "between the first and the third peak of a zigzag"),
    ("track reach, head reach", "along the track, and along the approach, from the order to astern "
     "until the ship is stopped in the water"),
    ("90 % interval", "of a measured value: the noise of its instruments, the instant of the order "
     "and the current that was taken out; of a simulated one: coefficients or seeds, and what "
     "held-out voyages have shown the model to get wrong"),
    ("*", "the model left its training data in this manoeuvre, and its interval is wider for it"),
)  # fmt: skip


def of_sheet(sheet: Sheet) -> Page:
    ship = sheet.profile.ship
    sailed = [e for e in sheet.entries if e.voyage is not None and e.lines]
    alone = [e for e in sheet.entries if e.voyage is None]
    short = [e for e in sheet.entries if e.voyage is not None and not e.lines]
    word, tone, claim = _answer(sheet, sailed, alone)
    scaled = "" if sheet.scale == 1.0 else f", scaled by {sheet.scale:g}"
    runs = [run for run in sheet.runs if run]
    parts = [f"{ship.name}, {ship.length_m * sheet.scale:g} m{scaled}"]
    parts += [listed(sheet.voyages, most=3)] if sheet.voyages else []
    parts += [listed(runs)] if runs else []
    sections = [Section("answer", "The answer", _summary(sheet, sailed, alone))]
    if sailed:
        sections.append(Section("measured", "Manoeuvres of the voyages", _all(sailed, sheet)))
    if alone:
        sections.append(Section("simulated", "By the model alone", _all(alone, sheet, "alone")))
    if short:
        sections.append(Section("parts", "Recognised, without a quantity", [Items(
            [[f"{head(e)}: {'; '.join(e.why_not)}."] for e in short]
        )]))  # fmt: skip
    sections.append(Section("terms", "Terms and limits", _terms(sheet)))
    return Page(
        title=f"{ship.name}: manoeuvres",
        kicker=" · ".join((*parts, f"shiplog {version('shiplog')}")),
        word=word,
        tone=tone,
        claim=claim,
        sections=sections,
    )


def _answer(sheet: Sheet, sailed: Sequence[Entry], alone: Sequence[Entry]) -> tuple[str, str, str]:
    name = sheet.profile.ship.name
    judged = [(e, line, met(line)) for e in (*sailed, *alone) for line in e.lines]
    broken = [(e, line) for e, line, kept in judged if kept is False]
    kept = [1 for _, _, one in judged if one]
    there = counted(len(sailed), "manoeuvre")
    if broken:
        words = sorted({f"{line.kind.words} of a {e.kind.replace('_', '-')}" for e, line in broken})
        return "limit exceeded", "found", f"{name}: {'; '.join(words)} above IMO's limit."
    if kept:
        return "within limits", "good", f"{name}: {len(kept)} quantities have a limit of IMO's " \
            "that applies, and keep it."  # fmt: skip
    if sailed:
        return "measured", "open", f"{name}: {there} measured; no limit of IMO's applies."
    return "simulated", "open", f"{name}: what the model does by the book; no limit applies."


def _summary(sheet: Sheet, sailed: Sequence[Entry], alone: Sequence[Entry]) -> list[Block]:
    """What IMO's standards ask about, of every manoeuvre that has it."""
    entries = (*sailed, *alone)
    found: Sequence[tuple[Entry, Quantity]] = [
        (e, line) for e in entries for line in e.lines if line.limit is not None
    ]
    columns = [("measured", "measured")] if sailed else []
    columns += [(k, k) for k, run in zip(MODELS, sheet.runs, strict=True) if run]
    judged = any(line.limit.applies for _, line in found if line.limit is not None)
    rows = []
    for entry, line in found:
        kept = {True: "kept", False: "exceeded", None: "-"}[met(line)]
        rows.append((
            [_place(entry)], [entry.name], [line.kind.words],
            *(_cell(getattr(line, key), line.kind.unit) for _, key in columns), [limit(line)],
            *([[kept]] if judged else []),
        ))  # fmt: skip
    titles = (
        "voyage", "manoeuvre", "quantity", *(title for title, _ in columns), "IMO MSC.137(76)",
        *(["limit"] if judged else []),
    )  # fmt: skip
    right = [title for title, _ in columns]
    table: list[Block] = [Grid(titles, rows, right, "What the standards ask about")] if rows else []
    notes: list[Line] = [[note] for note in (*not_applying(entries), *sheet.notes)]
    return [*table, Items(notes)]


def _place(entry: Entry) -> str:
    return "model alone" if entry.voyage is None else f"{entry.voyage}, {entry.start:.0f} s"


def _cell(estimate: Estimate | None, unit: str) -> Line:
    """The number that the JSON has, with its interval."""
    if estimate is None:
        return ["-"]
    text = value(estimate)
    middle, _, rest = text.partition(" ")
    after = f" {rest}" if rest else ""
    return [Number(estimate.value, middle), f"{after} {unit}" if unit != "1" else after]


def _all(entries: Sequence[Entry], sheet: Sheet, prefix: str = "voyage") -> list[Block]:
    pictures: list[Drawn] = []
    for number, entry in enumerate(entries[:MOST_DRAWN], 1):
        one = drawing.picture(entry, f"{prefix}-{number}")
        pictures += [one] if one is not None else []
    blocks: list[Block] = [Gallery(pictures)] if pictures else []
    for entry in entries:
        columns = columns_of(entry, sheet.runs)
        titles = ("quantity", *(title for title, _ in columns), "limit")
        rows = [
            ([line.kind.words],
             *(_cell(getattr(line, key), line.kind.unit) for _, key in columns), [limit(line)])
            for line in entry.lines
        ]  # fmt: skip
        inside: list[Block] = [
            Paragraph([f"{conditions(entry)[:1].upper()}{conditions(entry)[1:]}"])
        ]
        inside += [Paragraph([standing(entry)])] if standing(entry) else []
        inside += [Items([[note] for note in entry.notes])] if entry.notes else []
        inside.append(Grid(titles, rows, [title for title, _ in columns]))
        blocks.append(Fold(head(entry), inside))
    return blocks


def _terms(sheet: Sheet) -> list[Block]:
    length = sheet.profile.ship.length_m * sheet.scale
    meant = "they apply" if length >= 100.0 else "they do not apply to this one"
    return [
        Paragraph([f"IMO's standards, MSC.137(76), are for {SHIPS}; with a length of {length:g} m "
                   f"{meant}."]),
        Fold("Terms", [Items([[f"{word}: {meaning}."] for word, meaning in TERMS])]),
    ]  # fmt: skip
