"""Two actuators of a kind in each other's place: what no sensor shows, and a model of both may.

With the record's columns of the two exchanged, u' = P u, and no number fitted, the log Bayes factor
of the exchange over the record as it is read is

    ln p(y | u', nominal) - ln p(y | u, nominal)

A remainder of unknown kind that is less probable than that is no effect outside the catalogue.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shiplog.diagnosis.hypotheses import as_it_stands, evidence
from shiplog.diagnosis.trial.fitted import Point
from shiplog.diagnosis.trial.trial import Numbers, Trial
from shiplog.diagnosis.verdict.result import Decision
from shiplog.exceptions import listed
from shiplog.ship_profile.profile import Actuator, Profile
from shiplog.voyages.contradictions import twins

LEAST_NATS = 10.0  # an exchange is rarer than one in a thousand, and the noise may differ
CONTROLS = "controls"  # the family of what depends on the actuators


def explains(
    trial: Trial, point: Point, decision: Decision, numbers: Numbers, read_as: Profile
) -> str:
    """Why no cause is named, where two actuators exchanged explain more of a trial than what is
    unknown of it does; else empty.

    point     of the model as it stands   numbers   of the causes that the model has already
    """
    structure = decision.structure
    if structure is None or structure.family != CONTROLS:
        return ""
    for pair in twins.pairs(read_as):
        found = gain(trial, point, numbers, pair)
        if found > max(structure.evidence, LEAST_NATS):
            one, other = (actuator.name for actuator in pair)
            topics = listed(f"{a.name} on {a.topic}" for a in pair)
            return (
                f"These voyages are {found:.0f} nats more probable with {one} and {other} "
                f"exchanged, {found - structure.evidence:.0f} more than with a change of unknown "
                f"kind (look at `topic` and `field` of the two [[actuators]]: {topics})"
            )
    return ""


def gain(trial: Trial, point: Point, numbers: Numbers, pair: tuple[Actuator, Actuator]) -> float:
    """Log Bayes factor [nats] of the two exchanged; minus infinity where the model then diverges
    on segments on which it does not as they are."""
    record = trial.record
    names = [actuator.name for actuator in record.profile.actuators]
    columns = [names.index(actuator.name) for actuator in pair]
    actuator = record.actuator.copy()
    actuator[:, columns] = record.actuator[:, columns[::-1]]
    as_read, _ = evidence.scan(trial, point, (), trial.fixed)
    other = Trial.build(trial.campaign, replace(record, actuator=actuator), trial.fixed)
    try:
        other, at = as_it_stands.begin(other, numbers)
    except np.linalg.LinAlgError:
        return -np.inf
    if at.linear.lost[trial.weight > 0.0].any():
        return -np.inf
    other = replace(other, weight=trial.weight)  # of the same segments
    exchanged, _ = evidence.scan(other, at, (), other.fixed)
    return exchanged.evidence - as_read.evidence
