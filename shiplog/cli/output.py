"""What a command prints: text with its tables, JSON, an exit code, a window."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from shiplog.exceptions import ShiplogError

if TYPE_CHECKING:
    from shiplog.commands.prepare import Ingested
    from shiplog.report.result import Result

LOST = 3  # exit code: done, but something was lost or refused


def answer(result: Result, json_to: str | None) -> None:
    """Text on stdout, JSON where --json asks for it; `--json -` moves the text to stderr.

    Raises ShiplogError where the JSON cannot be written.
    """
    from shiplog.machine import files

    text = result.text
    if json_to == "-":
        if text:
            typer.echo(text, err=True)
        typer.echo(files.json_text(result.json))
        return
    if text:
        _print(result.lines)
    if json_to:
        try:
            files.write_answer(Path(json_to), files.json_text(result.json))
        except OSError as error:
            raise ShiplogError(
                f"{json_to} cannot be written: {error.strerror}.",
                hint="give --json a path in a folder that exists.",
            ) from error


def _print(lines: Sequence[str]) -> None:
    """Text on stdout. In a terminal its tables are drawn; in a file they are Markdown."""
    if not sys.stdout.isatty():
        typer.echo("\n".join(lines))
        return
    from rich.console import Console
    from rich.text import Text

    from shiplog.cli.terminal_tables import drawn
    from shiplog.report.evaluation.text_table import Table

    console = Console()
    for line in lines:
        if isinstance(line, Table) and line.rows:
            for number, block in enumerate(drawn(line, console.width)):
                console.print(*([""] if number else []), block, sep="\n")
        else:
            console.print(Text(line), soft_wrap=True)


def leave(done: Ingested, json_to: str | None) -> None:
    """Answer; exit 1 where nothing could be taken, 3 where something was lost or refused."""
    answer(done, json_to)
    for path, error in done.refused.items():
        typer.echo(f"{Path(path).name} refused: {error}", err=True)
    for path, what in done.lost.items():
        typer.echo(f"{Path(path).name}: not read: {what}", err=True)
    if done.refused and not done.reports:
        raise typer.Exit(1)
    if not done.complete:
        raise typer.Exit(LOST)


def leave_lost(lost: Sequence[ShiplogError]) -> None:
    """What was lost of a job that is done otherwise, and exit 3; nothing where nothing was."""
    for why in lost:
        typer.echo(str(why), err=True)
    if lost:
        raise typer.Exit(LOST)


def show(recording: Path, web: bool, time_s: float | None = None) -> None:
    """In a window, or a browser; with the cursor at that second."""
    from shiplog.report import viewer

    if not web:
        viewer.open_viewer(recording, time_s)
        return
    with viewer.serve(recording, time_s=time_s) as served:
        typer.echo(f"open {served.address} in a browser; Ctrl-C ends it", err=True)
        served.wait()
