"""Errors on voyages that the fit has not used: only a gain on these counts.

L_w = L_w(θ̂_{-k}),   k the fold of window w's voyage, θ̂_{-k} fitted with ω_w = 0 in fold k
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from shiplog.simulation.scoring import window_loss
from shiplog.simulation.sensitivities import Simulator, rollout, spread
from shiplog.simulation.window_series import WindowSeries, pick

FOLDS = 5
WORKERS = 2  # fits at a time; compiled rollouts leave Python's lock


@dataclass(frozen=True)
class CrossValidated:
    """Every window rolled out by a fit that knew nothing of its group.

    groups   [N]        which voyage (or day) a window is of
    states   [N, I, 6]  simulated
    spread   [N, I, 6]  the fit's own uncertainty
    loss     [N]        L of each window
    """

    groups: np.ndarray
    states: np.ndarray
    spread: np.ndarray
    loss: np.ndarray


def folds(groups: Sequence[str], count: int = FOLDS) -> list[np.ndarray]:
    """Masks [N] of the held-out windows: whole groups, dealt in turn in the order of windows.

    Dealing in turn puts neighbours, often of one manoeuvre, into different folds. One fold a
    group where there are fewer groups than `count`; none where there is but one.
    """
    order = list(dict.fromkeys(groups))
    if len(order) < 2:
        return []
    of = {group: i % min(count, len(order)) for i, group in enumerate(order)}
    number = np.array([of[group] for group in groups])
    return [number == k for k in range(min(count, len(order)))]


def cross_validate(
    fit: Callable[[WindowSeries], Simulator],
    data: WindowSeries,
    groups: Sequence[str],
    count: int = FOLDS,
) -> CrossValidated | None:
    """L_w(θ̂_{-k}) of each window w in fold k: fit without each fold and roll it out there; None
    where there is nothing to hold out.

    fit   gets `data` with the weights of the held-out windows at zero
    """
    parts = folds(groups, count) if count > 1 else []
    if not parts:
        return None

    def one(held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = fit(data._replace(weight=np.where(held, 0.0, data.weight)))
        states = rollout(found.model, found.theta, data)
        own = np.zeros_like(states)
        own[held] = spread(found.model, found.theta, found.covariance, pick(data, held))
        return states, own

    with ThreadPoolExecutor(WORKERS) as pool:
        results = list(pool.map(one, parts))
    states, own = np.empty_like(data.measured), np.zeros_like(data.measured)
    for held, (simulated, unsure) in zip(parts, results, strict=True):
        states[held], own[held] = simulated[held], unsure[held]
    loss = window_loss(states - data.measured, data.dt)
    return CrossValidated(np.array(list(groups)), states, own, loss)


def finite_mean(loss: np.ndarray) -> str:
    """Mean L of windows [N] for a sentence, without those that diverge, which are counted."""
    ends = np.isfinite(loss)
    if not ends.any():
        return "without an end in any window"
    lost = int((~ends).sum())
    return f"{loss[ends].mean():.0f}" + (f" ({lost} more diverge)" if lost else "")


def as_good(judged: dict[float, np.ndarray]) -> list[float]:
    """Which settings are not worse than the best by more than chance; none where fewer than two
    windows can be judged.

    judged   setting → L of each held-out window [N], infinite where it diverged

    One standard error (Breiman et al. 1984) of paired windows: with d_w = L_w - L_w(best),

        mean(d) ≤ sd(d)/√N

    A setting with which more windows diverge is not chosen; windows that diverge with every setting
    are left out.
    """
    lost = {one: int((~np.isfinite(loss)).sum()) for one, loss in judged.items()}
    able = [one for one in judged if lost[one] == min(lost.values())]
    kept = np.isfinite(np.stack([judged[one] for one in able])).all(0)
    if kept.sum() < 2:
        return []
    losses = {one: judged[one][kept] for one in able}
    best = min(losses, key=lambda one: float(losses[one].mean()))
    worse = {one: loss - losses[best] for one, loss in losses.items()}
    return [
        one for one, more in worse.items()
        if more.mean() <= more.std(ddof=1) / np.sqrt(len(more))
    ]  # fmt: skip
