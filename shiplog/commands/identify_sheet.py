"""`shiplog train --trial-sheet`: the numbers of a trial sheet to a run of a physical model."""

from __future__ import annotations

import hashlib
import logging
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from shiplog.commands import identify
from shiplog.commands.bars import staged
from shiplog.machine import files
from shiplog.manoeuvres import sheet_fit, trial_sheet
from shiplog.models import MODELS
from shiplog.nomenclature.channels import LEAST_WINDOW, WINDOW
from shiplog.report.evaluation.sheet_identification import PAGE, UNTESTED, SheetIdentification
from shiplog.report.evaluation.text_table import inert
from shiplog.report.result import Answer
from shiplog.simulation.sensitivities import Simulator
from shiplog.training.physics import setup, trust
from shiplog.training.physics.trust import Information
from shiplog.training.runs import load_model, run_folder, trust_file
from shiplog.training.runs.provenance import provenance
from shiplog.training.settings.options import TrainOptions
from shiplog.training.settings.run_config import Config
from shiplog.voyages.windows.split import plan
from shiplog.voyages.windows.split_settings import Split

log = logging.getLogger(__name__)

STAGES = {"sailing the sheet": 15.0, "saving": 1.0}  # seconds of seven numbers of a tanker


def sheet_command(path: Path, profile: str | None, out: Path, options: TrainOptions) -> Answer:
    """Raises ShiplogError."""
    found = identify_sheet(path, profile, out, options)
    files.write_text(found.run.path / PAGE, inert(found.page))
    return found.answer()


@staged("identifying", STAGES)
@threadpool_limits.wrap(limits=1, user_api="blas")
def identify_sheet(
    path: Path, profile: str | None, out: Path, options: TrainOptions
) -> SheetIdentification:
    """A run of the coefficients with which the model sails the sheet's numbers.

    profile   name or path; that which the sheet names unless given

    Raises ShiplogError. Nothing is written before the fit has ended well.
    """
    began = time.time()
    ship = trial_sheet.ship_of(path, profile)
    sheet = trial_sheet.read(path, ship.ship.length_m)
    settings = options.settings()["physics"]
    steps = sheet_fit.substeps(ship, sheet)
    draft = Config(model=options.model, split=Split(training=(), validation=()), physics=settings)
    beginning = MODELS[options.model].equations.begin(ship, draft.physics, options.parameters)
    model, start = replace(beginning.model, substeps=steps), beginning.start
    chosen = setup.free_parameters(draft.physics.free, start)
    free = chosen if draft.physics.free else chosen & sheet_fit.askable(start)
    log.info("%d numbers of %d manoeuvres", sheet.numbers, len(sheet.manoeuvres))
    fitted = sheet_fit.fit(model, start, free, ship, sheet)
    rows = fitted.rows
    window = min(WINDOW, max(int(rows.group_by("voyage").len()["len"].min()), LEAST_WINDOW))  # type: ignore[arg-type]
    names = tuple(rows["voyage"].unique(maintain_order=True))
    config = Config(
        model=options.model, window=window,
        split=Split(training=names, validation=(), chosen_by=f"the trial sheet {path.name}"),
        physics=draft.physics.model_copy(update=
            {"parameters": start.source, "substeps": steps, "sheet": path.name}
        ),
    )  # fmt: skip
    run = run_folder.create(
        out, config, ship, None, plan(rows, config.data, window), rows, rows.clear()
    )
    simulator = Simulator(model, fitted.found.values, fitted.found.covariance)
    identify.save(run, 0, start, simulator, fitted.found)
    text = path.read_bytes()
    files.write_text(run.path / trust_file.SHEET, text.decode("utf-8"))
    done = load_model.of_folder(
        run.finish(provenance({path.name: hashlib.sha256(text).hexdigest()}, began))
    )
    judged = trust.judge(
        done.identified(), fitted.found.covariance, (start.low, start.high),
        Information({path.name: fitted.information}, {path.name: np.zeros(len(start.values))}),
        start.source,
    )  # fmt: skip
    trust_file.save(done, judged)
    notes = [*beginning.estimates, UNTESTED]
    if not fitted.found.converged:
        notes.insert(0, f"The fit did not converge: {fitted.found.message}.")
    return SheetIdentification(done, sheet.source, fitted.reached, judged, tuple(notes))
