"""Every cause of the catalogue, and what became of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shiplog.models.causes import CATALOGUE
from shiplog.report.figures.bars import size_in_words, spoken
from shiplog.report.page.blocks import Block, Fold, Gallery, Grid, Line, Paragraph, probability
from shiplog.report.page.diagnosis.source import Source

NAMED, TRACE, OPEN, EXCLUDED, SMALL, UNTESTABLE, ABSENT = (
    "named", "present, below practical size", "not decided", "excluded", "too small to show",
    "not testable", "not assessed",
)  # fmt: skip


LEAST = 0.1  # probability, from which an answer that is not named is not excluded either


def blocks(source: Source) -> list[Block]:
    verdict = source.verdict
    rows = table(verdict)
    found: list[Block] = [Gallery(source.gallery(("ranking", "limits")))]
    count = {state: sum(r[1] == state for r in rows) for state in dict.fromkeys(r[1] for r in rows)}
    text = ", ".join(f"{n} {state}" for state, n in count.items())
    found.append(Paragraph([f"Of {len(rows)} causes: {text}."]))
    cells = [([name], [state], why) for name, state, why in rows]
    found.append(Fold("Every cause, and why", [Grid(("cause", "what became of it", "why"), cells)]))
    return found


def table(verdict: Mapping[str, Any]) -> list[tuple[str, str, Line]]:
    """(cause in words, what became of it, why), in the catalogue's order."""
    named = {_label(c["name"], _which(c)): c for c in verdict["causes"]}
    traces = {_label(c["name"], _which(c)): c for c in verdict["traces"]}
    limits = {_label(c["name"], c.get("channel") or c.get("actuator")): c
              for c in verdict["limits"]}  # fmt: skip
    weighed = {one["name"]: one["probability"] for one in verdict["ranking"]
               if one["probability"] >= LEAST}  # fmt: skip
    rejected = _reasons(verdict["rejected"])
    untestable = _reasons(verdict["unavailable"])
    labels = [c.label for c in CATALOGUE if not c.special]
    every = dict.fromkeys(labels)
    for one in (*named, *traces, *limits, *rejected, *untestable):
        every.setdefault(one)
    rows = []
    for label in every:
        bare = label.partition(":")[0]
        units = [one for one in every if one.startswith(f"{label}:") and one not in labels]
        if label not in named and units:
            continue  # a cause of several units stands there once for each
        state, why = _state(label, bare, named, traces, weighed, limits, rejected, untestable)
        rows.append((spoken(label), state, why))
    return rows


def _state(
    label: str, bare: str, named: Mapping, traces: Mapping, weighed: Mapping, limits: Mapping,
    rejected: Mapping, untestable: Mapping,
) -> tuple[str, Line]:  # fmt: skip
    if label in named:
        return NAMED, ["probability ", probability(named[label]["probability"])]
    if label in traces:
        return TRACE, [traces[label]["sentence"]]
    found = any(_is_of(one, bare) for one in (*named, *traces))
    if label not in untestable and not found and (label in weighed or bare in weighed):
        return OPEN, ["probability ", probability(weighed.get(label, weighed.get(bare)))]
    size = limits.get(label)
    least = "" if size is None else size_in_words(size["parameters"])
    for key in (label, bare):
        if key in untestable:
            return UNTESTABLE, [untestable[key]]
    if size is not None and size["share"] > 1.0:
        return SMALL, [f"would show from {least}" if least else "no size would show"]
    for key in (label, bare):
        if key in rejected:
            return EXCLUDED, [rejected[key]]
    if size is not None:
        return EXCLUDED, [f"not found; would show from {least}"]
    return ABSENT, ["no test of it was made"]


def _label(name: str, of: str | None) -> str:
    return f"{name}:{of}" if of else name


def _is_of(label: str, bare: str) -> bool:
    return label.partition(":")[0] == bare


def _which(cause: Mapping[str, Any]) -> str | None:
    for key in ("channel", "actuator"):
        if key in cause["parameters"]:
            return str(cause["parameters"][key]["value"])
    return None


def _reasons(rows: list[Mapping[str, str]]) -> dict[str, str]:
    """Label → reason; a reason that begins with a channel is of that channel."""
    found: dict[str, str] = {}
    for one in rows:
        head, colon, rest = one["reason"].partition(": ")
        labelled = f"{one['name']}:{head}"
        several = {c.label for c in CATALOGUE}
        if colon and labelled in several:
            found[labelled] = rest
        else:
            found.setdefault(one["name"], one["reason"])
    return found
