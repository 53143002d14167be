"""What logs are made of: a line a format. The first that takes a path makes its logs."""

from __future__ import annotations

from pathlib import Path

from shiplog.logs.conversion import bags, copies, nmea, nmea_folder, signalk, table_rows
from shiplog.logs.conversion.original import Format
from shiplog.ship_profile.profile import Profile

FORMATS = (
    bags.FORMAT,
    nmea_folder.FORMAT,
    copies.FORMAT,
    signalk.FORMAT,
    nmea.FORMAT,
    table_rows.FORMAT,  # takes what is left
)


def recognise(path: Path) -> Format:
    return next(one for one in FORMATS if one.takes(path))


def convertible(path: Path, profile: Profile | None) -> bool:
    """Whether logs can be made of it; the reader of logs says what is wrong with the others."""
    return recognise(path).sure(path, profile)
