"""Choices by voyages that no fit has used: how firm the ridge is, how much a network may say."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shiplog.simulation.sensitivities import Simulator, losses
from shiplog.simulation.window_series import WindowSeries, series
from shiplog.training.physics import hybrid_training, output_error, regularisation
from shiplog.training.physics.cross_validation import CrossValidated, cross_validate, finite_mean
from shiplog.training.physics.output_error import Identified
from shiplog.training.physics.setup import Prepared
from shiplog.training.settings import random_streams
from shiplog.training.settings.run_config import Physics

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Chosen:
    """A setting, and the mean L on held-out windows that each one on offer had."""

    value: float
    judged: dict[float, np.ndarray]

    def as_json(self) -> dict:
        """With null for a setting that lets a window diverge."""
        mean = {
            f"{value:g}": float(loss.mean()) if np.isfinite(loss).all() else None
            for value, loss in self.judged.items()
        }
        return {"value": self.value, "held_out_loss": mean}


def physics(
    ready: Prepared,
    part: WindowSeries,
    factor: float = regularisation.PLAUSIBLE,
    begin: np.ndarray | None = None,
) -> Identified:
    """The physics by some of the windows, the ridge `factor` times as wide as is plausible."""
    start = ready.start
    return output_error.identify(
        ready.model, start.values, start.spread, part,
        bounds=(start.low, start.high), free=ready.free, factor=factor, begin=begin,
    )  # fmt: skip


def choose_ridge(ready: Prepared, settings: Physics) -> tuple[Chosen, Identified, list[str]]:
    """The ridge that suits the validation voyages, as a network stops early on them; the training
    windows identified with it; and what there is to say. The plausible one where there are none."""
    if ready.unseen is None:
        return Chosen(regularisation.PLAUSIBLE, {}), physics(ready, ready.data), []
    found = regularisation.ladder(
        lambda factor, begin: physics(ready, ready.data, factor, begin), settings.ridges
    )
    unseen = series(ready.unseen)
    judged = {f: losses(ready.model, one.values, unseen) for f, one in found.items()}
    for factor, loss in judged.items():
        log.info("ridge of %g spreads: L %s on validation windows", factor, finite_mean(loss))
    chosen = Chosen(regularisation.choose(judged), judged)
    return chosen, found[chosen.value], [_ridge_sentence(chosen)]


def _worth(loss: np.ndarray) -> tuple[int, float]:
    """(n diverged, mean L of the others): what is less is better, first by the windows [N] that
    diverge."""
    ends = np.isfinite(loss)
    return int((~ends).sum()), float(loss[ends].mean()) if ends.any() else 0.0


def _ridge_sentence(chosen: Chosen) -> str:
    mean = {factor: finite_mean(loss) for factor, loss in chosen.judged.items()}
    best = min(chosen.judged, key=lambda factor: _worth(chosen.judged[factor]))
    plain, value = mean[regularisation.PLAUSIBLE], chosen.value
    among = f"{len(chosen.judged[value])} validation windows"
    if value != regularisation.PLAUSIBLE:
        return (
            f"Ridge of {value:g} times the plausible spreads, chosen on {among}: L "
            f"{mean[value]} there, {plain} with the plausible ones."
        )
    if best == regularisation.PLAUSIBLE:
        return f"Ridge of the plausible spreads: L {plain} on {among}, the least."
    return (
        f"Ridge of the plausible spreads: L {plain} on {among}; {mean[best]} with "
        f"{best:g} times those is not better by more than chance."
    )


def choose_network(
    ready: Prepared,
    settings: Physics,
    refit: Callable[[WindowSeries], Identified],
    by_voyage: CrossValidated | None,
    seed: int,
) -> tuple[Chosen, Simulator, Identified, str, CrossValidated | None]:
    """Choose how much the network may say on held-out voyages, then fit it to all."""
    found = refit(ready.data)

    def fitted(
        part: WindowSeries, physics: Identified, strength: float
    ) -> tuple[Simulator, Identified]:
        model, done = hybrid_training.fit(
            ready.model, physics, part,
            width=settings.width, strength=strength,
            rng=np.random.default_rng(random_streams.number(seed, "residual")),
        )  # fmt: skip
        return Simulator(model, done.values, done.covariance), done

    judged: dict[float, list[np.ndarray]] = {s: [] for s in (0.0, *settings.strengths)}
    validated: dict[float, CrossValidated | None] = {0.0: by_voyage}
    if by_voyage is not None:
        judged[0.0].append(by_voyage.loss)
        for strength in settings.strengths:
            one = cross_validate(
                lambda part, s=strength: fitted(part, refit(part), s)[0],
                ready.data, ready.voyages, settings.folds,
            )  # fmt: skip
            assert one is not None
            validated[strength] = one
            judged[strength].append(one.loss)
    candidates = {}
    if ready.unseen is not None:
        unseen = series(ready.unseen)
        judged[0.0].append(losses(ready.model, found.values, unseen))
        for strength in settings.strengths:
            candidates[strength] = fitted(ready.data, found, strength)
            simulator, _ = candidates[strength]
            judged[strength].append(losses(simulator.model, simulator.theta, unseen))
    whole = {strength: np.concatenate(parts) for strength, parts in judged.items()}
    best = hybrid_training.choose(whole)
    for strength, loss in whole.items():
        log.info("network of strength %g: L %s on held-out windows", strength, finite_mean(loss))
    if best == 0.0:
        # A silent network: the physics as they are, in the hybrid's form.
        simulator, done = fitted(ready.data, found, 1e-9)
        sentence = "The network adds nothing that survives held-out windows: it is kept silent."
    else:
        simulator, done = candidates.get(best) or fitted(ready.data, found, best)
        sentence = (
            f"Network of strength {best:g}: L {finite_mean(whole[best])} on {len(whole[best])} "
            f"held-out windows, physics alone {finite_mean(whole[0.0])}."
        )
    return Chosen(best, whole), simulator, done, f"Seed {seed}: {sentence}", validated.get(best)
