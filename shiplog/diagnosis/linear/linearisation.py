"""Short rollouts along the measured path, and their derivatives by everything that may be wrong.

A free rollout of a minute soon leaves the path of a ship that turns easily, and its derivatives are
then those of another voyage. Each segment is therefore first fitted to the measurement, by its
initial state and a slowly varying acceleration, z = (δξ, a). About this smoothed path the
simulation is linear:

    y ≈ y* + Z (z - z*) + H d,   d = θ - θ*

Where training divided a second into several steps, the time between two instants is divided too. A
segment in which the model still diverges is left out and counted (`Linear.lost`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from shiplog.diagnosis.linear import foreign_paths
from shiplog.diagnosis.linear.linear_segments import Linear, Path, Wide
from shiplog.diagnosis.linear.measurement_correction import Moved
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.simulation import foreign_model
from shiplog.simulation.kernel import paths, rollouts
from shiplog.simulation.window_series import Physical

STILLEST = 1e-3  # m, m/s, rad or rad/s: no ship is measured as still as that
KIND = np.array(((0, 2), (1, 3), (0, 2), (1, 3), (4, 4), (5, 5)))  # channels of one width
RUN_AWAY = 10.0  # expected distances from its measurement, beyond which a path has diverged
MOST_PULLS = 20  # steps of a path towards its measurement, at most
PULLED_NATS = 0.5  # gain of a step in any segment: with less, the path has converged
# The same of a path that was predicted, from which on its numbers were too far from those that it
# was predicted from. Ordinary steps of four trials left 3 to 14; a rudder's limit, 5e5 to 5e7.
FAR_NATS = 20.0


class Smooth(Physical, Protocol):
    """Equations that are linearised along a path."""

    @property
    def smooth(self) -> float:
        """s within which their derivatives may be taken to go straight; 0 where none do."""
        ...


def stable_steps(model: Smooth, step: float) -> int:
    """Steps between two instants with which the integration is as stable as in training.

    On the negative real axis the explicit Euler method is stable for |λ| h up to 2, two-step
    Adams-Bashforth up to 1 (Hairer, Nørsett & Wanner 1993, Sec. III.1 and V.1): of a model that
    training cut into n steps a second, |λ| may reach 2n, and a step must not exceed 1/(2n).
    """
    return max(1, math.ceil(2.0 * model.substeps * step - 1e-9))


def _interpolate(values: np.ndarray, many: int) -> np.ndarray:
    """v(k + i/m) = vₖ + i/m (vₖ₊₁ - vₖ), i < m: of values [S, K, ...] those at m = `many` instants
    for one, [S, (K - 1) m + 1, ...]."""
    if many == 1:
        return values
    part = np.arange(many).reshape(1, 1, many, *[1] * (values.ndim - 2)) / many
    left, right = values[:, :-1, None], values[:, 1:, None]
    fine = (len(values), (values.shape[1] - 1) * many, *values.shape[2:])
    inside = (left + part * (right - left)).reshape(fine)
    return np.concatenate((inside, values[:, -1:]), axis=1)


def first_path(model: Smooth, theta: np.ndarray, segments: Cut, g: SegmentGrid) -> Path:
    """ξ* = y₀ - (y₁ - y₀)/2 and aⱼ* = Δν/Δt - f(x, u; θ) at the nodes: the measured acceleration,
    by differences of the means of bins, less the model's at the measured state."""
    y = segments.y
    centre = (np.arange(g.bins) + 0.5) * g.bin
    nodes = np.arange(g.nodes) * g.node_step
    velocity = y[..., [1, 3, 5]]
    change = np.diff(velocity, axis=1) / g.bin
    at = 0.5 * (centre[1:] + centre[:-1])
    accelerated = resampled(at, change, nodes)
    states = resampled(centre, y, nodes)
    per = round(g.node_step / (g.step * g.every))
    modelled = accelerations(model, theta, states, segments.driven[:, ::per])
    start = y[:, 0] - 0.5 * (y[:, 1] - y[:, 0])
    return Path(start, np.moveaxis(accelerated - modelled, -1, 1))


def accelerations(
    model: Smooth, theta: np.ndarray, states: np.ndarray, driven: np.ndarray
) -> np.ndarray:
    """f(x, u; θ) [S, n, 3], the model's (u̇, v̇, ṙ) in m/s² and rad/s², at states x [S, n, 6] and
    what drives u [S, n, A + 3]."""
    inputs = np.concatenate((states, driven), 2).reshape(-1, states.shape[2] + driven.shape[2])
    if foreign_model.simulator_of(model) is not None:
        found = foreign_model.values(model, theta, inputs)
        return found.reshape(*states.shape[:2], 3)
    found = rollouts.values(model, theta, inputs)
    if found is not None:
        return found.reshape(*states.shape[:2], 3)
    from shiplog.diagnosis.linear import jax_paths

    return jax_paths.accelerations(model, theta, states, driven)


def resampled(at: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """v(t) = vᵢ + (t - tᵢ)/(tᵢ₊₁ - tᵢ) (vᵢ₊₁ - vᵢ) at the times `wanted` [m], constant beyond; of
    values [S, n, c] at times `at` [n]."""
    right = np.clip(np.searchsorted(at, wanted), 1, len(at) - 1)
    part = np.clip((wanted - at[right - 1]) / (at[right] - at[right - 1]), 0.0, 1.0)
    left = values[:, right - 1]
    return left + part[:, None] * (values[:, right] - left)


def fit_path(
    model: Smooth,
    theta: np.ndarray,
    segments: Cut,
    g: SegmentGrid,
    wide: Wide,
    path: Path | None = None,
    rounds: int = MOST_PULLS,
    about: np.ndarray | None = None,
) -> Path:
    """The path of each segment that is most probable given its measurement: Gauss-Newton in
    z = (δξ, a), until it converges or for so many rounds. It minimises

        Σ_b ((y_b - y_b(z))/σ)² + Σ (δξ/σ₀)² + Σⱼ ((aⱼ - āⱼ)/σₐ)²,   σ, σ₀, σₐ of `wide`,

    where each step's δξ counts from the start before it: a start far away is not held back.

    theta   θ* [C]
    about   ā [S, 3J] acceleration at the nodes that is expected of it; zero unless given
    """
    for _ in range(rounds):
        path, gained = pull_path(model, theta, segments, g, wide, path, about)
        if gained < PULLED_NATS:
            break
    return path or first_path(model, theta, segments, g)


def pull_path(
    model: Smooth,
    theta: np.ndarray,
    segments: Cut,
    g: SegmentGrid,
    wide: Wide,
    path: Path | None = None,
    about: np.ndarray | None = None,
) -> tuple[Path, float]:
    """One round of `fit_path`, and the most nats that it is expected to gain in a segment."""
    path = path or first_path(model, theta, segments, g)
    y, z, _ = simulated(model, theta, segments, path, g)
    return _closer(path, segments.y - y, z, segments.used, wide, about)


def predict_path(
    linear: Linear, d: np.ndarray, wide: Wide, about: np.ndarray | None = None
) -> Path:
    """Where a linearisation expects `fit_path` to end once θ has moved by d [C]: one step of
    Gauss-Newton from the gap y - y* - J d = e - J d - Z z*. Nothing is simulated; what is not
    linear shows when the model is linearised there. `about` as in `fit_path`."""
    gap = linear.e - linear.j @ d - np.einsum("sbcz,sz->sbc", linear.z, linear.path.coordinates)
    return _closer(linear.path, gap, linear.z, linear.cut.used, wide, about)[0]


def left_to_pull(linear: Linear, wide: Wide, about: np.ndarray | None = None) -> float:
    """The most nats that one more step of `fit_path` is expected to gain in a segment, from where
    the segments are linearised: of a path that was predicted, how far it is from that of its
    numbers. `about` as in `fit_path`."""
    gap = linear.e - np.einsum("sbcz,sz->sbc", linear.z, linear.path.coordinates)
    used = linear.cut.used & ~linear.lost[:, None, None]
    return _closer(linear.path, gap, linear.z, used, wide, about)[1]


def _closer(
    path: Path, gap: np.ndarray, z: np.ndarray, used: np.ndarray, wide: Wide,
    about: np.ndarray | None,
) -> tuple[Path, float]:  # fmt: skip
    """One step of Gauss-Newton, and the most nats that it is expected to gain in a segment.

        N = Zᵀ R⁻¹ Z + P⁻¹,   q = Zᵀ R⁻¹ (y - y*) - P⁻¹ (z* - (0, ā)),   δz = N⁻¹ q,
        gain = ½ δzᵀ q

    with R = diag(σ²) and P = diag(σ₀², σₐ²) of `wide`.

    gap   y - y* [S, B, 6], measured less simulated
    z     Z [S, B, 6, 6 + 3J]

    A path that diverged stays where it was.
    """
    count, _, _, size = z.shape
    away = np.logical_not(np.isfinite(gap).all((1, 2)) & np.isfinite(z).all((1, 2, 3)))
    if away.any():
        gap, z, used = gap.copy(), z.copy(), used & ~away[:, None, None]
        gap[away], z[away] = 0.0, 0.0
    prior = np.concatenate((wide.start, np.repeat(wide.acceleration, path.acceleration.shape[-1])))
    weight = np.where(used, 1.0 / wide.noise, 0.0)
    Z = (z * weight[..., None]).reshape(count, -1, size)  # R^-½ Z
    # the start is free about where it stands, the nodes about what is expected of them
    off = path.coordinates
    if about is not None:
        off[:, 6:] -= about
    Zt = np.swapaxes(Z, 1, 2)
    N = Zt @ Z + np.diag(prior**-2.0)
    q = (Zt @ (gap * weight).reshape(count, -1, 1))[..., 0] - off * prior**-2.0
    q[away] = 0.0  # else an acceleration that is not finite would be the gain of all
    step = np.linalg.solve(N, q[..., None])[..., 0]
    closer = Path(
        path.start + step[:, :6], path.acceleration + step[:, 6:].reshape(path.acceleration.shape)
    )
    return closer, 0.5 * float((step * q).sum(1).max(initial=0.0))


def linear(
    model: Smooth,
    theta: np.ndarray,
    segments: Cut,
    g: SegmentGrid,
    path: Path,
    moved: Moved,
    observed: np.ndarray,
    wide: Wide | None = None,
) -> Linear:
    """e = y - y* + Z z*,  J = H - O: the segments about a path, by all of θ [C], of which the last
    Q are causes' numbers.

    moved     [S, K, D, Q]  ∂u/∂θ: derivatives of actuators and wind by the causes' numbers
    observed  [S, B, 6, Q]  O = ∂y/∂θ: derivatives of the measurements by them
    wide      standard deviation of the path about its measurement: a path RUN_AWAY times that
              away has diverged; where it is not given, the span of the segments
    """
    y, z, j = simulated(model, theta, segments, path, g, moved)
    assert j is not None
    lost = _lost(segments, y, (z, j), wide)
    j[..., len(theta) - moved.shape[-1] :] -= observed
    if lost.any():
        segments = replace(segments, used=segments.used & ~lost[:, None, None])
        y = np.where(lost[:, None, None], segments.y, y)
        z[lost], j[lost] = 0.0, 0.0
    e = segments.y - y + np.einsum("sbcz,sz->sbc", z, path.coordinates)
    e[lost] = 0.0  # columns of zeros times a path that is not finite are not zero
    return Linear(segments, path, e, z, j, lost)


def _lost(
    segments: Cut, y: np.ndarray, columns: Sequence[np.ndarray], wide: Wide | None
) -> np.ndarray:
    """[S] bool: where path or columns are not finite, or |y - y*| > RUN_AWAY √(σ₀² + σ²).

    Only measured bins count, and channels of one kind (both of position, both of velocity)
    have one width: that of `wide`, or the root mean square of what all segments span.
    """
    if wide is None:
        span = np.ptp(segments.y, axis=1)[:, KIND].max(-1)
        width = np.sqrt((span**2).mean(0))
    else:
        width = np.hypot(wide.start, wide.noise)[KIND].max(-1)
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.where(segments.used, np.abs(segments.y - y), 0.0).max(1)
        near = (off <= RUN_AWAY * np.maximum(width, STILLEST)).all(-1)
    known = [np.isfinite(some).all((1, 2, 3)) for some in columns]
    return ~(near & np.isfinite(y).all((1, 2)) & np.logical_and.reduce(known))


def simulated(
    model: Smooth,
    theta: np.ndarray,
    segments: Cut,
    path: Path,
    g: SegmentGrid,
    moved: Moved | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """y* [S, B, 6], Z [S, B, 6, 6 + 3J] by start and accelerations at the nodes and, where `moved`
    is given, H [S, B, 6, C] by θ. Means over bins, y_b = (1/T) ∫ x dt over each of T s, by the
    trapezium. Not finite where the model diverges."""
    many = stable_steps(model, segments.step)
    along = _Along(
        path.start, _interpolate(path.interpolate(g), many), _interpolate(segments.driven, many),
        _interpolate(g.weights[None], many)[0], segments.step / many, g.bins, _series(moved, many),
    )  # fmt: skip
    if foreign_model.simulator_of(model) is not None:
        with np.errstate(all="ignore"):
            return foreign_paths.columns(model, theta, *along)
    found = paths.columns(model, theta, *along)
    if found is not None:
        return found
    from shiplog.diagnosis.linear import jax_paths

    with np.errstate(all="ignore"):
        return jax_paths.columns(model, theta, *along)


class _Along(NamedTuple):
    """What segments are simulated with: see `kernel.paths.columns`."""

    start: np.ndarray
    acceleration: np.ndarray
    driven: np.ndarray
    hats: np.ndarray
    step: float
    bins: int
    moved: tuple[np.ndarray, np.ndarray, int] | None


def _series(moved: Moved | None, many: int) -> tuple[np.ndarray, np.ndarray, int] | None:
    """Pairs, series [S, n, K] at so many instants for one, and how many numbers there are."""
    if moved is None:
        return None
    series = moved.series
    if many > 1:
        series = np.moveaxis(_interpolate(np.moveaxis(series, 1, 2), many), 2, 1)
    return moved.pairs, series, moved.shape[-1]
