"""Operations of the graph in the languages of the targets: a template each.

{0}, {1} and {2} are the operands. Comparisons give truth values, `select` chooses by one. All
follow IEEE 754 as JAX does: max and min of what is not a number are not a number.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

_COMMON = {
    "add": "({0} + {1})", "sub": "({0} - {1})", "neg": "(-{0})",
    "lt": "({0} < {1})", "le": "({0} <= {1})", "gt": "({0} > {1})", "ge": "({0} >= {1})",
    "eq": "({0} == {1})", "sqrt": "sqrt({0})", "floor": "floor({0})",
    "sin": "sin({0})", "cos": "cos({0})", "tan": "tan({0})", "exp": "exp({0})",
    "expm1": "expm1({0})", "log": "log({0})", "log1p": "log1p({0})", "tanh": "tanh({0})",
    "sinh": "sinh({0})", "cosh": "cosh({0})", "atan2": "atan2({0}, {1})", "asin": "asin({0})",
    "acos": "acos({0})",
}  # fmt: skip
_TIMES = {"mul": "({0} * {1})", "div": "({0} / {1})", "ne": "({0} != {1})"}


@dataclass(frozen=True)
class Language:
    """operations  kind → template
    number      how a number that is not finite is written: infinite, and none
    truth       words for true and false
    declared    of a name and an expression: a statement, of numbers and of truth values
    element     of an array's name and a place from 0 on
    store       likewise, with the value to keep there
    turn        where cosine and sine of the heading are known already; None where they are not
    """

    operations: Mapping[str, str]
    infinite: str
    none: str
    truth: tuple[str, str]
    declared: tuple[str, str]
    element: str
    store: str
    one_based: bool = False
    turn: tuple[str, str] | None = None

    def number(self, value: float) -> str:
        if value != value:
            return self.none
        if value in (float("inf"), float("-inf")):
            return self.infinite if value > 0 else f"(-{self.infinite})"
        text = repr(float(value))
        return f"({text})" if text.startswith("-") else text

    def at(self, array: str, place: int) -> str:
        return self.element.format(array, place + self.one_based)

    def kept(self, array: str, place: int, value: str) -> str:
        return self.store.format(array, place + self.one_based, value)


C = Language(
    _COMMON | _TIMES | {
        "abs": "fabs({0})", "max": "@NAME@_larger({0}, {1})", "min": "@NAME@_smaller({0}, {1})",
        "round": "rint({0})", "copysign": "copysign({0}, {1})", "exp2": "exp2({0})",
        "pow": "pow({0}, {1})", "and": "({0} && {1})", "or": "({0} || {1})",
        "xor": "({0} != {1})", "not": "(!{0})", "finite": "(fabs({0}) < HUGE_VAL)",
        "select": "({0} ? {1} : {2})",
    },
    infinite="HUGE_VAL", none="NAN", truth=("1", "0"),
    declared=("const double {0} = {1};", "const int {0} = {1};"),
    element="{0}[{1}]", store="{0}[{1}] = {2};", turn=("turn[0]", "turn[1]"),
)  # fmt: skip

PYTHON = Language(
    {kind: text.replace("asin(", "arcsin(").replace("acos(", "arccos(")
        .replace("atan2(", "arctan2(") for kind, text in (_COMMON | _TIMES).items()} | {
        "abs": "abs({0})", "max": "maximum({0}, {1})", "min": "minimum({0}, {1})",
        "round": "rint({0})", "copysign": "copysign({0}, {1})", "exp2": "exp2({0})",
        "pow": "power({0}, {1})", "and": "({0} & {1})", "or": "({0} | {1})",
        "xor": "({0} ^ {1})", "not": "logical_not({0})", "finite": "isfinite({0})",
        "select": "where({0}, {1}, {2})",
    },
    infinite="inf", none="nan", truth=("True", "False"), declared=("{0} = {1}", "{0} = {1}"),
    element="{0}[{1}]", store="{0}[{1}] = {2}",
)  # fmt: skip

OCTAVE = Language(
    _COMMON | {
        "mul": "({0} * {1})", "div": "({0} / {1})", "ne": "({0} ~= {1})",
        "abs": "abs({0})", "max": "larger({0}, {1})", "min": "smaller({0}, {1})",
        "round": "nearest({0})", "copysign": "signed({0}, {1})", "exp2": "(2 ^ {0})",
        # outside their domain Octave's are complex, and here there is no number
        "pow": "real_only({0} ^ {1})", "sqrt": "real_only(sqrt({0}))", "log": "real_only(log({0}))",
        "log1p": "real_only(log1p({0}))", "asin": "real_only(asin({0}))",
        "acos": "real_only(acos({0}))",
        "and": "({0} && {1})", "or": "({0} || {1})",
        "xor": "xor({0}, {1})", "not": "(~{0})", "finite": "isfinite({0})",
        "select": "chosen({0}, {1}, {2})",
    },
    infinite="Inf", none="NaN", truth=("true", "false"), declared=("{0} = {1};", "{0} = {1};"),
    element="{0}({1})", store="{0}({1}) = {2};", one_based=True,
)  # fmt: skip
