"""The list of a fleet: a CSV file with a line a ship.

    run,store,voyages
    atlas/runs/mmg,atlas/store,june_*
    borea/runs/mmg,borea/store,june_1; june_2[0:600]

Relative paths are those of the list's folder, so that a folder with list, runs and stores can be
moved. In `voyages` names and shell patterns stand between semicolons; an empty cell is all voyages
that the run was not trained on. Other columns are left alone.
"""

from __future__ import annotations

import csv
import hashlib
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from shiplog.exceptions import FleetError, listed, nearest

COLUMNS = ("run", "store", "voyages")
SEPARATOR = ";"  # between voyages: a comma ends the cell, and names may have spaces
MOST_BYTES = 16 << 20  # of a list: a hundred thousand ships; whatever is longer is no list
PLAIN = re.compile(r"[^A-Za-z0-9_-]+")  # what a folder's name leaves out of a run's
LONGEST = 40  # letters of a run's name in that of its folder
DIGITS = 8  # hexadecimal, of the folder's name: two of 1000 ships meet once in 8000 fleets
HINT = "give --list a CSV file with the columns run, store, voyages, and a line a ship."


@dataclass(frozen=True)
class Ship:
    """A line of the list.

    line      its number in the file, the head being 1
    run, store, voyages   as they are written
    beside    the list's folder
    """

    line: int
    run: str
    store: str
    voyages: str
    beside: Path

    @property
    def run_path(self) -> Path:
        return self.beside / self.run

    @property
    def store_path(self) -> Path:
        return self.beside / self.store

    @property
    def patterns(self) -> tuple[str, ...]:
        """Names and shell patterns of its voyages; none for all that the run was not trained
        on."""
        return tuple(word for one in self.voyages.split(SEPARATOR) if (word := one.strip()))

    @property
    def folder(self) -> str:
        """Name of its diagnosis' folder: that of the run, and digits of what the line says, so that
        it stays when lines are added or moved."""
        said = "\0".join((self.run, self.store, *self.patterns))
        digits = hashlib.sha256(said.encode("utf-8", "surrogatepass")).hexdigest()[:DIGITS]
        name = PLAIN.sub("_", Path(self.run).name)[:LONGEST].strip("_") or "run"
        return f"{name}-{digits}"


def read(path: Path) -> tuple[Ship, ...]:
    """The ships of a list, in its order. Raises FleetError."""
    rows = _rows(path)
    head = next(rows, (0, ()))[1]
    names = [cell.strip().lower() for cell in head]
    places = _places(path, names)
    ships = []
    for line, cells in rows:
        if not any(cell.strip() for cell in cells):
            continue
        if len(cells) > len(names):
            raise FleetError(
                f"{path}, line {line}: {len(cells)} cells stand under {len(names)} columns.",
                hint=f"put quotes around a cell with a comma; voyages are separated by "
                f"{SEPARATOR!r}.",
            )
        found = {name: cells[at].strip() if at < len(cells) else "" for name, at in places.items()}
        for name in ("run", "store"):
            if not found[name]:
                raise FleetError(
                    f"{path}, line {line}: the column {name} is empty.",
                    hint="each line names the folder of a run and the folder of a store.",
                )
        ships.append(Ship(line, **found, beside=path.parent))
    if not ships:
        raise FleetError(f"{path} has no ship: there is no line below its head.", hint=HINT)
    _refuse_double(path, ships)
    return tuple(ships)


def _rows(path: Path) -> Iterator[tuple[int, Sequence[str]]]:
    """Line and cells of each row. Raises FleetError for what is no text, or no CSV."""
    try:
        if path.exists() and not path.is_file():
            what = "a folder" if path.is_dir() else "no file"
            raise FleetError(f"{path} is {what}.", hint=HINT)
        if (size := path.stat().st_size) > MOST_BYTES:
            raise FleetError(f"{path} is no list of ships: it has {size / 1e6:.0f} MB.", hint=HINT)
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError as error:
        raise FleetError(f"{path} does not exist.", hint=HINT) from error
    except OSError as error:
        raise FleetError(f"{path} cannot be read: {error.strerror}.", hint=HINT) from error
    except ValueError as error:  # no UTF-8; or a path that no file can have
        raise FleetError(f"{path} is no text in UTF-8.", hint=HINT) from error
    if "\0" in text:
        raise FleetError(f"{path} is no text: there is a zero byte in it.", hint=HINT)
    if not text.strip():
        raise FleetError(f"{path} is empty.", hint=HINT)
    rows = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        for cells in rows:
            yield rows.line_num, cells
    except csv.Error as error:
        raise FleetError(f"{path}, line {rows.line_num}: {error}.", hint=HINT) from error


def _places(path: Path, names: Sequence[str]) -> dict[str, int]:
    """Column → place of its cells. Raises FleetError for one that is missing, or there twice."""
    for name in COLUMNS:
        if names.count(name) != 1:
            what = "twice" if name in names else f"not there{nearest(name, names)}"
            raise FleetError(
                f"{path}: the column {name} is {what}. Its head has {listed(names)}.", hint=HINT
            )
    return {name: names.index(name) for name in COLUMNS}


def _refuse_double(path: Path, ships: Sequence[Ship]) -> None:
    """Raises FleetError for two lines that ask for the same diagnosis."""
    first: dict[str, Ship] = {}
    for ship in ships:
        other = first.setdefault(ship.folder, ship)
        if other is not ship:
            raise FleetError(
                f"{path}: line {ship.line} says the same as line {other.line}: {ship.run} on "
                f"{ship.voyages or 'all voyages'} of {ship.store}.",
                hint="remove one of the two lines.",
            )
