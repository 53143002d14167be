"""A network, extended by causes that were tested on the ship's MMG, fitted to the same voyages."""

from __future__ import annotations

from dataclasses import replace

from shiplog.diagnosis import nominal_reference
from shiplog.diagnosis.evidence import TrialEvidence
from shiplog.diagnosis.result import Decision
from shiplog.diagnosis.trial_voyages import constants_for
from shiplog.models.extended import Extended
from shiplog.training.load_model import Run


class Own:
    """The run's own network on the segments of a trial that another model judges."""

    def __init__(self, run: Run, trial: TrialEvidence) -> None:
        self.judge = trial
        extension = run.extension
        self.numbers = run.extension_numbers()
        self.held = () if extension is None else extension.causes
        base, start, stand_in, values = run.base()
        setting = trial.reference.setting
        model = Extended(base, self.held, stand_in, values, constants_for(run, self.held, setting))
        self.reference = nominal_reference.assume(model, setting, start, trial.record, False, base)
        self._known: dict[tuple, tuple[TrialEvidence, Decision]] = {}

    def beside(self, decision: Decision) -> tuple[TrialEvidence, Decision]:
        """A trial of the network with what is named in it, and the decision there: its numbers
        are the judge's and stay, what else there is of points and hypotheses the network's."""
        key = tuple((n.cause.label, n.numbers.tobytes()) for n in decision.named)
        if key not in self._known:
            self._known[key] = self._beside(decision)
        trial, seen = self._known[key]
        return trial, replace(
            decision,
            point=seen.point,
            base=seen.base,
            noise_factor=seen.noise_factor,
            first=seen.first,
            nothing=seen.nothing,
        )

    def _beside(self, decision: Decision) -> tuple[TrialEvidence, Decision]:
        causes = (*self.held, *(n.cause for n in decision.named))
        trial = TrialEvidence(
            nominal_reference.beside(self.reference, causes),
            self.judge.record,
            [c.label for c in causes],
        )
        first = trial.begin(self.numbers)
        trial.leave_out(self.judge.weight == 0.0)
        nothing, _ = trial.scan(first, (), tuple(self.numbers))
        point, base = first, nothing
        if decision.named:
            numbers = {n.cause.label: n.numbers for n in decision.named}
            point = trial.at({**self.numbers, **numbers}, first, nothing.noise_factor)
            base, _ = trial.scan(point, (), trial.fixed)
        return trial, replace(
            decision,
            point=point,
            base=base,
            noise_factor=base.noise_factor,
            first=first,
            nothing=nothing,
        )
