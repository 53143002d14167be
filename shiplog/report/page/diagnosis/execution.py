"""What ran and what was left out: that it ran is no statement about the prediction."""

from __future__ import annotations

from shiplog.report.diagnosis.sections.subject import begin
from shiplog.report.page.blocks import Block, Grid, Items, Line, Paragraph, number, seconds
from shiplog.report.page.diagnosis.source import Source


def blocks(source: Source) -> list[Block]:
    verdict, subject = source.verdict, source.subject
    left_out = {one["voyage"]: 0.0 for one in verdict["intervals"] if one["kind"] == "external"}
    for one in verdict["intervals"]:
        if one["kind"] == "external":
            left_out[one["voyage"]] += one["end_s"] - one["start_s"]
    rows: list[tuple[Line, ...]] = [
        (
            [one["name"]], [begin(one["start"])],
            [seconds(one["seconds"])],
            [seconds(left_out[one["name"]])] if one["name"] in left_out else ["-"],
        )
        for one in subject["voyages"]
    ]  # fmt: skip
    head = ("voyage", "start, UTC", "length", "left out, pushed or towed")
    found: list[Block] = [Grid(head, rows, head[2:])]
    windows = (verdict.get("gain") or {}).get("held_out_windows")
    lines: list[Line] = []
    if windows is not None:
        lines.append([number(windows), " held-out windows of ", number(subject["window_s"], "s"),
                      " were simulated."])  # fmt: skip
    tested = len(verdict["limits"])
    lines.append([f"{tested} causes were tested, {len(verdict['unavailable'])} could not be."])
    if not verdict["base"]["before_effect"]:
        why = "The model's own voyages are not in the store, or are these"
        lines.append([f"{why}: its nominal errors are not known apart."])
    if subject.get("derived"):
        lines.append([subject["derived"]])
    found.append(Items(lines))
    if verdict["notes"]:
        found.append(Paragraph(["Notes:"], strong=True))
        found.append(Items([[note] for note in verdict["notes"]]))
    return found
