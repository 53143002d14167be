"""Where the answer comes from: program, run, logs, times."""

from __future__ import annotations

from shiplog.report.page.blocks import Block, Fold, Grid, Line
from shiplog.report.page.diagnosis.source import Source


def blocks(source: Source) -> list[Block]:
    subject, facts = source.subject, source.provenance
    rows: list[tuple[Line, Line]] = [
        (["shiplog"], [f"{subject['shiplog']} {facts.get('commit') or ''}".strip()]),
        (["run"], [f"{subject['run']} ({subject['model']}), {subject['made']}"]),
        (["trained on"], [", ".join(subject["trained_on"]) or "no voyage"]),
    ]
    for key in ("began", "ended", "machine", "python"):
        if facts.get(key):
            rows.append(([key], [str(facts[key])]))
    if facts.get("command"):
        rows.append((["command"], [" ".join(map(str, facts["command"]))]))
    hashes = facts.get("logs_sha256") or {}
    rows += [([f"log of {name}"], [f"SHA-256 {value}"]) for name, value in hashes.items() if value]
    return [Fold("Program, run and logs", [Grid(("what", "which"), rows)])]
