"""What logs are made of: a line a format. The first that takes a path makes its logs."""

from __future__ import annotations

from pathlib import Path

from shiplog.logs.conversion import (
    bags,
    copies,
    dataflash,
    mavlink,
    nmea,
    nmea2000,
    nmea_folder,
    signalk,
    table_rows,
    ulog,
)
from shiplog.logs.conversion.original import Format
from shiplog.ship_profile.profile import Profile

FORMATS = (
    bags.FORMAT,
    nmea_folder.FORMAT,
    copies.FORMAT,
    dataflash.FORMAT,
    mavlink.FORMAT,
    ulog.FORMAT,
    nmea2000.FORMAT,
    table_rows.MATLAB,
    table_rows.EXCEL,
    signalk.FORMAT,
    nmea.FORMAT,
    table_rows.FORMAT,  # takes what is left
)


def recognise(path: Path) -> Format:
    return next(one for one in FORMATS if one.takes(path))


def convertible(path: Path, profile: Profile | None) -> bool:
    """Whether logs can be made of it; the reader of logs says what is wrong with the others."""
    return recognise(path).sure(path, profile)


def voyages_in(folder: Path) -> list[Path]:
    """The files of a folder that recorders wrote, each a voyage, in the order of their names."""
    files = sorted(path for path in folder.glob("[!.]*") if path.is_file())
    recorders = [one for one in FORMATS if one.voyage]
    return [path for path in files if any(one.takes(path) for one in recorders)]
