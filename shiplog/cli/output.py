"""What a command prints: text with its tables, JSON, an exit code, a window."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from shiplog.exceptions import ShiplogError

if TYPE_CHECKING:
    from rich.table import Table

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
        _print(text)
    if json_to:
        try:
            files.write_answer(Path(json_to), files.json_text(result.json))
        except OSError as error:
            raise ShiplogError(
                f"{json_to} cannot be written: {error.strerror}.",
                hint="give --json a path in a folder that exists.",
            ) from error


def _print(text: str) -> None:
    """Text on stdout. In a terminal its Markdown tables are drawn; in a file they stay Markdown."""
    if not sys.stdout.isatty():
        typer.echo(text)
        return
    from rich.console import Console
    from rich.text import Text

    console = Console()
    lines = text.splitlines()
    while lines:
        size = next((i for i, line in enumerate(lines) if not line.startswith("|")), len(lines))
        if size > 2:
            console.print(_drawn(lines[:size]))
        else:
            size = max(size, 1)
            console.print(Text("\n".join(lines[:size])), soft_wrap=True)
        lines = lines[size:]


def _drawn(lines: Sequence[str]) -> Table:
    """A Markdown table: its head, its rule, its rows."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    head, rule, *rows = map(_cells, lines)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title, dashes in zip(head, rule, strict=True):
        table.add_column(Text(title), justify="right" if dashes.endswith(":") else "left")
    for row in rows:
        table.add_row(*map(Text, row))
    return table


def _cells(line: str) -> list[str]:
    """Of a row, blank ones included; a bar inside a cell has a backslash before it."""
    cells = re.split(r"(?<!\\)\|", line.strip().removeprefix("|").removesuffix("|"))
    return [cell.strip().replace("\\|", "|") for cell in cells]


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


def show(recording: Path, web: bool) -> None:
    from shiplog.report import viewer

    if not web:
        viewer.open_viewer(recording)
        return
    with viewer.serve(recording) as served:
        typer.echo(f"open {served.address} in a browser; Ctrl-C ends it", err=True)
        served.wait()
