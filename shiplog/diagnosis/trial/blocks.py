"""A trial's voyages in blocks, each of which a process of its own may hold.

What is large stays with a block: its segments, where they were linearised, and the products of its
parts. Between the holder of a block and the search go numbers, a factor of the noise, a remainder,
and a matrix G [1 + C, 1 + C] that the block has added up. Everything that a block answers follows
from the arguments of the call and from its voyages. What it keeps is a saving of time: a block that
another process takes over gives the same answers, to the last bit.

    G = Σ_blocks (Σ_v G_v)        equation (4), added within each block, then block by block

That is the order of `trial_products`, too, wherever the blocks are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from threadpoolctl import threadpool_limits

from shiplog.diagnosis.linear import linearisation
from shiplog.diagnosis.linear.linear_segments import Linear, Path, Wide
from shiplog.diagnosis.noise.campaign_parts import squares
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.noise.raised_noise import Residual
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.trial.cache import Cache
from shiplog.diagnosis.trial.fitted import Point
from shiplog.diagnosis.trial.trial import Trial

Numbers = Mapping[str, np.ndarray]
KEPT_POINTS = 4  # linearised, of a block: the first one and the last
KEPT_VALUES = 64  # numbers with a path, and weights: a few kB a segment in all


@dataclass(frozen=True)
class Kept:
    """A value that a block keeps under a key, or the key alone: the block then has to know it."""

    key: str
    value: Any = None

    @property
    def alone(self) -> Kept:
        return Kept(self.key)


@dataclass(frozen=True)
class Place:
    """Where a block is linearised: label → numbers, SI, and the path of its segments."""

    numbers: Numbers
    path: Path


@dataclass(frozen=True)
class Missing:
    """The answer of a block that does not know a key: it was begun anew, or has forgotten it."""


@dataclass(frozen=True)
class Diverged:
    """The answer where the model diverges: np.linalg.LinAlgError, in words."""

    words: str


@dataclass(frozen=True)
class Sum:
    """Σ_v G_v of a block's voyages; `logdets` of each of its parts' instruments and starts, and
    `volumes` of each voyage, in their order."""

    G: np.ndarray
    logdets: tuple[float, ...]
    volumes: tuple[float, ...]


@dataclass(frozen=True)
class Call:
    """A question to blocks: a method of `Block`, what it has to know, and the rest.

    kept   number of each block that is asked → what the method is given first
    rest   the same for all
    """

    method: str
    kept: Mapping[int, Sequence[Kept]]
    rest: tuple[Any, ...] = ()


class Holders(Protocol):
    """Whoever holds the blocks of a trial: this process, or others."""

    def answer(self, call: Call) -> list[Any]:
        """What each block that is asked answers, in the order of the question. One that knows a
        key no more is asked again with the values. Raises np.linalg.LinAlgError where one
        diverged."""
        ...


@dataclass
class Block:
    """Some voyages of a trial, with what was worked out of them.

    trial   of these voyages alone
    begin   row of the whole record at which theirs begin
    """

    trial: Trial
    begin: int
    known: dict[str, Any] = field(default_factory=dict)
    points: dict[str, Point] = field(default_factory=dict)
    residual: tuple[tuple[str, ...], Residual] | None = None

    def answer(self, method: str, kept: Sequence[Kept], rest: tuple[Any, ...]) -> Any:
        """Of one of the methods below; Missing, or Diverged."""
        for one in kept:
            if one.value is not None:
                self._keep(one)
            elif one.key not in self.known:
                return Missing()
        try:
            with threadpool_limits(limits=1, user_api="blas"):
                return getattr(self, method)(*(one.key for one in kept), *rest)
        except np.linalg.LinAlgError as error:
            return Diverged(str(error))

    def _keep(self, one: Kept) -> None:
        self.known[one.key] = one.value
        for key in list(self.known)[1:-KEPT_VALUES]:
            del self.known[key]

    # --- paths

    def pull(self, path: str, numbers: Numbers, wide: Wide) -> tuple[Path, float]:
        """A round of `linearisation.fit_path`, and what it gains at most; from the first path where
        there is none to start from."""
        ref, cut, whole = self._read(numbers)
        return linearisation.pull_path(
            ref.model, whole, cut, self.trial.grid, wide, self.known[path] or None,
            ref.expected_acceleration(cut, self.trial.grid),
        )  # fmt: skip

    def predict(self, near: str, numbers: Numbers, wide: Wide) -> Path:
        """Where the linearisation at `near` expects the path with other numbers."""
        ref, cut, whole = self._read(numbers)
        point = self._point(near)
        stood = np.concatenate((ref.theta, ref.columns.numbers(dict(point.numbers))))
        about = ref.expected_acceleration(cut, self.trial.grid)
        return linearisation.predict_path(point.linear, whole - stood, wide, about)

    def left_to_pull(self, at: str, wide: Wide) -> float:
        """How far a path that was predicted is from that of its numbers, in nats."""
        point = self._point(at)
        ref, cut, _ = self._read(point.numbers)
        about = ref.expected_acceleration(cut, self.trial.grid)
        return linearisation.left_to_pull(point.linear, wide, about)

    def place(self, at: str) -> tuple[np.ndarray, float]:
        """The segments linearised: which are lost [S], and max |e| over all."""
        linear = self._point(at).linear
        return linear.lost, linear.farthest

    def gather(self, at: str) -> Linear:
        """All arrays of a point, which are large; rows count in the whole record."""
        linear = self._point(at).linear
        cut = replace(linear.cut, rows=linear.cut.rows + self.begin)
        return replace(linear, cut=cut)

    # --- products

    def add(self, at: str, weight: str, noise: float, remainder: Remainder) -> Sum:
        """Σ_v G_v of the block's voyages (4)."""
        trial, own = self.trial, self._remainder(remainder)
        point, w = self._point(at), self.known[weight]
        logdets = trial.products.logdets(point, w)
        G, volumes = None, []
        for _, one in trial.products.each_voyage(point, noise, w, own):
            G = one.G if G is None else G + one.G
            volumes.append(one.volume)
        assert G is not None
        return Sum(G, tuple(logdets), tuple(volumes))

    def volumes(
        self, at: str, weight: str, noise: float, remainder: Remainder
    ) -> tuple[list[float], list[float]]:
        """Shares of log|R| of each voyage, and log|C₀| of each part."""
        own = self._remainder(remainder)
        return self.trial.products.volumes(self._point(at), noise, self.known[weight], own)

    def add_without(
        self, at: str, weight: str, noise: float, remainder: Remainder, gone: frozenset
    ) -> np.ndarray | None:
        """Σ_v G_v of those voyages that are not `gone`; None where no other is here."""
        trial, own = self.trial, self._remainder(remainder)
        kept = trial.products.kept_voyages(self._point(at), noise, self.known[weight], own)
        G = None
        for of, one in kept.items():
            if of not in gone:
                G = one if G is None else G + one
        return G

    def each(self, at: str, weight: str, noise: float, remainder: Remainder) -> list[Any]:
        """G_k of each part (3), which are large."""
        own, w = self._remainder(remainder), self.known[weight]
        return list(self.trial.products.each_part(self._point(at), noise, w, own))

    def misfit(
        self, at: str, weight: str, left: str, runs: str, process_noise: ProcessNoise
    ) -> float:
        """Of what the numbers `left` leave, `raised_noise.Residual.misfit`."""
        key = (at, weight, left)
        if self.residual is None or self.residual[0] != key:
            own = replace(self.trial, weight=self.known[weight])
            found = own.noise_left(self._point(at), self.known[left])
            assert isinstance(found, Residual)  # a block is one
            self.residual = key, found
        own_runs = self.known[runs]
        return self.residual[1].misfit(
            replace(process_noise, runs=own_runs if len(own_runs) else None)
        )

    def force_across(
        self, at: str, d: np.ndarray, noise: float, remainder: Remainder
    ) -> tuple[np.ndarray, np.ndarray]:
        """As of a trial, of its own segments."""
        return self.trial.force_across(self._point(at), d, noise, self._remainder(remainder))

    def squares(
        self, at: str, d: np.ndarray, nominal: ProcessNoise, process_noise: ProcessNoise
    ) -> np.ndarray:
        """χ² [S] of what the numbers d leave, as `campaign_parts.squares` has it."""
        left, d = self.trial.less_misfit(self._point(at).linear, d)
        return squares(replace(left, e=left.e - left.j @ d), nominal, process_noise)

    def _point(self, at: str) -> Point:
        """Linearised there; once more where it was not kept."""
        if at not in self.points:
            place: Place = self.known[at]
            linear = self.trial.linear_at(place.numbers, place.path)
            self.points[at] = Point(place.numbers, place.path, linear)
            for key in list(self.points)[1 : 1 - KEPT_POINTS]:
                del self.points[key]
        return self.points[at]

    def _read(self, numbers: Numbers) -> tuple[Any, Any, np.ndarray]:
        ref = self.trial.reference
        cut, _, _ = self.trial.reading(numbers)
        return ref, cut, np.concatenate((ref.theta, ref.columns.numbers(dict(numbers))))

    def _remainder(self, remainder: Remainder) -> Remainder:
        """When a force is on is said in rows of the whole record."""
        if remainder.course is None:
            return remainder
        on = tuple((a - self.begin, b - self.begin) for a, b in remainder.course.on)
        return replace(remainder, course=replace(remainder.course, on=on))


def cut_into_blocks(trial: Trial) -> tuple[Block, ...]:
    """The trial's blocks, of `trial_products.VOYAGES` voyages each."""
    of_segment = trial.record.voyage[trial.rows]
    found = []
    for voyages in trial.products.blocks:
        record = trial.record.pick([trial.record.names[v] for v in voyages])
        begin = int(np.flatnonzero(trial.record.voyage == voyages[0])[0])
        segments = np.flatnonzero(np.isin(of_segment, voyages))
        parts = [k for k, of in enumerate(trial.voyage) if of in voyages]
        own = replace(
            trial, campaign=trial.campaign.without_nominal(), record=record,
            rows=trial.rows[segments] - begin,
            parts=tuple(trial.parts[k] - segments[0] for k in parts), voyage=trial.voyage[parts],
            weight=trial.weight[segments], cache=Cache(), first=None, begun=False,
        )  # fmt: skip
        found.append(Block(own, begin))
    return tuple(found)


class Sent:
    """Which keys a block has been sent: it is given a value once, and again where it asks."""

    def __init__(self) -> None:
        self._keys: set[str] = set()

    def first(self, kept: Sequence[Kept]) -> list[Kept]:
        """What to send: keys alone of what the block was sent before."""
        found = [one.alone if one.key in self._keys else one for one in kept]
        self._keys |= {one.key for one in kept}
        return found


class Here:
    """All blocks in this process."""

    def __init__(self, blocks: Sequence[Block]) -> None:
        self.blocks = blocks
        self._sent = [Sent() for _ in blocks]

    def answer(self, call: Call) -> list[Any]:
        found = []
        for number, kept in call.kept.items():
            block, sent = self.blocks[number], self._sent[number]
            said = block.answer(call.method, sent.first(kept), call.rest)
            if isinstance(said, Missing):
                said = block.answer(call.method, kept, call.rest)
            found.append(said)
        return refuse_diverged(found)


def refuse_diverged(answers: list[Any]) -> list[Any]:
    """The answers. Raises np.linalg.LinAlgError for the first that diverged."""
    for one in answers:
        if isinstance(one, Diverged):
            raise np.linalg.LinAlgError(one.words)
    return answers
