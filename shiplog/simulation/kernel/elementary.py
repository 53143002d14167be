"""sin, cos, exp, log and their like in +, ·, / and √: the same numbers with every C library.

Each function is brought near zero by an exact identity and is a power series there, whose
coefficients are written as what they are (Muller 2016, Elementary Functions, Ch. 3 and 11). The
constants that reduce an argument, π/2 and ln 2, are split into parts of which the first have few
digits, so that k times them is exact (Cody & Waite 1980). Errors are below 2 units in the last
place for |x| < 10⁵; a heading that has run away farther has no meaning, but stays bounded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction

from shiplog.simulation.kernel.graph import Graph

PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494459230781640628620900")
LN2 = Fraction("0.69314718055994530941723212145817656807550013436025525412068000949339362196969472")
SPLIT_BITS = 33  # of the first parts of a constant: times k of 20 bits they are exact
FARTHEST = 1.0  # of a reduced angle, π/4 and rounding: beyond, the angle is no angle any more
LEAST_NORMAL = 2.0**-1022


def split(value: Fraction, parts: int = 3) -> list[float]:
    """Floating-point numbers that add up to it, all but the last of SPLIT_BITS bits."""
    found, left = [], value
    for _ in range(parts - 1):
        unit = Fraction(2) ** (math.frexp(float(left))[1] - SPLIT_BITS)
        part = (left // unit) * unit
        found.append(float(part))
        left -= part
    return [*found, float(left)]


def series(terms: Callable[[int], Fraction], count: int) -> list[float]:
    return [float(terms(k)) for k in range(count)]


# Terms are below 10⁻¹⁷ of the sum at the end of each reduced range.
SINE = series(lambda k: Fraction((-1) ** k, math.factorial(2 * k + 1)), 9)  # of x², |x| < π/4
COSINE = series(lambda k: Fraction((-1) ** k, math.factorial(2 * k)), 10)
EXPONENTIAL = series(lambda k: Fraction(1, math.factorial(k + 1)), 14)  # (eˣ - 1)/x, |x| < ln2 / 2
ARTANH = series(lambda k: Fraction(2, 2 * k + 1), 11)  # 2 artanh(s)/s, of s², |s| < 0.172
ARCTANGENT = series(lambda k: Fraction((-1) ** k, 2 * k + 1), 21)  # of t², |t| < tan(π/8)


def lowered(g: Graph, outputs: Sequence[int], into: Graph) -> list[int]:
    """The outputs of one graph in another, which has no function of these in it."""
    known: dict[int, int] = {}
    for node in g.needed(outputs):
        kind, *rest = g.nodes[node]
        if kind in ("const", "truth"):
            known[node] = into.const(rest[0])
        elif kind == "varying":
            known[node] = into.varying(rest[0])
        elif kind == "fixed":
            known[node] = into.fixed(rest[0])
        else:
            operands = [known[operand] for operand in rest]
            made = FUNCTIONS.get(kind)
            known[node] = made(into, *operands) if made else into.apply(kind, *operands)
    return [known[node] for node in outputs]


def _reduced(g: Graph, x: int, period: Fraction) -> tuple[int, int]:
    """k = x/period to the nearest whole number, and x - k · period."""
    k = g.apply("round", g.mul(x, g.const(float(1 / period))))
    left = x
    for part in split(period):
        left = g.sub(left, g.mul(k, g.const(part)))
    return k, left


def _sine_and_cosine(g: Graph, x: int) -> tuple[int, int, int]:
    """Of the reduced angle, and the quarter turn 0 to 3 that was taken off."""
    k, left = _reduced(g, x, PI / 2)
    left = g.apply("max", g.apply("min", left, g.const(FARTHEST)), g.const(-FARTHEST))
    square = g.mul(left, left)
    sine = g.mul(left, g.polynomial(square, SINE))
    four = g.mul(k, g.const(0.25))
    quarter = g.sub(k, g.mul(g.const(4.0), g.apply("floor", four)))
    return sine, g.polynomial(square, COSINE), quarter


def _turned(g: Graph, even: int, odd: int, quarter: int, negative: tuple[float, float]) -> int:
    """`even` in quarters 0 and 2, else `odd`; with a minus in the `negative` ones."""
    half = g.mul(quarter, g.const(0.5))
    value = g.select(g.apply("eq", half, g.apply("floor", half)), even, odd)
    one, other = (g.apply("eq", quarter, g.const(q)) for q in negative)
    return g.select(g.apply("or", one, other), g.neg(value), value)


def sin(g: Graph, x: int) -> int:
    s, c, quarter = _sine_and_cosine(g, x)
    return _turned(g, s, c, quarter, (2.0, 3.0))


def cos(g: Graph, x: int) -> int:
    s, c, quarter = _sine_and_cosine(g, x)
    return _turned(g, c, s, quarter, (1.0, 2.0))


def tan(g: Graph, x: int) -> int:
    return g.apply("div", sin(g, x), cos(g, x))


def _power_of_two(g: Graph, k: int) -> tuple[int, int]:
    """2^k as two factors, so that neither overflows where the product need not: k in ±2000."""
    k = g.apply("max", g.apply("min", k, g.const(2000.0)), g.const(-2000.0))
    first = g.apply("floor", g.mul(k, g.const(0.5)))
    return g.apply("pow2", first), g.apply("pow2", g.sub(k, first))


def exp(g: Graph, x: int) -> int:
    """eˣ = 2ᵏ eʳ"""
    return _grown(g, x, *_reduced(g, x, LN2), (-750.0, 710.0))


def exp2(g: Graph, x: int) -> int:
    """2ˣ = 2ᵏ e^(r ln 2)"""
    k = g.apply("round", x)
    return _grown(g, x, k, g.mul(g.sub(x, k), g.const(float(LN2))), (-1080.0, 1024.5))


def _grown(g: Graph, x: int, k: int, left: int, range_: tuple[float, float]) -> int:
    """2ᵏ eʳ; below the range 0, above it infinite."""
    value = g.add(g.const(1.0), g.mul(left, g.polynomial(left, EXPONENTIAL)))
    one, other = _power_of_two(g, k)
    found = g.mul(g.mul(value, one), other)
    low, high = (g.const(v) for v in range_)
    found = g.select(g.apply("gt", x, high), g.const(math.inf), found)
    return g.select(g.apply("lt", x, low), g.const(0.0), found)


def expm1(g: Graph, x: int) -> int:
    """eˣ - 1 = 2ᵏ (eʳ - 1) + (2ᵏ - 1)"""
    k, left = _reduced(g, x, LN2)
    value = g.mul(left, g.polynomial(left, EXPONENTIAL))
    one = g.const(1.0)
    scale = g.apply("pow2", g.apply("max", g.apply("min", k, g.const(1000.0)), g.const(-60.0)))
    found = g.add(g.mul(value, scale), g.sub(scale, one))
    found = g.select(g.apply("gt", x, g.const(690.0)), g.sub(exp(g, x), one), found)
    return g.select(g.apply("lt", x, g.const(-40.0)), g.const(-1.0), found)


def log(g: Graph, x: int) -> int:
    """ln x = e ln 2 + 2 artanh((m - 1)/(m + 1)),  x = m 2ᵉ, m in [√½, √2)"""
    zero, one = g.const(0.0), g.const(1.0)
    small = g.apply("lt", x, g.const(LEAST_NORMAL))
    grown = g.select(small, g.mul(x, g.const(2.0**64)), x)
    e, m = g.apply("exponent", grown), g.apply("fraction", grown)
    e = g.select(small, g.sub(e, g.const(64.0)), e)
    s = g.apply("div", g.sub(m, one), g.add(m, one))
    near = g.mul(s, g.polynomial(g.mul(s, s), ARTANH))
    high, low = split(LN2, 2)
    found = g.add(g.mul(e, g.const(high)), g.add(near, g.mul(e, g.const(low))))
    found = g.select(g.apply("eq", x, zero), g.const(-math.inf), found)
    # infinite, and what is not a number, are themselves; below zero there is none
    ordinary = g.apply("and", g.apply("ge", x, zero), g.apply("lt", x, g.const(math.inf)))
    beyond = g.select(g.apply("lt", x, zero), g.const(math.nan), x)
    return g.select(ordinary, found, beyond)


def log1p(g: Graph, x: int) -> int:
    """ln u + (x - (u - 1))/u,  u = 1 + x as rounded"""
    one = g.const(1.0)
    u = g.add(one, x)
    found = g.add(log(g, u), g.apply("div", g.sub(x, g.sub(u, one)), u))
    return g.select(g.apply("finite", found), found, log(g, u))


def tanh(g: Graph, x: int) -> int:
    """(e²ˣ - 1)/(e²ˣ + 1), of |x|: from 20 on it is 1."""
    size = g.apply("min", g.apply("abs", x), g.const(20.0))
    grown = expm1(g, g.mul(g.const(2.0), size))
    found = g.apply("div", grown, g.add(grown, g.const(2.0)))
    found = g.apply("copysign", found, x)
    return g.select(g.apply("eq", x, x), found, x)


def sinh(g: Graph, x: int) -> int:
    """(m + m/(m + 1))/2,  m = e^|x| - 1"""
    grown = expm1(g, g.apply("abs", x))
    part = g.apply("div", grown, g.add(grown, g.const(1.0)))
    found = g.mul(g.const(0.5), g.add(grown, part))
    found = g.select(g.apply("finite", grown), found, grown)
    return g.apply("copysign", found, x)


def cosh(g: Graph, x: int) -> int:
    grown = exp(g, g.apply("abs", x))
    return g.mul(g.const(0.5), g.add(grown, g.apply("div", g.const(1.0), grown)))


def atan2(g: Graph, y: int, x: int) -> int:
    """Of the smaller over the larger, t in [0, 1]; above tan(π/8) by π/4 + arctan((t-1)/(t+1))."""
    zero, one = g.const(0.0), g.const(1.0)
    up, across = g.apply("abs", y), g.apply("abs", x)
    steep = g.apply("gt", up, across)
    low, high = g.select(steep, across, up), g.select(steep, up, across)
    nothing = g.apply("eq", high, zero)
    t = g.apply("div", low, g.select(nothing, one, high))
    # both infinite
    t = g.select(g.apply("and", g.apply("eq", low, high), g.apply("gt", low, zero)), one, t)
    far = g.apply("gt", t, g.const(math.tan(math.pi / 8.0)))
    near = g.apply("div", g.sub(t, one), g.add(t, one))
    near = g.select(far, near, t)
    value = g.mul(near, g.polynomial(g.mul(near, near), ARCTANGENT))
    value = g.select(far, g.add(g.const(float(PI / 4)), value), value)
    value = g.select(steep, g.sub(g.const(float(PI / 2)), value), value)
    astern = g.apply("lt", g.apply("copysign", one, x), zero)
    value = g.select(astern, g.sub(g.const(float(PI)), value), value)
    found = g.apply("copysign", value, y)
    numbers = g.apply("and", g.apply("eq", x, x), g.apply("eq", y, y))
    return g.select(numbers, found, g.add(x, y))


def asin(g: Graph, x: int) -> int:
    one = g.const(1.0)
    return atan2(g, x, g.apply("sqrt", g.mul(g.sub(one, x), g.add(one, x))))


def acos(g: Graph, x: int) -> int:
    one = g.const(1.0)
    return atan2(g, g.apply("sqrt", g.mul(g.sub(one, x), g.add(one, x))), x)


def power(g: Graph, x: int, y: int) -> int:
    """|x|ʸ = e^(y ln|x|); below zero a sign for whole y, else no number."""
    zero, one = g.const(0.0), g.const(1.0)
    size = exp(g, g.mul(y, log(g, g.apply("abs", x))))
    whole = g.apply("eq", y, g.apply("floor", y))
    half = g.mul(g.const(0.5), y)
    even = g.apply("eq", half, g.apply("floor", half))
    below = g.select(whole, g.select(even, size, g.neg(size)), g.const(math.nan))
    found = g.select(g.apply("lt", x, zero), below, size)
    plain = g.apply("or", g.apply("eq", y, zero), g.apply("eq", x, one))
    return g.select(plain, one, found)


FUNCTIONS: dict[str, Callable[..., int]] = {
    "sin": sin, "cos": cos, "tan": tan, "exp": exp, "expm1": expm1, "exp2": exp2,
    "log": log, "log1p": log1p, "tanh": tanh, "sinh": sinh, "cosh": cosh,
    "atan2": atan2, "asin": asin, "acos": acos, "pow": power,
}  # fmt: skip
