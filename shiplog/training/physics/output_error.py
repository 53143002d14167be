"""Output error: the parameters whose rollouts come nearest to what was measured.

Gauss-Newton in a trust region (scipy's `least_squares`, within physical bounds), with a ridge that
holds each parameter to its starting value in units of its plausible spread: what the data say
nothing about stays where it was. Standard errors are those of correlated errors: a rollout's
error at one second is its error a second later. In units x = (θ - θ₀)/(φ s),

    x̂ = argmin Σ_w ω_w L_w(θ)/σ² + |x|²

Symbols as in the room's opening.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from shiplog.exceptions import ModelError, listed
from shiplog.simulation.sensitivities import losses, normal
from shiplog.simulation.window_series import Physical, WindowSeries

CORRELATION = 30.0  # s over which rollout errors are one observation, not many
LEAST_VARIANCE = 1e-12  # noise of data that a model fits exactly
REWEIGHTINGS = 3  # of weighing the ridge by the noise that the fit before it left
TOLERANCE = 1e-4  # relative fall of the sum of squares at which a fit has converged
MOST_EVALUATIONS = 60


@dataclass(frozen=True)
class Identified:
    """Parameters with what is known of them.

    values       [P]
    covariance   [P, P]  zero for those that were held
    free         [P]     which were fitted
    noise        weighted variance that one independent observation of the error has
    loss         mean L of the training windows at the start and at the end
    evaluations  of the whole sum with its derivatives
    converged    False where the last good values were kept; `message` says why
    """

    values: np.ndarray
    covariance: np.ndarray
    free: np.ndarray
    noise: float
    loss: tuple[float, float]
    evaluations: int
    converged: bool
    message: str

    @property
    def standard_error(self) -> np.ndarray:
        """(cov θ̂)ᵢᵢ^½ [P]; zero for those that were held."""
        return np.sqrt(np.diag(self.covariance))


def identify(
    model: Physical,
    start: np.ndarray,
    spread: np.ndarray,
    data: WindowSeries,
    *,
    bounds: tuple[np.ndarray, np.ndarray] | None = None,
    free: np.ndarray | None = None,
    begin: np.ndarray | None = None,
    factor: float = 1.0,
    most: int = MOST_EVALUATIONS,
    rounds: int = REWEIGHTINGS,
) -> Identified:
    """θ̂ = argmin Σ_w ω_w L_w(θ)/σ² + |(θ - θ₀)/(φ s)|², σ² in each round of the fit before it.

    start, spread   θ₀, s [P]  where the ridge holds each parameter, and how firmly
    bounds          low, high [P]  physical range
    free            [P]  which may move; all
    begin           [P]  where to begin, if not at `start`
    factor          φ, on the spreads in the ridge: 2 holds a quarter as firmly; what is plausible,
                    and so what an untouched parameter's standard error is, stays `spread`
    most, rounds    evaluations a round; rounds of weighing the ridge by the noise left over

    Raises ModelError where the windows diverge from the start, and from the fit of shorter ones.
    """
    free = (np.ones(len(start), dtype=bool) if free is None else free) & (spread > 0.0)
    width = factor * spread  # φ s
    values = np.array(start if begin is None else begin, dtype=float)
    endless = np.full(len(start), np.inf)
    low, high = bounds if bounds is not None else (-endless, endless)
    weight = data.weight
    before = _used(losses(model, np.array(start, dtype=float), data), weight)
    if not np.isfinite(_used(losses(model, values, data), weight)).all():
        values = _from_short_windows(model, start, width, data, (low, high), free, values)
    noise = residual_variance(_used(losses(model, values, data), weight), data)
    evaluations, converged, message = 0, True, "converged"
    for _ in range(rounds):
        problem = _Problem(model, start, width, data, free, noise)
        done = problem.solved(values, (low, high), most)
        evaluations += problem.evaluations
        values = problem.whole(done.x)
        converged = done.status > 0
        message = "converged" if converged else _unsettled(done, model.names, free, most)
        after = _used(losses(model, values, data), weight)
        now = residual_variance(after, data)
        steady = abs(now / noise - 1.0) < 0.05
        noise = now
        if steady:
            break
    total = weight.sum()
    return Identified(
        values=values,
        covariance=covariance(model, values, spread, data, free, noise, factor),
        free=free,
        noise=noise,
        loss=(float(weight @ before / total), float(weight @ after / total)),
        evaluations=evaluations,
        converged=converged,
        message=message,
    )


def residual_variance(loss: np.ndarray, data: WindowSeries) -> float:
    """σ² = t_c Σ_w ω_w L_w/(3 Σ_w ω_w T_w), LEAST_VARIANCE at least: weighted variance of one
    independent observation of the error, of L of each window [N] and their lengths T_w [s]."""
    samples = 3.0 * float((data.weight * data.dt.sum(1)).sum())
    return max(CORRELATION * float(data.weight @ loss) / samples, LEAST_VARIANCE)


def _from_short_windows(
    model: Physical,
    start: np.ndarray,
    spread: np.ndarray,
    data: WindowSeries,
    bounds: tuple[np.ndarray, np.ndarray],
    free: np.ndarray,
    values: np.ndarray,
) -> np.ndarray:
    """Values that hold whole windows, from ones with which some diverge: first fitted to the
    windows' beginnings, then to longer and longer ones. Raises ModelError where that fails."""
    whole = data.measured.shape[1]
    for share in (16, 8, 4, 2):
        size = max(whole // share, 3)
        part = data._replace(
            measured=data.measured[:, :size],
            actuator=data.actuator[:, :size],
            wind=data.wind[:, :size],
            dt=data.dt[:, : size - 1],
        )
        if not np.isfinite(_used(losses(model, values, part), data.weight)).all():
            break
        values = identify(
            model, start, spread, part, bounds=bounds, free=free, begin=values, rounds=1
        ).values
    lost = ~np.isfinite(_used(losses(model, values, data), data.weight))
    if lost.any():
        raise ModelError(
            f"The starting values let {int(lost.sum())} of {len(lost)} windows diverge, and no "
            "fit to shorter ones mends it.",
            hint="check the profile's signs and units, choose a shorter --window, or give better "
            "--parameters.",
        )
    return values


def _unsettled(done, names: Sequence[str], free: np.ndarray, most: int) -> str:
    """Which parameters the cost still falls along, the largest |Jᵀ r|, where the evaluations ran
    out."""
    slope = np.abs(done.jac.T @ done.fun)
    moving = [int(np.flatnonzero(free)[i]) for i in np.argsort(-slope)[:3]]
    return (
        f"after {most} evaluations {listed(names[i] for i in moving)} still move; "
        "the last values that made the error smaller are kept"
    )


class _Problem:
    """The sum of squares for scipy, in as few rows as there are parameters.

    JᵀJ, Jᵀr and rᵀr say all that a Gauss-Newton step needs to know; a root of them stands in for
    the J and r of ten thousands of rows, which never exist as a whole. In units x, with
    H = Σ_w ω_w Σ_t J_wᵀ W² J_w Δt/σ² = V diag(λ) Vᵀ, q = Σ_w ω_w Σ_t J_wᵀ W² r_t Δt/σ² and
    c = Σ_w ω_w L_w/σ²,

        J = (diag(λ^½) Vᵀ; I; 0),   p = diag(λ^-½) Vᵀ q,   r = (p; x; (c - |p|²)^½)

    have JᵀJ = H + I, Jᵀr = q + x and rᵀr = c + |x|². spread is φ s, the width of the ridge.
    """

    def __init__(self, model, start, spread, data, free, noise) -> None:
        self.model, self.start, self.spread, self.data = model, start, spread, data
        self.free, self.noise = free, noise
        self.evaluations = 0
        self._at: np.ndarray | None = None

    def solved(self, values: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], most: int):
        """x̂ = argmin c(x) + |x|²: scipy's solution from θ = `values` [P] on, within bounds, in at
        most `most` evaluations."""
        free, scale = self.free, self.spread[self.free]
        guess = (values - self.start)[free] / scale
        low, high = ((b - self.start)[free] / scale for b in bounds)
        return least_squares(
            self.residual,
            np.clip(guess, low + 1e-9, high - 1e-9),
            self.jacobian,  # type: ignore[arg-type]  # scipy's stub knows strings only
            bounds=(low, high),
            method="trf",
            xtol=1e-4,
            ftol=TOLERANCE,
            gtol=1e-10,
            max_nfev=most,
        )

    def whole(self, x: np.ndarray) -> np.ndarray:
        """θ = θ₀ + φ s x [P], of the free x."""
        values = self.start.copy()
        values[self.free] += x * self.spread[self.free]
        return values

    def _evaluate(self, x: np.ndarray) -> None:
        """r(x) and J(x), by one pass over all windows; not a number where the cost is none."""
        if self._at is not None and np.array_equal(self._at, x):
            return
        self.evaluations += 1
        self._at = x.copy()
        found = normal(self.model, self.whole(x), self.data, _indices(self.free))
        scale = self.spread[self.free]
        H = found.gram * np.outer(scale, scale) / self.noise
        weight = self.data.weight
        q = (weight @ _used(found.pull, weight)) * scale / self.noise
        c = float(weight @ _used(found.loss, weight)) / self.noise
        count = len(x)
        if not (np.isfinite(c) and np.isfinite(H).all()):
            self._residual = np.full(2 * count + 1, np.nan)
            self._jacobian = np.zeros((2 * count + 1, count))
            return
        # Eigenvalues rather than Cholesky: parameters that the data do not touch make it singular.
        eigenvalues, V = np.linalg.eigh(H)
        keep = eigenvalues > 1e-14 * max(eigenvalues[-1], 1e-300)
        root = np.where(keep, np.sqrt(np.maximum(eigenvalues, 0.0)), 0.0)
        inverse = np.where(keep, 1.0 / np.where(keep, root, 1.0), 0.0)
        p = inverse * (V.T @ q)
        rest = np.sqrt(max(c - float(p @ p), 0.0))
        self._jacobian = np.vstack((root[:, None] * V.T, np.eye(count), np.zeros(count)))
        self._residual = np.concatenate((p, x, [rest]))

    def residual(self, x: np.ndarray) -> np.ndarray:
        """r(x) [2P + 1], rᵀr = c(x) + |x|²."""
        self._evaluate(x)
        return self._residual

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """J(x) [2P + 1, P], JᵀJ = H + I."""
        self._evaluate(x)
        return self._jacobian


def _used(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Zero where the weight is: a window left out may have diverged, and 0 · inf is not 0."""
    return np.where(weight.reshape(-1, *[1] * (values.ndim - 1)) > 0, values, 0.0)


def _indices(free: np.ndarray) -> tuple[int, ...] | None:
    return None if free.all() else tuple(np.flatnonzero(free).tolist())


def covariance(
    model: Physical,
    values: np.ndarray,
    spread: np.ndarray,
    data: WindowSeries,
    free: np.ndarray,
    noise: float,
    factor: float = 1.0,
) -> np.ndarray:
    """cov θ̂ [P, P]: the ridge's and the data's information, with each window one observation of its
    own gradient (the sandwich of Huber 1967 and White 1980, shrunk). In units s, with H and F as in
    the room's opening, g_w = Σ_t J_wᵀ W² r_t Δt/σ² and n = Σ_w ω_w:

        p = tr(H (H + F)⁻¹),   S = (n Σ_w ω_w g_w g_wᵀ + p H)/(n + p)
        cov = (H + F)⁻¹ (n/(n - 1) S + F²) (H + F)⁻¹

    A ridge of another firmness (φ = `factor`) moves the estimate, and not how far from the truth
    the starting values plausibly are: that stays s = `spread`. noise   σ²
    """
    found = normal(model, values, data, _indices(free))
    scale = spread[free]
    H = found.gram * np.outer(scale, scale) / noise
    F = np.eye(len(scale)) / factor**2
    information = H + F
    g = _used(found.pull, data.weight) * scale / noise * np.sqrt(data.weight)[:, None]
    inverse = np.linalg.inv(information)
    # Few windows say little about how their gradients vary: the expected scatter counts as much
    # more windows as there are parameters that the data determine.
    p = float(np.trace(H @ inverse))
    n = float(data.weight.sum())
    S = (n * g.T @ g + p * H) / (n + p)
    meat = n / max(n - 1.0, 1.0) * S + F @ F
    sandwich = inverse @ meat @ inverse
    whole = np.zeros((len(values), len(values)))
    whole[np.ix_(free, free)] = sandwich * np.outer(scale, scale)
    return whole
