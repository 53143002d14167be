"""`shiplog profile`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli.options import JsonOption
from shiplog.cli.output import answer


def profile(
    log: Annotated[
        Path, typer.Argument(help="A log, table, folder of tables, NMEA text or bag of some ship.")
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
    from shiplog.machine import files
    from shiplog.machine.paths import check_file, refuse_taken

    if out is not None:
        refuse_taken(out)
        out = check_file(out, "--out")
    from shiplog.commands.convert import draft
    from shiplog.nomenclature.contract import CONTRACT
    from shiplog.report.result import Answer

    text = draft(log, vessel)
    content = {"contract": CONTRACT, "profile": text, "written": None if out is None else str(out)}
    if out is not None:
        files.write_text(out, text)
        text = f"draft written to {out}: look over every line that says CHECK"
    answer(Answer((text,), content), json_to)
