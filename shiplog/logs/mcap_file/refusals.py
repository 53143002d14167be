"""Why a file is refused outright, and what to do about it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from shiplog.exceptions import LogUnreadable
from shiplog.logs.mcap_file import foreign_files

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


def begins_as_log(path: Path) -> bool:
    """Whether a file begins as an MCAP log does."""
    with path.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


def refuse_log(path: Path, given: Path) -> None:
    """Raises LogUnreadable for a log that was given as it is: there is nothing to convert."""
    if path == given:
        raise LogUnreadable(
            f"{path.name} is an MCAP log already: there is nothing to convert.",
            hint=f"ingest it: shiplog ingest {path}.",
        )


def refusal(path: Path, start: bytes, size: int) -> Refusal | None:
    """Why a file that begins so is no log; None where it begins as every MCAP log does."""
    if start == MAGIC:
        return None
    if size == 0:
        return _refused(f"{path} is empty (0 bytes).", "copy or record it again.")
    if (known := foreign_files.refusal(path)) is not None:
        return Refusal(known)
    if start[:4] == b"PAR1" or path.suffix.lower() in (".csv", ".parquet", ".txt"):
        return _refused(
            f"{path} is a table, not an MCAP log.",
            f"draft a profile with `shiplog profile {path} --out my-ship.toml`, look it over, and "
            "give it with --profile; shiplog convert makes logs of tables without ingesting them.",
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
        "copy the original again if it is a log; shiplog reads MCAP logs, ROS bags, NMEA 0183 "
        "text, and CSV or Parquet tables.",
        final=False,
    )


def _refused(message: str, hint: str, final: bool = True) -> Refusal:
    return Refusal(LogUnreadable(message, hint=hint), final)
