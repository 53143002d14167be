"""Manoeuvres of voyages, and of models: the sheet, and its pages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from shiplog.commands.bars import staged
from shiplog.machine.paths import refuse_same_names
from shiplog.manoeuvres import sheet as sheets
from shiplog.models.causes import user
from shiplog.report.manoeuvres import bridge, drawing
from shiplog.report.manoeuvres import page as pages
from shiplog.report.manoeuvres.sheet import ManoeuvreSheet
from shiplog.report.page import html
from shiplog.report.result import Shown
from shiplog.ship_profile.profile import Profile
from shiplog.training.runs import load_model
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.run_checks import refuse_other_columns, refuse_other_profile
from shiplog.voyages.store.store import Store

MEMBERS = 100  # of each of many manoeuvres: the ends of an interval are known to a seventh of it
STAGES = {"finding and sailing manoeuvres": 10.0}


@staged("manoeuvres", STAGES)
def manoeuvres_of(
    paths: Sequence[Path],
    store: Store | None,
    voyages: Sequence[str],
    cause_files: Sequence[Path] = (),
    *,
    scale: float = 1.0,
    members: int = MEMBERS,
    full_load: bool = False,
    simulators: Sequence[str] = (),
) -> ManoeuvreSheet:
    """Of these voyages, all of the store where none is named; of the runs alone without a store.
    Raises ShiplogError."""
    refuse_same_names(paths)
    causes = user.load(cause_files)
    runs = [load_model.load(path, causes, simulators) for path in paths]
    names: list[str] = [] if store is None else store.select(list(voyages) or None)
    profile = store.profile(names) if store is not None else _profile_of(runs)
    for run in runs:
        refuse_other_columns(run, profile.columns, "the chosen voyages")
        refuse_other_profile(run, profile, "the chosen voyages")
    made = sheets.make(profile, store, names, runs, scale, members, full_load)
    shown = Shown(lambda: drawing.Plots(made.entries), lambda: html.render(pages.of_sheet(made)))
    return ManoeuvreSheet(made, shown)


def _profile_of(runs: Sequence[Run]) -> Profile:
    return runs[0].profile


def write_pages(
    found: ManoeuvreSheet, report: Path | None, card: Path | None, poster: Path | None
) -> None:
    """Those that were asked for. Raises ShiplogError where one cannot be written."""
    for page, path in (
        (pages.of_sheet, report), (bridge.pilot_card, card), (bridge.poster, poster)
    ):  # fmt: skip
        if path is not None:
            html.write(page(found.sheet), path)
