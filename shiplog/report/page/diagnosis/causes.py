"""Each named cause: sentence, numbers with intervals, equation, what it may be instead."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shiplog.exceptions import listed
from shiplog.report.figures.bars import spoken
from shiplog.report.page.blocks import (
    Block,
    Equation,
    Grid,
    Line,
    Number,
    Paragraph,
    number,
    probability,
)
from shiplog.report.page.diagnosis.source import Source

# The equations of motion that causes enter (Fossen 2021, Sec. 6; Yasukawa and Yoshimura 2015).
MODEL = "ν̇ = f(ν, u, ω),  ν = (surge, sway, yaw rate), u actuators, ω apparent wind"


def blocks(source: Source) -> list[Block]:
    causes = source.verdict["causes"]
    said = Paragraph([source.verdict["sentence"]])
    if not causes:
        return [said, Paragraph(["No cause is named: the model stays as it is."]), Equation(MODEL)]
    found: list[Block] = [said, Paragraph(["The model before:"]), Equation(MODEL)]
    for cause in causes:
        found += _cause(cause)
    return found


def _cause(cause: Mapping[str, Any]) -> list[Block]:
    head = [f"{spoken(cause['name']).capitalize()} (probability ",
            probability(cause["probability"]), ")"]  # fmt: skip
    found: list[Block] = [
        Paragraph(head, strong=True), Paragraph([cause["sentence"]]), Equation(cause["equation"]),
    ]  # fmt: skip
    rows = [_row(name, one) for name, one in cause["parameters"].items()]
    if rows:
        found.append(Grid(("parameter", "value", "90 % interval"), rows, ("value",)))
    if alike := cause["indistinguishable_from"]:
        text = f"These data cannot tell it from {listed(map(spoken, alike))}."
        if cause.get("next_test"):
            text += f" A test that can: {cause['next_test']}."
        found.append(Paragraph([text]))
    if times := cause.get("times"):
        found.append(Grid(
            ("voyage", "from", "to", "strongest force"),
            [([one["voyage"]], [number(one["start_s"], "s", 5)], [number(one["end_s"], "s", 5)],
              [number(one["force_N"], "N")]) for one in times],
            ("from", "to", "strongest force"), "When it was at work",
        ))  # fmt: skip
    return found


def _row(name: str, one: Mapping[str, Any]) -> tuple[Line, Line, Line]:
    title: Line = [name.replace("_", " ")]
    if isinstance(one["value"], str):
        return title, [one["value"]], ["-"]
    unit = one["unit"]
    ends: list[str | Number] = [number(one["low"], unit, 4), " to ", number(one["high"], unit, 4)]
    return title, [number(one["value"], unit, 4)], ends
