"""`shiplog trend`."""

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
    StoreOption,
    TrialVoyages,
    page_file,
)
from shiplog.cli.output import answer


def trend(
    run: Annotated[
        Path,
        typer.Argument(help="A trained run, such as runs/mmg.", autocompletion=completion.runs),
    ],
    voyages: TrialVoyages = None,
    of: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CAUSE",
            help="Follow this cause, such as fouling, several times; unless given, those that a "
            "diagnosis of these voyages names, which takes longer.",
        ),
    ] = None,
    event: Annotated[
        list[str] | None,
        typer.Option(
            metavar="DATE",
            help="A docking, cleaning or repair, as 2026-05-17, several times: before and after "
            "are compared.",
        ),
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="CAUSE=VALUE",
            help="When does the trend pass this, such as thrust_loss=0.9? Several times.",
        ),
    ] = None,
    store: StoreOption = STORE,
    cause: Causes = None,
    report: ReportOption = None,
    json_to: JsonOption = None,
) -> None:
    """Each cause's size voyage by voyage, and the ship's speed loss.

    Sizes with 90 % intervals, by partial pooling between the voyages; the slope of what wears; a
    docking with before and after; the date of a limit; the speed loss at equal revolutions,
    filtered in the sense of ISO 19030.

    Example: shiplog trend runs/mmg --of fouling --limit fouling=1.3 --event 2026-05-17
    """
    check_runs([run], store, voyages, cause)
    to = page_file(report)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.trend import trend_of, write_page
        from shiplog.diagnosis.season.asked import parse_date, parse_limit
    from shiplog.voyages.store.store import Store

    found = trend_of(
        run, Store(store), voyages or [], of=of or [],
        events=[parse_date(text) for text in event or []],
        limits=dict(map(parse_limit, limit or [])), cause_files=cause or [],
    )  # fmt: skip
    answer(found, json_to)
    write_page(found, to)
