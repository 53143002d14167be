"""Causes by what they take off whole windows: for a model that somebody gave and nobody fitted.

What such a model gets wrong everywhere has no usual size, since no campaign shows what is usual;
beside it the evidence of short segments prefers whatever bends most. So its causes are fitted to
the windows' L itself, and chosen by L on voyages that were left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares

from shiplog.causes import Cause, Setting
from shiplog.channels import VELOCITY_IN_STATE, VELOCITY_WEIGHTS
from shiplog.extend import ExtendedSimulator, as_record
from shiplog.record import Record
from shiplog.sensitivity import Series, rollout, series
from shiplog.windows import Windows

MOST = 6  # numbers of all chosen causes together
FOLDS = 8  # of whole voyages
FAR = 1e3  # of a residual: a rollout beyond has left the pond
JUDGED = 3  # candidates, best first on all windows, that are judged on voyages left out
WORTH = 0.1  # of L on voyages left out, that each cause must take off
LIKELY = 0.5  # share of the draws of voyages in which a cause must be the choice
RESAMPLED = 2000  # times that voyages are drawn again


@dataclass(frozen=True)
class Search:
    """Windows, and a model with room for every cause; numbers are in units of realistic sizes.

    at      label → its places in the simulator's numbers
    size    [P + Q]  realistic size of each; bounds [P + Q] in those units
    """

    cut: Windows
    data: Series
    recorded: Record
    simulator: ExtendedSimulator
    at: dict[str, np.ndarray]
    size: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def residual(self, labels: Sequence[str], x: np.ndarray) -> np.ndarray:
        """[N, I, 3] whose squares sum to L."""
        theta = self.simulator.theta.copy()
        where = self.where(labels)
        theta[where] = x * self.size[where]
        error = self.states(labels, theta) - self.cut.state.double().numpy()
        steps = np.sqrt(self.data.steps)[..., None]
        weighed = error[..., list(VELOCITY_IN_STATE)] * np.array(VELOCITY_WEIGHTS) * steps
        return np.clip(np.nan_to_num(weighed, nan=FAR), -FAR, FAR)

    def states(self, labels: Sequence[str], theta: np.ndarray) -> np.ndarray:
        """`ExtendedSimulator.states`, without asking the causes that are not there."""
        read = [c for c in self.simulator.model.causes if c.label in labels and c.reads]
        was = self.recorded
        for cause in read:
            was = cause.read(was, theta[self.at[cause.label]])
        shape = self.cut.state.shape
        driven = np.concatenate((was.actuator, was.share[:, None]), 1)
        data = self.data._replace(
            measured=was.state.reshape(shape),
            actuator=driven.reshape(*shape[:2], -1),
            wind=was.true_wind.reshape(*shape[:2], 2),
        )
        with np.errstate(all="ignore"):
            shown = replace(was, state=rollout(self.simulator.model, theta, data).reshape(-1, 6))
            for cause in reversed(read):
                shown = cause.read(shown, cause.inverse(theta[self.at[cause.label]]))
        return shown.state.reshape(shape)

    def where(self, labels: Sequence[str]) -> np.ndarray:
        return np.concatenate([np.zeros(0, int), *(self.at[label] for label in labels)])

    def fit(self, labels: Sequence[str], start: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Least squares of L over some windows [N] bool, barely held to zero."""
        where = self.where(labels)
        low, high = self.low[where], self.high[where]

        def error(x: np.ndarray) -> np.ndarray:
            return np.concatenate((self.residual(labels, x)[rows].ravel(), 0.3 * x))

        begin = np.clip(start, low + 1e-6, high - 1e-6)
        return least_squares(
            error, begin, bounds=(low, high), diff_step=0.02, max_nfev=12, xtol=1e-3, ftol=1e-4
        ).x

    def loss(self, labels: Sequence[str], x: np.ndarray) -> np.ndarray:
        """L of each window [N]."""
        return (self.residual(labels, x) ** 2).sum((1, 2))

    def held_out(self, labels: Sequence[str], x: np.ndarray) -> np.ndarray:
        """L of each window [N], with numbers fitted without its voyage's fold."""
        loss = np.empty(len(self.cut))
        for out in self.folds():
            loss[out] = self.loss(labels, self.fit(labels, x, ~out))[out]
        return loss

    def folds(self) -> list[np.ndarray]:
        """[N] bool each: windows of voyages that are left out together."""
        voyages = self.cut.plan["voyage"].to_list()
        known = list(dict.fromkeys(voyages))
        fold = np.array([known.index(v) % FOLDS for v in voyages])
        return [fold == one for one in range(min(FOLDS, len(known)))]


@dataclass(frozen=True)
class Selected:
    """Causes in the order in which they were chosen.

    numbers      label → [count], SI; covariance likewise, by leaving voyages out (jackknife)
    probability  label → share of the draws of voyages in which it was worth it, and more than
                 whatever was not chosen at all
    without      voyage → label → numbers fitted without that voyage's fold
    refused      label → why it was not chosen
    """

    numbers: Mapping[str, np.ndarray] = field(default_factory=dict)
    covariance: Mapping[str, np.ndarray] = field(default_factory=dict)
    probability: Mapping[str, float] = field(default_factory=dict)
    without: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)


def search_of(
    before: ExtendedSimulator, causes: Sequence[Cause], setting: Setting, cut: Windows,
    constants: Mapping[str, np.ndarray] | None = None,
) -> Search:  # fmt: skip
    """Room for causes beside the model as it is. Causes of more than MOST numbers are left out."""
    causes = [c for c in causes if c.count <= MOST]
    count = len(before.theta)
    nothing = {c.label: np.zeros(c.count) for c in causes}
    simulator = before.with_causes(causes, nothing, None, constants)
    at, first = {}, count
    for cause in causes:
        at[cause.label] = np.arange(first, first + cause.count)
        first += cause.count
    sizes = np.concatenate([np.ones(count), *(c.sizes(setting) for c in causes)])
    bounds = [c.bounds(setting) for c in causes]
    free = np.full(count, np.inf)
    low = np.concatenate((-free, *(b[0] for b in bounds))) / sizes
    high = np.concatenate((free, *(b[1] for b in bounds))) / sizes
    recorded = as_record(cut, before.profile, before.shares, before.lengths)
    return Search(cut, series(cut), recorded, simulator, at, sizes, low, high)


def select(search: Search) -> Selected:
    """Forward, by L on voyages left out."""
    every = np.ones(len(search.cut), dtype=bool)
    chosen: tuple[str, ...] = ()
    start = np.zeros(0)
    held = search.loss((), start)
    steps = []  # L before, and with each candidate
    refused: dict[str, str] = {}
    while True:
        room = MOST - len(start)
        tried = {}
        for label, at in search.at.items():
            if label not in chosen and len(at) <= room:
                begin = np.concatenate((start, np.zeros(len(at))))
                x = search.fit((*chosen, label), begin, every)
                tried[label] = (search.loss((*chosen, label), x).mean(), x)
        judged = {
            label: (search.held_out((*chosen, label), tried[label][1]), tried[label][1])
            for label in sorted(tried, key=lambda n: tried[n][0])[:JUDGED]
        }
        if not judged:
            break
        best = min(judged, key=lambda n: judged[n][0].mean())
        losses = {label: loss for label, (loss, _) in judged.items()}
        for label, loss in losses.items():
            less = 1.0 - loss.mean() / held.mean()
            beside = f" beside {' and '.join(chosen)}" if chosen else ""
            refused[label] = f"takes {less:.0%} off voyages left out{beside}"
        if _sure(search, held, losses, best, chosen) < LIKELY:
            break
        steps.append((held, losses, best))
        refused.pop(best)
        chosen, held, start = (*chosen, best), *judged[best]
    if not chosen:
        return Selected(refused=refused)
    probability = {
        best: _sure(search, before, losses, best, chosen) for before, losses, best in steps
    }
    return _selected(search, chosen, start, probability, refused)


def _sure(
    search: Search, held: np.ndarray, losses: Mapping[str, np.ndarray], best: str,
    chosen: Sequence[str],
) -> float:  # fmt: skip
    """Share of the draws of voyages in which `best` is worth it, and no other one is worth more,
    but for those that are chosen too."""
    voyages = np.array(search.cut.plan["voyage"].to_list())
    names = np.unique(voyages)
    drawn = np.random.default_rng(0).integers(0, len(names), (RESAMPLED, len(names)))

    def total(loss: np.ndarray) -> np.ndarray:
        return np.array([loss[voyages == v].sum() for v in names])[drawn].sum(1)

    own = total(losses[best])
    won = own < (1.0 - WORTH) * total(held)
    for name, loss in losses.items():
        if name != best and name not in chosen:
            won &= own < total(loss)
    return float(won.mean())


def _selected(search, chosen, start, probability, refused) -> Selected:
    unit = search.size[search.where(chosen)]
    folds = search.folds()
    parts = [search.fit(chosen, start, ~out) * unit for out in folds]
    middle = np.mean(parts, axis=0)
    spread = np.array(parts) - middle
    covariance = (len(parts) - 1.0) / len(parts) * spread.T @ spread
    at, places = 0, {}
    for label in chosen:
        places[label] = slice(at, at + len(search.at[label]))
        at += len(search.at[label])
    voyages = np.array(search.cut.plan["voyage"].to_list())
    return Selected(
        {n: (start * unit)[where] for n, where in places.items()},
        {n: covariance[where, where] for n, where in places.items()},
        probability,
        {
            str(v): {n: part[where] for n, where in places.items()}
            for out, part in zip(folds, parts, strict=True)
            for v in np.unique(voyages[out])
        },
        refused,
    )
