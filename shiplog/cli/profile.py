"""`shiplog profile`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli.options import JsonOption
from shiplog.cli.output import answer


def profile(
    log: Annotated[
        Path,
        typer.Argument(help="A log, recorder's file, table, folder of tables or bag of a ship."),
    ],
    out: Annotated[Path | None, typer.Option(help="Write the draft here, not to stdout.")] = None,
    vessel: Annotated[
        str | None, typer.Option(help="Which ship, where the log holds many: its MMSI or name.")
    ] = None,
    json_to: JsonOption = None,
) -> None:
    """Draft a ship profile from a log's topics, or a table's columns.

    Look over every line of it that says CHECK.

    Example: shiplog profile unknown.mcap --out my-ship.toml
    """
    from shiplog.machine.paths import check_file, refuse_taken

    if out is not None:  # before the log is read
        refuse_taken(out)
        check_file(out, "--out")
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.convert import draft_profile

    answer(draft_profile(log, out, vessel), json_to)
