"""Voyages in question to a decision: set-up, search, refutation; for a given model more than once.

Of a given model no nominal campaign shows the discrepancy. It is learned from the voyages in
question, where it absorbs the effects of causes; so it is learned again without the effects of
the named causes, until the same causes are named. Each further search starts from nothing and from
these causes.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis import evidence, placebo, refutation, setup, trial_voyages
from shiplog.diagnosis.fitted import Point
from shiplog.diagnosis.held_out import HeldOut
from shiplog.diagnosis.result import Decision
from shiplog.diagnosis.search import Search
from shiplog.diagnosis.trial import Trial
from shiplog.exceptions import listed
from shiplog.models.causes import Cause
from shiplog.simulation.error_reduction import Gain
from shiplog.training.load_model import Run
from shiplog.voyages.recording import Record
from shiplog.voyages.windows import Windows

MOST_ROUNDS = 3  # of learning a given model's discrepancy again

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


def decided(
    run: Run, nominal: Record | None, recorded: Record, cut: Windows | None,
    causes: Sequence[Cause], lacking: str, reach: Callable[[str], None] = lambda stage: None,
) -> Decided:  # fmt: skip
    """As `setup.trial_of`; `cut` are the voyages' windows, and `reach` is called at each stage."""

    def once(numbers: Mapping[str, np.ndarray] | None = None) -> Decided:
        made = setup.trial_of(run, nominal, recorded, causes, lacking, numbers)
        return _once(run, made, cut, reach, numbers)

    done = once()
    for _ in range(MOST_ROUNDS if nominal is None and run.given else 0):
        names = _names(done)
        if not names:
            break
        before, done = names, once({n: done.decision.fit.found.numbers[n] for n in names})
        if set(before) == set(_names(done)):
            break
    return done


def _names(done: Decided) -> list[str]:
    return [one.cause.label for one in done.decision.named]


def _once(
    run: Run, made: setup.Setup, cut: Windows | None, reach: Callable[[str], None],
    likely: Mapping[str, np.ndarray] | None,
) -> Decided:  # fmt: skip
    trial, point = evidence.begin(made.trial, run.extension_numbers())
    log.info(
        "%s against %s: %d segments of %d s, of which a share of %.2f counts",
        listed(trial.record.names, most=4), run.name, len(trial.rows), trial.grid.seconds,
        trial.reference.counts,
    )  # fmt: skip
    judge = None if cut is None else HeldOut(cut, trial_voyages.simulator(run, trial), trial)
    reach("hypotheses")
    search = Search(trial, point, placebo.placebos(trial.campaign), likely=likely)
    search.run()
    reach("held-out voyages")
    decision, _, gain, refuted = refutation.judged(search, judge)
    return Decided(trial, made.untested, point, judge, decision, gain, refuted)
