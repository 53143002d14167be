"""A jaxpr as a graph of scalars.

Arrays are arrays of nodes: what only moves elements about (slices, reshapes, concatenations) costs
nothing. An operation that is not in the tables here raises UnknownOperation; then JAX runs the
model as it stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np
from jax import Array
from jax.extend import core

from shiplog.simulation.kernel.graph import Graph, UnknownOperation

Nodes = np.ndarray  # of integers: nodes of the graph, in the array's shape

# Of so many nodes the code takes longer to make than it saves: a wide network has kernels of its
# own, and its model is JAX's.
MOST_NODES = 10_000


class Reader:
    """Reads jaxprs into one graph of `most` nodes at most."""

    def __init__(self, graph: Graph, most: int = MOST_NODES) -> None:
        self.graph, self.most = graph, most

    def read(self, closed: Any, arguments: Sequence[Nodes]) -> list[Nodes]:
        """Outputs of a closed jaxpr, of nodes for its inputs."""
        return self._evaluate(closed.jaxpr, [self.array(c) for c in closed.consts], arguments)

    def array(self, values: Any) -> Nodes:
        """Known numbers as nodes."""
        values = np.asarray(values)
        if values.dtype.kind not in "fbiu":
            raise UnknownOperation(f"numbers of type {values.dtype}")
        flat = [self.graph.const(v) for v in values.ravel().tolist()]
        return np.array(flat, dtype=np.int64).reshape(values.shape)

    def numbers(self, nodes: Nodes, name: str) -> np.ndarray:
        """The inverse of `array`, where all are known: places in an array, and such."""
        found = [self.graph.value(int(node)) for node in nodes.ravel()]
        if any(value is None for value in found):
            raise UnknownOperation(f"{name} by what is not known beforehand")
        return np.array(found).reshape(nodes.shape)

    def _evaluate(self, jaxpr: Any, consts: Sequence[Nodes], given: Sequence[Nodes]) -> list[Nodes]:
        known: dict[Any, Nodes] = {}
        known.update(zip(jaxpr.constvars, consts, strict=True))
        known.update(zip(jaxpr.invars, given, strict=True))

        def of(variable: Any) -> Nodes:
            return self.array(variable.val) if hasattr(variable, "val") else known[variable]

        for equation in jaxpr.eqns:
            found = self._equation(equation, [of(v) for v in equation.invars])
            if len(self.graph.nodes) > self.most:
                raise UnknownOperation(f"more than {self.most} operations")
            known.update(zip(equation.outvars, found, strict=True))
        return [of(v) for v in jaxpr.outvars]

    def _equation(self, equation: Any, given: list[Nodes]) -> list[Nodes]:
        name, params = equation.primitive.name, equation.params
        if name.startswith("custom_"):
            raise UnknownOperation(f"a derivative of its own ({name})")
        if (inner := _inner(params)) is not None and name not in ("scan", "while", "cond"):
            consts = [self.array(c) for c in inner.consts]
            return self._evaluate(inner.jaxpr, consts, given[-len(inner.jaxpr.invars) :])
        if name == "scan":
            return self._scan(params, given)
        if name in ELEMENTWISE:
            _check_type(name, equation.outvars[0].aval.dtype)
            return [self.elementwise(ELEMENTWISE[name], *given)]
        if name in REDUCED:
            return [self.reduced(REDUCED[name], given[0], params["axes"])]
        if name in STRUCTURAL:
            made = STRUCTURAL[name](self, params, *given)
            return list(made) if isinstance(made, list | tuple) else [made]
        if name in MOVED_BY_JAX:
            return [self._moved(equation, given)]
        raise UnknownOperation(name)

    def elementwise(self, function: Callable[..., int], *given: Nodes) -> Nodes:
        shape = np.broadcast_shapes(*(nodes.shape for nodes in given))
        flat = [np.broadcast_to(nodes, shape).ravel().tolist() for nodes in given]
        found = [function(self.graph, *nodes) for nodes in zip(*flat, strict=True)]
        return np.array(found, dtype=np.int64).reshape(shape)

    def product(self, left: Nodes, right: Nodes) -> Nodes:
        """left [m, k] · right [n, k]ᵀ: [m, n]."""
        if left.shape[0] * right.shape[0] * left.shape[1] > self.most:
            raise UnknownOperation(f"more than {self.most} operations")
        each = self.elementwise(lambda g, x, y: g.mul(x, y), left[:, None], right[None])
        return self.reduced("add", each, (2,))

    def reduced(self, kind: str, nodes: Nodes, axes: Sequence[int]) -> Nodes:
        kept = [axis for axis in range(nodes.ndim) if axis not in axes]
        moved = np.transpose(nodes, [*axes, *kept])
        flat = moved.reshape(-1, *(nodes.shape[axis] for axis in kept))
        if not len(flat):
            raise UnknownOperation(f"{kind} of nothing")
        found = flat[0]
        for row in flat[1:]:
            found = self.elementwise(lambda g, a, b: g.apply(kind, a, b), found, row)
        return np.asarray(found, dtype=np.int64)

    def _scan(self, params: Any, given: list[Nodes]) -> list[Nodes]:
        """A loop of known length, written out."""
        consts, carried = params["num_consts"], params["num_carry"]
        fixed, carry, along = (
            given[:consts], given[consts : consts + carried], given[consts + carried :]
        )  # fmt: skip
        steps = range(params["length"])
        rows: dict[int, list[Nodes]] = {}
        for step in reversed(steps) if params["reverse"] else steps:
            found = self.read(params["jaxpr"], [*fixed, *carry, *(x[step] for x in along)])
            carry, rows[step] = found[:carried], found[carried:]
        stacked = [np.stack([rows[step][i] for step in steps]) for i in range(len(rows[steps[0]]))]
        return [*carry, *stacked]

    def _moved(self, equation: Any, given: list[Nodes]) -> Nodes:
        """What moves elements to known places, by JAX itself: of the nodes' integers."""
        name = equation.primitive.name
        moved = equation.primitive.bind(
            *(
                nodes.astype(np.int32)
                if i in MOVED_BY_JAX[name]
                else self.numbers(nodes, name).astype(np.int32)
                for i, nodes in enumerate(given)
            ),
            **equation.params,
        )
        return np.asarray(moved, dtype=np.int64)


def _check_type(name: str, kind: np.dtype) -> None:
    """Whole numbers are kept as numbers: what rounds them, and single precision, is not known."""
    whole = kind.kind in "iu" and name not in WHOLE
    if whole or kind.kind == "c" or (kind.kind == "f" and kind != np.float64):
        raise UnknownOperation(f"{name} of {kind}")
    if kind.kind == "b" and name not in TRUTHS:
        raise UnknownOperation(f"{name} of {kind}")


def _inner(params: Any) -> Any:
    for key in ("jaxpr", "call_jaxpr", "fun_jaxpr"):
        inner = params.get(key)
        if inner is not None:
            return inner if hasattr(inner, "consts") else core.ClosedJaxpr(inner, ())
    return None


# --- operations ------------------------------------------------------------------------------


def _plain(kind: str) -> Callable[..., int]:
    return lambda g, *nodes: g.apply(kind, *nodes)


def _sign(g: Graph, x: int) -> int:
    """-1, 0 or 1; of what is not a number, not a number."""
    zero = g.const(0.0)
    still = g.select(g.apply("eq", x, x), zero, x)
    below = g.select(g.apply("lt", x, zero), g.const(-1.0), still)
    return g.select(g.apply("gt", x, zero), g.const(1.0), below)


def _logistic(g: Graph, x: int) -> int:
    """1 / (1 + e⁻ˣ) = (1 + tanh(x/2)) / 2"""
    half = g.const(0.5)
    return g.add(half, g.mul(half, g.apply("tanh", g.mul(half, x))))


def _truncated(g: Graph, x: int) -> int:
    """Towards zero."""
    down = g.apply("floor", g.apply("abs", x))
    return g.select(g.apply("lt", x, g.const(0.0)), g.neg(down), down)


def _remainder(g: Graph, x: int, y: int) -> int:
    """x - y · trunc(x / y), with the sign of x."""
    return g.sub(x, g.mul(y, _truncated(g, g.apply("div", x, y))))


def _cube_root(g: Graph, x: int) -> int:
    size = g.apply("pow", g.apply("abs", x), g.const(1.0 / 3.0))
    return g.select(g.apply("lt", x, g.const(0.0)), g.neg(size), size)


def _clamp(g: Graph, low: int, x: int, high: int) -> int:
    within = g.select(g.apply("ge", x, high), high, x)
    return g.select(g.apply("le", x, low), low, within)


def _logical(kind: str) -> Callable[..., int]:
    def made(g: Graph, *nodes: int) -> int:
        if not all(g.is_truth(node) for node in nodes):
            raise UnknownOperation(f"{kind} of integers")
        return g.apply(kind, *nodes)

    return made


def _power(g: Graph, x: int, y: int) -> int:
    exponent = g.value(y)
    if exponent is not None and exponent == int(exponent) and abs(exponent) <= 64:
        return integer_power(g, x, int(exponent))
    return g.apply("sqrt", x) if exponent == 0.5 else g.apply("pow", x, y)


def integer_power(g: Graph, x: int, n: int) -> int:
    """xⁿ by squaring."""
    if n < 0:
        return g.apply("div", g.const(1.0), integer_power(g, x, -n))
    found, square = None, x
    while n:
        if n & 1:
            found = square if found is None else g.mul(found, square)
        n >>= 1
        square = g.mul(square, square) if n else square
    return g.const(1.0) if found is None else found


ELEMENTWISE: dict[str, Callable[..., int]] = {
    **{name: _plain(name) for name in (
        "add", "sub", "mul", "neg", "abs", "max", "min", "sqrt", "floor",
        "sin", "cos", "tan", "asin", "acos", "atan2", "exp", "expm1", "exp2", "log", "log1p",
        "tanh", "sinh", "cosh", "lt", "le", "gt", "ge", "eq", "ne",
    )},
    **{name: _logical(name) for name in ("and", "or", "xor", "not")},
    "div": lambda g, x, y: g.over(x, y),
    "add_any": _plain("add"),
    "pow": _power,
    "square": lambda g, x: g.mul(x, x),
    "rsqrt": lambda g, x: g.over(g.const(1.0), g.apply("sqrt", x)),
    "cbrt": _cube_root,
    "sign": _sign,
    "logistic": _logistic,
    "atan": lambda g, x: g.apply("atan2", x, g.const(1.0)),
    "ceil": lambda g, x: g.neg(g.apply("floor", g.neg(x))),
    "rem": _remainder,
    "clamp": _clamp,
    "is_finite": _plain("finite"),
    "select_n": lambda g, test, no, *yes: _chosen(g, test, no, *yes),
    "copy": lambda g, x: x,
    "copy_p": lambda g, x: x,
    "stop_gradient": lambda g, x: x,
}  # fmt: skip

WHOLE = frozenset(
    {"add", "sub", "mul", "neg", "abs", "max", "min", "sign", "clamp", "select_n", "copy", "copy_p"}
)
TRUTHS = frozenset(
    {"lt", "le", "gt", "ge", "eq", "ne", "and", "or", "xor", "not", "is_finite", "select_n",
     "copy", "copy_p", "stop_gradient"}
)  # fmt: skip
REDUCED = {
    "reduce_sum": "add", "reduce_prod": "mul", "reduce_max": "max", "reduce_min": "min",
    "reduce_and": "and", "reduce_or": "or",
}  # fmt: skip


def _chosen(g: Graph, test: int, no: int, *yes: int) -> int:
    if not yes:
        return no
    first, *others = yes
    if others or not g.is_truth(test):
        raise UnknownOperation("select of more than two")
    return g.select(test, first, no)


def _converted(r: Reader, params: Any, x: Nodes) -> Nodes:

    wanted = np.dtype(params["new_dtype"])
    kind = wanted.kind
    if kind not in "fbiu" or (kind == "f" and wanted != np.float64):
        raise UnknownOperation(f"numbers of type {wanted}")

    def one(g: Graph, node: int) -> int:
        if g.is_truth(node):
            return node if kind == "b" else g.select(node, g.const(1.0), g.const(0.0))
        if kind == "b":
            return g.apply("ne", node, g.const(0.0))
        if kind in "iu":
            return _truncated(g, node) if g.value(node) is None else node
        return node

    return r.elementwise(one, x)


def _integer_pow(r: Reader, params: Any, x: Nodes) -> Nodes:
    return r.elementwise(lambda g, node: integer_power(g, node, params["y"]), x)


def _broadcast(r: Reader, params: Any, x: Nodes, *_: Nodes) -> Nodes:
    shape, at = params["shape"], params["broadcast_dimensions"]
    whole = [1] * len(shape)
    for axis, place in enumerate(at):
        whole[place] = x.shape[axis]
    return np.broadcast_to(x.reshape(whole), shape)


def _slice(r: Reader, params: Any, x: Nodes) -> Nodes:
    strides = params["strides"] or (1,) * x.ndim
    return x[
        tuple(
            slice(a, b, s)
            for a, b, s in zip(
                params["start_indices"], params["limit_indices"], strides, strict=True
            )
        )
    ]


def _split(r: Reader, params: Any, x: Nodes) -> list[Nodes]:
    at = np.cumsum(params["sizes"])[:-1]
    return np.split(x, at, axis=params["axis"]) if params["sizes"] else []


def _iota(r: Reader, params: Any, *_: Nodes) -> Nodes:
    size = params["shape"][params["dimension"]]
    whole = [1] * len(params["shape"])
    whole[params["dimension"]] = size
    return np.broadcast_to(r.array(np.arange(size)).reshape(whole), params["shape"])


def _summed_along(r: Reader, params: Any, x: Nodes) -> Nodes:
    rows = np.moveaxis(x, params["axis"], 0)
    rows = rows[::-1] if params["reverse"] else rows
    found = [rows[0]]
    for row in rows[1:]:
        found.append(r.elementwise(lambda g, a, b: g.add(a, b), found[-1], row))
    whole = np.stack(found[::-1] if params["reverse"] else found)
    return np.moveaxis(whole, 0, params["axis"])


def _product(r: Reader, params: Any, a: Nodes, b: Nodes) -> Nodes:
    """Any contraction, with batches before."""
    (of_a, of_b), (batch_a, _) = params["dimension_numbers"]
    if batch_a:
        raise UnknownOperation("dot_general with batches")
    rest_a = [i for i in range(a.ndim) if i not in of_a]
    rest_b = [i for i in range(b.ndim) if i not in of_b]
    left = np.transpose(a, [*rest_a, *of_a]).reshape(-1, math.prod(a.shape[i] for i in of_a))
    right = np.transpose(b, [*rest_b, *of_b]).reshape(-1, left.shape[1])
    shape = [a.shape[i] for i in rest_a] + [b.shape[i] for i in rest_b]
    return r.product(left, right).reshape(shape)


STRUCTURAL: dict[str, Callable[..., Any]] = {
    "convert_element_type": _converted,
    "integer_pow": _integer_pow,
    "broadcast_in_dim": _broadcast,
    "reshape": lambda r, p, x, *_: x.reshape(p["new_sizes"]),
    "squeeze": lambda r, p, x: np.squeeze(x, tuple(p["dimensions"])),
    "expand_dims": lambda r, p, x: np.expand_dims(x, tuple(p["dimensions"])),
    "transpose": lambda r, p, x: np.transpose(x, p["permutation"]),
    "slice": _slice,
    "split": _split,
    "tile": lambda r, p, x: np.tile(x, p["reps"]),
    "stack": lambda r, p, *x: np.stack(x, p["axis"]),
    "concatenate": lambda r, p, *x: np.concatenate(x, p["dimension"]),
    "rev": lambda r, p, x: np.flip(x, p["dimensions"]),
    "iota": _iota,
    "cumsum": _summed_along,
    "dot_general": _product,
    "device_put": lambda r, p, *x: list(x),
}
# Which operands are elements that are moved; the others say where.
MOVED_BY_JAX = {
    "gather": (0,), "dynamic_slice": (0,), "dynamic_update_slice": (0, 1), "scatter": (0, 2),
    "pad": (0, 1),
}  # fmt: skip


def trace(function: Callable[..., Array], *shapes: tuple[int, ...]) -> Any:
    """The closed jaxpr of a function of arrays of these shapes, in double precision."""
    from shiplog.machine.jit_cache import double

    with double():
        return jax.make_jaxpr(function)(*(np.zeros(shape) for shape in shapes))
