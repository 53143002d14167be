"""A model's ν̇ as a graph of scalars, with its coefficients left open and all else known.

    ν̇ [3] = f(θ; x, u, ω)

x [6] is the state over ground, u [A] the actuators as they act, ω [2] the true wind. Coefficients θ
are the graph's fixed inputs, so that a file can show and change them; sizes of the ship are numbers
in it. A network's layers stay products of a known matrix with a vector, one node a row: written out
as sums they would be a hundred thousand operations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from shiplog.exceptions import ModelError
from shiplog.machine import trees
from shiplog.simulation.kernel.graph import Graph, UnknownOperation

STATES = 6
WIND = 2
ATAN2 = "atan2"
LEAST_SQUARE = 1e-290  # of components: below, their square has lost digits
DOT = "dot"  # (dot, matrix, row, operands …): a row of a known matrix times the operands
LEAST_PRODUCT = 512  # multiplications from which on a product stays one: below, scalars are faster
MOST_NODES = 60_000  # a source of so many operations still compiles within seconds
MOST_READ = 10_000_000  # a network's weights are nodes while it is read


class WithoutAngles(Graph):
    """Sines and cosines of an angle A ± T, T = atan2(y, x), by components, which cost a root and a
    division where T, sin and cos cost three calls of the C library:

        cos T = x / h, sin T = y / h, h = √(x² + y²),   sin(A ± T) = sin A cos T ± cos A sin T, ...
    """

    def apply(self, kind: str, *operands: int) -> int:
        if kind in ("sin", "cos"):
            found = self._by_components(kind, operands[0])
            if found is not None:
                return found
        return super().apply(kind, *operands)

    def _by_components(self, kind: str, node: int) -> int | None:
        how, *rest = self.nodes[node]
        if how == ATAN2:
            return self._of_angle(node)[0 if kind == "cos" else 1]
        if how not in ("add", "sub"):
            return None
        turned = [self.nodes[one][0] == ATAN2 for one in rest]
        if turned.count(True) != 1:
            return None
        first, second = (
            self._of_angle(one) if own else (super(WithoutAngles, self).apply("cos", one),
                                             super(WithoutAngles, self).apply("sin", one))
            for one, own in zip(rest, turned, strict=True)
        )  # fmt: skip
        if kind == "cos":  # of a sum: a minus, of a difference a plus
            one, other = self.mul(first[0], second[0]), self.mul(first[1], second[1])
            return self.sub(one, other) if how == "add" else self.add(one, other)
        one, other = self.mul(first[1], second[0]), self.mul(first[0], second[1])
        return self.add(one, other) if how == "add" else self.sub(one, other)

    def _of_angle(self, node: int) -> tuple[int, int]:
        """cos T and sin T; of T = atan2(0, 0) = 0, and of what is as small, 1 and 0."""
        _, y, x = self.nodes[node]
        square = self.add(self.mul(x, x), self.mul(y, y))
        least = self.const(LEAST_SQUARE)
        there = self.apply("gt", square, least)
        length = self.apply("sqrt", self.apply("max", square, least))
        scale = self.apply("div", self.const(1.0), length)
        found = ((x, 1.0), (y, 0.0))
        cos, sin = (
            self.apply("select", there, self.mul(one, scale), self.const(none))
            for one, none in found
        )
        return cos, sin


@dataclass(frozen=True)
class Equations:
    """graph      its varying inputs are x, u and ω in this order, its fixed ones θ
    outputs    [3] nodes of ν̇; of causes around a simulator of others, [5], with V behind
    matrices   [m, k] of the products in it
    actuators  A
    count      of the coefficients"""

    graph: Graph
    outputs: tuple[int, ...]
    matrices: tuple[np.ndarray, ...]
    actuators: int
    count: int

    @property
    def inputs(self) -> int:
        return STATES + self.actuators + WIND


def of_model(
    model: Any, count: int, actuators: int, share: bool,
    water: Callable[[Any], tuple[Any, Any]] | None = None,
) -> Equations:  # fmt: skip
    """Equations of a model with `count` coefficients. Raises ModelError for one of which no code
    can be made.

    share   whether its last actuator column is the share of the campaign: 1, its end, as a
            simulation has it
    water   of the coefficients θ, V along x₀ and y₀: two outputs more
    """
    from shiplog.machine.arrays import jnp
    from shiplog.simulation.kernel import from_jaxpr

    leaves, structure = trees.flatten(model)
    columns = actuators + (1 if share else 0)

    def acceleration(theta, state, actuator, wind):
        whole = trees.unflatten(structure, leaves)
        found = whole.acceleration(theta, state, actuator, wind)
        if water is None:
            return found
        return jnp.concatenate((found, jnp.stack([jnp.asarray(one) for one in water(theta)])))

    graph, matrices = WithoutAngles(), []

    class Reader(from_jaxpr.Reader):
        def product(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
            kept = _product(graph, matrices, left, right)
            return super().product(left, right) if kept is None else kept

    try:
        closed = from_jaxpr.trace(acceleration, (count,), (STATES,), (columns,), (WIND,))
        theta = np.array([graph.fixed(i) for i in range(count)], dtype=np.int64)
        x = [graph.varying(i) for i in range(STATES + actuators + WIND)]
        acting = x[STATES : STATES + actuators] + ([graph.const(1.0)] if share else [])
        given = [
            theta,
            *(np.array(part, dtype=np.int64) for part in (x[:STATES], acting, x[-WIND:])),
        ]
        (found,) = Reader(graph, MOST_READ).read(closed, given)
        outputs = tuple(int(node) for node in found.ravel())
        if sum(graph.value(node) is None for node in graph.needed(outputs)) > MOST_NODES:
            raise UnknownOperation(f"more than {MOST_NODES} operations")
    except UnknownOperation as error:
        raise ModelError(
            f"The equations of {type(model).__name__} cannot be written in another language: "
            f"{error}.",
            hint="write the cause or model with the operations that jax.numpy shares with C.",
        ) from error
    return Equations(graph, outputs, tuple(matrices), actuators, count)


def _product(
    graph: Graph, matrices: list[np.ndarray], left: np.ndarray, right: np.ndarray
) -> np.ndarray | None:
    """left [m, k] · right [n, k]ᵀ of which one is a large known matrix; None of others."""
    if left.shape[0] * right.shape[0] * left.shape[1] < LEAST_PRODUCT:
        return None
    for known, vectors, turned in ((right, left, False), (left, right, True)):
        matrix = _numbers(graph, known)
        if matrix is not None:
            rows = np.array([_rows(graph, matrices, matrix, vector) for vector in vectors])
            return rows.T if turned else rows
    return None


def _numbers(graph: Graph, nodes: np.ndarray) -> np.ndarray | None:
    found = [graph.value(int(node)) for node in nodes.ravel()]
    return None if None in found else np.array(found, dtype=float).reshape(nodes.shape)


def _rows(
    graph: Graph, matrices: list[np.ndarray], matrix: np.ndarray, vector: np.ndarray
) -> list[int]:
    place = next((i for i, one in enumerate(matrices) if np.array_equal(one, matrix)), None)
    if place is None:
        place = len(matrices)
        matrices.append(matrix)
    which, operands = graph.const(float(place)), [int(node) for node in vector]
    rows = range(len(matrix))
    return [graph.apply(DOT, which, graph.const(float(row)), *operands) for row in rows]
