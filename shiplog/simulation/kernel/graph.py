"""Equations as a graph of scalars, in which equal operations are one node.

A node is an operation on earlier nodes, so that the nodes are in an order in which they can be
computed. What is known is computed while the graph is built (constants, a + 0, 1 · a), and what is
asked for twice is there once: common subexpressions cost nothing, not those that derivatives share
with values either.

Inputs are of two kinds. `varying` ones (state, actuators, wind) differ from sample to sample.
`fixed` ones (coefficients, a ship's sizes) do not, nor does what depends on them alone.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

Key = tuple[Any, ...]

COMMUTES = frozenset({"add", "mul", "eq", "ne", "and", "or", "xor"})
BOOLEAN = frozenset(
    {"lt", "le", "gt", "ge", "eq", "ne", "and", "or", "xor", "not", "finite", "truth"}
)
# Of known numbers. What is not here is computed where it runs: a constant must not depend on the
# C library of the machine that made the code.
KNOWN: dict[str, Callable] = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "div": operator.truediv,
    "neg": operator.neg, "abs": abs, "max": max, "min": min, "sqrt": np.sqrt,
    "floor": np.floor, "round": np.rint, "copysign": math.copysign,
    "lt": operator.lt, "le": operator.le, "gt": operator.gt, "ge": operator.ge,
    "eq": operator.eq, "ne": operator.ne,
    "and": operator.and_, "or": operator.or_, "xor": operator.xor, "not": operator.not_,
    "finite": math.isfinite,
}  # fmt: skip


class UnknownOperation(Exception):
    """An operation of a model's that no code is made of; says its name."""


class Graph:
    """Nodes are integers. `nodes[i]` is (operation, operands …): an operand is an earlier node;
    those of "const", "truth", "varying" and "fixed" are the number, the truth value, and the
    input's place. `varies[i]` says whether it depends on a varying input."""

    def __init__(self) -> None:
        self.nodes: list[Key] = []
        self.varies: list[bool] = []
        self._places: dict[Key, int] = {}

    def _put(self, key: Key, varies: bool) -> int:
        # 0.0 and -0.0 are equal and not the same, and nan is not equal to itself
        place = (key[0], float(key[1]).hex()) if key[0] == "const" else key
        found = self._places.get(place)
        if found is None:
            found = self._places[place] = len(self.nodes)
            self.nodes.append(key)
            self.varies.append(varies)
        return found

    def const(self, value: Any) -> int:
        """A known number or truth value."""
        if isinstance(value, bool | np.bool_):
            return self._put(("truth", bool(value)), False)
        return self._put(("const", float(value)), False)

    def varying(self, place: int) -> int:
        return self._put(("varying", place), True)

    def fixed(self, place: int) -> int:
        return self._put(("fixed", place), False)

    def value(self, node: int) -> float | bool | None:
        """The number or truth value of a node that is known."""
        kind, *rest = self.nodes[node]
        return rest[0] if kind in ("const", "truth") else None

    def is_truth(self, node: int) -> bool:
        """Whether it is true or false, and not a number."""
        kind, *operands = self.nodes[node]
        return kind in BOOLEAN or (kind == "select" and self.is_truth(operands[1]))

    def apply(self, kind: str, *operands: int) -> int:
        """The node of an operation, simplified."""
        if kind in ("eq", "ne") and self.is_truth(operands[0]):
            differ = self.apply("xor", *operands)
            return differ if kind == "ne" else self.apply("not", differ)
        values = [self.value(node) for node in operands]
        if kind in KNOWN and all(v is not None for v in values):
            known = self._known(kind, values)
            if known is not None:
                return known
        simple = _SIMPLER.get(kind)
        found = simple(self, values, *operands) if simple is not None else None
        if found is not None:
            return found
        if kind in COMMUTES and operands[0] > operands[1]:
            operands = operands[::-1]
        return self._put((kind, *operands), any(self.varies[node] for node in operands))

    def _known(self, kind: str, values: Sequence[Any]) -> int | None:
        if kind in ("max", "min") and any(math.isnan(v) for v in values):
            return self.const(math.nan)
        try:
            with np.errstate(all="ignore"):
                return self.const(KNOWN[kind](*values))
        except (ZeroDivisionError, ValueError, OverflowError):
            return None

    def needed(self, outputs: Iterable[int]) -> list[int]:
        """The nodes that these depend on, themselves included, in order."""
        wanted, left = set(), list(outputs)
        while left:
            node = left.pop()
            if node not in wanted:
                wanted.add(node)
                left += self.operands(node)
        return sorted(wanted)

    def operands(self, node: int) -> tuple[int, ...]:
        kind, *rest = self.nodes[node]
        return () if kind in ("const", "truth", "varying", "fixed") else tuple(rest)

    # --- what is used often -------------------------------------------------------------------

    def add(self, a: int, b: int) -> int:
        return self.apply("add", a, b)

    def sub(self, a: int, b: int) -> int:
        return self.apply("sub", a, b)

    def mul(self, a: int, b: int) -> int:
        return self.apply("mul", a, b)

    def neg(self, a: int) -> int:
        return self.apply("neg", a)

    def select(self, test: int, yes: int, no: int) -> int:
        return self.apply("select", test, yes, no)

    def over(self, a: int, b: int) -> int:
        """a / b as a · (1/b): one division serves all that is divided by b, and its derivatives."""
        one = self.const(1.0)
        if self.value(a) == 1.0:
            return self.apply("div", one, b)
        return self.mul(a, self.apply("div", one, b))

    def polynomial(self, x: int, coefficients: Sequence[float]) -> int:
        """Σ cᵢ xⁱ by Horner's rule, c₀ first."""
        found = self.const(coefficients[-1])
        for c in reversed(coefficients[:-1]):
            found = self.add(self.mul(found, x), self.const(c))
        return found


def _add(g: Graph, values: Sequence, a: int, b: int) -> int | None:
    x, y = values
    if x == 0.0:
        return b
    if y == 0.0:
        return a
    if g.nodes[b][0] == "neg":
        return g.sub(a, g.nodes[b][1])
    if g.nodes[a][0] == "neg":
        return g.sub(b, g.nodes[a][1])
    return None


def _sub(g: Graph, values: Sequence, a: int, b: int) -> int | None:
    x, y = values
    if y == 0.0:
        return a
    if x == 0.0:
        return g.neg(b)
    if g.nodes[b][0] == "neg":
        return g.add(a, g.nodes[b][1])
    return None


def _mul(g: Graph, values: Sequence, a: int, b: int) -> int | None:
    for value, node, other in ((values[0], a, b), (values[1], b, a)):
        if value == 0.0:
            return g.const(0.0)
        if value == 1.0:
            return other
        if value == -1.0:
            return g.neg(other)
        if g.nodes[node][0] == "neg":
            return g.neg(g.mul(g.nodes[node][1], other))
    return None


def _div(g: Graph, values: Sequence, a: int, b: int) -> int | None:
    if values[1] == 1.0:
        return a
    if values[0] == 0.0:
        return g.const(0.0)
    return None


def _neg(g: Graph, values: Sequence, a: int) -> int | None:
    kind, *operands = g.nodes[a]
    if kind == "neg":
        return operands[0]
    return g.sub(operands[1], operands[0]) if kind == "sub" else None


def _select(g: Graph, values: Sequence, test: int, yes: int, no: int) -> int | None:
    if values[0] is not None:
        return yes if values[0] else no
    return yes if yes == no else None


def _and(g: Graph, values: Sequence, a: int, b: int) -> int | None:
    for value, other in ((values[0], b), (values[1], a)):
        if value is not None:
            return other if value else g.const(False)
    return a if a == b else None


def _or(g: Graph, values: Sequence, a: int, b: int) -> int | None:
    for value, other in ((values[0], b), (values[1], a)):
        if value is not None:
            return g.const(True) if value else other
    return a if a == b else None


def _not(g: Graph, values: Sequence, a: int) -> int | None:
    return g.nodes[a][1] if g.nodes[a][0] == "not" else None


_SIMPLER: dict[str, Callable[..., int | None]] = {
    "add": _add, "sub": _sub, "mul": _mul, "div": _div, "neg": _neg, "select": _select,
    "and": _and, "or": _or, "not": _not,
}  # fmt: skip
