"""`shiplog cache`."""

from __future__ import annotations

from typing import Annotated

import typer

from shiplog.cli.options import JsonOption
from shiplog.cli.output import answer
from shiplog.machine import disk_cache


def cache(
    clear: Annotated[bool, typer.Option("--clear", help="Remove every file of the cache.")] = False,
    json_to: JsonOption = None,
) -> None:
    """Show or remove what shiplog keeps on disk.

    With these files it runs faster the next time.

    Example: shiplog cache --clear
    """
    from shiplog.report.evaluation.text_table import table
    from shiplog.report.result import Answer

    removed = disk_cache.trim(0 if clear else disk_cache.LIMIT)
    sizes = disk_cache.sizes()
    kept = sum(total for _, total in sizes.values())
    rows = [
        (kind, disk_cache.FOLDERS.get(kind, "-"), count, total / 1e6)
        for kind, (count, total) in sizes.items()
    ]
    text = (
        f"{disk_cache.folder()} holds {kept / 1e6:.1f} MB (at most "
        f"{disk_cache.LIMIT / 1e6:.0f} MB; the oldest files are removed first)."
    )
    if removed:
        text += f" {removed / 1e6:.1f} MB were removed."
    content = {
        "folder": str(disk_cache.folder()),
        "bytes": kept,
        "removed": removed,
        "limit": disk_cache.LIMIT,
        "folders": {
            kind: {"files": count, "bytes": total} for kind, (count, total) in sizes.items()
        },
    }
    answer(Answer((table(("folder", "what", "files", "MB"), rows), "", text), content), json_to)
