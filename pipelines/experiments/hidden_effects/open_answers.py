"""The answers that a verdict leaves open, each a set of what acts together, with its probability.

The verdict's `ranking` has a probability for every cause by itself, and causes that act in every
answer stand in it first. Which of them make one answer is in its `sentence` alone: "Undecided: side
thrust (50%), or something outside the catalogue (intermittent) (50%)". So that is read here, and a
test reads what `shiplog.report.diagnosis.verdict_sentence` writes.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from pipelines.experiments.hidden_effects.parameters import NAMES

Open = tuple[frozenset[str], float]  # causes, `none` or `unknown:family`, and the probability

WHOLE = re.compile(r"Undecided: (?P<answers>.*?\(\d+%\))(?:\. |, which held-out |$)")
SHARE = re.compile(r" \(\d+%\)(?:,? or | and )?")
FAVOURED = "the log Bayes factor favours "  # what follows acts together
OUTSIDE = re.compile(r"something outside the catalogue \((?P<family>\w+)\)")
WORDS = {name.replace("_", " "): name for name in NAMES} | {"no change": "none"}


def label_of(name: str) -> str:
    """`clock_offset:wind` is a name and what of it; `unknown:position` is one answer."""
    return name if name.startswith("unknown") else name.partition(":")[0]


def marginals(verdict: Mapping[str, Any]) -> dict[str, float]:
    """Label → its probability in the ranking, in that order; channels of one name together."""
    found: dict[str, float] = {}
    for one in verdict.get("ranking") or ():
        if one.get("probability") is not None:
            label = label_of(one["name"])
            found[label] = found.get(label, 0.0) + float(one["probability"])
    return found


def open_answers(verdict: Mapping[str, Any]) -> tuple[Open, ...]:
    """Those of the sentence, each with the probability of the least probable of its labels; where
    no sentence says any, the labels of the ranking, each an answer. Raises ValueError where the
    sentence has an answer that is not of the catalogue."""
    likely = marginals(verdict)
    stated = _stated(str(verdict.get("sentence") or ""))
    if stated is None:
        return tuple((frozenset({label}), p) for label, p in likely.items())
    return tuple((labels, min(likely.get(label, 0.0) for label in labels)) for labels in stated)


def _stated(sentence: str) -> list[frozenset[str]] | None:
    found = WHOLE.match(sentence)
    if found is None:
        return None
    text = found["answers"]
    together = text.startswith(FAVOURED)
    parts = [part for part in SHARE.split(text.removeprefix(FAVOURED)) if part]
    answers = [frozenset(map(_label, part.split(", "))) for part in parts]
    return [frozenset().union(*answers)] if together else answers


def _label(words: str) -> str:
    if found := OUTSIDE.fullmatch(words):
        return f"unknown:{found['family']}"
    if words not in WORDS:
        raise ValueError(f"{words!r} is no answer of the catalogue.")
    return WORDS[words]
