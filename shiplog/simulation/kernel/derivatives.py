"""Derivatives on the graph, in reverse: of a few outputs by any number of inputs.

    x̄ᵢ = Σⱼ ȳⱼ ∂yⱼ/∂xᵢ,  from the output, whose ȳ is 1, back to the inputs (Griewank & Walther
    2008, Evaluating Derivatives, Sec. 3.2)

Value and derivatives are of one graph and share what they have in common. Where a function has a
corner the derivative is that of JAX 0.10: half to each of two equal ones at max and min, 1 of |x|
at 0, 0 at the limits of `lax.clamp`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from shiplog.simulation.kernel.graph import Graph

# Inputs of these do not move what they give, but for jumps.
STEPS = frozenset({"floor", "round", "const", "truth", "varying", "fixed"})


def gradients(g: Graph, outputs: Sequence[int], inputs: Sequence[int]) -> list[list[int]]:
    """∂y/∂x, a row an output y, a column an input x: nodes of the same graph."""
    return [_gradient(g, output, inputs) for output in outputs]


def _gradient(g: Graph, output: int, inputs: Sequence[int]) -> list[int]:
    moved = {output: g.const(1.0)}  # ȳ of the nodes that were reached
    wanted = set(inputs)
    reaching = _reaching(g, output, wanted)
    for node in reversed(g.needed([output])):
        bar = moved.get(node)
        if bar is None or node in wanted or node not in reaching:
            continue
        kind, *operands = g.nodes[node]
        if kind in STEPS or g.is_truth(node):
            continue
        for place, share in RULES[kind](g, node, bar, *operands):
            if place in reaching and g.value(share) != 0.0:
                moved[place] = g.add(moved[place], share) if place in moved else share
    zero = g.const(0.0)
    return [moved.get(node, zero) for node in inputs]


def _reaching(g: Graph, output: int, wanted: set[int]) -> set[int]:
    """The nodes that depend on a wanted input."""
    found = set(wanted)
    for node in g.needed([output]):
        if any(operand in found for operand in g.operands(node)):
            found.add(node)
    return found


Share = list[tuple[int, int]]  # operand, its part of x̄


def _linear(a: float, b: float) -> Callable[..., Share]:
    def rule(g: Graph, node: int, bar: int, x: int, y: int) -> Share:
        return [(x, g.mul(g.const(a), bar)), (y, g.mul(g.const(b), bar))]

    return rule


def _mul(g: Graph, node: int, bar: int, x: int, y: int) -> Share:
    return [(x, g.mul(bar, y)), (y, g.mul(bar, x))]


def _div(g: Graph, node: int, bar: int, x: int, y: int) -> Share:
    """∂(x/y) = (dx - (x/y) dy) / y"""
    part = g.over(bar, y)
    return [(x, part), (y, g.neg(g.mul(part, node)))]


def _larger(test: str) -> Callable[..., Share]:
    """Of max ("gt") and min ("lt"): to the one that is chosen; half to each of two equal ones."""

    def rule(g: Graph, node: int, bar: int, x: int, y: int) -> Share:
        zero, half = g.const(0.0), g.mul(g.const(0.5), bar)
        equal = g.apply("eq", x, y)
        return [
            (one, g.select(equal, half, g.select(g.apply(test, one, other), bar, zero)))
            for one, other in ((x, y), (y, x))
        ]

    return rule


def _by(slope: Callable[[Graph, int, int], int]) -> Callable[..., Share]:
    """Of one operand: `slope` of graph, node and operand."""

    def rule(g: Graph, node: int, bar: int, x: int) -> Share:
        return [(x, g.mul(bar, slope(g, node, x)))]

    return rule


def _abs(g: Graph, node: int, x: int) -> int:
    return g.select(g.apply("ge", x, g.const(0.0)), g.const(1.0), g.const(-1.0))


def _select(g: Graph, node: int, bar: int, test: int, yes: int, no: int) -> Share:
    zero = g.const(0.0)
    return [(yes, g.select(test, bar, zero)), (no, g.select(test, zero, bar))]


def _atan2(g: Graph, node: int, bar: int, y: int, x: int) -> Share:
    """∂ atan2(y, x) = (x dy - y dx) / (x² + y²)"""
    part = g.over(bar, g.add(g.mul(x, x), g.mul(y, y)))
    return [(y, g.mul(part, x)), (x, g.neg(g.mul(part, y)))]


def _pow(g: Graph, node: int, bar: int, x: int, y: int) -> Share:
    """∂ xʸ = y xʸ⁻¹ dx + xʸ ln x dy; without the first where y = 0, the second where x = 0."""
    zero, one = g.const(0.0), g.const(1.0)
    less = g.apply("pow", x, g.sub(y, one))
    by_x = g.select(g.apply("eq", y, zero), zero, g.mul(y, less))
    nothing = g.apply("eq", x, zero)
    by_y = g.select(nothing, zero, g.mul(node, g.apply("log", g.select(nothing, one, x))))
    return [(x, g.mul(bar, by_x)), (y, g.mul(bar, by_y))]


def _square_root_of_one_less(g: Graph, x: int) -> int:
    return g.apply("sqrt", g.sub(g.const(1.0), g.mul(x, x)))


RULES: dict[str, Callable[..., Share]] = {
    "add": _linear(1.0, 1.0),
    "sub": _linear(1.0, -1.0),
    "mul": _mul,
    "div": _div,
    "max": _larger("gt"),
    "min": _larger("lt"),
    "select": _select,
    "atan2": _atan2,
    "pow": _pow,
    "neg": _by(lambda g, n, x: g.const(-1.0)),
    "abs": _by(_abs),
    "sqrt": _by(lambda g, n, x: g.over(g.const(0.5), n)),
    "sin": _by(lambda g, n, x: g.apply("cos", x)),
    "cos": _by(lambda g, n, x: g.neg(g.apply("sin", x))),
    "tan": _by(lambda g, n, x: g.add(g.const(1.0), g.mul(n, n))),
    "exp": _by(lambda g, n, x: n),
    "expm1": _by(lambda g, n, x: g.add(n, g.const(1.0))),
    "exp2": _by(lambda g, n, x: g.mul(g.const(math.log(2.0)), n)),
    "log": _by(lambda g, n, x: g.over(g.const(1.0), x)),
    "log1p": _by(lambda g, n, x: g.over(g.const(1.0), g.add(g.const(1.0), x))),
    "tanh": _by(lambda g, n, x: g.sub(g.const(1.0), g.mul(n, n))),
    "sinh": _by(lambda g, n, x: g.apply("cosh", x)),
    "cosh": _by(lambda g, n, x: g.apply("sinh", x)),
    "asin": _by(lambda g, n, x: g.over(g.const(1.0), _square_root_of_one_less(g, x))),
    "acos": _by(lambda g, n, x: g.over(g.const(-1.0), _square_root_of_one_less(g, x))),
}
