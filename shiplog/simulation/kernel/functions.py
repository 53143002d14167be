"""A graph as functions over lanes, what depends on the coefficients alone computed once.

    prepare(fixed, constants)          of coefficients and sizes, once a call: the hoisted part
    NAME(varying, constants, outputs)  of a vector for every varying input: a vector an output

An output that is known, or hoisted, is written by `NAME_fill` once: the memory of outputs is kept
from sample to sample.
"""

from __future__ import annotations

from collections.abc import Sequence

from shiplog.simulation.kernel.graph import Graph
from shiplog.simulation.kernel.writer import POINTER, Function, Module, Value

COMPARED = {"lt": "olt", "le": "ole", "gt": "ogt", "ge": "oge", "eq": "oeq", "ne": "une"}
INTRINSICS = {"sqrt": "sqrt", "abs": "fabs", "floor": "floor", "round": "rint",
              "copysign": "copysign"}  # fmt: skip
OPERATORS = {
    "add": Value.__add__, "sub": Value.__sub__, "mul": Value.__mul__, "div": Value.__truediv__
}  # fmt: skip
# Of a double, sign, 11 bits of exponent and 52 of fraction (IEEE 754). A whole number k is the
# lowest bits of k + 1.5 · 2⁵².
WHOLE, MANTISSA, BIAS = 1.5 * 2.0**52, 52, 1023
WHOLE_BITS = 0x4338000000000000
ROOT_HALF_BITS = 0x3FE6A09E00000000  # of √½, rounded down: fractions are from there to twice that


class Functions:
    """Writes functions of one lowered graph into a module; all share the hoisted constants."""

    def __init__(self, module: Module, graph: Graph) -> None:
        self._module, self._graph = module, graph
        self._hoisted: dict[int, int] = {}  # node: place among the constants

    def write(self, name: str, outputs: Sequence[int]) -> None:
        g = self._graph
        changing = [(i, node) for i, node in enumerate(outputs) if g.varies[node]]
        still = [(i, node) for i, node in enumerate(outputs) if not g.varies[node]]
        arguments = [("x", POINTER), ("c", POINTER), ("out", POINTER)]
        with self._module.function(name, arguments, private=True) as (f, (x, c, out)):
            values = _Values(f, g, x, c, self._place)
            for node in g.needed([node for _, node in changing]):
                if g.varies[node]:
                    values.compute(node)
            for i, node in changing:
                f.store_lanes(values.of(node), out, i)
        with self._module.function(f"{name}_fill", arguments[1:], private=True) as (f, (c, out)):
            values = _Values(f, g, c, c, self._place)
            for i, node in still:
                f.store_lanes(values.of(node), out, i)

    def _place(self, node: int) -> int:
        if self._graph.is_truth(node):  # constants are numbers
            one, zero = self._graph.const(1.0), self._graph.const(0.0)
            node = self._graph.select(node, one, zero)
        return self._hoisted.setdefault(node, len(self._hoisted))

    def prepare(self) -> int:
        """Last of all, when it is known what is hoisted: how many constants by all functions."""
        g, scalar = self._graph, Module(1)
        arguments = [("fixed", POINTER), ("c", POINTER)]
        with scalar.function("prepare", arguments) as (f, (fixed, c)):
            values = _Values(f, g, fixed, fixed, None)
            for node in g.needed(self._hoisted):
                values.compute(node)
            for node, place in self._hoisted.items():
                f.store(values.of(node), c, place)
        self._module.adopt(scalar)
        return len(self._hoisted)


class _Values:
    """Nodes of a graph as values of a function: inputs are loaded, operations written."""

    def __init__(self, f: Function, g: Graph, inputs: Value, constants: Value, place) -> None:
        self._f, self._g, self._inputs, self._constants = f, g, inputs, constants
        self._place = place  # None where constants are computed, not loaded
        self._known: dict[int, Value] = {}

    def of(self, node: int) -> Value:
        if node not in self._known:
            self._known[node] = self._loaded(node)
        return self._known[node]

    def _loaded(self, node: int) -> Value:
        kind, *rest = self._g.nodes[node]
        if kind == "const":
            return self._f.lanes(rest[0])
        if kind == "truth":
            return _truth(self._f, rest[0])
        assert self._place is not None, kind
        found = self._f.spread(self._f.load(self._constants, self._place(node)))
        return found.compared("une", 0.0) if self._g.is_truth(node) else found

    def compute(self, node: int) -> None:
        kind, *rest = self._g.nodes[node]
        if kind in ("const", "truth"):
            return
        if kind in ("varying", "fixed"):
            self._known[node] = self._f.load_lanes(self._inputs, rest[0])
            return
        self._known[node] = _operation(self._f, kind, [self.of(operand) for operand in rest],
                                       [self._g.value(operand) for operand in rest])  # fmt: skip


def _truth(f: Function, value: bool) -> Value:
    count, word = f.module.lanes, "true" if value else "false"
    if count == 1:
        return Value(f, word, "i1")
    return Value(f, "<" + ", ".join([f"i1 {word}"] * count) + ">", f"<{count} x i1>")


def _operation(f: Function, kind: str, given: list[Value], known: list) -> Value:
    if kind in OPERATORS:
        return OPERATORS[kind](*given)
    if kind in COMPARED:
        return given[0].compared(COMPARED[kind], given[1])
    if kind == "neg":
        return f.put(f"fneg {given[0].kind} {given[0].text}", given[0].kind)
    if kind == "select":
        return given[0].chosen(given[1], given[2])
    if kind in ("max", "min"):
        return _extreme(f, kind, given, known)
    if kind in INTRINSICS:
        return f.intrinsic(INTRINSICS[kind], *given)
    if kind in ("and", "or", "xor"):
        return f.put(f"{kind} {given[0].kind} {given[0].text}, {given[1].text}", given[0].kind)
    if kind == "not":
        return f.put(f"xor {given[0].kind} {given[0].text}, {_truth(f, True).text}", given[0].kind)
    if kind == "finite":
        size = f.intrinsic("fabs", given[0])
        return size.compared("olt", float("inf"))
    return BITS[kind](f, given[0])


def _extreme(f: Function, kind: str, given: list[Value], known: list) -> Value:
    """Not a number where either is none. A known number is chosen only where it is beyond."""
    if known[0] is not None:
        given = given[::-1]
    elif known[1] is None:
        return f.intrinsic("maximum" if kind == "max" else "minimum", *given)
    one, limit = given
    return limit.compared("ogt" if kind == "max" else "olt", one).chosen(limit, one)


def _whole(f: Function, value: int) -> Value:
    count = f.module.lanes
    if count == 1:
        return Value(f, str(value), "i64")
    return Value(f, "<" + ", ".join([f"i64 {value}"] * count) + ">", f"<{count} x i64>")


def _bits(f: Function, x: Value) -> Value:
    kind = _whole(f, 0).kind
    return f.put(f"bitcast {x.kind} {x.text} to {kind}", kind)


def _number(f: Function, bits: Value) -> Value:
    kind = f.module.vector
    return f.put(f"bitcast {bits.kind} {bits.text} to {kind}", kind)


def _shifted(f: Function, how: str, bits: Value, by: int) -> Value:
    return f.put(f"{how} {bits.kind} {bits.text}, {_whole(f, by).text}", bits.kind)


def _pow2(f: Function, k: Value) -> Value:
    """2ᵏ of a whole k from -1022 to 1023: k + 1023 where the exponent stands."""
    return _number(f, _shifted(f, "shl", _bits(f, k + (WHOLE + BIAS)), MANTISSA))


def _exponent_bits(f: Function, x: Value) -> Value:
    bits = _bits(f, x)
    base = _whole(f, ROOT_HALF_BITS)
    less = f.put(f"sub {bits.kind} {bits.text}, {base.text}", bits.kind)
    return _shifted(f, "ashr", less, MANTISSA)


def _exponent(f: Function, x: Value) -> Value:
    """e of x = m 2ᵉ with m in [√½, √2)."""
    e = _exponent_bits(f, x)
    bits = f.put(f"add {e.kind} {e.text}, {_whole(f, WHOLE_BITS).text}", e.kind)
    return _number(f, bits) - WHOLE


def _fraction(f: Function, x: Value) -> Value:
    """m of x = m 2ᵉ with m in [√½, √2)."""
    e = _shifted(f, "shl", _exponent_bits(f, x), MANTISSA)
    bits = _bits(f, x)
    return _number(f, f.put(f"sub {bits.kind} {bits.text}, {e.text}", bits.kind))


BITS = {"pow2": _pow2, "exponent": _exponent, "fraction": _fraction}
