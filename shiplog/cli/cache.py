"""`shiplog cache`."""

from __future__ import annotations

from typing import Annotated

import typer

from shiplog import disk_cache
from shiplog.cli.options import JsonOption
from shiplog.cli.output import answer


def cache(
    clear: Annotated[bool, typer.Option("--clear", help="Remove all that is kept.")] = False,
    json_to: JsonOption = None,
) -> None:
    """What shiplog keeps to be faster the next time: where, how much, and a way to remove it.

    Example: shiplog cache --clear
    """
    removed = disk_cache.trim(0) if clear else disk_cache.trim()
    kept = disk_cache.size()
    most = disk_cache.LIMIT / 1e6
    text = f"{disk_cache.folder()} holds {kept / 1e6:.1f} MB (at most {most:.0f} MB)."
    if removed:
        text += f" {removed / 1e6:.1f} MB were removed."
    content = {"folder": str(disk_cache.folder()), "bytes": kept, "removed": removed}
    answer(text, content | {"limit": disk_cache.LIMIT}, json_to)
