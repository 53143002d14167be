"""What to record next, so that the next verdict says more."""

from __future__ import annotations

from shiplog.report.figures.bars import size_in_words, spoken
from shiplog.report.page.blocks import Block, Items, Line, Number, Paragraph, number
from shiplog.report.page.diagnosis.source import Source

ENDS = ("named", "none")  # verdicts that are an answer
MOST = 6  # lines: more is no plan


def blocks(source: Source) -> list[Block]:
    verdict = source.verdict
    lines: list[Line] = []
    for cause in verdict["causes"]:
        if (expected := cause.get("next_test_expected")) is not None:
            parts: list[str | Number] = [
                f"{spoken(cause['name']).capitalize()}: {expected['manoeuvre']}, ",
                number(expected["seconds"], "s"), ". By simulation it brings ",
                number(expected["nats"]), " nats of evidence.",
            ]  # fmt: skip
            lines.append(parts)
        elif cause.get("next_test"):
            lines.append([f"{spoken(cause['name']).capitalize()}: {cause['next_test']}."])
    lines += [[note] for note in verdict["notes"] if note.startswith("A test that separates")]
    uncovered = [one for one in verdict["intervals"] if one["kind"] == "coverage"]
    lines += [[f"Voyages as {one['voyage']} from {one['start_s']:.0f} s on. {one['sentence']}"]
              for one in uncovered[:2]]  # fmt: skip
    hidden = [one for one in verdict["limits"] if one["share"] > 1.0][:2]
    lines += [
        [f"A smaller {spoken(one['name'], one.get('channel') or one.get('actuator'))} than "
         f"{size_in_words(one['parameters'])} would not have shown: sail longer, and more in the "
         "conditions in which it acts."]
        for one in hidden
    ]  # fmt: skip
    if not lines:
        if verdict["verdict"] not in ENDS:
            return [Paragraph(["No manoeuvre is known that would decide it. More voyages, of "
                               "other courses, speeds and winds, tell more."])]  # fmt: skip
        return [
            Paragraph(["Nothing is needed for this answer. More voyages find smaller changes."])
        ]
    return [Items(lines[:MOST])]
