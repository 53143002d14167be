"""A model and the voyages of a season: each cause's size voyage by voyage."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from threadpoolctl import threadpool_limits

from shiplog.commands.bars import reach, staged
from shiplog.diagnosis.hypotheses import as_it_stands
from shiplog.diagnosis.season import season_fit, speed_loss, trends
from shiplog.diagnosis.trial import setup, trial_voyages
from shiplog.diagnosis.trial.fitted import Fit
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict import trial_decision
from shiplog.models.causes import Cause, user
from shiplog.report.diagnosis import answer
from shiplog.report.page import html
from shiplog.report.result import Shown
from shiplog.report.season import drawing, page
from shiplog.report.season.season import NO_CAUSE, UNDATED, Season
from shiplog.training.runs import load_model
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.run_checks import refuse_other_ship
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store import voyage_starts
from shiplog.voyages.store.store import Store

log = logging.getLogger(__name__)

# seconds of the sample logs' second season
STAGES = {"nominal voyages": 60.0, "hypotheses": 30.0, "season": 5.0}


@staged("following a season", STAGES)
@threadpool_limits.wrap(limits=1, user_api="blas")  # of matrices too small to share out
def trend_of(
    run_path: Path,
    store: Store,
    voyages: Sequence[str],
    *,
    of: Sequence[str] = (),
    events: Sequence[datetime] = (),
    limits: Mapping[str, float] | None = None,
    cause_files: Sequence[Path] = (),
) -> Season:
    """Of the causes `of`, or without any of those that a diagnosis of these voyages names. Raises
    ShiplogError.

    events   dates at which every cause may have changed, such as dockings
    limits   cause → limit of its parameter
    """
    causes = user.load(cause_files)
    run = load_model.load(run_path, causes)
    names = trial_voyages.voyages_of(run, store, voyages)
    profile = store.profile(names)
    refuse_other_ship(run, profile)
    recorded = trial_voyages.record_of(store, names, profile)
    there = [] if run.given else store.there(run.trained_on)
    nominal = trial_voyages.record_of(store, there, profile) if there else None
    nominal, recorded = trial_voyages.rescale_time(run, nominal, recorded)
    season_fit.refuse_little(recorded, answer.enough(recorded))
    starts = voyage_starts.dated(store, names)
    trial, fit, labels = _followed(run, nominal, recorded, causes, [*of, *(limits or {})], store)
    reach("season")
    found = trends.of_fit(trial, fit, labels, starts, events, limits)
    water = season_fit.water_of(found)
    losses = speed_loss.of_voyages(trial, trends.nominal_theta(trial), water)
    order = trial.record.names
    notes = [] if found else [NO_CAUSE]
    if len(starts) < len(names):
        notes.append(UNDATED)
    if nominal is None:
        notes.append(answer.without_nominal(run, store.path))
    season = Season(run.name, profile.ship.name, order, starts, found, losses, tuple(notes))
    shown = Shown(
        lambda: drawing.Plots(season), lambda: html.render(page.of_season(season))
    )  # fmt: skip
    return replace(season, shown=shown)


def _followed(
    run: Run, nominal: Record | None, recorded: Record, causes: Sequence[Cause],
    wanted: Sequence[str], store: Store,
) -> tuple[Trial, Fit, tuple[str, ...]]:  # fmt: skip
    """The trial, the hypothesis that holds the causes, and their labels."""
    lacking = run.lacks
    if wanted:
        reach("nominal voyages")
        made = setup.trial_of(run, nominal, recorded, causes, lacking).trial
        trial, point = as_it_stands.begin(made, run.extension_numbers())
        labels = season_fit.labels_of(trial, wanted)
        reach("hypotheses")
        return trial, season_fit.fitted(trial, point, labels), labels
    names, profile = recorded.names, recorded.profile
    cut = trial_voyages.windows_of(run, store, names, profile)
    there = [] if nominal is None else list(nominal.names)
    before = trial_voyages.windows_of(run, store, there, profile) if there else None
    decided = trial_decision.decide_trial(
        run, nominal, recorded, cut, causes, lacking, reach, None, before, profile
    )
    labels = tuple(one.cause.label for one in decided.decision.named)
    return decided.trial, decided.decision.fit, labels


def write_page(season: Season, report: Path | None) -> None:
    """Where it was asked for. Raises ShiplogError where it cannot be written."""
    if report is not None:
        html.write(page.of_season(season), report)
