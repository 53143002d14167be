"""Rollouts of windows, written for lanes: a window each.

    xₖ₊₁ = xₖ + h ẋ(xₖ, uₖ; θ)                                    (Eq. 9)
    sₖ₊₁ = sₖ + h (A sₖ + B),  s = ∂x/∂θ, A = ∂ẋ/∂x, B = ∂ẋ/∂θ

A step of the path, its derivatives and what becomes of them are one pass over memory that stays
in the processor's cache. Inputs are held over `substeps` of each measured step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from shiplog.nomenclature.channels import VELOCITY_IN_STATE
from shiplog.simulation.kernel.writer import DOUBLE, INT, POINTER, Function, Module, Value

STATES = 6
BLOCK = 4  # columns and rows of JᵀJ that are summed in registers


@dataclass(frozen=True)
class Sizes:
    """Of a kind of ship: `driven` inputs after the state (actuators, then the true wind), and
    `coefficients` P. A function of it writes ν̇ [3], cos ψ, sin ψ, and, where it has derivatives,
    ∂ν̇/∂x [3, columns of x], ∂ν̇/∂θ [3, P]."""

    driven: int
    coefficients: int
    by: int = STATES  # columns of ∂ν̇/∂x
    zeros: frozenset[int] = frozenset()  # outputs that are zero whatever the inputs

    @property
    def inputs(self) -> int:
        return STATES + self.driven

    @property
    def slopes(self) -> int:
        """Where ∂ν̇/∂x begins."""
        return 5

    @property
    def by_theta(self) -> int:
        """Where ∂ν̇/∂θ begins."""
        return self.slopes + 3 * self.by

    @property
    def outputs(self) -> int:
        return self.by_theta + 3 * self.coefficients


class Block:
    """As many windows as there are lanes, from the `first` on: of N; the last one fills up. What
    is written of it twice is the same."""

    def __init__(self, f: Function, first: Value, count: Value) -> None:
        self.f = f
        last = count - 1
        self.windows = [f.smaller(first + lane, last) for lane in range(f.module.lanes)]

    def rows(self, pointer: Value, stride: Value | int) -> Rows:
        """Each window's own part of an array, `stride` numbers apart."""
        return Rows(self.f, [self.f.at(pointer, window * stride) for window in self.windows])


@dataclass(frozen=True)
class Rows:
    """A pointer for each lane."""

    f: Function
    pointers: Sequence[Value]

    def gathered(self, offset: Value | int) -> Value:
        """Number `offset` of each."""
        return self.f.together([self.f.load(pointer, offset) for pointer in self.pointers])

    def scattered(self, values: Sequence[Value], offset: Value | int) -> None:
        """A vector for each of some numbers in a row, to every lane's place for them."""
        f, lanes = self.f, self.f.module.lanes
        for at in range(0, len(values), lanes):
            part = list(values[at : at + lanes])
            filled = part + [f.lanes(0.0)] * (lanes - len(part))
            place = offset + at
            for pointer, row in zip(self.pointers, f.transposed(filled), strict=True):
                f.store(narrowed(f, row, len(part)), pointer, place)


def narrowed(f: Function, row: Value, count: int) -> Value:
    """The first numbers of a vector."""
    if count == f.module.lanes:
        return row
    mask = ", ".join(f"i32 {i}" for i in range(count))
    kind = f"<{count} x double>"
    text = f"shufflevector {row.kind} {row.text}, {row.kind} poison, <{count} x i32> <{mask}>"
    return f.put(text, kind)


@dataclass(frozen=True)
class Step:
    """What a step needs of the function's outputs: rates of position, and derivatives of them."""

    h: Value
    ch: Value  # h cos ψ
    sh: Value  # h sin ψ
    north: Value  # h ẋ₀
    east: Value  # h ẏ₀


def step_of(f: Function, x: Value, out: Value, h: Value) -> Step:
    cos, sin = f.load_lanes(out, 3), f.load_lanes(out, 4)
    u, v = f.load_lanes(x, 1), f.load_lanes(x, 3)
    return Step(h, h * cos, h * sin, h * (cos * u - sin * v), h * (sin * u + cos * v))


def advance(f: Function, x: Value, out: Value, step: Step) -> None:
    """The state, one step of Euler on."""
    r = f.load_lanes(x, 5)
    changes = (
        step.north, step.h * f.load_lanes(out, 0), step.east, step.h * f.load_lanes(out, 1),
        step.h * r, step.h * f.load_lanes(out, 2),
    )  # fmt: skip
    for i, change in enumerate(changes):
        f.store_lanes(f.load_lanes(x, i) + change, x, i)


class Windows:
    """Writes `rollout`, `slopes` and `normal` of windows."""

    def __init__(self, module: Module, sizes: Sizes) -> None:
        self.module, self.sizes = module, sizes

    def _rows(self, block: Block, given: dict[str, Value]) -> dict[str, Rows]:
        """Each window's part of what is given."""
        instants = given["I"]
        widths = {
            "start": STATES, "actuator": given["I"] * (self.sizes.driven - 2),
            "wind": given["I"] * 2, "dt": given["I"] - 1, "steps": instants, "weight": 1,
            "states": instants * STATES, "measured": instants * STATES,
            "slopes": instants * (STATES * self.padded),
        }  # fmt: skip
        return {n: block.rows(given[n], width) for n, width in widths.items() if n in given}

    def _driven(self, f: Function, rows: dict[str, Rows], given: dict[str, Value], k, x) -> Value:
        """Inputs of step k into x, and its length over the substeps."""
        actuators = self.sizes.driven - 2
        for i in range(actuators):
            f.store_lanes(rows["actuator"].gathered(k * actuators + i), x, STATES + i)
        for i in range(2):
            f.store_lanes(rows["wind"].gathered(k * 2 + i), x, STATES + actuators + i)
        return rows["dt"].gathered(k) * given["part"]

    @property
    def padded(self) -> int:
        """P filled up to whole vectors, so that rows begin where a cache line does."""
        lanes = self.module.lanes
        return -(-self.sizes.coefficients // lanes) * lanes

    def rollout(self, function: str) -> None:
        """States [N, I, 6] of `function`, ν̇ without derivatives."""
        names = ["c", "start", "actuator", "wind", "dt", "states"]
        arguments = [(n, POINTER) for n in names] + [
            ("N", INT), ("I", INT), ("substeps", INT), ("part", DOUBLE)
        ]  # fmt: skip
        with self.module.function("rollout", arguments) as (f, values):
            given = dict(zip([n for n, _ in arguments], values, strict=True))
            x, out = f.reserve(self.sizes.inputs), f.reserve(5)
            f.call(f"{function}_fill", given["c"], out)
            with f.loop(given["N"], 0, self.module.lanes, outer=True) as first:
                rows = self._rows(Block(f, first, given["N"]), given)
                begun = [rows["start"].gathered(i) for i in range(STATES)]
                for i, value in enumerate(begun):
                    f.store_lanes(value, x, i)
                rows["states"].scattered(begun, 0)
                with f.loop(given["I"] - 1, outer=True) as k:
                    h = self._driven(f, rows, given, k, x)
                    with f.loop(given["substeps"], outer=True):
                        f.call(function, x, given["c"], out)
                        advance(f, x, out, step_of(f, x, out, h))
                    now = [f.load_lanes(x, i) for i in range(STATES)]
                    rows["states"].scattered(now, k * STATES + STATES)

    def values(self, function: str) -> None:
        """ν̇ [n, 3] at inputs [n, columns of x]."""
        arguments = [("c", POINTER), ("inputs", POINTER), ("found", POINTER), ("n", INT)]
        with self.module.function("values", arguments) as (f, (c, inputs, found, n)):
            x, out = f.reserve(self.sizes.inputs), f.reserve(5)
            f.call(f"{function}_fill", c, out)
            with f.loop(n, 0, self.module.lanes, outer=True) as first:
                block, width = Block(f, first, n), self.sizes.inputs
                given, rates = block.rows(inputs, width), block.rows(found, 3)
                for i in range(width):
                    f.store_lanes(given.gathered(i), x, i)
                f.call(function, x, c, out)
                rates.scattered([f.load_lanes(out, i) for i in range(3)], 0)

    def row_slopes(self, function: str) -> None:
        """All outputs of `function` [n, outputs] at inputs [n, columns of x]."""
        arguments = [("c", POINTER), ("inputs", POINTER), ("found", POINTER), ("n", INT)]
        with self.module.function("row_slopes", arguments) as (f, (c, inputs, found, n)):
            count, lanes, width = self.sizes.outputs, self.module.lanes, self.sizes.inputs
            x, out = f.reserve(width), f.reserve(count)
            f.call(f"{function}_fill", c, out)
            with f.loop(n, 0, lanes, outer=True) as first:
                block = Block(f, first, n)
                given, rows = block.rows(inputs, width), block.rows(found, count)
                for i in range(width):
                    f.store_lanes(given.gathered(i), x, i)
                f.call(function, x, c, out)
                whole = count // lanes * lanes
                with f.loop(f.int(whole), 0, lanes) as at:
                    rows.scattered([f.load_lanes(out, at + q) for q in range(lanes)], at)
                with f.loop(f.int(count), whole) as at:
                    rows.scattered([f.load_lanes(out, at)], at)

    def slopes(self, function: str) -> None:
        """States [N, I, 6] and their derivatives by all coefficients [N, I, 6, P]."""
        names = ["c", "start", "actuator", "wind", "dt", "states", "slopes", "work"]
        arguments = [(n, POINTER) for n in names] + [
            ("N", INT), ("I", INT), ("substeps", INT), ("part", DOUBLE)
        ]  # fmt: skip
        P, padded = self.sizes.coefficients, self.padded
        with self.module.function("slopes_of", arguments) as (f, values):
            given = dict(zip([n for n, _ in arguments], values, strict=True))
            x, out = f.reserve(self.sizes.inputs), f.reserve(self.sizes.outputs)
            s = given["work"]  # [6, padded]
            f.call(f"{function}_fill", given["c"], out)
            with f.loop(given["N"], 0, self.module.lanes, outer=True) as first:
                rows = self._rows(Block(f, first, given["N"]), given)
                begun = [rows["start"].gathered(i) for i in range(STATES)]
                for i, value in enumerate(begun):
                    f.store_lanes(value, x, i)
                rows["states"].scattered(begun, 0)
                with f.loop(f.int(STATES * padded)) as i:
                    f.store_lanes(f.lanes(0.0), s, i)
                with f.loop(f.int(STATES * padded), 0, self.module.lanes) as i:
                    for pointer in rows["slopes"].pointers:
                        f.store(f.lanes(0.0), pointer, i)
                with f.loop(given["I"] - 1, outer=True) as k:
                    h = self._driven(f, rows, given, k, x)
                    with f.loop(given["substeps"], outer=True):
                        f.call(function, x, given["c"], out)
                        step = step_of(f, x, out, h)
                        self._sensitivities(f, s, padded, out, step, f.int(P), None)
                        advance(f, x, out, step)
                    now = [f.load_lanes(x, i) for i in range(STATES)]
                    rows["states"].scattered(now, k * STATES + STATES)
                    self._kept(f, rows["slopes"], s, padded, (k + 1) * (STATES * padded))

    def _sensitivities(self, f, s, padded, out, step, count, columns) -> None:
        """sₖ₊₁ of `count` coefficients; the places of their columns, or None for all in order."""
        sizes = self.sizes
        A = [
            [
                (i, step.h * f.load_lanes(out, place))
                for i in range(STATES)
                if (place := sizes.slopes + row * sizes.by + i) not in sizes.zeros
            ]
            for row in range(3)
        ]
        with f.loop(count) as p:
            column = p if columns is None else f.load(columns, p, INT)
            dx, du, dy, dv, dpsi, dr = (f.load_lanes(s, p + i * padded) for i in range(STATES))
            f.store_lanes(dx + step.ch * du - step.sh * dv - step.east * dpsi, s, p)
            f.store_lanes(dy + step.sh * du + step.ch * dv + step.north * dpsi, s, p + 2 * padded)
            f.store_lanes(dpsi + step.h * dr, s, p + 4 * padded)
            for row, now in enumerate((du, dv, dr)):
                P = sizes.coefficients
                moved = step.h * f.load_lanes(out, column + (sizes.by_theta + row * P))
                for i, a in A[row]:
                    moved = moved + a * (dx, du, dy, dv, dpsi, dr)[i]
                f.store_lanes(now + moved, s, p + (2 * row + 1) * padded)

    def _kept(self, f: Function, slopes: Rows, s: Value, padded: int, offset: Value) -> None:
        """Sensitivities into a row of each window's [6, padded P]."""
        lanes = self.module.lanes
        with f.loop(f.int(STATES * padded), 0, lanes) as at:
            slopes.scattered([f.load_lanes(s, at + j) for j in range(lanes)], offset + at)

    def normal(self, function: str, weights: Sequence[float]) -> None:
        """Loss [N], half its gradient [N, n], and weighted JᵀJ [blocks, 4, 4] a lane each, by n
        chosen coefficients: in `work`, s [6, padded], rows [chunk · 3, padded], gram after it."""
        names = [
            "c",
            "measured",
            "actuator",
            "wind",
            "dt",
            "steps",
            "weight",
            "columns",
            "loss",
            "pull",
            "s",
            "rows",
            "gram",
        ]
        arguments = [(n, POINTER) for n in names] + [
            (n, INT) for n in ("N", "I", "substeps", "n", "padded", "chunk")
        ] + [("part", DOUBLE)]  # fmt: skip
        with self.module.function("normal", arguments) as (f, values):
            given = dict(zip([n for n, _ in arguments], values, strict=True))
            x, out = f.reserve(self.sizes.inputs), f.reserve(self.sizes.outputs)
            f.call(f"{function}_fill", given["c"], out)
            total = f.reserve(1)
            with f.loop(given["N"], 0, self.module.lanes, outer=True) as first:
                self._normal_of_block(f, given, function, weights, first, x, out, total)

    def _normal_of_block(self, f, given, function, weights, first, x, out, total) -> None:
        padded, n, s = given["padded"], given["n"], given["s"]
        # `rows` among what is given are those of JᵀJ
        windows = self._rows(Block(f, first, given["N"]), given)
        for i in range(STATES):
            f.store_lanes(windows["measured"].gathered(i), x, i)
        # windows that fill a block up have no weight of their own
        valid = [(first + lane).compared("slt", given["N"]) for lane in range(self.module.lanes)]
        weight = f.together([
            one.chosen(f.load(pointer), 0.0)
            for one, pointer in zip(valid, windows["weight"].pointers, strict=True)
        ])  # fmt: skip
        used, root = weight.compared("ogt", 0.0), f.intrinsic("sqrt", weight)
        with f.loop(padded * STATES) as i:
            f.store_lanes(f.lanes(0.0), s, i)
        pull = given["pull"]  # a vector a coefficient, a block after the other
        base = (first / self.module.lanes) * padded
        with f.loop(padded) as i:
            f.store_lanes(f.lanes(0.0), pull, base + i)
        f.store_lanes(f.lanes(0.0), total)
        steps = given["I"] - 1
        with f.loop((steps + given["chunk"] - 1) / given["chunk"], outer=True) as part:
            begin = part * given["chunk"]
            end = f.smaller(begin + given["chunk"], steps)
            with f.loop(end, begin, outer=True) as k:
                h = self._driven(f, windows, given, k, x)
                with f.loop(given["substeps"], outer=True):
                    f.call(function, x, given["c"], out)
                    step = step_of(f, x, out, h)
                    self._sensitivities(f, s, padded, out, step, n, given["columns"])
                    advance(f, x, out, step)
                time = windows["steps"].gathered(k + 1)
                width = f.intrinsic("sqrt", time)
                pulls, factors = [], []
                for place, w in zip(VELOCITY_IN_STATE, weights, strict=True):
                    y = windows["measured"].gathered(k * STATES + (STATES + place))
                    scale = width * w
                    error = (f.load_lanes(x, place) - y) * scale
                    f.store_lanes(f.load_lanes(total) + error * error, total)
                    pulls.append(error * scale)
                    factors.append(scale * root)
                row = (k - begin) * 3 * padded
                with f.loop(n) as p:
                    pulled = f.load_lanes(pull, base + p)
                    for q, place in enumerate(VELOCITY_IN_STATE):
                        slope = f.load_lanes(s, p + padded * place)
                        pulled = pulled + pulls[q] * slope
                        own = used.chosen(slope * factors[q], 0.0)
                        f.store_lanes(own, given["rows"], row + padded * q + p)
                    f.store_lanes(pulled, pull, base + p)
            self._added(f, given, (end - begin) * 3)
        f.store_lanes(f.load_lanes(total), given["loss"], first / self.module.lanes)

    def _added(self, f: Function, given: dict[str, Value], count: Value) -> None:
        """`count` rows into JᵀJ: blocks of 4 by 4 at and above the diagonal, lane by lane."""
        padded, rows, gram = given["padded"], given["rows"], given["gram"]
        sums = [[f.reserve() for _ in range(BLOCK)] for _ in range(BLOCK)]
        place = f.reserve()
        f.store(f.int(0), place)
        with f.loop(padded, 0, BLOCK) as i, f.loop(padded, i, BLOCK) as j:
            at = f.load(place, 0, INT)
            cells = [(a, b) for a in range(BLOCK) for b in range(BLOCK)]
            for a, b in cells:
                f.store_lanes(f.load_lanes(gram, at + (a * BLOCK + b)), sums[a][b])
            with f.loop(count) as r:
                left = [f.load_lanes(rows, r * padded + i + a) for a in range(BLOCK)]
                for b in range(BLOCK):
                    right = f.load_lanes(rows, r * padded + j + b)
                    for a in range(BLOCK):
                        now = f.load_lanes(sums[a][b])
                        f.store_lanes(now + left[a] * right, sums[a][b])
            for a, b in cells:
                f.store_lanes(f.load_lanes(sums[a][b]), gram, at + (a * BLOCK + b))
            f.store(at + BLOCK * BLOCK, place)
