"""`shiplog compare`."""

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
    TestVoyages,
    page_file,
)
from shiplog.cli.output import answer, leave_lost, show
from shiplog.exceptions import ShiplogError, UsageError


def compare(
    runs: Annotated[
        list[Path], typer.Argument(help="One or more trained runs.", autocompletion=completion.runs)
    ],
    voyages: TestVoyages = None,
    store: StoreOption = STORE,
    save: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.rrd|png|svg|html",
            help="Write the recording, a picture or the page here and open nothing.",
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="VOYAGE:SECONDS",
            help="Open it at this moment: that voyage in front, the charts about it. Without "
            "--voyages, only that voyage is compared.",
        ),
    ] = None,
    web: Annotated[
        bool,
        typer.Option("--web", help="Show it in a browser, at 127.0.0.1, instead of the viewer."),
    ] = False,
    cause: Causes = None,
    simulator: Simulators = None,
    report: ReportOption = None,
    json_to: JsonOption = None,
) -> None:
    """Measured against simulated in Rerun.

    It opens the viewer, unless --save, --report or --web is given.

    Example: shiplog compare runs/ref runs/d-ref --save compare.rrd
    """
    from shiplog.machine.paths import check_file
    from shiplog.report.viewer import saving

    if web and save is not None:
        raise UsageError(
            "--web serves the recording, and --save writes it and opens nothing.",
            hint="leave one of them out.",
        )
    check_runs(runs, store, voyages, cause)
    page = page_file(report)
    to = check_file(save or runs[0] / "compare.rrd", "--save")
    saving.check(to)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.compare import compare_runs
        from shiplog.commands.evaluate import keep_pages
    from shiplog.voyages.store.store import Store

    result = compare_runs(runs, Store(store), voyages or [], to, cause or [], at, simulator or [])
    answer(result, json_to)
    lost = [*result.lost, *keep_pages(result.evaluation, Store(store), page)]
    shown = web or (save is None and page is None)
    if shown and result.recording is not None:
        try:
            show(result.recording, web, result.moment and result.moment.seconds)
        except ShiplogError as error:
            lost.append(error)
    leave_lost(lost)
