"""Since when each named cause acts, or how fast it grows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shiplog.report.diagnosis.sections.onset import HALF
from shiplog.report.figures.bars import spoken
from shiplog.report.page.blocks import (
    Block,
    Fold,
    Gallery,
    Grid,
    Line,
    Paragraph,
    number,
    probability,
    seconds,
)
from shiplog.report.page.diagnosis.source import Source
from shiplog.report.page.diagnosis.where import opening

RECORDED = (
    "Times are recorded time: the voyages one after another, in the order of their start, without "
    "what lies between them. The process noise and the other causes are as in the verdict."
)


def blocks(source: Source) -> list[Block]:
    causes = source.verdict["causes"]
    dated = [one for one in causes if one.get("onset")]
    growing = [one for one in causes if one.get("slope")]
    if not dated and not growing:
        why = "None of the named causes was dated." if causes else "No cause is named."
        return [Paragraph([why])]
    found: list[Block] = []
    if pictures := source.gallery(("onset",)):
        found.append(Gallery(pictures))
    if dated:
        head = ("cause", "acts since", "90 % interval", "from the start", "until")
        found.append(Grid(head, [_row(one) for one in dated]))
        found.append(Paragraph([RECORDED]))
    for one in dated:
        found += _while_on(one)
    for one in causes:
        found += _season(one)
    later = [one for one in dated if one["onset"]["from_start"] < HALF]
    if later:
        onset = later[0]["onset"]
        found.append(Paragraph(["The first of these beginnings in the recording:"]))
        found.append(opening(source, onset["voyage"], onset["start_s"]))
    if growing:
        head = ("cause", "change in a day", "90 % interval", "over")
        found.append(Grid(head, [_growth(one) for one in growing]))
    return found


def _row(cause: Mapping[str, Any]) -> tuple[Line, ...]:
    onset, off = cause["onset"], cause.get("off")
    since: Line = ["the start"]
    between: Line = ["-"]
    if onset["from_start"] < HALF:
        between = [seconds(onset["low"]), " to ", seconds(onset["high"])]
        since = [seconds(onset["start_s"]), f" of {onset['voyage']}"]
    until: Line = ["the end"]
    if off is not None:
        until = [
            seconds(off["start_s"]), f" of {off['voyage']} (", seconds(off["low"]), " to ",
            seconds(off["high"]), ")",
        ]  # fmt: skip
    return (
        [spoken(cause["name"])], since, between,
        [probability(onset["from_start"])], until,
    )  # fmt: skip


def _while_on(cause: Mapping[str, Any]) -> list[Block]:
    found = []
    for name, one in (cause.get("while_on") or {}).items():
        unit = one["unit"]
        found.append(Paragraph([
            f"{spoken(cause['name']).capitalize()} while it acts, {name.replace('_', ' ')}: ",
            number(one["value"], unit), " (", number(one["low"], unit), " to ",
            number(one["high"], unit), "). The size above is that of the whole trial.",
        ]))  # fmt: skip
    return found


def _season(cause: Mapping[str, Any]) -> list[Block]:
    """The cause in each voyage."""
    if not (voyages := cause.get("voyages")):
        return []
    rows = [
        ([one["voyage"]], [(one.get("date") or "-")[:10]], [name.replace("_", " ")],
         [number(size["value"], size["unit"])],
         [number(size["low"], size["unit"]), " to ", number(size["high"], size["unit"])])
        for one in voyages for name, size in one["parameters"].items()
    ]  # fmt: skip
    head = ("voyage", "date", "parameter", "value", "90 % interval")
    title = f"{spoken(cause['name']).capitalize()} voyage by voyage, by partial pooling"
    return [Fold(title, [Grid(head, rows, ("value",))])]


def _growth(cause: Mapping[str, Any]) -> tuple[Line, ...]:
    slope = cause["slope"]
    unit = "" if slope["unit"] == "1/day" else slope["unit"]
    return (
        [f"{spoken(cause['name'])}, {slope['parameter'].replace('_', ' ')}"],
        [number(slope["value"], unit)],
        [number(slope["low"], unit), " to ", number(slope["high"], unit)],
        [number(slope["days"], "days")],
    )
