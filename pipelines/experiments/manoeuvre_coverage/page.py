"""The tables of all ships, misses first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import polars as pl

from pipelines.experiments.manoeuvre_coverage import tables

GOAL = (0.85, 0.95)


def text(ships: Sequence[dict[str, Any]]) -> str:
    """What is outside the goal, then every quantity, kind of ship and coefficient."""
    found = tables.quantities(ships).filter(pl.col("quantity").is_in(list(tables.NAMED)))
    none = tables.missing(ships)
    parts = [
        f"{len(ships)} ships. Without an interval: {none['measured']} measured, "
        f"{none['simulated']} simulated.",
        "## All", tables.by(found, "what", "against"),
    ]  # fmt: skip
    judged = found.filter(pl.col("against") == "true")
    for what in tables.COLUMNS:
        one = judged.filter(pl.col("what") == what)
        if not one.is_empty():
            parts += [f"## {what.capitalize()}", tables.by(tables.worst_first(one), "quantity"),
                      tables.by(one, "family")]  # fmt: skip
    pairs = tables.extended_pairs(judged)
    if pairs is not None:
        parts += ["## The same quantities of the ships that a diagnosis extended", pairs]
    coefficients = tables.coefficients(ships)
    trusted = coefficients.filter(pl.col("verdict") == "trusted")
    parts += [
        "## Coefficients", tables.trust(coefficients, "verdict", "kind"),
        tables.trust(trusted, "kind", "name"), tables.trust(trusted, "family", "kind"),
    ]  # fmt: skip
    return "\n\n".join(parts)
