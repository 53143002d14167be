"""What a command leaves: text, JSON, an exit code, a window."""

from __future__ import annotations

from pathlib import Path

import typer

from shiplog.exceptions import ShiplogError

LOST = 3  # exit code: done, but something was lost or refused


def answer(text: str, content: dict, json_to: str | None) -> None:
    """Text on stdout, JSON where it was asked for; `--json -` moves the text to stderr."""
    from shiplog import files  # it loads polars

    if json_to == "-":
        typer.echo(text, err=True)
        typer.echo(files.json_text(content))
        return
    if text:
        typer.echo(text)
    if json_to:
        try:
            files.write_text(Path(json_to), files.json_text(content))
        except OSError as error:
            raise ShiplogError(
                f"{json_to} cannot be written: {error.strerror}.",
                hint="give --json a path in a folder that exists.",
            ) from error


def leave(done, json_to: str | None) -> None:
    """Answer; exit 1 where nothing could be taken, 3 where something was lost or refused."""
    from shiplog.report import tables

    text = "\n".join(line for one in done.reports for line in tables.voyage_lines(one))
    answer(text, tables.voyages_json(done.reports, done.refused), json_to)
    for path, error in done.refused.items():
        typer.echo(f"{Path(path).name} refused: {error}", err=True)
    if done.refused and not done.reports:
        raise typer.Exit(1)
    if not done.complete:
        raise typer.Exit(LOST)


def show(recording: Path, web: bool) -> None:
    from shiplog.report import viewer

    if not web:
        viewer.open_viewer(recording)
        return
    with viewer.serve(recording) as served:
        typer.echo(f"open {served.address} in a browser; Ctrl-C ends it", err=True)
        served.wait()
