"""Dependence of the residual on inputs that the model does not have.

The inputs of a model are velocities, actuators and apparent wind. Heading, place, time and recent
changes of the controls are not. If they predict the residual on held-out voyages, a term is missing
that a new fit of the model cannot provide. With accelerations y [K, 3] at nodes and features X of
the model's own inputs (X₀), and of an omitted one in addition (X₁):

    W_f(λ) = (X̃ᵀ X̃ + λ n I)⁻¹ X̃ᵀ ỹ            without fold f; ~ less the means without f
    E_f(λ) = Σ_{k in f} (y_k - ȳ - W_fᵀ (x_k - x̄))²           squared error on fold f [3]
    λ_f = argmin of the same error on the other folds, each left out too (nested cross-validation)
    E = Σ_f E_f(λ_f),   R² = (min(E(X₀), E(∅)) - E(X₀, X₁))/min(E(X₀), E(∅))

All of it is done on sums of products over folds. R² is significant where it exceeds what shifted
or exchanged values of the omitted input reach (SHIFTS draws; greatest, and mean and BEYOND standard
deviations), and LEAST_R2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import polars as pl

from shiplog.diagnosis.noise.residual_acceleration import ACCELERATIONS
from shiplog.nomenclature import channels
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.timescale import NODE_STEP

CHANNELS = tuple(c.name for c in channels.VELOCITY)
LEAST_R2 = 0.05  # of the variance: what a model misfits itself reaches half of it in another season
BEYOND = 4.0  # standard deviations of what chance reaches
SHIFTS = 20
LEAST_SHIFT = 30  # nodes, the least shift: random forces are no longer correlated by then
EXCHANGED_S = 300.0  # s, exchanged to make time mean nothing
VOYAGE_FOLDS = 8  # more voyages are left out in groups
MAP_CENTRES = 12
OUTLIER = 6.0  # robust standard deviations; a ship that was pushed by hand must not decide
PENALTIES = 10.0 ** np.arange(-4.0, 2.0)  # of the mean square of a feature


@dataclass(frozen=True, slots=True)
class Dependence:
    """How far one omitted input predicts the residual acceleration.

    r2      share of the variance of each channel, on voyages left out; below 0: worse than none
    folds   what was left out in turn: "voyages", "groups of voyages" or "halves" of the only one
    """

    variable: str  # a family of the contract: heading, position, time or controls
    r2: tuple[float, float, float]  # surge, sway, yaw_rate
    acts_on: tuple[str, ...]
    folds: str

    @property
    def significant(self) -> bool:
        return bool(self.acts_on)


@dataclass(frozen=True)
class _Nodes:
    """What the regressions share, K nodes in order of voyage and time.

    y        [K, 3]  accelerations, outliers cut
    visible  [K, G]  a rough model's features of all inputs of the model
    carried  [K, H]  what a missing effect may be proportional to
    runs     [K]     voyage
    folds    [K]     the group that is held out together
    """

    y: np.ndarray
    visible: np.ndarray
    carried: np.ndarray
    runs: np.ndarray
    folds: np.ndarray


Indices = np.ndarray  # [K] which node's unseen variable goes with each node


def table(
    nodes: pl.DataFrame,
    profile: Profile,
    rng: np.random.Generator,
    shifts: int = SHIFTS,
    node_step: float = NODE_STEP,
) -> tuple[Dependence, ...]:
    """R² of each channel: one row each for heading, position, time and controls.

    nodes   nodes of `residual_acceleration.table`, or the same columns of any other model's
            residual
    rng     draws the shifts
    node_step    s between nodes

    R² is beyond what a regression on the model's inputs predicts; that of position also beyond
    heading, or every steady force would count as a matter of place.
    """
    shared, folds = _nodes(nodes, profile)
    psi = nodes["heading"].to_numpy()
    heading = _heading(psi, shared.carried)
    designs: dict[str, tuple[Callable[[Indices], np.ndarray], np.ndarray]] = {
        "heading": (heading, shared.visible),
        "position": (
            _position(nodes.select("x0", "y0").to_numpy(), psi),
            np.concatenate((shared.visible, heading(np.arange(len(psi)))), 1),
        ),
        "time": (_time(nodes["share"].to_numpy(), shared.carried), shared.visible),
        "controls": (_controls(nodes, profile, shared, node_step), shared.visible),
    }
    time = nodes["time_s"].to_numpy()
    found = []
    for variable, (features, known) in designs.items():
        move = _exchanged if variable == "time" else _shifted
        r2 = _gains(shared, known, [features(np.arange(len(time)))])[0]
        null = _gains(
            shared, known, [features(move(shared.runs, time, rng)) for _ in range(shifts)]
        )
        lucky = np.maximum(null, 0.0)  # how much worse than nothing a bad guess is does not count
        limit = np.maximum(lucky.max(0), lucky.mean(0) + BEYOND * lucky.std(0))
        acts_on = tuple(
            c for c, a, b in zip(CHANNELS, r2, np.maximum(limit, LEAST_R2), strict=True) if a > b
        )
        found.append(Dependence(variable, _three(r2), acts_on, folds))
    return tuple(found)


def _three(values: np.ndarray) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])


def _nodes(nodes: pl.DataFrame, profile: Profile) -> tuple[_Nodes, str]:
    """y, X₀ = (u, v, r, u|u|, v|v|, r|r|, uv, ur, vr, wind, drive), what carries a missing effect
    (1, u, v, r, drive), and the folds with their name. y is cut at OUTLIER robust deviations."""
    y = nodes.select(ACCELERATIONS).to_numpy()
    middle = np.median(y, axis=0)
    reach = OUTLIER * 1.4826 * np.median(np.abs(y - middle), axis=0)
    runs = nodes["voyage"].rle_id().to_numpy().astype(int)
    motion = _unit(nodes.select(CHANNELS).to_numpy())
    blown = nodes.select("wind_ahead", "wind_starboard").to_numpy()
    blown = _unit(blown * np.linalg.norm(blown, axis=1, keepdims=True))
    drive = _drive(nodes, profile)
    u, v, r = motion.T
    visible = np.concatenate(
        (motion, motion * np.abs(motion), np.stack((u * v, u * r, v * r), 1), blown, drive), 1
    )
    carried = np.concatenate((np.ones((len(y), 1)), motion, drive), 1)
    folds, name = _folds(runs)
    return _Nodes(np.clip(y, middle - reach, middle + reach), visible, carried, runs, folds), name


def _drive(nodes: pl.DataFrame, profile: Profile) -> np.ndarray:
    """(nᵢ|nᵢ|)ᵢ, (Σ n|n|) sin δⱼ, (Σ n|n|) cos δⱼ [K, D]: thrust of each screw, over its root mean
    square, and all of it turned by each angle."""
    values = {a.name: nodes[a.name].to_numpy() for a in profile.actuators}
    strengths = [
        values[a.name] * np.abs(values[a.name])
        for a in profile.actuators
        if a.kind in ("propeller", "thruster")
    ]
    angles = [values[a.name] for a in profile.actuators if a.kind in ("rudder", "azimuth")]
    strength = _unit(np.stack(strengths or [np.ones(nodes.height)], 1))
    total = strength.sum(1)
    turned = [total * turn(angle) for angle in angles for turn in (np.sin, np.cos)]
    return np.concatenate((strength, np.stack(turned, 1) if turned else strength[:, :0]), 1)


def _folds(runs: np.ndarray) -> tuple[np.ndarray, str]:
    """[K] the fold of each: voyages, groups of them in order, or halves of one."""
    count = int(runs.max()) + 1
    if count == 1:
        return (np.arange(len(runs)) >= len(runs) // 2).astype(int), "halves"
    if count <= VOYAGE_FOLDS:
        return runs, "voyages"
    ends = np.cumsum(np.bincount(runs)) - 1
    group = np.unique(ends * VOYAGE_FOLDS // len(runs), return_inverse=True)[1]
    return group[runs], "groups of voyages"


def _unit(values: np.ndarray) -> np.ndarray:
    """x/√mean(x²): columns over their root mean square; a column of zeros stays."""
    return values / np.maximum(np.sqrt((values**2).mean(0)), 1e-12)


def _times(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Every column of one with every column of the other, [K, L R]."""
    return (left[:, :, None] * right[:, None, :]).reshape(len(left), -1)


# --- features of the unseen variables, as at node i for node k ------------------------------------


def _heading(psi: np.ndarray, carried: np.ndarray) -> Callable[[Indices], np.ndarray]:
    """cos kψ, sin kψ, k = 1, 2, 3; and the first one, that of an earth-fixed vector, times what
    carries it."""
    harmonics = np.stack([turn(k * psi) for k in (1, 2, 3) for turn in (np.cos, np.sin)], 1)

    def features(at: Indices) -> np.ndarray:
        turned = harmonics[at]
        return np.concatenate((turned, _times(turned[:, :2], carried[:, 1:])), 1)

    return features


def _position(place: np.ndarray, psi: np.ndarray) -> Callable[[Indices], np.ndarray]:
    """exp(-½ |p - c|²/w²) (1, cos ψ, sin ψ): bumps about centres c of the places it was at, w their
    median distance: forces in body axes, and earth-fixed ones turned there."""
    centres = [place.mean(0)]
    for _ in range(MAP_CENTRES - 1):  # each as far as can be from those before
        away = np.min([((place - c) ** 2).sum(1) for c in centres], axis=0)
        centres.append(place[away.argmax()])
    grid = np.array(centres)
    between = np.linalg.norm(grid[:, None] - grid, axis=-1) + np.diag(np.full(MAP_CENTRES, np.inf))
    width = max(float(np.median(between.min(0))), 1e-6)
    bumps = np.exp(-0.5 * ((place[:, None] - grid) ** 2).sum(-1) / width**2)
    axes = np.stack((np.ones(len(psi)), np.cos(psi), np.sin(psi)), 1)
    return lambda at: _times(bumps[at], axes)


def _time(share: np.ndarray, carried: np.ndarray) -> Callable[[Indices], np.ndarray]:
    """t and t² times what carries the effect, t = 2 share - 1, from -1 to 1 over the campaign."""
    t = 2.0 * share - 1.0
    powers = np.stack((t, t**2), 1)
    return lambda at: _times(powers[at], carried)


def _controls(
    nodes: pl.DataFrame, profile: Profile, shared: _Nodes, node_step: float
) -> Callable[[Indices], np.ndarray]:
    """Δu_i times what carries the effect: what each actuator did since the node before; nothing
    where a stretch begins."""
    values = nodes.select(profile.actuator_names).to_numpy()
    step = np.diff(nodes["time_s"].to_numpy(), prepend=-np.inf)
    follows = (np.diff(shared.runs, prepend=-1) == 0) & (step < 1.5 * node_step)
    change = _unit(np.where(follows[:, None], np.diff(values, axis=0, prepend=values[:1]), 0.0))
    return lambda at: _times(change[at], shared.carried)


def _shifted(runs: np.ndarray, time: np.ndarray, rng: np.random.Generator) -> Indices:
    """Round and round within each voyage, by LEAST_SHIFT at least."""
    moved = np.arange(len(runs))
    for run in np.unique(runs):
        rows = np.flatnonzero(runs == run)
        least = min(LEAST_SHIFT, len(rows) // 2)
        moved[rows] = np.roll(rows, rng.integers(least, len(rows) - least + 1))
    return moved


def _exchanged(runs: np.ndarray, time: np.ndarray, rng: np.random.Generator) -> Indices:
    """Pieces of the campaign in another order: within a voyage the campaign hardly ages."""
    begins = (np.diff(runs, prepend=-1) != 0) | (np.diff(time // EXCHANGED_S, prepend=-1.0) != 0)
    pieces = np.split(np.arange(len(runs)), np.flatnonzero(begins)[1:])
    return np.concatenate([pieces[i] for i in rng.permutation(len(pieces))])


# --- ridge regression on sums, voyages left out ---------------------------------------------------


def _gains(shared: _Nodes, known: np.ndarray, designs: list[np.ndarray]) -> np.ndarray:
    """R² = (E₀ - E(X₀, X₁))/E₀ [D, 3], E₀ = min(E(X₀), E(∅)): share of the variance that each
    design X₁ predicts beyond X₀ = `known`."""
    whole = np.zeros((len(shared.y), 0))
    total, before = (_cross_validation_error(shared, x) for x in (whole, known))
    after = np.stack(
        [_cross_validation_error(shared, np.concatenate((known, x), 1)) for x in designs]
    )
    # relative to the better guess without it: a share of the remaining variance
    base = np.minimum(before, total)
    return (base - after) / np.maximum(base, 1e-300)


def _cross_validation_error(shared: _Nodes, features: np.ndarray) -> np.ndarray:
    """Σ_f E_f(λ_f) [3]: squared error on each fold f in turn, the penalty chosen among the others:

        λ_f = argmin_λ Σ_{g ≠ f} E_{g | fg}(λ),   E_{g | fg} on fold g without folds f and g

    With two folds, the halves of the other one take the place of the folds g.
    """
    x = np.concatenate((np.ones((len(features), 1)), _unit(features), shared.y), 1)
    count = int(shared.folds.max()) + 1
    T_f = np.stack([_square(x[shared.folds == fold]) for fold in range(count)])
    T = T_f.sum(0)
    W, mean = _ridge(T - T_f)
    E = _errors(T_f, W, mean)  # E_f(λ) [F, L, 3]
    E_inner = np.zeros_like(E)  # Σ_g E_{g | fg}(λ)
    if count > 2:
        fg = np.array(list(combinations(range(count), 2)))  # each pair once: it serves both
        W, mean = _ridge(T - T_f[fg[:, 0]] - T_f[fg[:, 1]])
        for f, g in ((0, 1), (1, 0)):
            np.add.at(E_inner, fg[:, f], _errors(T_f[fg[:, g]], W, mean))
    else:  # one fold to choose by: its own halves
        for fold in range(count):
            rows = x[shared.folds != fold]
            half = np.stack([_square(part) for part in np.array_split(rows, 2)])
            E_inner[fold] = _errors(half, *_ridge(half[::-1])).sum(0)
    best = E_inner.argmin(1)  # λ_f
    return np.take_along_axis(E, best[:, None], 1)[:, 0].sum(0)


def _square(rows: np.ndarray) -> np.ndarray:
    """T = Σ_k t_k t_kᵀ [1 + P + 3, 1 + P + 3] of rows t = (1, x, y)."""
    return rows.T @ rows


def _centred(sums: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Σ (t - m)(t - m)ᵀ = Σ t tᵀ - (Σ t) mᵀ - m (Σ t)ᵀ + n m mᵀ [..., P + 3, P + 3] of t = (x, y),
    about a mean m that need not be their own."""
    n, total = sums[..., :1, :1], sums[..., 0, 1:]
    cross = total[..., :, None] * mean[..., None, :]
    about = n * mean[..., :, None] * mean[..., None, :]
    return sums[..., 1:, 1:] - cross - np.swapaxes(cross, -1, -2) + about


def _ridge(sums: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """W(λ) = (X̃ᵀ X̃ + λ n I)⁻¹ X̃ᵀ ỹ [T, L, P, 3] for each penalty λ of PENALTIES, and the means
    (x̄, ȳ) [T, P + 3] that it is about; T sums [1 + P + 3, 1 + P + 3] of (1, x, y).
    Raises np.linalg.LinAlgError where a matrix is singular."""
    n = sums[..., 0, 0]
    mean = sums[..., 0, 1:] / n[..., None]
    centred = _centred(sums, mean)
    XtX, Xty = centred[..., :-3, :-3], centred[..., :-3, -3:]
    penalty = PENALTIES[:, None, None] * n[:, None, None, None] * np.eye(XtX.shape[-1])
    return np.linalg.solve(XtX[:, None] + penalty, Xty[:, None]), mean


def _errors(sums: np.ndarray, weights: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """E(λ) = ỹᵀ ỹ - 2 Wᵀ X̃ᵀ ỹ + Wᵀ X̃ᵀ X̃ W (its diagonal) [T, L, 3]: squared errors on other rows,
    of which `sums` are known, about the means that W = `weights` [T, L, P, 3] are about."""
    centred = _centred(sums, mean)
    XtX, Xty = centred[:, None, :-3, :-3], centred[:, None, :-3, -3:]
    yty = np.diagonal(centred[..., -3:, -3:], axis1=-2, axis2=-1)
    return yty[:, None] - 2.0 * (weights * Xty).sum(-2) + (weights * (XtX @ weights)).sum(-2)
