"""Voyages of a season fitted by themselves, where they are far from what all have in common.

The likelihood (21) is linear about the numbers x₀ with which the season was fitted, one size for
all voyages. A voyage whose size is FAR standard deviations from there has another likelihood: it is
fitted by itself, and linearised where that converges (the trial of its segments alone, `evaluate`).
A process noise that was estimated with one size for all is then too large, too. So each voyage has
a λ of its own, at the maximum of its evidence, as soon as one is far.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.hypotheses import evidence
from shiplog.diagnosis.hypotheses.evaluate import evaluate
from shiplog.diagnosis.onset import stretch_information
from shiplog.diagnosis.onset.stretch_information import Piece, Stretches
from shiplog.diagnosis.season.pooling import LEVEL_SPREAD
from shiplog.diagnosis.trial.cache import Cache
from shiplog.diagnosis.trial.fitted import Fit, Point, Start
from shiplog.diagnosis.trial.trial import Trial

log = logging.getLogger(__name__)

# Standard deviations between a voyage's size and where it was linearised, from which it is fitted
# by itself. On the sample logs, with a current of 0.10 m/s and a clock that is 0.34 s late in one
# season of three, voyages are 5 to 20 away, and the sizes come out as 0.09 m/s and 0.2 s.
FAR = 4.0


@dataclass(frozen=True)
class Linearised:
    """Where each voyage of a season was linearised.

    stood    [V, q] numbers there, in units
    alone    [V] bool: fitted by itself
    pieces   [V] of one voyage each, in order; none where all stand where the season's fit does
    """

    stood: np.ndarray
    alone: np.ndarray
    pieces: tuple[Piece, ...] = ()

    def far(self, of: Stretches) -> np.ndarray:
        """[V] bool: max |x̂ - x₀|/sd(x) > FAR over the numbers, each voyage by itself."""
        mean, deviation = by_themselves(of)
        return (np.abs(mean - self.stood) / deviation).max(-1) > FAR


def by_themselves(of: Stretches) -> tuple[np.ndarray, np.ndarray]:
    """x̂ and sd(x) [V, q] of sizes x ~ N(0, s² I), s LEVEL_SPREAD: (M + s⁻² I)⁻¹ y."""
    A = of.M.reshape(of.y.size, -1) + LEVEL_SPREAD**-2.0 * np.eye(of.y.size)
    covariance = np.linalg.inv(A)
    mean = (covariance @ of.y.ravel()).reshape(of.y.shape)
    return mean, np.sqrt(np.diagonal(covariance)).reshape(of.y.shape)


def first_of_voyages(trial: Trial) -> np.ndarray:
    """[V] the first segment of each voyage: stretches that are whole voyages."""
    return np.flatnonzero(np.diff(trial.record.voyage[trial.rows], prepend=-1))


def common(trial: Trial, fit: Fit, labels: Sequence[str]) -> Linearised:
    """Every voyage where the fit stands."""
    at = in_units(trial, labels, fit.point.numbers)
    voyages = len(first_of_voyages(trial))
    return Linearised(np.tile(at, (voyages, 1)), np.zeros(voyages, bool))


def information_of(trial: Trial, fit: Fit, labels: Sequence[str], of: Linearised) -> Stretches:
    """y and M of (17), a stretch a voyage."""
    return stretch_information.of_causes(trial, fit, labels, first_of_voyages(trial), of.pieces)


def fitted_alone(
    trial: Trial, fit: Fit, labels: Sequence[str], of: Linearised, information: Stretches
) -> Linearised:  # fmt: skip
    """The voyages that are far fitted by themselves, from their linear sizes on; the others where
    they are, with a λ of their own. A voyage on which the model diverges stays.

    information   of each voyage, where it was linearised so far
    """
    which, (sizes, _) = of.far(information), by_themselves(information)
    remainder = stretch_information.without_time(fit.remainder)
    pieces, stood, alone = [], of.stood.copy(), of.alone.copy()
    for v, piece in enumerate(_one_each(trial, fit)):
        if which[v]:
            numbers = _bounded(trial, fit.point.numbers, labels, sizes[v])
            start = Start(numbers, piece.point, fit.estimate.noise_factor)
            own = evaluate(piece.trial, fit.included, remainder, start)
            if not own.diverged:
                stood[v], alone[v] = in_units(trial, labels, own.point.numbers), True
                pieces.append(replace(piece, point=own.point, noise=own.estimate.noise_factor))
                continue
            log.info("%s diverges when it is fitted by itself", _name(trial, piece))
        found, _ = evidence.scan(
            piece.trial, piece.point, (), fit.included, fit.estimate.noise_factor, remainder
        )
        pieces.append(replace(piece, noise=found.noise_factor))
    return Linearised(stood, alone, tuple(pieces))


def in_units(
    trial: Trial, labels: Sequence[str], numbers: Mapping[str, np.ndarray]
) -> np.ndarray:  # fmt: skip
    """Numbers of some causes, one after another."""
    return stretch_information.numbers_at(numbers, trial.reference.columns, labels)


def _one_each(trial: Trial, fit: Fit) -> list[Piece]:
    """A voyage each, linearised where the fit is."""
    voyage = trial.record.voyage[trial.rows]
    return [
        Piece(_of_rows(trial, rows), _picked(fit.point, rows), rows, fit.estimate.noise_factor)
        for rows in (np.flatnonzero(voyage == v) for v in dict.fromkeys(voyage.tolist()))
    ]


def _of_rows(trial: Trial, rows: np.ndarray) -> Trial:
    """The trial of some of its segments, whole parts of it, with products of its own."""
    place = np.full(len(trial.rows), -1)
    place[rows] = np.arange(len(rows))
    kept = [i for i, part in enumerate(trial.parts) if place[part[0]] >= 0]
    return replace(
        trial, rows=trial.rows[rows], parts=tuple(place[trial.parts[i]] for i in kept),
        voyage=trial.voyage[kept], weight=trial.weight[rows], cache=Cache(),
        first=None if trial.first is None else _picked(trial.first, rows),
    )  # fmt: skip


def _picked(point: Point, rows: np.ndarray) -> Point:
    linear = point.linear.pick(rows)
    return Point(point.numbers, linear.path, linear)


def _bounded(
    trial: Trial, numbers: Mapping[str, np.ndarray], labels: Sequence[str], sizes: np.ndarray
) -> dict[str, np.ndarray]:
    """The numbers with those of the causes in question, within what they may be, SI."""
    columns, at, found = trial.reference.columns, 0, dict(numbers)
    for label in labels:
        unit = columns.unit[columns.indices[label]]
        found[label] = np.clip(sizes[at : at + len(unit)] * unit, *trial.bounds(label))
        at += len(unit)
    return dict(trial.clipped(found))


def _name(trial: Trial, piece: Piece) -> str:
    return trial.record.names[trial.record.voyage[piece.trial.rows[0]]]
