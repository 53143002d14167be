"""Stretches of the voyages that the verdict marks, each with what opens it in the recording."""

from __future__ import annotations

from shiplog.report.page.blocks import Block, Fold, Gallery, Grid, Paragraph, seconds
from shiplog.report.page.diagnosis.source import Source
from shiplog.report.page.diagnosis.where import opening

MOST_ROWS = 40  # of a table; the JSON has them all


def blocks(source: Source) -> list[Block]:
    verdict = source.verdict
    found: list[Block] = [Gallery(source.gallery(("stretches",)))]
    rows = [
        (
            [one["voyage"]], [seconds(one["start_s"])], [seconds(one["end_s"])],
            [one["kind"]], [one["sentence"]], [f"{one['voyage']}:{one['start_s']:.0f}"],
        )
        for one in verdict["intervals"][:MOST_ROWS]
    ]  # fmt: skip
    if rows:
        head = ("voyage", "from", "to", "kind", "what", "--at")
        found.append(Grid(head, rows, ("from", "to")))
        first = verdict["intervals"][0]
        found.append(Paragraph(["The first in the recording; for another, with its own `--at`:"]))
        found.append(opening(source, first["voyage"], first["start_s"]))
    else:
        found.append(Paragraph(["No stretch was left out, or is outside the training data."]))
    if len(verdict["intervals"]) > MOST_ROWS:
        found.append(Paragraph([f"And {len(verdict['intervals']) - MOST_ROWS} more."]))
    if clashes := verdict["contradictions"]:
        lines = [([c["voyage"]], [c["channel"].replace("_", " ")], [c["sentence"]])
                 for c in clashes]  # fmt: skip
        found.append(Grid(("voyage", "channel", "what contradicts"), lines))
    if verdict["unseen"]:
        lines = [([one["variable"]], [one["sentence"]]) for one in verdict["unseen"]]
        found.append(Fold(
            "Does the rest depend on what the model does not see?",
            [Grid(("input", "cross-validated R²"), lines)],
        ))  # fmt: skip
    return found
