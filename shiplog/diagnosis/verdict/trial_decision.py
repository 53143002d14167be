"""Voyages in question to a decision: set-up, search, refutation; for a given model twice.

Of a given model no nominal campaign shows the discrepancy. It is learned from the voyages in
question, where it absorbs the effects of causes. The causes that a first search names are therefore
taken out, the discrepancy is learned again, and a second search decides. It starts from nothing and
from these causes. What is then refuted stays out of the discrepancy: a third search would cost as
much as the first two.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.decision_parts import ALL, Parts
from shiplog.diagnosis.hypotheses import as_it_stands
from shiplog.diagnosis.hypotheses.search import Search
from shiplog.diagnosis.nominal import placebo
from shiplog.diagnosis.trial import setup, trial_voyages
from shiplog.diagnosis.trial.fitted import Point
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict import refutation
from shiplog.diagnosis.verdict.decide import decide
from shiplog.diagnosis.verdict.held_out import HeldOut
from shiplog.diagnosis.verdict.result import Decision
from shiplog.exceptions import listed
from shiplog.machine import memory
from shiplog.models.causes import Cause
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.error_reduction import Gain
from shiplog.training.runs.load_model import Run
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.windows.windows import Windows

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Decided:
    """What was decided of a trial, and its model as it stands, linearised at `point`.

    untested   label → why a cause cannot be tested
    judge      windows that decisions are judged on; None where there are none
    gain       of what is named, on voyages held out
    refuted    name → why held-out voyages refute it
    """

    trial: Trial
    untested: Mapping[str, str]
    point: Point
    judge: HeldOut | None
    decision: Decision
    gain: Gain | None
    refuted: Mapping[str, str]


def decide_trial(
    run: Run, nominal: Record | None, recorded: Record, cut: Windows | None,
    causes: Sequence[Cause], lacking: str, reach: Callable[[str], None] = lambda stage: None,
    barred: Mapping[str, str] | None = None, before: Windows | None = None,
    read_as: Profile | None = None, parts: Parts = ALL,
    share: Callable[[Trial], Trial] = lambda trial: trial,
    excluded: Mapping[str, str] | None = None,
) -> Decided:  # fmt: skip
    """As `setup.trial_of`; `cut` are the voyages' windows, `before` those of the nominal voyages,
    `read_as` the voyages' own profile, and `reach` is called at each stage. `share` gives a trial's
    voyages to others, and returns the same trial."""

    def searched(numbers: Mapping[str, np.ndarray] | None = None) -> _Searched:
        made = setup.trial_of(
            run, nominal, recorded, causes, lacking, numbers, barred=barred, parts=parts,
            excluded=excluded,
        )  # fmt: skip
        as_nominal = cut is not None and not judge_of(made.trial).worse_than_nominal
        made = replace(made, trial=share(replace(made.trial, as_nominal=as_nominal)))
        return _searched(run, made, reach, parts, numbers, nominal is None and run.given)

    def judge_of(trial: Trial) -> HeldOut:
        assert cut is not None
        simulator = trial_voyages.simulator(run, trial)
        return HeldOut(cut, simulator, trial, None, before, read_as)

    found = searched()
    if nominal is None and run.given and (numbers := found.numbers):
        del found  # its products, before those of the next one
        found = searched(numbers)
    trial = found.trial
    judge = None if cut is None else judge_of(trial)
    reach("held-out voyages")
    refutes = judge if parts.refutation else None
    decision, _, gain, refuted = refutation.judge(found.search, refutes)
    if refutes is None and judge is not None and decision.named:
        gain = judge.gain(decision)
    untested, point = found.untested, found.point
    del found  # the other hypotheses, before the pictures
    trial.cache.release()
    return Decided(trial, untested, point, judge, decision, gain, refuted)


@dataclass(frozen=True)
class _Searched:
    """A trial with the hypotheses that were weighed; `untested` and `point` as in `Decided`."""

    trial: Trial
    untested: Mapping[str, str]
    point: Point
    search: Search

    @property
    def numbers(self) -> dict[str, np.ndarray]:
        """Label → numbers of the causes that would be named, whatever held-out voyages say."""
        decision, _ = decide(self.search)
        return {
            one.cause.label: decision.fit.estimate.numbers[one.cause.label]
            for one in decision.named
        }


def _searched(
    run: Run, made: setup.Setup, reach: Callable[[str], None], parts: Parts,
    likely: Mapping[str, np.ndarray] | None, nearer: bool,
) -> _Searched:  # fmt: skip
    memory.give_back()  # what the nominal campaign took
    trial, point = as_it_stands.begin(made.trial, run.extension_numbers())
    log.info(
        "%s against %s: %d segments of %d s, of which a share of %.2f counts",
        listed(trial.record.names, most=4), run.name, len(trial.rows), trial.grid.seconds,
        trial.reference.counts,
    )  # fmt: skip
    reach("hypotheses")
    search = Search(
        trial, point, placebo.placebos(trial.campaign), likely, parts=parts, nearer=nearer
    )
    search.run()
    return _Searched(trial, made.untested, point, search)
