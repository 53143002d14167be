"""Sizes of causes in each voyage by partial pooling, equations (21) to (23)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

LEVEL_SPREAD = 2.0  # s, realistic sizes: a season's level may be twice as large as is realistic
SPREADS = np.geomspace(0.01, 3.0, 25)  # τ, realistic sizes: from hardly any to three of them
HALF_CAUCHY = 0.3  # A: voyages of one level differ by less than a third of a realistic size
DRAWS = 4000  # the ends of a 90 % interval are then known to a twentieth of it
SEED = 0
SWEEPS, BURNT = 500, 50  # of Gibbs sampling over the τ of several causes: DRAWS / SWEEPS draws each


@dataclass(frozen=True)
class Voyages:
    """Likelihood (21) of causes' sizes in each of V voyages, in units of their realistic sizes.

    y      [V, q]  numbers of all causes, one cause after another
    M      [V, q, V, q]
    days   [V] date of each voyage, days
    level  [V] which level μ_g each has, counted from 0
    each   how many of the q numbers each cause has; unless given, all are of one
    """

    y: np.ndarray
    M: np.ndarray
    days: np.ndarray
    level: np.ndarray
    each: tuple[int, ...] = ()

    @property
    def places(self) -> list[np.ndarray]:
        """Places of each cause's numbers among the q."""
        each = self.each or (self.y.shape[1],)
        return np.split(np.arange(self.y.shape[1]), np.cumsum(each)[:-1])

    @property
    def span(self) -> float:
        """Days from the first voyage to the last."""
        return float(np.ptp(self.days))

    @property
    def middle(self) -> float:
        """The date at which t is zero."""
        return 0.5 * float(self.days.max() + self.days.min())


@dataclass(frozen=True)
class Pooled:
    """Draws of (22), and what each voyage says by itself, in units of the realistic size.

    sizes       [D, V, q]   x_v
    levels      [D, G, q]   μ_g, at the middle of the season
    slope       [D, q]      β, over the season; zero where it has none
    spread      [D]         τ
    alone       [D, V, q]   x_v where each has a size of its own, x_v ~ N(0, s² I): without pooling
    """

    sizes: np.ndarray
    levels: np.ndarray
    slope: np.ndarray
    spread: np.ndarray
    alone: np.ndarray


def pool(of: Voyages, wears: Sequence[bool], freedom: float = math.inf) -> tuple[Pooled, ...]:
    """DRAWS of w and τ of each cause given the data; the same ones at each call.

    wears    whether each cause has a slope β
    freedom  degrees of it with which the size of the covariance is known: Student's t
    """
    V, q = of.y.shape
    rng = np.random.default_rng(SEED)
    model = _Model.of(of, [one and of.span > 0.0 and V > 2 for one in wears])
    which = _spreads(model, rng)
    heavy = np.ones(DRAWS)
    if math.isfinite(freedom):
        heavy = np.sqrt(freedom / rng.chisquare(freedom, DRAWS))
    standard = rng.standard_normal((DRAWS, len(model.pull))) * heavy[:, None]
    w = np.empty_like(standard)
    kept, place = np.unique(which, axis=0, return_inverse=True)
    for i, taus in enumerate(kept):
        mean, root, _ = model.given(tuple(taus.tolist()))
        own = place.ravel() == i
        w[own] = mean + standard[own] @ root.T
    sizes = (w @ model.B.T).reshape(DRAWS, V, q)
    alone = _alone(of, rng, heavy)
    return tuple(
        Pooled(
            sizes[..., at], w[:, model.levels(h)].reshape(DRAWS, -1, len(at)),
            w[:, model.slopes(h)] if len(model.slopes(h)) else np.zeros((DRAWS, len(at))),
            SPREADS[which[:, h]], alone[..., at],
        )
        for h, at in enumerate(of.places)
    )  # fmt: skip


@dataclass
class _Model:
    """(22) of several causes: x = B w, w = (μ, β, u), each number of w one of a cause.

    B        [V q, p]
    kind     [p] 0 a level μ, 1 a slope β, 2 a voyage's own u
    cause    [p] whose it is
    """

    B: np.ndarray
    kind: np.ndarray
    cause: np.ndarray
    information: np.ndarray
    pull: np.ndarray
    known: dict[tuple[int, ...], tuple[np.ndarray, np.ndarray, float]] = field(default_factory=dict)

    @classmethod
    def of(cls, of: Voyages, slopes: Sequence[bool]) -> _Model:
        V, q = of.y.shape
        G = int(of.level.max()) + 1
        whose = np.empty(q, int)
        for h, at in enumerate(of.places):
            whose[at] = h
        sloping = np.flatnonzero(np.asarray(slopes)[whose])
        t = (of.days - of.middle) / max(of.span, 1e-12)
        B = np.concatenate((
            np.kron(np.eye(G)[of.level], np.eye(q)), np.kron(t[:, None], np.eye(q)[:, sloping]),
            np.eye(V * q),
        ), axis=1)  # fmt: skip
        kind = np.repeat([0, 1, 2], [G * q, len(sloping), V * q])
        cause = np.concatenate((np.tile(whose, G), whose[sloping], np.tile(whose, V)))
        M, y = of.M.reshape(V * q, V * q), of.y.reshape(V * q)
        return cls(B, kind, cause, B.T @ M @ B, B.T @ y)

    def levels(self, h: int) -> np.ndarray:
        return np.flatnonzero((self.kind == 0) & (self.cause == h))

    def slopes(self, h: int) -> np.ndarray:
        return np.flatnonzero((self.kind == 1) & (self.cause == h))

    @property
    def causes(self) -> int:
        return int(self.cause.max()) + 1

    def given(self, taus: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, float]:
        """Mean, root of the covariance and (23), of τ = SPREADS[taus] of each cause."""
        if taus not in self.known:
            own = SPREADS[np.array(taus)][self.cause] ** -2.0
            of_trend = np.where(self.kind == 1, 1.0, LEVEL_SPREAD**-2.0)
            precision = np.where(self.kind == 2, own, of_trend)
            self.known[taus] = _posterior(self.information, self.pull, precision)
        return self.known[taus]


def _spreads(model: _Model, rng: np.random.Generator) -> np.ndarray:
    """Draws of τ of each cause [DRAWS, H] as places in SPREADS, w integrated out: of one cause from
    p(τ | r) itself, of several by Gibbs sampling, each given the others'."""
    count, several = len(SPREADS), model.causes > 1
    # even in log τ, so that a density over τ counts τ times
    prior = np.log(SPREADS) - np.log1p((SPREADS / HALF_CAUCHY) ** 2)
    state = [int(np.searchsorted(SPREADS, HALF_CAUCHY))] * model.causes
    found = []
    for _ in range(BURNT + SWEEPS if several else 1):
        for h in range(model.causes):
            log_p = prior + [
                model.given((*state[:h], k, *state[h + 1 :]))[2] for k in range(count)
            ]  # fmt: skip
            p = np.exp(log_p - log_p.max())
            if not several:
                return rng.choice(count, (DRAWS, 1), p=p / p.sum())
            state[h] = int(rng.choice(count, p=p / p.sum()))
        found.append(tuple(state))
    return np.repeat(np.array(found[BURNT:]), DRAWS // SWEEPS, axis=0)


def _posterior(
    information: np.ndarray, pull: np.ndarray, precision: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """A⁻¹ b, a root of A⁻¹, and (23)."""
    L = np.linalg.cholesky(information + np.diag(precision))
    root = np.linalg.inv(L).T  # A⁻¹ = L⁻ᵀ L⁻¹
    half = root.T @ pull
    volume = 0.5 * float(np.log(precision).sum()) - float(np.log(np.diagonal(L)).sum())
    return root @ half, root, 0.5 * float(half @ half) + volume


def _alone(of: Voyages, rng: np.random.Generator, heavy: np.ndarray) -> np.ndarray:
    """x | r with a size for each voyage and nothing that they have in common: x ~ N(0, s² I)."""
    V, q = of.y.shape
    information = of.M.reshape(V * q, V * q)
    mean, root, _ = _posterior(information, of.y.reshape(V * q), np.full(V * q, LEVEL_SPREAD**-2.0))
    drawn = mean + (rng.standard_normal((DRAWS, V * q)) * heavy[:, None]) @ root.T
    return drawn.reshape(DRAWS, V, q)
