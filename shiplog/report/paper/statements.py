"""What the paper states of its window sets, asked of losses on a test voyage.

Trainings of one seed begin with the same weights, so that two sets are compared seed by seed: the
mean of ln L_set - ln L_reference, with Student's interval. There are eight statements, so each has
an interval of 1 - 0.05/8 (Bonferroni). The one about every augmentation holds if it does of each of
them, and does not hold if one of six intervals of 1 - 0.05/48 shows the contrary.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl
from scipy.stats import t as student

LEVEL = 0.05  # of all comparisons together
SAME_RATIO = 1.25  # ratio: "no significant difference" holds where the interval ends below it

HOLDS, FAILS, UNCLEAR = "holds", "does not hold", "not shown"


@dataclass(frozen=True)
class Statement:
    """A sentence of Sec. 4.4, as: L of `left` is smaller than L of `right`, or no other."""

    left: str
    right: str
    smaller: bool
    words: str


EVERY = "every augmented set"
STATEMENTS = (
    Statement("sli2", "ref", True, "Slicing to twice the data improves on the reference set."),
    Statement("sli10", "ref", True, "Slicing to ten times the data improves on it."),
    Statement("sli10", "sli2", False, "Slicing finer than twice makes no significant difference."),
    Statement("jit2", "ref", True, "Jittering to twice the data improves slightly."),
    Statement("jit10", "ref", True, "Jittering to ten times the data improves."),
    Statement("sli2xjit2", "ref", True, "Slicing and jittering together, four times, improve."),
    Statement("sli10xjit10", "ref", True, "Slicing and jittering, a hundred times, improve."),
    Statement("d-ref", EVERY, True, "Twice the measured data beats every augmentation."),
)
AUGMENTED = ("sli2", "sli10", "jit2", "jit10", "sli2xjit2", "sli10xjit10")


def differences(losses: pl.DataFrame) -> pl.DataFrame:
    """One row a statement that these sets can answer.

    losses   set, seed, loss: L over the test windows of each training

    statement, left, right, seeds, ratio (geometric mean of L_left / L_right), low, high (null with
    one seed), finding: "holds", "does not hold" (the contrary holds) or UNCLEAR.
    """
    by_set = {
        str(name): dict(own.select("seed", "loss").iter_rows())
        for (name,), own in losses.group_by("set", maintain_order=True)
    }
    rows = []
    for one in STATEMENTS:
        right = _best(by_set) if one.right == EVERY else one.right
        if one.left not in by_set or right not in by_set:
            continue
        pairs = _paired(by_set[one.left], by_set[right])
        if not len(pairs):
            continue
        middle, half = float(pairs.mean()), _half_width(pairs)
        low, high = middle - half, middle + half
        finding = _finding(one, low, high, math.isfinite(half))
        if one.right == EVERY:
            finding = _of_every(one, by_set)
        rows.append({
            "statement": one.words, "left": one.left, "right": right, "seeds": len(pairs),
            "ratio": math.exp(middle),
            "low": math.exp(low) if math.isfinite(half) else None,
            "high": math.exp(high) if math.isfinite(half) else None,
            "finding": finding,
        })  # fmt: skip
    return pl.DataFrame(rows, schema=SCHEMA)


SCHEMA = {
    "statement": pl.String, "left": pl.String, "right": pl.String, "seeds": pl.Int64,
    "ratio": pl.Float64, "low": pl.Float64, "high": pl.Float64, "finding": pl.String,
}  # fmt: skip


def _paired(left: Mapping[int, float], right: Mapping[int, float]) -> np.ndarray:
    shared = sorted(set(left) & set(right))
    pairs = np.array([math.log(left[s] / right[s]) for s in shared if left[s] * right[s] > 0])
    return pairs[np.isfinite(pairs)] if len(pairs) else pairs


def _half_width(pairs: np.ndarray, among: int = 1) -> float:
    """Of the interval of their mean, one of `among` for one statement; infinite with one pair."""
    n = len(pairs)
    if n < 2:
        return math.inf
    quantile = float(student.ppf(1.0 - LEVEL / len(STATEMENTS) / among / 2.0, n - 1))
    return quantile * float(pairs.std(ddof=1)) / math.sqrt(n)


def _of_every(one: Statement, by_set: Mapping[str, Mapping[int, float]]) -> str:
    """Against each augmented set that is there: which is the best was seen in the same losses."""
    each = [_paired(by_set[one.left], by_set[name]) for name in AUGMENTED if name in by_set]
    each = [pairs for pairs in each if len(pairs)]
    if all(pairs.mean() + _half_width(pairs) < 0.0 for pairs in each):
        return HOLDS
    contrary = any(pairs.mean() - _half_width(pairs, len(each)) > 0.0 for pairs in each)
    return FAILS if contrary else UNCLEAR


def _finding(one: Statement, low: float, high: float, sure: bool) -> str:
    if not sure:
        return UNCLEAR
    if not one.smaller:
        if low > 0.0 or high < 0.0:
            return FAILS
        return HOLDS if max(-low, high) < math.log(SAME_RATIO) else UNCLEAR
    if high < 0.0:
        return HOLDS
    return FAILS if low > 0.0 else UNCLEAR


def _best(by_set: Mapping[str, Mapping[int, float]]) -> str:
    """The augmented set of the smallest mean loss."""
    there = [name for name in AUGMENTED if name in by_set]
    means = {name: float(np.mean(list(by_set[name].values()))) for name in there}
    return min(means, key=means.__getitem__, default="")


def sentence(row: Mapping[str, Any]) -> str:
    """One comparison in words, with its number; `row` of the table of `differences`."""
    left, right, ratio = row["left"], row["right"], row["ratio"]
    if row["low"] is None:
        return f"L of {left} is {ratio:.2f} times that of {right}: one seed, so no interval."
    between = f"{row['low']:.2f} to {row['high']:.2f}"
    finding = row["finding"]
    if finding == UNCLEAR and row["high"] < 1.0:  # of one set; the statement is about every set
        finding = f"{UNCLEAR} of every augmented set"
    return f"L of {left} is {ratio:.2f} ({between}) times that of {right}: {finding}."
