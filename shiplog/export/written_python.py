"""Python that an export has written, loaded again as its user loads it."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def names_of(path: Path, name: str) -> dict[str, Any]:
    """What the file defines, run as the module `name`.

    Its text is shiplog's own, of a moment ago: a template and numbers. The names of strangers in it
    (ship, run, actuators) are `inert`, and nothing else of a user is run.
    """
    known: dict[str, Any] = {"__name__": name}
    exec(compile(path.read_text("utf-8"), path.name, "exec"), known)
    return known
