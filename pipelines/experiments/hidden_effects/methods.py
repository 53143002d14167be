"""Who answers the same cases: this program, simpler methods, and two answers that need no run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipelines.experiments.hidden_effects.parameters import NAMES
from pipelines.experiments.hidden_effects.score import FAILED, Answer

PROGRAM = "this program"
RIVALS = {"regression": "regression + BIC", "glr": "likelihood ratio"}
NULL, RANDOM = "always none", "random answer"
METHODS = (PROGRAM, *RIVALS.values(), NULL, RANDOM)


def answers(given: Sequence[Answer]) -> dict[str, list[Answer]]:
    """Method → its answers; a case that it was not asked is left out, a method that was asked
    nothing too."""
    found: dict[str, list[Answer]] = {method: [] for method in METHODS}
    for one in given:
        found[PROGRAM].append(one)
        for rival, title in RIVALS.items():
            if (reported := _rival(one, rival)) is not None:
                found[title].append(reported)
        found[NULL].append(null(one))
        found[RANDOM].append(random(one))
    return {method: of for method, of in found.items() if of}


def _rival(one: Answer, rival: str) -> Answer | None:
    """None where it was not asked; where it was and failed, that is its answer."""
    if rival in one.rivals:
        return one.by(rival)
    if any(step["step"] == "rivals" and step["rc"] != 0 for step in one.steps):
        return one.answered({"verdict": FAILED, "step": "rivals"})
    return None


def null(one: Answer) -> Answer:
    """Nothing is ever hidden, and that is sure."""
    sure = [{"name": "none", "probability": 1.0}]
    return one.answered({"verdict": "none", "causes": [], "ranking": sure})


def random(one: Answer) -> Answer:
    """A name of the catalogue or none, each as likely, drawn by the case's seed and the row that it
    stands in: two rows of one seed are two draws."""
    labels = ("none", *NAMES)
    drawn = np.random.default_rng([one.planned.seed, *f"random {one.planned.label}".encode()])
    name = labels[int(drawn.integers(len(labels)))]
    order = (name, *(label for label in labels if label != name))
    ranking = [{"name": label, "probability": 1.0 / len(labels)} for label in order]
    verdict = {"verdict": "none", "causes": [], "ranking": ranking}
    if name != "none":
        verdict |= {"verdict": "named", "causes": ranking[:1]}
    return one.answered(verdict)
