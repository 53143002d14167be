"""Store and run to a trial: nominal campaign, testable causes, voyages in question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.decision_parts import ALL, Parts
from shiplog.diagnosis.nominal import nominal_cache, nominal_campaign, voyage_effects
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.trial.trial_voyages import model_of, setting_of
from shiplog.models import causes as catalogue
from shiplog.models.causes import Cause
from shiplog.training.runs.load_model import Run
from shiplog.voyages.rows.recording import Record


@dataclass(frozen=True)
class Setup:
    """A trial, and label → why a cause cannot be tested on it."""

    trial: Trial
    untested: Mapping[str, str]


def trial_of(
    run: Run, nominal: Record | None, recorded: Record, own: Sequence[Cause],
    lacking: str = "", numbers: Mapping[str, np.ndarray] | None = None,
    barred: Mapping[str, str] | None = None, parts: Parts = ALL,
    excluded: Mapping[str, str] | None = None,
) -> Setup:  # fmt: skip
    """For a network, the ship's MMG is tested, fitted to the network's training voyages.

    own       causes of the user's
    nominal   the voyages that the run was trained on, before these; None where there are none
    lacking   why the model cannot identify causes that change forces; empty where it can
    numbers   of causes found in these voyages, where no nominal campaign shows the discrepancy
    barred    name → why a cause is not tested, in addition to what ship and model lack
    excluded  label → how the sensors exclude a cause: voyages may differ in it as they do, and no
              hypothesis has it
    parts     of the decision, that act: a part that does not is taken from what was learned
    """
    setting = setting_of(run, nominal if nominal is not None else recorded, recorded)
    extension = run.extension
    held = {} if extension is None else {c.label: c for c in extension.causes}
    fitted = "" if nominal is not None or run.given else run.kind.family.name
    wanted = [c for c in (*catalogue.CATALOGUE, *own)
              if c.label not in held]  # fmt: skip
    chosen, untested = catalogue.testable(setting, wanted, fitted)
    if lacking:
        untested |= {c.label: lacking for c in chosen if c.kind != "sensor"}
        chosen = [c for c in chosen if c.kind == "sensor"]
    if run.fixed:
        untested |= {c.label: run.fixed for c in chosen if c.changes_ship}
        chosen = [c for c in chosen if not c.changes_ship]
    for cause in [c for c in chosen if c.name in (barred or {})]:
        untested[cause.label] = (barred or {})[cause.name]
        chosen.remove(cause)
    out = {c.label: (excluded or {})[c.label] for c in chosen if c.label in (excluded or {})}
    untested |= out
    every: list[Cause] = [*held.values(), *(c for c in chosen if c.label not in held)]
    model, start = model_of(run, every, setting)
    if nominal is None:
        inputs = None if run.judges_itself else run.base()[0]
        there = {**run.extension_numbers(), **(numbers or {})}
        campaign = nominal_campaign.assume_campaign(
            model, setting, start, recorded, run.given, inputs, there
        )
    else:
        # where the coefficients converge depends on the nominal voyages alone: it can be kept
        before = setting_of(run, nominal, nominal)
        testable, _ = catalogue.testable(before)
        plain, _ = model_of(run, testable, before)
        start = nominal_campaign.widen(plain, before, start)
        at = nominal_cache.converged(plain, before, start, nominal)
        found = nominal_cache.characteristics(plain, before, start, nominal, at)
        if not parts.voyage_effects:
            least = dict.fromkeys(found.deviation, voyage_effects.LEAST_DEVIATION)
            found = replace(found, deviation=least)
        if not parts.share_of_trial:
            found = replace(found, share=1.0)
        campaign = nominal_campaign.learn(model, setting, start, nominal, at, found)
    return Setup(Trial.build(campaign, recorded, tuple(held), excluded=tuple(out)), untested)
