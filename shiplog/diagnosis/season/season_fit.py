"""The hypothesis whose causes are followed over a season."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses.evaluate import evaluate
from shiplog.diagnosis.hypotheses.hypothesis import name_of
from shiplog.diagnosis.noise.remainder import RAISED, Remainder
from shiplog.diagnosis.season.trends import Trend
from shiplog.diagnosis.trial.fitted import Fit, Point, Start
from shiplog.diagnosis.trial.trial import Trial
from shiplog.exceptions import ShiplogError, UsageError, listed
from shiplog.voyages.rows.recording import Record


def labels_of(trial: Trial, wanted: Sequence[str]) -> tuple[str, ...]:
    """Labels of causes by their names, or by labels where a name has several. Raises UsageError."""
    known = [c.label for c in trial.reference.model.causes if c.label not in trial.fixed]
    found = []
    for one in wanted:
        own = [label for label in known if one in (label, name_of(label))]
        if not own:
            raise UsageError(
                f"No cause {one!r} can be tested here. There are: {listed(known)}.",
                hint="`shiplog diagnose` says why the others cannot.",
            )
        exact = [label for label in own if label == one]
        if len(own) > 1 and not exact:
            raise UsageError(
                f"{one!r} may be each of {listed(own)}.", hint=f"name one, such as {own[0]}."
            )
        found.append((exact or own)[0])
    return tuple(dict.fromkeys(found))


def fitted(trial: Trial, point: Point, labels: Sequence[str]) -> Fit:
    """These causes with process noise that may be raised, from zero. Raises ShiplogError where the
    fit diverges."""
    by = {c.label: c for c in trial.reference.model.causes}
    numbers = dict(point.numbers) | {label: np.zeros(by[label].count) for label in labels}
    fit = evaluate(trial, tuple(numbers), Remainder(RAISED), Start(numbers, point.path))
    if fit.diverged or fit.estimate.covariance is None:
        raise ShiplogError(
            f"{listed(labels)} could not be fitted to these voyages: the model diverges.",
            hint="follow fewer causes, or see what `shiplog diagnose` names.",
        )
    return fit


def water_of(found: Sequence[Trend]) -> dict[str, tuple[float, float]]:
    """Voyage → velocity of the water along x₀ and y₀ [m/s], where a current is a cause."""
    water = {}
    for one in (v for trend in found if trend.label == "current" for v in trend.voyages):
        speed, towards = one.pooled["speed"].value, math.radians(one.pooled["direction"].value)
        water[one.voyage] = (speed * math.cos(towards), speed * math.sin(towards))
    return water


def refuse_little(recorded: Record, enough: bool) -> None:
    """Raises ShiplogError for voyages that are too short for a verdict, too."""
    if not enough:
        raise ShiplogError(
            f"Too little to follow a cause: {recorded.seconds:.0f} s can be used, and "
            f"{thresholds.LEAST_RECORD_S:.0f} s are needed.",
            hint="name more voyages with --voyages.",
        )
