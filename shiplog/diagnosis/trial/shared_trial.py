"""A trial whose voyages are held in blocks, by this process or by others: `blocks`.

It answers as the trial does, to the last bit. What is large is asked for where it is needed alone:
a point has its path here, and its linearisation with the holders (`Remote`).
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Self

import numpy as np

from shiplog.diagnosis.linear import linearisation
from shiplog.diagnosis.linear.linear_segments import Linear, Path
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.noise.part_products import Gram
from shiplog.diagnosis.noise.raised_noise import Residuals
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.trial.blocks import Block, Call, Holders, Kept, Place, Sum, cut_into_blocks
from shiplog.diagnosis.trial.cache import Numbers, Total
from shiplog.diagnosis.trial.fitted import Point
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.trial.trial_products import Products, add_up


@dataclass(frozen=True)
class Shared:
    """Holders of a trial's blocks.

    sizes   segments of each block
    count   numbers the points
    """

    holders: Holders
    sizes: tuple[int, ...]
    count: Iterator[int] = field(default_factory=itertools.count)

    def split(self, values: np.ndarray) -> list[np.ndarray]:
        """Of each segment [S, ...] those of each block."""
        return np.split(values, np.cumsum(self.sizes)[:-1])

    def paths(self, path: Path) -> list[Path]:
        both = zip(self.split(path.start), self.split(path.acceleration), strict=True)
        return [Path(*one) for one in both]

    def ask(self, method: str, kept: Sequence[Sequence[Kept]], *rest: Any) -> list[Any]:
        """All blocks at once; `kept` of each."""
        return self.holders.answer(Call(method, dict(enumerate(kept)), rest))

    def ask_in_turn(self, method: str, kept: Sequence[Sequence[Kept]], *rest: Any) -> Iterator[Any]:
        """One block after the other: for answers of which all together are too large."""
        for number, one in enumerate(kept):
            yield self.holders.answer(Call(method, {number: one}, rest))[0]

    def weights(self, weight: np.ndarray) -> list[Kept]:
        """Of each block, under a key that says what they are."""
        each = self.split(weight)
        return [Kept(f"weight {hashlib.sha256(w.tobytes()).hexdigest()}", w) for w in each]


class Remote(Linear):
    """A linearisation that the blocks hold. `lost` and `farthest` are known; its arrays are
    gathered at the first use of one of them."""

    def __init__(
        self, shared: Shared, places: Sequence[Kept], path: Path, lost: np.ndarray, farthest: float
    ) -> None:
        known = {"shared": shared, "places": tuple(places), "path": path, "lost": lost,
                 "_farthest": farthest}  # fmt: skip
        for name, value in known.items():
            object.__setattr__(self, name, value)

    shared: Shared
    places: tuple[Kept, ...]

    @property
    def farthest(self) -> float:
        return self.__dict__["_farthest"]

    def __getattr__(self, name: str) -> Any:
        if name not in ("cut", "e", "z", "j"):
            raise AttributeError(name)
        return getattr(self.gathered(), name)

    def gathered(self) -> Linear:
        """All of it, in this process."""
        if "_whole" not in self.__dict__:
            first, *others = self.shared.ask("gather", [(one,) for one in self.places])
            cuts = [one.cut for one in (first, *others)]
            joined = {
                name: np.concatenate([getattr(one, name) for one in (first, *others)])
                for name in ("e", "z", "j", "lost")
            }
            cut = cuts[0]
            for one in cuts[1:]:
                cut = cut.joined(one)
            object.__setattr__(self, "_whole", Linear(cut, self.path, **joined))
        return self.__dict__["_whole"]

    def pick(self, keep: np.ndarray) -> Linear:
        return self.gathered().pick(keep)

    def less(self, accelerations: np.ndarray) -> Linear:
        return self.gathered().less(accelerations)

    def less_numbers(self, numbers: np.ndarray, accelerations: np.ndarray) -> Linear:
        return self.gathered().less_numbers(numbers, accelerations)

    def joined(self, other: Linear) -> Linear:
        return self.gathered().joined(other)


def places_of(point: Point) -> tuple[Kept, ...]:
    """Of each block; a point of such a trial has them."""
    assert isinstance(point.linear, Remote)
    return point.linear.places


@dataclass(frozen=True)
class SharedProducts(Products):
    """Products that the blocks add up."""

    shared: Shared | None = None

    def _known(self, point: Point, weight: np.ndarray) -> tuple[Shared, list[tuple[Kept, Kept]]]:
        """What each block has to know of a point and its segments' weights."""
        assert self.shared is not None
        both = zip(places_of(point), self.shared.weights(weight), strict=True)
        return self.shared, list(both)

    def _added(self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder) -> Total:
        shared, known = self._known(point, weight)
        each: list[Sum] = shared.ask("add", known, noise, remainder)
        logdet = sum(itertools.chain.from_iterable(one.logdets for one in each))
        volumes = itertools.chain.from_iterable(one.volumes for one in each)
        return Total(add_up(one.G for one in each), sum(volumes, logdet))

    def _volume(
        self, first: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> float:
        shared, known = self._known(first, weight)
        each = shared.ask("volumes", known, noise, remainder)
        logdets = itertools.chain.from_iterable(logdets for _, logdets in each)
        volumes = itertools.chain.from_iterable(volumes for volumes, _ in each)
        return sum(volumes, sum(logdets))

    def _without(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder, gone: set
    ) -> np.ndarray:
        shared, known = self._known(point, weight)
        each = shared.ask("add_without", known, noise, remainder, frozenset(gone))
        return add_up(G for G in each if G is not None)

    def each_part(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> Iterator[Gram]:
        shared, known = self._known(point, weight)
        for block in shared.ask_in_turn("each", known, noise, remainder):
            yield from block


@dataclass(frozen=True)
class SharedTrial(Trial):
    """A trial whose blocks are held elsewhere."""

    shared: Shared | None = None

    @classmethod
    def share(cls, trial: Trial, hold: Callable[[tuple[Block, ...]], Holders]) -> Self:
        """The same trial; `hold` gives its blocks to somebody."""
        blocks = cut_into_blocks(trial)
        sizes = tuple(len(block.trial.rows) for block in blocks)
        known = {one.name: getattr(trial, one.name) for one in fields(trial)}
        return cls(**known, shared=Shared(hold(blocks), sizes))

    @property
    def products(self) -> Products:
        return SharedProducts(
            self.campaign, self.omitted, self.grid, self.parts, self.voyage, self.cache,
            shared=self.shared,
        )  # fmt: skip

    def linearise(
        self,
        numbers: Numbers,
        near: Path | Point | None = None,
        noise_factor: float | None = None,
        remainder: Remainder | None = None,
    ) -> Point:
        """As of a trial: each round of the path is one of all blocks."""
        ref, shared = self.reference, self.shared
        assert shared is not None
        wide = ref.wide
        if noise_factor is not None:
            wide = ref.allowed_distance(noise_factor, remainder or Remainder())
        rounds = linearisation.MOST_PULLS
        if isinstance(near, Point):
            paths = shared.ask("predict", [(one,) for one in places_of(near)], numbers, wide)
            found = self._placed(numbers, _joined(paths))
            left = shared.ask("left_to_pull", [(one,) for one in places_of(found)], wide)
            if max(left) < linearisation.FAR_NATS:
                return self._refuse_divergent(found)
        else:
            paths, rounds = None if near is None else shared.paths(near), 1 if near else rounds
        for _ in range(rounds):
            pulled = shared.ask("pull", self._starts(paths), numbers, wide)
            paths = [path for path, _ in pulled]
            if max(gained for _, gained in pulled) < linearisation.PULLED_NATS:
                break
        assert paths is not None
        return self.linearise_about(numbers, _joined(paths))

    def linearise_about(self, numbers: Numbers, path: Path) -> Point:
        return self._refuse_divergent(self._placed(numbers, path))

    def _placed(self, numbers: Numbers, path: Path) -> Point:
        """Linearised about this very path, wherever the model diverges."""
        shared = self.shared
        assert shared is not None
        key = f"point {next(shared.count)}"
        places = [Kept(key, Place(numbers, one)) for one in shared.paths(path)]
        placed = shared.ask("place", [(one,) for one in places])
        lost = np.concatenate([lost for lost, _ in placed])
        farthest = max(away for _, away in placed)
        return Point(numbers, path, Remote(shared, places, path, lost, farthest))

    def _starts(self, paths: Sequence[Path] | None) -> list[tuple[Kept, ...]]:
        assert self.shared is not None
        key = f"path {next(self.shared.count)}"
        each: Sequence[Path | tuple[()]] = paths or [()] * len(self.shared.sizes)
        return [(Kept(key, one),) for one in each]

    def squares(self, point: Point, d: np.ndarray, process_noise: ProcessNoise) -> np.ndarray:
        assert self.shared is not None
        asked = [(one,) for one in places_of(point)]
        nominal = self.reference.process_noise
        return np.concatenate(self.shared.ask("squares", asked, d, nominal, process_noise))

    def noise_left(self, point: Point, d: np.ndarray) -> Residuals:
        shared, ref = self.shared, self.reference
        assert shared is not None
        weights, places = shared.weights(self.weight), places_of(point)
        numbers = Kept(f"numbers {next(shared.count)}", d)
        none = Kept("no runs", np.zeros(0))
        last: list[tuple[object, list[Kept]]] = []  # runs that were sent, and under which keys

        def misfits(
            process_noise: ProcessNoise, runs: Sequence[np.ndarray] | None
        ) -> Sequence[float]:
            each = [none] * len(places)
            if runs is not None:
                if not last or last[0][0] is not runs[0].base:
                    key = f"runs {next(shared.count)}"
                    last[:] = [(runs[0].base, [Kept(key, one) for one in runs])]
                each = last[0][1]
            known = list(zip(places, weights, [numbers] * len(places), each, strict=True))
            return shared.ask("misfit", known, process_noise)

        sizes = tuple(int((one.value > 0.0).sum()) for one in weights)
        return Residuals(ref.process_noise, ref.counts, sizes, misfits)

    def force_across(
        self, point: Point, d: np.ndarray, noise: float, remainder: Remainder
    ) -> tuple[np.ndarray, np.ndarray]:
        assert self.shared is not None
        asked = [(one,) for one in places_of(point)]
        found = self.shared.ask("force_across", asked, d, noise, remainder)
        mean, variance = (np.concatenate(parts) for parts in zip(*found, strict=True))
        return mean, variance

    def less_misfit(self, linear: Linear, d: np.ndarray) -> tuple[Linear, np.ndarray]:
        whole = linear.gathered() if isinstance(linear, Remote) else linear
        return super().less_misfit(whole, d)


def _joined(paths: Sequence[Path]) -> Path:
    """Of all segments, from those of each block."""
    return Path(*(np.concatenate([getattr(one, name) for one in paths])
                  for name in ("start", "acceleration")))  # fmt: skip
