"""Verdicts or evaluations next to each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np
import polars as pl

from shiplog.exceptions import listed
from shiplog.report.diagnosis.sections.subject import dates
from shiplog.report.figures import changes, style
from shiplog.report.figures.bars import STATED, size_in_words, spoken
from shiplog.report.figures.content import Content
from shiplog.report.page.blocks import (
    Answers,
    Block,
    Drawn,
    Gallery,
    Grid,
    Items,
    Line,
    Page,
    Paragraph,
    Part,
    Section,
    number,
    or_diverged,
    probability,
    share,
)
from shiplog.report.page.comparison.alike import Item, differences
from shiplog.report.page.diagnosis.page import WORDS
from shiplog.report.page.drawing import gallery
from shiplog.simulation import error_reduction

MOST_LIMITS = 30  # rows of the table of smallest sizes


def of_items(items: Sequence[Item]) -> Page:
    """The page; where the items are unlike, it says so first."""
    unlike = differences(items)
    first = items[0]
    verdicts = first.kind == "verdict" and all(one.kind == "verdict" for one in items)
    claim, tone = _claim(items) if verdicts else _claim_of_losses(items)
    sections = [Section("alike", "What is alike", _alike(items, unlike))]
    if verdicts:
        sections += [
            Section("verdicts", "Verdicts", _verdicts(items)),
            Section("sizes", "Sizes of causes", _sizes(items)),
            Section("limits", "Smallest sizes that would show", _limits(items)),
        ]
    elif all(one.kind == "evaluation" for one in items):
        sections.append(Section("errors", "Errors", _errors(items)))
    names = listed((one.name for one in items), most=6)
    ships = listed(dict.fromkeys(str(one.subject["ship"]) for one in items), most=3)
    return Page(
        title=f"{ships}: {names}",
        kicker=f"{ships} · {names} · shiplog {version('shiplog')}",
        word="unlike results" if unlike else "compared",
        tone="found" if unlike else tone,
        claim=claim,
        sections=sections,
    )


# --- what is alike --------------------------------------------------------------------------------


def _alike(items: Sequence[Item], unlike: Sequence[str]) -> list[Block]:
    found: list[Block] = []
    if unlike:
        found.append(Paragraph(["Compared although they are unlike (--anyway):"], strong=True))
        found.append(Items([[why] for why in unlike]))
    rows = [
        ([one.name], [one.kind], [str(one.subject["ship"])], [one.run], [listed(one.voyages, 4)],
         [dates([v["start"] for v in one.subject["voyages"]])],
         [f"{one.subject['window_s']} s"])
        for one in items
    ]  # fmt: skip
    head = ("result", "kind", "ship", "run", "voyages", "when", "window")
    return [*found, Grid(head, rows)]


# --- verdicts -------------------------------------------------------------------------------------


def _claim(items: Sequence[Item]) -> tuple[str, str]:
    said = [f"{one.name}: {_word(one)}" for one in items]
    changed = len({_word(one) for one in items}) > 1 or len({_names(one) for one in items}) > 1
    how = "The verdicts differ" if changed else "The verdicts are the same"
    return f"{how}: {'; '.join(said)}.", "found" if changed else "good"


def _verdict(item: Item) -> Mapping[str, Any]:
    return item.result.verdict


def _names(item: Item) -> tuple[str, ...]:
    return tuple(sorted(cause["name"] for cause in _verdict(item)["causes"]))


def _word(item: Item) -> str:
    verdict = _verdict(item)
    if verdict["causes"]:
        return " and ".join(spoken(one["name"]) for one in verdict["causes"])
    return WORDS.get(verdict["verdict"], (verdict["verdict"],))[0]


def _verdicts(items: Sequence[Item]) -> list[Block]:
    pairs = [(one.name, [[_verdict(one)["sentence"]]]) for one in items]
    rows = []
    for one in items:
        verdict = _verdict(one)
        ranking = verdict["ranking"]
        likely = [r for r in ranking if r["probability"] >= STATED] or ranking[:1]
        gain = verdict.get("gain")
        rows.append((
            [one.name], [_word(one)],
            _ranked(likely),
            ["-"] if not gain else [share(gain["reduction"]), " (", share(gain["low"]), " to ",
                                    share(gain["high"]), ")"],
            ["-"] if not gain else [number(gain["before"])],
            ["-"] if not gain else [number(gain["after"])],
        ))  # fmt: skip
    head = ("result", "verdict", "likeliest", "explained", "L before", "L after")
    return [Answers(pairs), Grid(head, rows, head[4:])]


def _ranked(answers: Sequence[Mapping[str, Any]]) -> Line:
    """Each with its probability; several may act at once."""
    found: list[Part] = []
    for one in answers:
        found += [", " if found else "", spoken(one["name"]), " ", probability(one["probability"])]
    return found or ["-"]


def sizes(items: Sequence[Item]) -> pl.DataFrame:
    """result, cause, parameter, unit, value, low, high: every number of a named cause."""
    rows = [
        (item.name, spoken(cause["name"], _channel(cause)), name, one["unit"],
         float(one["value"]), float(one["low"]), float(one["high"]))
        for item in items
        for cause in _verdict(item)["causes"]
        for name, one in cause["parameters"].items()
        if not isinstance(one["value"], str)
    ]  # fmt: skip
    return pl.DataFrame(rows, changes.SCHEMA, orient="row")


def _channel(cause: Mapping[str, Any]) -> str | None:
    one = cause["parameters"].get("channel") or cause["parameters"].get("actuator")
    return str(one["value"]) if one else None


def _sizes(items: Sequence[Item]) -> list[Block]:
    table = sizes(items)
    if table.is_empty():
        return [Paragraph(["None of them names a cause with a size."])]
    drawn = [
        Drawn(style.svg(changes.figure(own), f"size-{i}"), changes.words(own), title)
        for i, (title, own) in enumerate(changes.by_parameter(table))
    ]
    rows = []
    names = [one.name for one in items]
    for title, own in changes.by_parameter(table):
        cells: list[Line] = []
        by = {row["result"]: row for row in own.to_dicts()}
        for name in names:
            row = by.get(name)
            cells.append(["not named"] if row is None else [
                number(row["value"], row["unit"]), " (", number(row["low"], row["unit"]), " to ",
                number(row["high"], row["unit"]), ")",
            ])  # fmt: skip
        rows.append(([title], *cells, [changes.verdict(own, names)]))
    head = ("number", *names, "changed?")
    return [Gallery(drawn), Grid(head, rows)]


def _limits(items: Sequence[Item]) -> list[Block]:
    by = [
        {spoken(one["name"], one.get("channel") or one.get("actuator")): one
         for one in _verdict(item)["limits"]}
        for item in items
    ]  # fmt: skip
    causes = list(dict.fromkeys(name for each in by for name in each))[:MOST_LIMITS]
    rows = []
    for cause in causes:
        cells: list[Line] = []
        for each in by:
            one = each.get(cause)
            cells.append(["not tested"] if one is None else [
                size_in_words(one["parameters"]) or "not detectable", " (", share(one["share"]),
                " of its realistic size)",
            ])  # fmt: skip
        rows.append(([cause], *cells))
    return [Grid(("cause", *(one.name for one in items)), rows)]


# --- evaluations ----------------------------------------------------------------------------------


def _claim_of_losses(items: Sequence[Item]) -> tuple[str, str]:
    if any(one.kind != "evaluation" for one in items):
        return "These results are of different kinds: only what they are about is compared.", "open"
    said = [
        f"{name} L {'diverged' if a['loss'] is None else format(a['loss'], '.0f')}"
        for item in items
        for name, a in item.result.answers.items()
    ]
    return f"On the same windows: {'; '.join(said)}.", "open"


def _errors(items: Sequence[Item]) -> list[Block]:
    rows = []
    base = _losses(items[0])
    for item in items:
        for name, answer in item.result.answers.items():
            rows.append((
                [f"{item.name}: {name}" if item.name != name else name],
                or_diverged(answer["loss"]), or_diverged(answer["end_position_m"], "m"),
                or_diverged(answer["end_heading_deg"], "deg"), _change(base, _losses(item, name)),
            ))  # fmt: skip
    head = ("model", "L", "position at the end", "heading at the end", "L over the first's")
    names = ("position_error", "heading_error", "windows")
    return [Grid(head, rows, head[1:4]), Gallery(gallery(_together(items), names))]


def _together(items: Sequence[Item]) -> Content:
    """All runs of all evaluations in one set of pictures; of two of a name, the first."""
    content = items[0].result.content
    data = content.data
    for item in items[1:]:
        other = item.result.content.data
        fresh = {key: label for key, label in other.models.items() if key not in data.models}
        more = pl.col("model").is_in(list(fresh))
        data = replace(
            data, models={**data.models, **fresh},
            tracks=pl.concat([data.tracks, other.tracks.filter(more)]),
            errors=pl.concat([data.errors, other.errors.filter(more)]),
        )  # fmt: skip
    return replace(content, data=data)


def _losses(item: Item, run: str | None = None) -> pl.DataFrame:
    """voyage, window, loss of a run, the first unless given."""
    errors = item.result.content.data.errors
    run = run or next(iter(item.result.answers))
    return errors.filter(pl.col("model") == run).select("voyage", "window", "loss")


def _change(base: pl.DataFrame, other: pl.DataFrame) -> Line:
    """Ratio of the mean L with its 90 % interval, over the windows that both have."""
    both = base.join(other, on=["voyage", "window"], suffix="_other").drop_nulls().sort(
        "voyage", "window"
    )  # fmt: skip
    if both.is_empty():
        return ["no window in common"]
    before, after = (both[k].to_numpy() for k in ("loss", "loss_other"))
    if np.array_equal(before, after):
        return ["1"]
    ratio = float(after.sum() / max(before.sum(), 1e-12))
    low, high = error_reduction.shares(before, after, both["voyage"].to_list())
    return [f"{ratio:.3g} ({low:.3g} to {high:.3g})"]
