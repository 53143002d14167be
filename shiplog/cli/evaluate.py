"""`shiplog evaluate`."""

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
from shiplog.cli.output import LOST, answer, leave_lost


def evaluate(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="A trained run, such as runs/ref; of several, also which is better.",
            autocompletion=completion.runs,
        ),
    ],
    voyages: TestVoyages = None,
    store: StoreOption = STORE,
    cause: Causes = None,
    simulator: Simulators = None,
    report: ReportOption = None,
    json_to: JsonOption = None,
) -> None:
    """How far off a model is on measured voyages.

    L, RMSE per channel, errors at the end of a window, and coverage, next to two baselines; which
    coefficients may be trusted, and whether the residuals are noise. Of several runs, the
    probability that one is better than another on new voyages.

    Example: shiplog evaluate runs/ref --voyages voyage_6
    """
    check_runs(runs, store, voyages, cause)
    page = page_file(report)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.evaluate import evaluate_runs, keep_pages, save
    from shiplog.voyages.store.store import Store

    found = evaluate_runs(runs, Store(store), voyages or [], cause or [], simulator or [])
    answer(found, json_to)
    leave_lost([*save(found), *keep_pages(found, Store(store), page)])
    if any(run.failures for run in found.runs):
        raise typer.Exit(LOST)
    if set(found.too_short) & set(voyages or ()):  # by its own name, and the answer says so
        raise typer.Exit(LOST)
