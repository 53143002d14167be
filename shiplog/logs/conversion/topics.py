"""A folder of one table a topic, as dumped from a ROS bag or a flight recorder."""

from __future__ import annotations

import logging
import re
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.exceptions import ChannelMissing, ShiplogError, listed
from shiplog.logs.conversion import clock
from shiplog.logs.conversion.columns import named_apart, plain, refuse_scaled, schema_of
from shiplog.logs.conversion.delimited import unlike
from shiplog.logs.conversion.nmea import lines_to_series
from shiplog.logs.conversion.steps_back import of_one_recording
from shiplog.logs.conversion.table_files import is_table, read_table
from shiplog.logs.conversion.write import THE_MESSAGES_OWN, Series
from shiplog.ship_profile.profile import Column, Profile

log = logging.getLogger(__name__)

NAMED = 4  # tables that a sentence on several names
# Column names of clocks, the one that is trusted most first: of the message, then the recorder's.
# A flight recorder's GNSS topic also holds UTC; its `timestamp` is what all its topics share.
STAMP_COLUMNS = (
    "stamp_ns", "stamp", "header.stamp", "timestamp", "utc", "time_utc", "datetime", "time", "t",
    "unix", "epoch",
)  # fmt: skip
LOGGED = (
    "log_time_ns",
    "log_time",
    "rosbagTimestamp",
    "bag_time",
    "received",
    "timestamp_received",
)
UNIT_IN_NAME = {"ns": "ns", "nsec": "ns", "us": "us", "usec": "us", "ms": "ms", "msec": "ms"}


def holds_tables(folder: Path) -> bool:
    """Whether there is a table in a folder that is not hidden."""
    return any(is_table(path) for path in folder.glob("[!.]*"))


def folder_to_series(
    folder: Path,
    profile: Profile | None,
    without: Collection[Path] = (),
    times: Mapping[str, Column] | None = None,
) -> tuple[list[Series], list[str]]:
    """Each table of a folder as a topic: `a__b.parquet` is /a/b, and every number a field. Also
    the reasons of the tables that had to be left out. Hidden files are none.

    A column `log_time_ns` (or of the names above) is the recorder's clock, `stamp_ns` the
    message's; other names and units come from the profile's [table], with channel = "time".
    `times` are such names where there is no profile yet. Reasons that differ in a table's name or
    in numbers alone are one. A column of NMEA sentences becomes their topics. Nothing is aligned:
    that is ingest's work.
    Raises ChannelMissing where no table has a time.
    """
    parts: list[Series] = []
    reasons: list[str] = []
    why: dict[str, list[tuple[str, ShiplogError]]] = {}  # alike but for their numbers and names
    for path in sorted(p for p in folder.glob("[!.]*") if is_table(p) and p not in without):
        try:
            found, lost = _one(path, profile, times or {})
            parts += found
            reasons += lost
        except ShiplogError as error:
            why.setdefault(_kind_of(error.message), []).append((path.name, error))
    reasons += [_all_of(said) for said in why.values()]
    if not parts:
        raise ChannelMissing(
            f"{folder} holds no table of a topic. {' '.join(reasons)}".rstrip(),
            hint=next((e.hint for said in why.values() for _, e in said if e.hint), "")
            or "give one table per topic, each with a column of times such as log_time_ns, or a "
            "single table; a clock that counts since boot is named in a profile's [table], as "
            'timestamp = { channel = "time", unit = "us" }.',
        )
    return named_apart(parts), reasons


def _kind_of(message: str) -> str:
    """A sentence without what differs from table to table."""
    return re.sub(r"\d[\d.]*|'[^']*'|\S+\.(csv|txt|tsv|parquet)\b", "#", message)


def _all_of(said: list[tuple[str, ShiplogError]]) -> str:
    """What is said of several tables alike, once, with their names."""
    names = [name for name, _ in said]
    message = said[0][1].message
    if len(said) == 1:
        return message if names[0] in message else f"{names[0]}: {message}"
    return f"{len(said)} tables ({listed(names, most=NAMED)}), such as {names[0]}: {message}"


def _one(
    path: Path, profile: Profile | None, times: Mapping[str, Column]
) -> tuple[list[Series], list[str]]:
    table = read_table(path, profile.table if profile else None)
    frame = table.frame.drop(table.undecided)
    lost = [f"{path.name}: {what}." for what in table.lost] + [
        f"{path.name}: the numbers of the column {name!r}, such as {example!r}, can be read in two "
        f"ways; give it a `decimal` in [table]."
        for name, example in table.undecided.items()
    ]
    named = {n: c for n, c in profile.table.items() if c.channel == "time"} if profile else {}
    named = named or dict(times)
    if profile:
        refuse_scaled(named, profile)
    by_profile = next((n for n in named if n in frame.columns), None)
    stamp_name = by_profile or _known(frame, STAMP_COLUMNS)
    logged_name = _known(frame, LOGGED)
    names = [n for n in (stamp_name, logged_name) if n]
    if not names:
        raise ChannelMissing(
            f"{path.name} has no column of times. Columns found: {listed(frame.columns)}.",
            hint='name it in [table], as { channel = "time", unit = "us" }.',
        )
    columns = {n: named.get(n) for n in names}
    clocks = {
        n: clock.instants(frame[n], (c.unit if c else None) or _unit(n), c.format if c else None)
        for n, c in columns.items()
    }
    clocks = {n: of_one_recording(times, path.name) for n, times in clocks.items()}
    stamp, logged = clocks[names[0]], clocks[names[-1]]
    keep = (logged if logged_name else stamp).is_not_null()
    order = logged.filter(keep).arg_sort()
    frame, logged = frame.filter(keep)[order], logged.filter(keep)[order]
    stamp = stamp.filter(keep)[order].fill_null(strategy="forward").fill_null(logged)
    if frame.height == 0:
        return [], lost
    topic = "/" + path.stem.replace("__", "/")
    text = next((n for n in frame.columns if n.lower() in ("sentence", "nmea")), None)
    if text is not None and frame[text].dtype == pl.String:
        parts = lines_to_series(frame[text].fill_null("").to_list(), path.name, logged.to_list())
        return parts, lost
    columns = _numbers(frame.drop(*clocks), path)
    if not columns:
        return [], lost
    schema = schema_of(topic, columns)
    return [Series(topic, schema, stamp.to_numpy(), columns, logged.to_numpy())], lost


def _numbers(frame: pl.DataFrame, path: Path) -> dict[str, np.ndarray]:
    """Each column of numbers [n] under the name of its field; what is not one is reported.

    Words in a column of numbers are values that were not measured.
    """
    numbers: dict[str, pl.Series] = {}
    for column in frame.get_columns():
        if column.dtype.is_numeric() and not column.name.endswith("_ns"):
            numbers[column.name] = column.cast(pl.Float64)
        elif column.dtype == pl.String:
            number = clock.number_of(column)
            filled = column.filter(column.str.strip_chars() != "")
            words = len(filled) - number.count()
            if number.count() <= words:
                log.info("%s: %r holds no numbers and is left out", path.name, column.name)
                continue
            if words:
                log.warning(
                    "%s: %d values of %s are no numbers; taken as not measured",
                    path.name, words, column.name,
                )  # fmt: skip
            numbers[column.name] = number
    fields = unlike([*THE_MESSAGES_OWN, *map(plain, numbers)])[len(THE_MESSAGES_OWN) :]
    for name, field in zip(numbers, fields, strict=True):
        if field != plain(name):
            log.warning("%s: the column %r becomes the field %s", path.name, name, field)
    return {
        field: column.fill_null(np.nan).to_numpy()
        for field, column in zip(fields, numbers.values(), strict=True)
    }


def _known(frame: pl.DataFrame, names: tuple[str, ...]) -> str | None:
    lowered = {name.lower(): name for name in reversed(frame.columns)}
    for name in names:
        for unit in ("", *(f"_{u}" for u in (*UNIT_IN_NAME, "s", "utc"))):
            if name + unit in lowered:
                return lowered[name + unit]
    return None


def _unit(name: str) -> str | None:
    return UNIT_IN_NAME.get(name.lower().rsplit("_", 1)[-1])
