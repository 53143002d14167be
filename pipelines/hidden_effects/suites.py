"""The suites: which seeds, and what is hidden in each. All of a case follows from its seed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pipelines.hidden_effects.parameters import ABSORBED, SURVIVE
from pipelines.hidden_effects.plan import Plan, Planned
from pipelines.known_ship.cases import CATALOGUE, OUTSIDE

Rule = Callable[[int, int], str]  # seed, number in the row → cause


def _pair(seed: int, number: int) -> str:
    """Two different names of the catalogue, drawn evenly by the seed; no pair is left out."""
    names = tuple(CATALOGUE)
    drawn = np.random.default_rng([seed, *b"two at once"]).choice(len(names), 2, replace=False)
    return "+".join(names[i] for i in sorted(drawn))


STRIDE = 8  # has no factor in common with the 21 causes
RULES: dict[str, Rule] = {
    "none": lambda seed, number: "none",
    # each equally often, and of every kind some before a row is half done
    "one": lambda seed, number: tuple(CATALOGUE)[STRIDE * number % len(CATALOGUE)],
    "two": _pair,
    "outside": lambda seed, number: tuple(OUTSIDE)[number % len(OUTSIDE)],
}
GOALS: tuple[tuple[str, float | None, int], ...] = (  # rule, size, seconds of the trial
    ("one", 1.0, 7000),
    ("one", 0.3, 7000),
    ("one", 1.0, 500),
    ("none", None, 7000),
    ("outside", 1.0, 7000),
    ("two", 1.0, 7000),
)
SUITES = {  # name → (first seed, cases; of `goals`: of each row)
    "fixed": (1001, 12),  # the first twelve after 1000, and none, one, two, outside all occur
    "brief": (1001, 12),  # the same ships and effects in campaigns of 3000 s: minutes
    "nightly": (30000, 200),  # never tuned on: shift the block monthly
    "goals": (20000, 20),
    "network": (25000, len(SURVIVE) + len(ABSORBED)),
}


def plan(suite: str, first_seed: int | None = None, count: int | None = None) -> Plan:
    """The rows of `goals` share their seeds: the same ships, weather and noise in each."""
    first, number = SUITES[suite]
    first = first if first_seed is None else first_seed
    number = number if count is None else count
    seeds = range(first, first + number)
    if suite == "network":
        causes = (*SURVIVE, *ABSORBED)
        return Plan(suite, first, tuple(
            Planned(str(s), s, causes[(s - first) % len(causes)], 1.0, 7000, "feedforward")
            for s in seeds
        ))  # fmt: skip
    if suite != "goals":
        seconds = 3000 if suite == "brief" else 7000
        return Plan(suite, first, tuple(Planned(str(s), s, None, None, seconds) for s in seeds))
    return Plan(suite, first, tuple(
        Planned(f"{seed}-{row}", seed, RULES[rule](seed, seed - first), size, seconds)
        for seed in seeds
        for row, (rule, size, seconds) in enumerate(GOALS, 1)
    ))  # fmt: skip
