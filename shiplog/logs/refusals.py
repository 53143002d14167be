"""Why a file is refused outright, and what to do about it."""

from __future__ import annotations

import os
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


def check_magic(path: Path, start: bytes, size: int) -> None:
    """Refuse a file that does not begin as every MCAP log does."""
    if start == MAGIC:
        return
    if size == 0:
        raise LogUnreadable(f"{path} is empty (0 bytes).", hint="copy or record it again.")
    if start[:4] == b"PAR1" or path.suffix.lower() in (".csv", ".parquet", ".txt"):
        raise LogUnreadable(
            f"{path} is a table, not an MCAP log.",
            hint="turn it into a log first: shiplog convert TABLE --profile P --out DIR.",
        )
    found = start.hex(" ").upper()
    if start[:6] == MAGIC[:6]:
        raise LogUnreadable(
            f"{path} begins with {found} instead of {MAGIC.hex(' ').upper()}: a line-ending "
            "conversion has stripped its CR bytes, as a git checkout or an FTP transfer in text "
            "mode does. Every such byte in the data is gone too, so the file cannot be mended.",
            hint="copy the original again in binary mode (git: mark *.mcap as binary).",
        )
    if MAGIC.startswith(start):
        raise LogUnreadable(f"{path} is cut off after {size} bytes.", hint="copy it again.")
    raise LogUnreadable(
        f"{path} is no MCAP log: it begins with {found}, expected {MAGIC.hex(' ').upper()}.",
        hint="give an .mcap file; for a CSV or Parquet table use shiplog convert.",
    )
