"""MATLAB files as tables: a vector is a column, and so is a row or a column of a matrix.

Versions 4 to 7 are read by scipy, 7.3 (HDF5), tables, timetables and datetimes by mat-io, an extra.
Traps: a double of whole numbers is stored as one byte each, and arithmetic with it would wrap; a
row of a struct may lie either way; a datetime is an object that no version of scipy decodes. A
datenum counts days from the year 0: `unit = "d"` of a time column. A datetime without a zone is as
on the wall, and taken as UTC.
"""

from __future__ import annotations

import logging
import re
import struct
import warnings
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from shiplog.exceptions import ChannelMissing, listed
from shiplog.logs.conversion.delimited import DelimitedTable, unlike
from shiplog.logs.conversion.recordings import library

log = logging.getLogger(__name__)

EXTRA = "matlab"
PLAIN, HDF5 = b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"
HDF5_AT = 512  # bytes of MATLAB's own before those of HDF5
HDF5_MARK = b"\x89HDF\r\n\x1a\n"
LEVEL_4 = struct.Struct("5i")
LEVEL_4_BYTES = {0: 8, 1: 4, 2: 4, 3: 2, 4: 2, 5: 1}  # of a number, by its kind
LONGEST_NAME = 64  # letters of a variable, and the zero that ends it
MOST_COLUMNS = 256  # of a matrix: a wider one is a picture or a grid, and no table
MOST_PARTS = 64  # of a cell or a struct array, that become columns each
DEEPEST = 8  # structs in structs
LONGEST_LISTED = 6


def is_matlab(path: Path) -> bool:
    """Whether a file begins as MATLAB's do."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        start = stream.read(HDF5_AT + len(HDF5_MARK))
    return start.startswith(PLAIN) or _is_hdf5(start) or _is_level_4(start, path.stat().st_size)


def _is_level_4(start: bytes, size: int) -> bool:
    """Whether a file is of version 4, which has no mark: its first matrix is described by five
    whole numbers, and then named. The first is 1000 M + 10 P + T: M the order of bytes, P the kind
    of number, T whether it is full, text or sparse."""
    if len(start) < LEVEL_4.size:
        return False
    for order, big in (("<", 0), (">", 1)):
        kind, rows, columns, imaginary, letters = struct.unpack(f"{order}5i", start[:20])
        machine, number, form = kind // 1000, kind // 10 % 10, kind % 10
        fits = kind >= 0 and machine == big and kind // 100 % 10 == 0 and form <= 2
        if not fits or number not in LEVEL_4_BYTES or imaginary not in (0, 1):
            continue
        if rows < 1 or columns < 1 or not 1 < letters <= LONGEST_NAME:
            continue
        name = start[LEVEL_4.size : LEVEL_4.size + letters]
        whole = LEVEL_4.size + letters + rows * columns * LEVEL_4_BYTES[number]
        if re.fullmatch(rb"[A-Za-z]\w*\0", name) and whole <= size:
            return True
    return False


def _is_hdf5(start: bytes) -> bool:
    return start.startswith(HDF5) or (start.startswith(b"MATLAB") and start[HDF5_AT:] == HDF5_MARK)


def read_matlab(path: Path, known: Collection[str] = ()) -> DelimitedTable:
    """The columns of one length that hold most of what is `known`, else most of all; the others
    are named in a warning.

    Raises ChannelMissing where there is no such column, or the file cannot be read; LibraryMissing
    where an extra is needed.
    """
    columns: dict[str, Any] = {}
    matrices: set[str] = set()
    for name, value in _variables(path).items():
        for column, values, of_matrix in _columns(name, value):
            columns[column] = values
            matrices |= {column} if of_matrix else set()
    lengths = Counter(len(values) for values in columns.values() if len(values) > 1)
    if not lengths:
        raise ChannelMissing(
            f"{path.name} holds no vector, matrix, struct or table of numbers.",
            hint="write the time, position, heading and actuators as vectors of one length.",
        )
    wanted = Counter(len(columns[name]) for name in known if name in columns)
    rows = max(lengths, key=lambda n: (wanted[n], lengths[n], n))
    left = {name: len(v) for name, v in columns.items() if len(v) not in (1, rows)}
    if left:
        shown = listed([f"{n} ({count})" for n, count in left.items()], most=LONGEST_LISTED)
        log.warning("%s: read are its columns of %d rows; of other lengths, and not read: %s",
                    path.name, rows, shown)  # fmt: skip
    kept = {name: values for name, values in columns.items() if len(values) == rows}
    names = dict(zip(kept, unlike(_short(list(kept))), strict=True))
    frame = pl.DataFrame({names[name]: values for name, values in kept.items()})
    nameless = tuple(names[name] for name in kept if name in matrices)
    return DelimitedTable(frame, nameless=nameless)


def _short(names: list[str]) -> list[str]:
    """Names without the variable that all of them are of."""
    first = names[0].partition(".")[0] + "."
    every = len(names) > 1 and all(name.startswith(first) for name in names)
    return [name.removeprefix(first) for name in names] if every else names


def _variables(path: Path) -> Mapping[str, Any]:
    """Variable → its value. mat-io where the file or a variable is nothing for scipy."""
    from scipy.io import loadmat

    with path.open("rb") as stream:
        start = stream.read(HDF5_AT + len(HDF5_MARK))
    try:
        if _is_hdf5(start):
            return _by_mat_io(path, "a MATLAB 7.3 file")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a duplicate name "None", and such
            found = loadmat(path, mat_dtype=True)
        if any(_opaque(name, value) for name, value in found.items()):
            return _by_mat_io(path, "a MATLAB file with tables, timetables, datetimes or strings")
    except (OSError, ValueError, TypeError, KeyError, EOFError, NotImplementedError) as error:
        raise ChannelMissing(f"{path} cannot be read: {error}.", hint="check the file.") from error
    return {name: value for name, value in found.items() if not name.startswith("__")}


def _by_mat_io(path: Path, what: str) -> Mapping[str, Any]:
    matio = library("matio", EXTRA, path, what)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = matio.load_from_mat(str(path))
    return {name: value for name, value in found.items() if not name.startswith("__")}


def _opaque(name: str, value: Any, depth: int = 0) -> bool:
    """Whether scipy left a value as MATLAB's object, in a struct or by itself: of versions up to
    1.17 their name is "None"."""
    if name == "None" or type(value).__name__ in ("MatlabOpaque", "MatlabFunction"):
        return type(value).__name__ != "MatlabFunction"
    if depth > DEEPEST or not isinstance(value, np.ndarray):
        return False
    if value.dtype.names:
        parts = (value[field].flat for field in value.dtype.names)
        return any(_opaque("", one, depth + 1) for part in parts for one in list(part)[:1])
    if value.dtype == object:
        return any(_opaque("", one, depth + 1) for one in value.ravel()[:MOST_PARTS])
    return False


def _columns(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, Any, bool]]:
    """(name, values [n], whether it is a row or column of a matrix) of a variable and what is in
    it. A struct's fields are joined by dots, parts of a cell or a matrix numbered from 1."""
    if depth > DEEPEST:
        return
    if hasattr(value, "columns") and hasattr(value, "index"):  # a table's frame, of pandas
        yield from _of_frame(name, value)
    elif isinstance(value, Mapping) or isinstance(getattr(value, "properties", None), Mapping):
        fields = value if isinstance(value, Mapping) else value.properties
        for field, inner in fields.items():
            yield from _columns(f"{name}.{field}", inner, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.names:
        yield from _of_struct(name, value, depth)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        yield from _of_cell(name, value, depth)
    elif isinstance(value, np.ndarray):
        yield from _of_array(name, value)


def _of_frame(name: str, frame: Any) -> Iterator[tuple[str, Any, bool]]:
    index = frame.index
    if type(index).__name__ in ("DatetimeIndex", "TimedeltaIndex"):
        yield f"{name}.{index.name or 'Time'}", _plain(np.asarray(index.to_numpy())), False
    for column in frame.columns:
        values = np.asarray(frame[column].to_numpy())
        if values.dtype == object and len(values) and isinstance(values[0], np.ndarray):
            values = np.stack([np.asarray(one).ravel() for one in values])
        yield from _of_array(f"{name}.{column}", values)


def _of_struct(name: str, value: np.ndarray, depth: int) -> Iterator[tuple[str, Any, bool]]:
    """Of one struct its fields; of many with a number in each field a column, else each one's."""
    every = value.ravel()
    names = value.dtype.names or ()
    if len(every) == 1:
        for field in names:
            yield from _columns(f"{name}.{field}", every[0][field], depth + 1)
        return
    for field in names:
        inner = [np.asarray(one[field]) for one in every]
        if all(one.size == 1 and one.dtype.kind in "biuf" for one in inner):
            yield f"{name}.{field}", np.array([float(one.ravel()[0]) for one in inner]), False
        elif len(inner) <= MOST_PARTS:
            for place, one in enumerate(inner, 1):
                yield from _columns(f"{name}_{place}.{field}", one, depth + 1)


def _of_cell(name: str, value: np.ndarray, depth: int) -> Iterator[tuple[str, Any, bool]]:
    every = value.ravel()
    if len(every) == 1:
        yield from _columns(name, every[0], depth + 1)
        return
    texts = [_text(one) for one in every]
    if len(every) > 1 and all(one is not None for one in texts):
        yield name, texts, False
        return
    inner = [np.asarray(one) for one in every]
    if all(one.size == 1 and one.dtype.kind in "biuf" for one in inner) and len(every) > 1:
        yield name, np.array([float(one.ravel()[0]) for one in inner]), False
    elif len(every) <= MOST_PARTS:
        for place, one in enumerate(every, 1):
            yield from _columns(f"{name}_{place}", one, depth + 1)


def _text(value: Any) -> str | None:
    if isinstance(value, str):
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind == "U" and value.size <= 1:
        return str(value.ravel()[0]) if value.size else ""
    return None


def _of_array(name: str, value: np.ndarray) -> Iterator[tuple[str, Any, bool]]:
    """A vector, or the shorter way of a matrix column by column; nothing of what is empty, of more
    than two dimensions, complex, or wider than a table."""
    if value.size == 0 or value.dtype.kind not in "biufmMUO":
        return
    value = value.squeeze() if value.size > 1 else value.reshape(1)
    if value.ndim == 1:
        yield name, _plain(value), False
    elif value.ndim == 2 and min(value.shape) <= MOST_COLUMNS and value.dtype.kind != "U":
        along = value if value.shape[0] >= value.shape[1] else value.T
        for place, column in enumerate(along.T, 1):
            yield f"{name}_{place}", _plain(column), True


def _plain(values: np.ndarray) -> Any:
    """Numbers as doubles, durations in seconds, datetimes and texts as they are."""
    if values.dtype.kind == "m":
        blank = np.isnat(values)
        return np.where(blank, np.nan, values / np.timedelta64(1, "ns") * 1e-9)
    if values.dtype.kind == "M":
        return pl.Series(values.astype("datetime64[ns]"))
    if values.dtype.kind in "UO":
        return [None if one is None else str(one) for one in values]
    return values.astype(np.float64)
