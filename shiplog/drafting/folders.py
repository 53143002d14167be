"""What the tables of a folder are: one a topic of one voyage, or one a voyage."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from shiplog.drafting.labels import counted_time, found_labels
from shiplog.drafting.toml_text import quoted
from shiplog.exceptions import ProfileError, ShiplogError
from shiplog.logs.conversion.table_files import is_table, read_table
from shiplog.logs.conversion.topics import STAMP_COLUMNS
from shiplog.ship_profile.profile import Column

FEWEST_COLUMNS = 4  # of a table that has a whole voyage: time, position, heading
MOST = 0.8  # of the tables that have the same columns
LOOKED_AT = 12  # tables that are read to see what a folder is
COUNTERS = ("us", "ms", "ns")  # of a clock that runs since boot


@dataclass(frozen=True)
class Folder:
    """trips  the tables, where each is a voyage; clock  the column that all topics count by, and
    how, where it is no Unix time."""

    trips: tuple[Path, ...] = ()
    clock: tuple[str, Column] | None = None


def look_into(folder: Path) -> Folder:
    """What is in a folder. A table that cannot be read says nothing of it."""
    paths = sorted(path for path in folder.glob("[!.]*") if is_table(path))
    tables = {}
    for path in paths[:LOOKED_AT]:
        try:
            tables[path] = read_table(path)
        except ShiplogError:
            continue
    if len(tables) < 2:
        return Folder()
    alike = Counter(tuple(table.frame.columns) for table in tables.values())
    columns, often = alike.most_common(1)[0]
    same = [path for path, table in tables.items() if tuple(table.frame.columns) == columns]
    if len(columns) >= FEWEST_COLUMNS and often >= MOST * len(tables) and _timed(tables[same[0]]):
        return Folder(trips=(*same, *(p for p in paths[LOOKED_AT:])))
    counts: Counter[tuple[str, str]] = Counter()
    for table in tables.values():
        name = next((n for n in STAMP_COLUMNS if n in table.frame.columns), None)
        if name is None or not table.frame[name].dtype.is_numeric() or table.frame.height < 2:
            continue
        unit = counted_time(table.frame[name], table).unit
        if unit in COUNTERS:
            counts[name, unit] += 1
    if not counts:
        return Folder()
    (name, unit), often = counts.most_common(1)[0]
    if 2 * often < len(tables):
        return Folder()
    return Folder(clock=(name, Column(channel="time", unit=unit)))


def _timed(table) -> bool:
    try:
        return any(label.channel == "time" for label in found_labels(table, Path("t"), None))
    except ShiplogError:
        return True  # of several vessels: it has a time, and the draft asks which


def clock_section(clock: tuple[str, Column] | None) -> str:
    """A draft's [table] for topics that count since boot; nothing where there is no such clock."""
    if clock is None:
        return ""
    name, column = clock
    return (
        f'\n[table]\n{quoted(name)} = {{ channel = "time", unit = "{column.unit}" }}'
        "  # CHECK: counts since boot, by the step between rows; the date is not in it\n"
    )


def recognised(text: str, folder: Path, left_out: tuple[str, ...]) -> str:
    """The draft. Raises ProfileError for one without a sensor, where tables had to be left out."""
    if left_out and "\n[sensors." not in text:
        raise ProfileError(
            f"{folder} drafts nothing: no sensor is in the tables that can be read. "
            + " ".join(left_out),
            hint="look at why tables were left out, and give one table per topic.",
        )
    return text
