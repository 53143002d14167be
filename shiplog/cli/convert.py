"""`shiplog convert`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.cli.options import JsonOption
from shiplog.cli.output import LOST, answer


def convert(
    tables: Annotated[
        list[Path],
        typer.Argument(
            help="CSV or Parquet tables, NMEA 0183 text, Signal K logs, folders of one of them per "
            "topic or instrument, ROS bags, ArduPilot DataFlash logs, MAVLink "
            "telemetry logs, PX4 ULog files, NMEA 2000 logs, MATLAB files, Excel workbooks."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the logs.")],
    profile: Annotated[
        str | None,
        typer.Option(
            "--profile",
            help="The profile whose [table] section names the columns; NMEA and bags need none.",
            autocompletion=completion.profiles,
        ),
    ] = None,
    json_to: JsonOption = None,
) -> None:
    """Recorders' files, tables, text and ROS bags to MCAP logs.

    Example: shiplog convert tables/*.parquet --profile esso-osaka --out logs
    """
    from shiplog.machine.paths import check_writable

    check_writable(out, "--out")
    from shiplog.ship_profile import file as profiles

    ship = profiles.load(profile) if profile else None
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.convert import convert as convert_tables

    done = convert_tables(tables, ship, out)
    answer(done, json_to)
    for path, why in done.refused.items():
        typer.echo(f"{Path(path).name} refused: {why}", err=True)
    for path, what in done.lost.items():
        typer.echo(f"{Path(path).name}: not converted: {what}", err=True)
    if done.refused or done.lost:
        raise typer.Exit(LOST if done.logs else 1)
