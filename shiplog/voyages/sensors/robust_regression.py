"""Least squares for sensors that should agree: noise with a memory, outliers, honest intervals.

Residuals are changes from one second's mean to the next, so that a linear average is the same on
both sides of an equation and no constant of integration is left. Their memory is taken out by an
autoregression fitted to the residuals (Cochrane & Orcutt 1949), outliers by Huber's weights (1964),
and the interval is the larger of the model's own and the one from the scatter between blocks of
time. With residuals r_b(x) [c] of bins b and parameters x [k], of prior N(0, diag(s²)):

    e_b = r_b - Σ_l φ_l r_{b-l}                             ORDER bins of memory    `_whitened`
    w_b = min(1, HUBER σ √c/|e_b|)/σ²,   σ = 1.4826 median|e|
    0 = g(x) = Σ_b T_bᵀ w_b e_b + P x,   P = diag(s⁻²)                                  `fit`
    x ← x - N⁻¹ g,   N = Σ_b T_bᵀ w_b J_b + P,   J = ∂e/∂x, T the slope J smoothed over bins
    cov x = the larger of N⁻¹ (Σ_b T_bᵀ w_b T_b + P) N⁻¹ and N⁻¹ (Ω + P) N⁻¹

T instead of J as an instrument: the noise of a measured slope would bias x towards zero (errors in
variables). Ω is the covariance of the sum of scores T_bᵀ w_b e_b over blocks (Newey & West 1987).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh
from scipy.special import stdtrit

from shiplog.voyages.rows.resampling import RATE_HZ

ROWS = int(RATE_HZ)  # a bin is one second
ORDER = 8  # bins of memory: a gyro that drifts for ten seconds needs as many
BLOCK_S = 20  # what is further apart is taken as independent
NEIGHBOURS = 2  # blocks on either side whose errors may still be alike
SPARE_BLOCKS = 2  # at least, beyond one for each parameter: their scatter is to say something
HUBER = 2.0  # standard deviations
TURNS, TURNS_ROUGH = 24, 20
RENEWED = (2, 5, 9)  # turns at which the rough fit looks at the memory of its residual
BIN_WEIGHTS = (0.36, 0.24, 0.08)  # weights of a bin and its neighbours on either side
LEAST_KNOWN = 0.15
STRIDE = 0.5  # priors in one turn
NINETY_QUANTILE = 0.95  # quantile of either end of a 90 % interval

Model = Callable[[np.ndarray], np.ndarray]  # parameters [k] → residuals [B, c]


@dataclass(frozen=True)
class Bins:
    """Whole seconds inside unbroken stretches of rows.

    first [B]  row with which a bin begins
    run   [B]  how many bins stand before it in the same stretch
    """

    first: np.ndarray
    run: np.ndarray

    def mean(self, values: np.ndarray) -> np.ndarray:
        """v̄_b = (1/ROWS) Σ_{i in b} vᵢ: [n, c] at 10 Hz to the mean of each bin [B, c]."""
        total = np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)))
        return (total[self.first + ROWS] - total[self.first]) / ROWS

    def change(self, values: np.ndarray) -> np.ndarray:
        """v̄_b - v̄_{b-1} [B, c] of [n, c] at 10 Hz: the change of the mean since the bin before; 0
        where none is."""
        mean = self.mean(values)
        change = np.zeros_like(mean)
        change[1:] = np.diff(mean, axis=0)
        change[self.run == 0] = 0.0
        return change


def bins(starts: np.ndarray, margin: int) -> Bins:
    """starts [n] bool: the rows with which a new stretch begins; `margin` rows stay free."""
    edges = np.append(np.flatnonzero(starts), len(starts))
    first, run = [], []
    for a, b in pairwise(edges.tolist()):
        count = (b - a - 2 * margin) // ROWS
        if count > ORDER + 1:
            first.append(a + margin + ROWS * np.arange(count))
            run.append(np.arange(count))
    if not first:
        return Bins(np.zeros(0, np.int64), np.zeros(0, np.int64))
    return Bins(np.concatenate(first), np.concatenate(run))


def shifted(values: np.ndarray, rows: float) -> np.ndarray:
    """v(t + δ) = v_i + (δ - i)(v_{i+1} - v_i), i = ⌊δ⌋: [n, c] as it is δ = `rows` later, between
    rows by a straight line; the ends stand still."""
    whole, count = int(np.floor(rows)), len(values)
    share = rows - whole
    lead, tail = (min(max(n, 0), count + 1) for n in (-whole, whole + 1))
    inside = values[max(whole, 0) : max(count + 1 + min(whole, -1), 0)]
    held = np.concatenate((np.repeat(values[:1], lead, 0), inside, np.repeat(values[-1:], tail, 0)))
    return held[:-1] + share * (held[1:] - held[:-1])


def spread_over(change: np.ndarray, grid: Bins, seconds: int) -> float:
    """mean_b |Σ_{l < n} Δ_{b-l}|: mean size of a change Δ [B, c] from bin to bin, added up over
    n = `seconds`; 0 where no stretch is so long."""
    total = np.cumsum(change, axis=0)
    last = np.flatnonzero(grid.run >= seconds)
    if len(last) == 0:
        return 0.0
    return float(np.mean(np.linalg.norm(total[last] - total[last - seconds], axis=1)))


@dataclass(frozen=True)
class RobustFit:
    """value [k], cov [k, k]; `reverse` [k]: the same with the other side's noise in the slope."""

    value: np.ndarray
    cov: np.ndarray
    reverse: np.ndarray
    quantile: float  # of Student's t, for a 90 % interval

    def interval(self, index: int) -> tuple[float, float, float]:
        """x, min(x, x') - t s, max(x, x') + t s, s = cov_ii^½ and t Student's: value, low, high. A
        slope lies between both ways, x and x', of regressing one side on the other."""
        one, other = float(self.value[index]), float(self.reverse[index])
        half = self.quantile * float(np.sqrt(self.cov[index, index]))
        return one, min(one, other) - half, max(one, other) + half


@dataclass(frozen=True)
class Problem:
    """What is to vanish, and what is known of its parameters beforehand.

    steps [k]    of the central differences
    prior [k]    how large a parameter may be, one standard deviation about 0: what the manoeuvres
                 do not show stays there with an interval of that width; 0 keeps it at zero
    limit [k]    none leaves ± this
    other_side   parameters → derivatives [B, c] of some parameters from the other instrument,
                 whose noise is another one: {index: column}
    """

    model: Model
    grid: Bins
    steps: np.ndarray
    prior: np.ndarray
    limit: np.ndarray
    other_side: Callable[[np.ndarray], dict[int, np.ndarray]]

    @property
    def free(self) -> np.ndarray:
        return np.flatnonzero(self.prior > 0)

    def moved(self, value: np.ndarray, step: np.ndarray) -> np.ndarray:
        """x + δ/max(1, max|δ/s|/STRIDE), within ± limit: the free parameters one step δ further."""
        free = self.free
        step = step / max(1.0, float(np.max(np.abs(step) / self.prior[free])) / STRIDE)
        out = value.copy()
        out[free] = np.clip(value[free] + step, -self.limit[free], self.limit[free])
        return out

    def slope(self, value: np.ndarray, here: np.ndarray) -> np.ndarray:
        """(r(x + h) - r(x))/h [B, c, k]: first derivatives of the residual, the quick way."""
        steps = np.diag(self.steps)[self.free]
        slopes = [(self.model(value + step) - here) / step.sum() for step in steps]
        return np.stack(slopes, axis=-1)

    def derivatives(self, value: np.ndarray, here: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(r(x + h) - r(x - h))/2h and (r(x + h) - 2 r(x) + r(x - h))/h² [B, c, k]: first and
        second derivatives of the residual, the second in each parameter alone."""
        slope, bend = [], []
        for i in self.free:
            step = np.zeros_like(value)
            step[i] = self.steps[i]
            above, below = self.model(value + step), self.model(value - step)
            slope.append((above - below) / (2.0 * self.steps[i]))
            bend.append((above - 2.0 * here + below) / self.steps[i] ** 2)
        return np.stack(slope, axis=-1), np.stack(bend, axis=-1)


def rough(problem: Problem, starts: list[np.ndarray]) -> np.ndarray:
    """x with the least mean |e| of those that Levenberg-Marquardt reaches from `starts`: of the
    valleys that they lie in, the bottom of the one that leaves least unforeseen."""
    if not (problem.grid.run > ORDER).any():
        return starts[0]
    return min((_descended(problem, start) for start in starts), key=lambda found: found[1])[0]


def _descended(problem: Problem, value: np.ndarray) -> tuple[np.ndarray, float]:
    """Levenberg-Marquardt, the memory renewed as it goes: parameters, and mean |e| there.

        δ = -(N + μ diag N)⁻¹ g,   N = Σ_b J_bᵀ w_b J_b + P,   g = Σ_b J_bᵀ w_b e_b + P x

    accepted where Σ w e² + xᵀ P x falls; then μ ← μ/10, else 10 μ.
    """
    free, usable = problem.free, problem.grid.run > ORDER
    P = np.diag(problem.prior[free] ** -2.0)
    damping, memory, residual = 1e-3, np.zeros(ORDER), problem.model(value)
    step = np.zeros(len(free))
    for turn in range(TURNS_ROUGH):
        if turn in RENEWED:
            memory = _memory(residual, problem.grid.run)
        e = _whitened(residual, memory)[usable]
        J = _whitened(problem.slope(value, residual), memory)[usable]
        sigma = _noise(e, J, problem.prior[free])
        weight = np.minimum(1.0, HUBER * sigma / np.maximum(np.abs(e), 1e-12)) / sigma**2
        N = np.einsum("bci,bcj->ij", weight[:, :, None] * J, J) + P
        g = np.einsum("bci,bc->i", J, weight * e) + P @ value[free]
        cost = np.sum(weight * e**2) + value[free] @ P @ value[free]
        for _ in range(6):
            step = -np.linalg.solve(N + damping * np.diag(np.diag(N)), g)
            there = problem.moved(value, step)
            left = problem.model(there)
            e = _whitened(left, memory)[usable]
            if np.sum(weight * e**2) + there[free] @ P @ there[free] < cost:
                value, residual, damping = there, left, 0.1 * damping
                break
            damping = max(10.0 * damping, 1e-3)
        if turn > RENEWED[-1] and (np.abs(step) < 1e-3 * problem.prior[free]).all():
            break
    unforeseen = _whitened(residual, _memory(residual, problem.grid.run))[usable]
    return value, float(np.mean(np.abs(unforeseen)))


def fit(problem: Problem, start: np.ndarray) -> RobustFit | None:
    """x with g(x) = 0 by Gauss-Newton from `start`, x ← x - N⁻¹ g, and its covariance (the module's
    equations). None where there is too little to say how sure it is, where the voyage shows one
    parameter only together with another, or where a slope is another one when the sides are
    exchanged: then neither side shows more than its noise."""
    grid, free = problem.grid, problem.free
    usable = grid.run > ORDER
    block = np.cumsum(np.diff(grid.first // (BLOCK_S * ROWS), prepend=-1) != 0)[usable]
    names, block = np.unique(block, return_inverse=True)
    # Eight parameters have wrong valleys that three do not: twice the blocks keep them apart.
    if len(names) < len(free) + max(SPARE_BLOCKS, len(free) - 1):
        return None
    value, memory = start, np.zeros(ORDER)
    here = _linear(problem, value, memory)
    for turn in range(TURNS):
        N = here.cross(here.tool, here.slope)
        step = -np.linalg.solve(N, here.score(here.tool, value[free]))
        value = problem.moved(value, step)
        if turn < TURNS // 3:
            memory = _memory(here.residual, grid.run)
        here = _linear(problem, value, memory)
        small = 0.01**2 * np.diag(np.linalg.inv(N))
        if turn > TURNS // 3 and (step**2 < small).all():
            break
    N_inverse = np.linalg.inv(_normal(here))
    own = N_inverse @ here.cross(here.tool, here.tool) @ N_inverse  # of the model's own noise
    scores = np.einsum("bci,bc->bi", here.tool, here.weight * here.e)
    of_blocks = np.stack([np.bincount(block, s, len(names)) for s in scores.T], axis=1)
    between = _long_run(of_blocks) * len(names) / (len(names) - len(free)) + here.precision
    between = N_inverse @ between @ N_inverse
    if not (np.diag(own) > 0.0).all():  # two that go together to the last digit
        return None
    larger = np.sqrt(np.maximum(1.0, np.diag(between) / np.diag(own)))
    cov = np.zeros((len(value), len(value)))
    cov[np.ix_(free, free)] = larger[:, None] * own * larger[None, :]

    reverse, tool = value.copy(), here.tool.copy()
    for index, column in problem.other_side(value).items():
        at = int(np.searchsorted(free, index))
        tool[..., at] = _whitened(_smooth(column), memory)[usable]
        step = -np.linalg.solve(here.cross(tool, here.slope), here.score(tool, value[free]))
        if abs(step[at]) > problem.prior[index]:  # noise on both sides, and little else
            return None
        reverse[index] += step[at]
    quantile = float(stdtrit(max(len(names) - 1, 2), NINETY_QUANTILE))
    return RobustFit(value, cov, reverse, quantile)


@dataclass(frozen=True)
class _Linear:
    """The problem about one point, its memory taken out: [B, c] and, by parameter, [B, c, k]."""

    residual: np.ndarray  # r, with its memory
    e: np.ndarray
    slope: np.ndarray  # J = ∂e/∂x
    bend: np.ndarray  # ∂²e/∂x², smoothed
    tool: np.ndarray  # T, the slope smoothed
    weight: np.ndarray  # w
    precision: np.ndarray  # P [k, k], of what is known beforehand

    def cross(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Σ_b leftᵀ w right + P [k, k]."""
        return np.einsum("bci,bcj->ij", self.weight[:, :, None] * left, right) + self.precision

    def score(self, tool: np.ndarray, value: np.ndarray) -> np.ndarray:
        """g = Σ_b Tᵀ w e + P x [k]."""
        return np.einsum("bci,bc->i", tool, self.weight * self.e) + self.precision @ value


def _linear(problem: Problem, value: np.ndarray, memory: np.ndarray) -> _Linear:
    """e, J, T and w = min(1, HUBER σ √c/|e|)/σ² at x = `value`, φ = `memory`."""
    usable, prior = problem.grid.run > ORDER, problem.prior[problem.free]
    residual = problem.model(value)
    slopes, bends = problem.derivatives(value, residual)
    e, slope, bend, tool = (
        _whitened(part, memory)[usable]
        for part in (residual, slopes, _smooth(bends), _smooth(slopes))
    )
    sigma = _noise(e, slope, prior)
    size = np.linalg.norm(e, axis=1) / (sigma * np.sqrt(e.shape[1]))
    weight = np.minimum(1.0, HUBER / np.maximum(size, 1e-9))[:, None] / sigma**2
    weight = np.broadcast_to(weight, e.shape)
    return _Linear(residual, e, slope, bend, tool, weight, np.diag(prior**-2.0))


def _normal(here: _Linear) -> np.ndarray:
    """∂g/∂x [k, k]: how the score answers to the parameters, N + diag Σ_b (∂²e/∂x²)ᵀ w e where that
    is less, symmetric, and along each axis LEAST_KNOWN of N at least.

    The noise of a delayed channel is in its slope too and would pass for knowledge of the delay;
    the second derivative takes it out again. Where little else is left, little is known.
    """
    N = here.cross(here.tool, here.slope)
    N = 0.5 * (N + N.T)
    noise = np.einsum("bci,bc->i", here.bend, here.weight * here.e).clip(max=0.0)
    share, axes = eigh(N + np.diag(noise), N)  # of what the slopes promise, by axis
    back = N @ axes
    return (back * share.clip(LEAST_KNOWN, 1.0)) @ back.T


def _noise(e: np.ndarray, slope: np.ndarray, prior: np.ndarray) -> float:
    """σ = 1.4826 median|e|: standard deviation of the residual [B, c] without its outliers.

    Not below a millionth of what the parameters could do: numbers without noise are no instrument.
    """
    could = float(np.sqrt(np.mean((slope * prior) ** 2)))
    return max(1.4826 * float(np.median(np.abs(e))), 1e-6 * could, 1e-12)


def _long_run(scores: np.ndarray) -> np.ndarray:
    """Ω = Γ₀ + Σ_l (1 - l/(NEIGHBOURS + 1)) (Γ_l + Γ_lᵀ), Γ_l = Σ_g s_g s_{g-l}ᵀ: covariance [k, k]
    of the sum of scores s [G, k] of blocks whose neighbours may be alike.

    Newey and West (1987): an error that lasts half a block would otherwise count twice as evidence.
    """
    total = scores.T @ scores
    for lag in range(1, NEIGHBOURS + 1):
        both = scores[lag:].T @ scores[:-lag]
        total += (1.0 - lag / (NEIGHBOURS + 1.0)) * (both + both.T)
    return total


def _smooth(values: np.ndarray) -> np.ndarray:
    """Σ_l a_|l| v_{b-l}, a = BIN_WEIGHTS [B, c, k]: alike to both sides; a slope with less of its
    own noise."""
    out = BIN_WEIGHTS[0] * values
    for lag, share in enumerate(BIN_WEIGHTS[1:], start=1):
        out[lag:] += share * values[:-lag]
        out[:-lag] += share * values[lag:]
    return out


def _memory(residual: np.ndarray, run: np.ndarray) -> np.ndarray:
    """φ = (Σ ρ ρᵀ + ε I)⁻¹ Σ ρ r_b [ORDER], ρ = (r_{b-1}, …, r_{b-ORDER}): coefficients of the
    residual on those before it, all components alike, each over its median size and cut at 4."""
    scale = 1.4826 * np.median(np.abs(residual), axis=0) + 1e-12
    tamed = np.clip(residual / scale, -4.0, 4.0)
    usable = np.flatnonzero(run > ORDER)
    before = np.stack([tamed[usable - k] for k in range(1, ORDER + 1)], axis=-1)
    before, now = before.reshape(-1, ORDER), tamed[usable].ravel()
    normal = before.T @ before
    return np.linalg.solve(normal + 1e-6 * np.trace(normal) * np.eye(ORDER), before.T @ now)


def _whitened(values: np.ndarray, memory: np.ndarray) -> np.ndarray:
    """v_b - Σ_l φ_l v_{b-l} [B, ...]: less what its memory φ foretells; the first ORDER of a
    stretch are not to be used."""
    out = values.copy()
    for lag, share in enumerate(memory, start=1):
        out[lag:] -= share * values[:-lag]
    return out
