"""Where the lines of a watch go, as they come."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from shiplog.exceptions import ShiplogError


@contextmanager
def lines(json_to: str | None) -> Iterator[Callable[[str], None] | None]:
    """What takes a line of JSON; None where nobody asked. Raises ShiplogError."""
    if json_to is None:
        yield None
        return
    if json_to == "-":
        yield typer.echo
        return
    path = Path(json_to)
    yield lambda line: _append(path, line)


def _append(path: Path, line: str) -> None:
    try:
        with path.open("a", encoding="utf-8") as stream:
            stream.write(line + "\n")
    except OSError as error:
        raise ShiplogError(
            f"{path} cannot be written: {error.strerror}.",
            hint="give --json a path in a folder that exists, on a disk with room.",
        ) from error


def text(json_to: str | None) -> Callable[[str], None]:
    """What takes a line of text: stdout, or stderr where JSON has stdout."""
    return lambda line: typer.echo(line, err=json_to == "-")


def drawn(run: Path, web: bool) -> Callable[[Any], None]:
    """What takes an event to the viewer."""
    from shiplog.commands.watch_view import viewer

    return viewer(run, web)
