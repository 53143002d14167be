"""Equations as statements of a language: what depends on coefficients alone, and ν̇ itself.

    hoisted   c = of p: once, and again where a coefficient was changed
    varying   ν̇ = of c and x: at every step

A value that is used once is written where it is used, as long as the line stays readable.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from shiplog.export.equations import DOT, Equations
from shiplog.export.languages import Language
from shiplog.simulation.kernel.graph import Graph

LONGEST = 60  # letters of an expression that is still written inside another
HEADING = 4  # of the state
STATE_NAMES = {1: "u", 3: "v", 4: "psi", 5: "r"}  # of the state as the field has them


@dataclass(frozen=True)
class Statements:
    """hoisted    lines that fill the array `c` of the array `p` of coefficients
    varying    lines that give the numbers `outputs` of `c` and `x`
    outputs    expressions of u̇, v̇ and ṙ, and of what the equations have behind them
    constants  length of `c`
    """

    hoisted: tuple[str, ...]
    varying: tuple[str, ...]
    outputs: tuple[str, ...]
    constants: int


# (array's name, matrix's number, its rows, expressions of its operands) -> lines of a product
Product = Callable[[str, int, int, list[str]], list[str]]


def written(equations: Equations, language: Language, product: Product) -> Statements:
    """`product` writes a matrix times a vector into an array of the name it is given."""
    g = equations.graph
    needed = g.needed(equations.outputs)
    hoisted = _hoisted(g, needed, equations.outputs)
    places = {node: i for i, node in enumerate(hoisted)}
    first = _Writer(equations, language, product, places, varying=False)
    for node in g.needed(hoisted):
        first.compute(node)
    lines = [language.kept("c", i, first.number(node)) for node, i in places.items()]
    second = _Writer(equations, language, product, places, varying=True)
    for node in needed:
        if g.varies[node]:
            second.compute(node)
    outputs = tuple(second.number(node) for node in equations.outputs)
    return Statements((*first.lines, *lines), tuple(second.lines), outputs, len(places))


def _hoisted(g: Graph, needed: list[int], outputs: tuple[int, ...]) -> list[int]:
    """Nodes of coefficients alone that something varying uses, or that are an output."""
    found: dict[int, None] = {}
    for node in needed:
        if g.varies[node]:
            for one in g.operands(node):
                if not g.varies[one] and g.value(one) is None:
                    found[one] = None
    for node in outputs:
        if not g.varies[node] and g.value(node) is None:
            found[node] = None
    return list(found)


class _Writer:
    def __init__(
        self,
        equations: Equations,
        language: Language,
        product: Product,
        places: dict[int, int],
        varying: bool,
    ) -> None:
        self._of, self._language, self._product = equations, language, product
        self._g, self._places, self._varying = equations.graph, places, varying
        self._known: dict[int, str] = {}
        self._arrays: dict[tuple[int, ...], str] = {}
        self.lines: list[str] = []
        outputs = equations.outputs if varying else tuple(places)
        within = [n for n in self._g.needed(outputs) if self._g.varies[n] or not varying]
        self._uses = Counter(one for n in within for one in self._g.operands(n))
        self._uses.update(outputs)

    def number(self, node: int) -> str:
        """The expression of a node, a truth value as 1 or 0."""
        found = self.of(node)
        if self._g.is_truth(node):
            one, zero = (self._language.number(v) for v in (1.0, 0.0))
            return self._language.operations["select"].format(found, one, zero)
        return found

    def of(self, node: int) -> str:
        found = self._known.get(node)
        if found is None:
            found = self._known[node] = self._loaded(node)
        return found

    def _loaded(self, node: int) -> str:
        kind, *rest = self._g.nodes[node]
        if kind == "const":
            return self._language.number(rest[0])
        if kind == "truth":
            return self._language.truth[0 if rest[0] else 1]
        if kind == "varying":
            return self._input(rest[0])
        assert self._varying and node in self._places, kind
        found = self._language.at("c", self._places[node])
        return f"({found} != 0)" if self._g.is_truth(node) else found

    def compute(self, node: int) -> None:
        kind, *rest = self._g.nodes[node]
        if kind in ("const", "truth", "varying"):  # written where they are used
            return
        if kind == "fixed":
            self._known[node] = self._language.at("p", rest[0])
        elif kind in ("cos", "sin") and self._turns(rest[0]):
            turn = self._language.turn
            assert turn is not None
            self._known[node] = turn[0] if kind == "cos" else turn[1]
        elif kind == DOT:
            self._known[node] = self._row(rest)
        else:
            self._keep(node, self._language.operations[kind].format(*map(self.of, rest)))

    def _turns(self, node: int) -> bool:
        """Whether it is the heading, whose cosine and sine are known."""
        return self._language.turn is not None and self._g.nodes[node] == ("varying", HEADING)

    def _input(self, place: int) -> str:
        if place in STATE_NAMES:
            name = STATE_NAMES[place]
            if name not in self._arrays.values():
                self._arrays[(place,)] = name
                declared = self._language.declared[0]
                self.lines.append(declared.format(name, self._language.at("x", place)))
            return name
        return self._language.at("x", place)

    def _row(self, rest: list[int]) -> str:
        which, row, *operands = rest
        matrix, place = (int(self._g.value(n) or 0.0) for n in (which, row))
        key = (matrix, *operands)
        name = self._arrays.get(key)
        if name is None:
            name = self._arrays[key] = f"product{len(self._arrays)}"
            given = [self.number(one) for one in operands]
            self.lines += self._product(name, matrix, len(self._of.matrices[matrix]), given)
        return self._language.at(name, place)

    def _keep(self, node: int, expression: str) -> None:
        truth = self._g.is_truth(node)
        if self._uses[node] == 1 and len(expression) < LONGEST:
            self._known[node] = expression
            return
        name = f"{'b' if truth else 't'}{node}"
        plain = expression[1:-1] if _wrapped(expression) else expression
        self.lines.append(self._language.declared[1 if truth else 0].format(name, plain))
        self._known[node] = name


def _wrapped(text: str) -> bool:
    """Whether its first bracket closes at its end."""
    if not text.startswith("("):
        return False
    depth = 0
    for i, letter in enumerate(text):
        depth += (letter == "(") - (letter == ")")
        if depth == 0:
            return i == len(text) - 1
    return False
