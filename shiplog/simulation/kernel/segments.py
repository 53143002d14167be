"""Paths of segments and their variational equations, written for lanes: a segment each.

    xₖ₊₁ = xₖ + h (3/2 fₖ - 1/2 fₖ₋₁),   δ̇ = A(t) δ + B(t),   δ = ∂x/∂(ξ, a, θ),  δ(0) = (I | 0 | 0)

by two-step Adams-Bashforth, the first step by Euler, with means over bins by the trapezium. A is
∂ẋ/∂x along the path. B has rows of u, v and r only: hⱼ(t) by the acceleration of node j, ∂f/∂θ by
a coefficient, ∂f/∂θ + ∂f/∂u ∂u/∂θ by a cause's number. The columns are derivatives of what was
simulated, and not of what that approximates.
"""

from __future__ import annotations

from dataclasses import dataclass

from shiplog.simulation.kernel.windows import STATES, Block, Rows, Sizes
from shiplog.simulation.kernel.writer import DOUBLE, INT, POINTER, Function, Module, Value

# Arguments of `paths_of` (without θ) and `columns_of`: pointers, whole numbers, the step.
POINTERS = (
    "c", "start", "acceleration", "driven", "hats", "begun", "moved", "pairs", "y", "z", "j", "work"
)  # fmt: skip
GIVEN = ("slopes", "states", "hats", "begun", "moved", "pairs", "z", "j", "work")
COUNTS = ("S", "K", "bins", "per", "J", "C", "Q", "n")


@dataclass(frozen=True)
class Step:
    """What all columns of a step share: cos ψ, sin ψ, ẋ₀ and ẏ₀, A's rows of u, v and r without
    what is zero whatever happens, the weights of the two slopes, and that of a mean."""

    cos: Value
    sin: Value
    north: Value
    east: Value
    rows: tuple[tuple[tuple[int, Value], ...], ...]
    new: Value
    old: Value
    half: Value


class Segments:
    """Writes the loops of segments."""

    def __init__(self, module: Module, sizes: Sizes) -> None:
        self.module, self.sizes = module, sizes

    def write(self, name: str, function: str, numbers: bool) -> None:
        """Means over bins y [S, B, 6], by start and nodes z [S, B, 6, 6 + 3J] and, with `numbers`,
        by θ j [S, B, 6, C]; `work` holds four times six vectors for each of these columns."""
        arguments = [(n, POINTER) for n in POINTERS] + [(n, INT) for n in COUNTS]
        with self.module.function(name, [*arguments, ("h", DOUBLE)]) as (f, values):
            given = dict(zip([*POINTERS, *COUNTS, "h"], values, strict=True))
            x, out = f.reserve(self.sizes.inputs), f.reserve(self.sizes.outputs)
            before, mean = f.reserve(STATES), f.reserve(STATES)
            f.call(f"{function}_fill", given["c"], out)
            with f.loop(given["S"], 0, self.module.lanes, outer=True) as first:
                block = Block(f, first, given["S"])
                loops = _Loops(f, self.sizes, given, block, x, out, before, mean, numbers)
                loops.begin()
                with f.loop(given["bins"], outer=True) as bin_:
                    loops.clear_means()
                    with f.loop(given["per"], outer=True) as part:
                        k = bin_ * given["per"] + part
                        loops.inputs(k)
                        f.call(function, x, given["c"], out)
                        step = loops.step(k)
                        loops.columns(k, step)
                        loops.path(k, step)
                    loops.keep(bin_)

    def write_given(self, name: str) -> None:
        """The same columns of slopes that are known along a path, without the path: `states`
        [S, K, 6], and `slopes` [S, K, …] as the function of a model writes them."""
        arguments = [(n, POINTER) for n in GIVEN] + [(n, INT) for n in COUNTS]
        with self.module.function(name, [*arguments, ("h", DOUBLE)]) as (f, values):
            given = dict(zip([*GIVEN, *COUNTS, "h"], values, strict=True))
            x, out = f.reserve(STATES), f.reserve(self.sizes.outputs)
            with f.loop(given["S"], 0, self.module.lanes, outer=True) as first:
                block = Block(f, first, given["S"])
                loops = _Loops(f, self.sizes, given, block, x, out, x, x, numbers=True)
                loops.begin_columns()
                with f.loop(given["bins"], outer=True) as bin_:
                    loops.clear_means()
                    with f.loop(given["per"], outer=True) as part:
                        k = bin_ * given["per"] + part
                        for i in range(STATES):
                            f.store_lanes(loops.rows["states"].gathered(k * STATES + i), x, i)
                        with f.loop(self.sizes.outputs) as i:
                            place = k * self.sizes.outputs + i
                            f.store_lanes(loops.rows["slopes"].gathered(place), out, i)
                        loops.columns(k, loops.step(k))
                    loops.keep(bin_)


class _Loops:
    """Of one block of segments. In `work` [4, 6, W] vectors: columns now, the slopes before, sums
    over the bin, and what the numbers of causes add (W = 6 + 3J + C)."""

    def __init__(
        self, f: Function, sizes: Sizes, given: dict[str, Value], block: Block, x: Value,
        out: Value, before: Value, mean: Value, numbers: bool,
    ) -> None:  # fmt: skip
        self.f, self.sizes, self.given = f, sizes, given
        self.x, self.out, self.before, self.mean = x, out, before, mean
        self.numbers = numbers
        self.nodes = given["J"]
        self.of_z = self.nodes * 3 + STATES
        self.width = self.of_z + given["C"] if numbers else self.of_z
        self.work = given["work"]
        bins, instants = given["bins"] * STATES, given["K"]
        strides = {
            "start": STATES, "driven": instants * sizes.driven, "acceleration": instants * 3,
            "states": instants * STATES, "slopes": instants * sizes.outputs,
            "moved": instants * given["n"], "y": bins, "z": bins * self.of_z,
            "j": bins * given["C"],
        }  # fmt: skip
        self.rows = {n: block.rows(given[n], by) for n, by in strides.items() if n in given}

    def _at(self, kind: int, row: int, column: Value | int) -> Value:
        """Place of a column's number in `work`: kind 0 now, 1 slope before, 2 sum, 3 added."""
        return self.width * (kind * STATES + row) + column

    def _clear(self, first: Value, count: Value) -> None:
        with self.f.loop(first + count, first) as i:
            self.f.store_lanes(self.f.lanes(0.0), self.work, i)

    def begin(self) -> None:
        """ξ, and its columns."""
        f = self.f
        self.begin_columns()
        for i in range(STATES):
            f.store_lanes(self.rows["start"].gathered(i), self.x, i)
            f.store_lanes(f.lanes(0.0), self.before, i)

    def begin_columns(self) -> None:
        """δ(0) = (I | 0 | 0)"""
        self._clear(self.f.int(0), self.width * (2 * STATES))
        for i in range(STATES):
            self.f.store_lanes(self.f.lanes(1.0), self.work, self._at(0, i, i))

    def clear_means(self) -> None:
        self._clear(self.width * (2 * STATES), self.width * STATES)
        if "y" in self.rows:
            for i in range(STATES):
                self.f.store_lanes(self.f.lanes(0.0), self.mean, i)

    def inputs(self, k: Value) -> None:
        count = self.sizes.driven
        for d in range(count):
            self.f.store_lanes(self.rows["driven"].gathered(k * count + d), self.x, STATES + d)

    def step(self, k: Value) -> Step:
        f, sizes, out = self.f, self.sizes, self.out
        h = self.given["h"]
        euler = k.compared("eq", 0)
        new = f.spread(euler.chosen(h, h * 1.5))
        cos, sin = f.load_lanes(out, 3), f.load_lanes(out, 4)
        u, v = f.load_lanes(self.x, 1), f.load_lanes(self.x, 3)
        north, east = cos * u - sin * v, sin * u + cos * v
        rows = tuple(
            tuple(
                (i, f.load_lanes(out, place))
                for i in range(STATES)
                if (place := sizes.slopes + row * sizes.by + i) not in sizes.zeros
            )
            for row in range(3)
        )
        half = f.number(0.5) / f.put(f"sitofp i64 {self.given['per'].text} to double", DOUBLE)
        old = f.spread(euler.chosen(f.number(0.0), h * -0.5))
        return Step(cos, sin, north, east, rows, new, old, f.spread(half))

    def path(self, k: Value, step: Step) -> None:
        """The state, a step on, with the acceleration of the path's nodes."""
        f, x, out = self.f, self.x, self.out
        extra = [self.rows["acceleration"].gathered(k * 3 + q) for q in range(3)]
        rates = (
            step.north, f.load_lanes(out, 0) + extra[0], step.east,
            f.load_lanes(out, 1) + extra[1], f.load_lanes(x, 5), f.load_lanes(out, 2) + extra[2],
        )  # fmt: skip
        for i, rate in enumerate(rates):
            now = f.load_lanes(x, i)
            after = now + step.new * rate + step.old * f.load_lanes(self.before, i)
            total = f.load_lanes(self.mean, i) + step.half * (now + after)
            f.store_lanes(total, self.mean, i)
            f.store_lanes(after, x, i)
            f.store_lanes(rate, self.before, i)

    def columns(self, k: Value, step: Step) -> None:
        """All columns, a step on: by the start, by the nodes that have begun, by θ."""
        f = self.f
        zero = f.lanes(0.0)
        with f.loop(STATES) as i:
            self._advance(i, step, (zero, zero, zero))
        begun = f.load(self.given["begun"], k, INT)
        for row in range(3):
            first = self.nodes * row + STATES
            with f.loop(begun) as j:
                hat = f.spread(f.load(self.given["hats"], k * self.nodes + j))
                pushed = tuple(hat if q == row else zero for q in range(3))
                self._advance(first + j, step, pushed)
        if self.numbers:
            self._by_numbers(k, step)

    def _by_numbers(self, k: Value, step: Step) -> None:
        f, sizes, given = self.f, self.sizes, self.given
        P, by_theta = sizes.coefficients, sizes.by_theta
        causes, first = given["Q"], f.int(P) - given["Q"]
        with f.loop(first) as i:
            pushed = [f.load_lanes(self.out, i + (by_theta + row * P)) for row in range(3)]
            self._advance(self.of_z + i, step, pushed)
        for row in range(3):
            with f.loop(causes) as i:
                own = f.load_lanes(self.out, first + i + (by_theta + row * P))
                f.store_lanes(own, self.work, self._at(3, row, i))
        with f.loop(given["n"], outer=True) as pair:  # that what drives changes with
            d = f.load(given["pairs"], pair * 2, INT)
            i = f.load(given["pairs"], pair * 2 + 1, INT)
            moved = self.rows["moved"].gathered(pair * given["K"] + k)
            for row in range(3):
                slope = f.load_lanes(self.out, d + (sizes.slopes + row * sizes.by + STATES))
                place = self._at(3, row, i)
                f.store_lanes(f.load_lanes(self.work, place) + slope * moved, self.work, place)
        with f.loop(causes) as i:
            pushed = [f.load_lanes(self.work, self._at(3, row, i)) for row in range(3)]
            self._advance(self.of_z + (first + i), step, pushed)

    def _advance(self, column: Value, step: Step, pushed) -> None:
        """δₖ₊₁ = δₖ + `new` δ̇ₖ + `old` δ̇ₖ₋₁, and ½ (δₖ + δₖ₊₁) into the bin's sum."""
        f = self.f
        at = [f.load_lanes(self.work, self._at(0, i, column)) for i in range(STATES)]
        _, du, _, dv, dpsi, dr = at
        motion = []
        for row in range(3):
            found = pushed[row]
            for i, slope in step.rows[row]:
                found = found + slope * at[i]
            motion.append(found)
        changes = (
            step.cos * du - step.sin * dv - step.east * dpsi, motion[0],
            step.sin * du + step.cos * dv + step.north * dpsi, motion[1], dr, motion[2],
        )  # fmt: skip
        for i, change in enumerate(changes):
            was = f.load_lanes(self.work, self._at(1, i, column))
            after = at[i] + step.new * change + step.old * was
            place = self._at(2, i, column)
            total = f.load_lanes(self.work, place) + step.half * (at[i] + after)
            f.store_lanes(total, self.work, place)
            f.store_lanes(after, self.work, self._at(0, i, column))
            f.store_lanes(change, self.work, self._at(1, i, column))

    def keep(self, bin_: Value) -> None:
        """The bin's means into y, z and j."""
        f = self.f
        if "y" in self.rows:
            means = [f.load_lanes(self.mean, i) for i in range(STATES)]
            self.rows["y"].scattered(means, bin_ * STATES)
        self._kept(bin_, self.rows["z"], f.int(0), self.of_z)
        if self.numbers:
            self._kept(bin_, self.rows["j"], self.of_z, self.given["C"])

    def _kept(self, bin_: Value, to: Rows, first: Value, count: Value) -> None:
        f, lanes = self.f, self.f.module.lanes
        whole = count / lanes * lanes
        for i in range(STATES):
            offset = (bin_ * STATES + i) * count
            with f.loop(whole, 0, lanes) as at:
                rows = [
                    f.load_lanes(self.work, self._at(2, i, first + at) + q) for q in range(lanes)
                ]
                to.scattered(rows, offset + at)
            with f.loop(count, whole) as at:
                row = f.load_lanes(self.work, self._at(2, i, first + at))
                to.scattered([row], offset + at)
