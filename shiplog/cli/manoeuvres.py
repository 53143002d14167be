"""`shiplog manoeuvres`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.cli.inputs import check_runs
from shiplog.cli.options import (
    STORE,
    Causes,
    JsonOption,
    ReportOption,
    Simulators,
    StoreOption,
    Voyages,
    page_file,
)
from shiplog.cli.output import answer
from shiplog.exceptions import UsageError


def manoeuvres(
    runs: Annotated[
        list[Path] | None,
        typer.Argument(
            help="A trained run, and one that a diagnosis extended; without one, what was "
            "measured.",
            autocompletion=completion.runs,
        ),
    ] = None,
    voyages: Voyages = None,
    store: StoreOption = STORE,
    alone: Annotated[
        bool, typer.Option("--alone", help="Only what the runs sail by the book; no voyage.")
    ] = False,
    scale: Annotated[
        float, typer.Option(help="How many times the ship is longer than its model (Froude).")
    ] = 1.0,
    full_load: Annotated[
        bool,
        typer.Option(
            "--full-load",
            help="Also at the profile's full_load_draught_m, from what was measured in ballast.",
        ),
    ] = False,
    members: Annotated[
        int, typer.Option(min=1, help="Draws of a model for its intervals; 1 for none.")
    ] = 100,
    cause: Causes = None,
    simulator: Simulators = None,
    report: ReportOption = None,
    pilot_card: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Also write the pilot card of IMO A.601(15): FILE.html."),
    ] = None,
    poster: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Also write the wheelhouse poster of IMO A.601(15): FILE.html."
        ),
    ] = None,
    json_to: JsonOption = None,
) -> None:
    """Manoeuvres: measured, simulated, and IMO's limits.

    Turns, zigzags, stops, pull-outs and spirals are found in ordinary logs. Each has its
    conditions, why it is or is not of the standard, and its quantities with 90 % intervals.

    Example: shiplog manoeuvres runs/mmg --voyages 'trial_*' --report manoeuvres.html
    """
    if alone and not runs:
        raise UsageError("--alone is about runs, and none is given.", hint="name a run.")
    if alone:
        from shiplog.machine.paths import check_causes, check_run

        for run in runs or ():
            check_run(run)
        check_causes(cause or ())
    else:
        check_runs(runs or [], store, voyages, cause)
    pages = [page_file(one) for one in (report, pilot_card, poster)]
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.manoeuvres import manoeuvres_of, write_pages
    from shiplog.voyages.store.store import Store

    found = manoeuvres_of(
        runs or [], None if alone else Store(store), voyages or [], cause or [], scale=scale,
        members=members, full_load=full_load, simulators=simulator or [],
    )  # fmt: skip
    answer(found, json_to)
    write_pages(found, *pages)
