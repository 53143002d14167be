"""A network, extended by causes that were tested on the ship's MMG, fitted to the same voyages."""

from __future__ import annotations

from dataclasses import replace

from shiplog.diagnosis.hypotheses import as_it_stands, evidence
from shiplog.diagnosis.noise.remainder import RAISED, Remainder
from shiplog.diagnosis.nominal import nominal_campaign, nominal_reference
from shiplog.diagnosis.trial.fitted import Fit
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.trial.trial_voyages import constants_for
from shiplog.diagnosis.verdict.result import Decision
from shiplog.models.extended import Extended
from shiplog.training.runs.load_model import Run

ANY_NOISE = Remainder(RAISED)  # a network's process noise is its own, whatever the judge's is


class Own:
    """The run's own network on the segments of a trial that another model judges."""

    def __init__(self, run: Run, trial: Trial) -> None:
        self.judge = trial
        extension = run.extension
        self.numbers = run.extension_numbers()
        self.held = () if extension is None else extension.causes
        base, start, stand_in, values = run.base()
        setting = trial.reference.setting
        model = Extended(base, self.held, stand_in, values, constants_for(run, self.held, setting))
        self.reference = nominal_reference.assume(model, setting, start, trial.record, False, base)
        self._known: dict[tuple, tuple[Trial, Fit, Fit]] = {}

    def extended_by(self, decision: Decision) -> tuple[Trial, Decision]:
        """A trial of the network with what is named in it, and the decision there: its numbers
        are the judge's and stay, what else there is of points and hypotheses the network's."""
        key = tuple((n.cause.label, n.numbers.tobytes()) for n in decision.named)
        if key not in self._known:
            self._known[key] = self._extended_by(decision)
        trial, fit, nothing = self._known[key]
        return trial, replace(decision, fit=fit, nothing=nothing)

    def _extended_by(self, decision: Decision) -> tuple[Trial, Fit, Fit]:
        """The trial, and its fits with what is named and with nothing."""
        causes = (*self.held, *(n.cause for n in decision.named))
        campaign = nominal_campaign.uniform_campaign(
            nominal_reference.with_causes(self.reference, causes)
        )
        trial = Trial.build(campaign, self.judge.record, [c.label for c in causes])
        trial, first = as_it_stands.begin(trial, self.numbers)
        trial = trial.leave_out(self.judge.weight == 0.0)

        def fitted(point, included) -> Fit:
            found, _ = evidence.scan(trial, point, (), included, remainder=ANY_NOISE)
            return Fit(point, found, ANY_NOISE)

        nothing = fitted(first, tuple(self.numbers))
        if not decision.named:
            return trial, nothing, nothing
        numbers = {n.cause.label: n.numbers for n in decision.named}
        both = {**self.numbers, **numbers}
        point = trial.linearise(both, first, nothing.estimate.noise_factor)
        return trial, fitted(point, trial.fixed), nothing
