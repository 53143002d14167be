"""What `shiplog paper` found, from its folder: paper.json, and the figures' SVG files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from shiplog.exceptions import ShiplogError, listed
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted
from shiplog.report.figures import style
from shiplog.report.page.blocks import (
    Answers,
    Block,
    Drawn,
    Gallery,
    Grid,
    Items,
    Line,
    Page,
    Section,
    number,
)
from shiplog.report.paper import statements
from shiplog.report.paper.style import named

ANSWER = "paper.json"
CAPTIONS = {
    "histograms": "How often each velocity and actuator was where, in each set",
    "wind": "Apparent wind of each set",
    "validation_loss": "Validation loss over the epochs of every training",
    "test_loss": "Test loss of every training, by set",
    "inputs": "Inputs of the longest test voyage",
}


def of_folder(out: Path) -> Page:
    """Raises ShiplogError for a folder without an answer."""
    path = out / ANSWER
    try:
        answer = json.loads(path.read_text(encoding="utf-8"))
        if answer["contract"] != CONTRACT:
            raise ValueError(f"it is of contract {answer['contract']!r}, not {CONTRACT}")
        return _page(answer, out)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ShiplogError(
            f"{path} cannot be read: {error}.", hint=f"shiplog paper --out {out} makes it."
        ) from error


def _page(answer: Mapping[str, Any], out: Path) -> Page:
    held = [s for s in answer["statements"] if s["finding"] == statements.HOLDS]
    test = listed(answer["split"]["test"], most=4)
    claim = (
        f"Of {counted(len(answer['statements']), 'statement')} of the paper {len(held)} hold on "
        f"{test}, with {counted(len(answer['sets']), 'window set')}."
    )
    return Page(
        title=f"{answer['ship']}: window sets",
        kicker=f"{answer['ship']} · test on {test} · recipe {answer['recipe']} · "
        f"shiplog {version('shiplog')}",
        word="published experiment",
        tone="good" if held else "open",
        claim=claim,
        sections=[
            Section("answer", "What the paper states, on these data", _statements(answer)),
            Section("losses", "Losses", _losses(answer)),
            Section("figures", "Figures", [Gallery(_figures(out))]),
            Section("execution", "Execution", _execution(answer)),
        ],
    )


def _statements(answer: Mapping[str, Any]) -> list[Block]:
    pairs = [
        (row["statement"], [[statements.sentence(row)]]) for row in answer["statements"]
    ]  # fmt: skip
    return [Answers(pairs)]


def _losses(answer: Mapping[str, Any]) -> list[Block]:
    rows: list[tuple[Line, ...]] = [
        ([named(one["set"])], [number(one["seeds"])], [number(one["mean"])],
         [number(one["least"])], [number(one["most"])])
        for one in answer["sets"]
    ]  # fmt: skip
    rows += [
        ([f"baseline: {name.replace('_', ' ')}"], ["-"], [number(loss)], ["-"], ["-"])
        for name, loss in answer["floors"].items()
    ]
    head = ("set", "seeds", "mean test L", "least", "most")
    return [Grid(head, rows, head[1:])]


def _figures(out: Path) -> list[Drawn]:
    found = []
    for path in sorted((out / "figures").glob("*.svg")):
        words = CAPTIONS.get(path.stem, f"States of {path.stem.replace('_', ' ')}")
        svg = style.inline(path.read_text(encoding="utf-8"), path.stem)
        found.append(Drawn(svg, words, path.stem.replace("_", " ").capitalize(), wide=True))
    return found


def _execution(answer: Mapping[str, Any]) -> list[Block]:
    split = answer["split"]
    lines: list[Line] = [
        [f"{part.capitalize()}: {listed(split[part])}."]
        for part in ("training", "validation", "test")
    ]
    lines += [[f"Not trained: {name}: {why}"] for name, why in answer["failures"].items()]
    return [Items(lines)]
