"""`shiplog demo`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli.options import JsonOption
from shiplog.cli.output import LOST, answer, show
from shiplog.exceptions import ShiplogError


def demo(
    out: Annotated[
        Path, typer.Option(help="Where store, runs, recordings and diagnosis go.")
    ] = Path("demo"),
    view: Annotated[bool, typer.Option("--view/--no-view", help="Open the viewer.")] = True,
    logs: Annotated[
        Path | None, typer.Option(help="Sample logs; those of the clone unless given.")
    ] = None,
    json_to: JsonOption = None,
) -> None:
    """The main job on the sample logs, from MCAP to a verdict.

    It ingests, trains, evaluates, compares and diagnoses.

    Example: shiplog demo --out demo --no-view
    """
    from shiplog.machine.paths import check_writable, sample_logs

    check_writable(out, "--out")
    folder = sample_logs(logs)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.demo import run_demo

    result = run_demo(out, folder)
    answer(result, json_to)
    if view:
        try:
            show(result.recording, web=False)
        except ShiplogError as error:  # the job is done; only the window is missing
            typer.echo(f"The viewer was not opened: {error.message}", err=True)
    if not result.complete:  # what was lost is said by then
        raise typer.Exit(LOST)
