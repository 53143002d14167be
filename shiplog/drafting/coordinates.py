"""Coordinates of a table whose sign or size is not that of degrees."""

from __future__ import annotations

import re
from dataclasses import replace

import polars as pl

from shiplog.drafting import facts
from shiplog.drafting.column_names import FoundColumn, with_doubts

HEMISPHERES = {"latitude": ("N", "S"), "longitude": ("E", "W")}
NEAR = 3  # columns from a coordinate: its letter stands no further away


def on_earth(columns: list[FoundColumn], rows: pl.DataFrame) -> list[FoundColumn]:
    """Latitude and longitude with the sign of their hemisphere and the factor of their size."""
    values = [rows[one.column] for one in columns]
    if not all(v.dtype.is_numeric() for v in values):
        return columns
    factor, doubt = facts.scale_of_coordinates(*(v.cast(pl.Float64) for v in values))
    signed = [_signed(one, rows) for one in columns]
    doubts = (doubt,) if doubt else ()
    return [with_doubts(replace(one, sign=one.sign * factor), *doubts) for one in signed]


def _signed(one: FoundColumn, rows: pl.DataFrame) -> FoundColumn:
    """South and west are negative: where the letter is next to an unsigned number, the sign is
    the letter's."""
    letters = HEMISPHERES[one.channel]
    values = rows[one.column].cast(pl.Float64).fill_nan(None)
    unsigned = not bool((values < 0).any())
    header = re.search(r"[\[(]\s*(?:deg|°)?\s*([NSEW])(?:outh|est)?\s*[\])]", one.column)
    if header and header[1] == letters[1] and unsigned:
        return with_doubts(replace(one, sign=-1.0), f"{header[1]} stands in the column's name")
    letter = _letters_near(one.column, letters, rows)
    if letter is None:
        return one
    negative = letter == letters[1]
    if not unsigned:
        wrong = bool(((values < 0) != negative).filter((values != 0) & letter.is_not_null()).any())
        return with_doubts(one, f"its signs are not those of {letter.name!r}") if wrong else one
    if bool(negative.drop_nulls().all()):
        return with_doubts(replace(one, sign=-1.0), f"{letters[1]}, of {letter.name!r}")
    if bool(negative.any()):
        return with_doubts(
            one, f"{letter.name!r} is {letters[1]} in some rows: make those negative"
        )
    return one


def _letters_near(column: str, letters: tuple[str, str], rows: pl.DataFrame) -> pl.Series | None:
    """The hemisphere in each row, of the column of such letters that is next to a coordinate's."""
    at = rows.columns.index(column)
    near = range(max(at - NEAR, 0), min(at + NEAR + 1, len(rows.columns)))
    order = sorted(near, key=lambda i: (abs(i - at), i < at))
    for i in order:
        values = rows[rows.columns[i]]
        if values.dtype != pl.String:
            continue
        first = (
            values.str.strip_chars()
            .str.to_uppercase()
            .str.replace(r"^(N|S|E|W)(ORTH|OUTH|AST|EST)$", "$1")
        )
        filled = first.set(first == "", None)
        if filled.null_count() < len(filled) and filled.drop_nulls().is_in(letters).all():
            return filled
    return None
