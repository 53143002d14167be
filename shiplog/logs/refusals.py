"""Why a file is refused outright, and what to do about it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from shiplog.exceptions import LogUnreadable

MAGIC = b"\x89MCAP0\r\n"


def check_file(path: Path) -> None:
    """Refuse a folder, a missing file and one that may not be read."""
    if path.is_dir():
        raise LogUnreadable(
            f"{path} is a folder without MCAP logs.", hint="give a log, or a folder of them."
        )
    if not path.is_file():
        raise LogUnreadable(f"{path} does not exist.", hint="give the path of one MCAP file.")
    if not os.access(path, os.R_OK):
        raise LogUnreadable(f"{path} may not be read.", hint="change its permissions.")


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a file is no log; `final` where nothing of one can be in it."""

    error: LogUnreadable
    final: bool = True


def refusal(path: Path, start: bytes, size: int) -> Refusal | None:
    """Why a file that begins so is no log; None where it begins as every MCAP log does."""
    if start == MAGIC:
        return None
    if size == 0:
        return _refused(f"{path} is empty (0 bytes).", "copy or record it again.")
    if start[:4] == b"PAR1" or path.suffix.lower() in (".csv", ".parquet", ".txt"):
        return _refused(
            f"{path} is a table, not an MCAP log.",
            "turn it into a log first: shiplog convert TABLE --profile P --out DIR.",
        )
    found = start.hex(" ").upper()
    if start[:6] == MAGIC[:6]:
        return _refused(
            f"{path} begins with {found} instead of {MAGIC.hex(' ').upper()}: a line-ending "
            "conversion has stripped its CR bytes, as a git checkout or an FTP transfer in text "
            "mode does. Every such byte in the data is gone too, so the file cannot be mended.",
            "copy the original again in binary mode (git: mark *.mcap as binary).",
            final=False,
        )
    if MAGIC.startswith(start):
        return _refused(f"{path} is cut off after {size} bytes.", "copy it again.")
    return _refused(
        f"{path} is no MCAP log: it begins with {found}, expected {MAGIC.hex(' ').upper()}.",
        "give an .mcap file; for a CSV or Parquet table use shiplog convert.",
        final=False,
    )


def _refused(message: str, hint: str, final: bool = True) -> Refusal:
    return Refusal(LogUnreadable(message, hint=hint), final)
