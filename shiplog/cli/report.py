"""`shiplog report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli.options import JsonOption
from shiplog.cli.output import answer


def report(
    results: Annotated[
        list[Path],
        typer.Argument(
            help="The folder of a diagnosis, an evaluated run, a store or a voyage in it; several "
            "are compared."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="The page; unless given, report.html in the result's own folder."),
    ] = None,
    figures: Annotated[
        Path | None,
        typer.Option(help="Also each picture as SVG, PDF and PNG, with its rows as Parquet."),
    ] = None,
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Compare unlike results; the page says so.")
    ] = False,
    json_to: JsonOption = None,
) -> None:
    """One page of a result, or of several next to each other.

    The page needs nothing else: no network, no script. It can be mailed and printed.

    Example: shiplog report diagnosis --out september.html
    """
    from shiplog.machine.paths import check_page, check_writable

    if out is not None:
        out = check_page(out, "--out")
    if figures is not None:
        check_writable(figures, "--figures")
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.report import report_results

    answer(report_results(results, out, figures, anyway), json_to)
