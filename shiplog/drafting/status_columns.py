"""Columns that say whether the receiver next to them has a fix, by their names and their values."""

from __future__ import annotations

import re

import polars as pl

from shiplog.drafting import words
from shiplog.drafting.column_names import FoundColumn
from shiplog.logs.conversion.columns import text_of

MOST_VALUES = 20  # different ones: what has more is a measurement
STATUS = (  # how the column is called, all values that it may have, and those without a fix
    (r"(gps_|gnss_|gga_)?(fix_)?qual(ity)?(_indicator)?|gps_q", "0 1 2 3 4 5 6 7 8 9", "0 6 7 8"),
    (r"(gps_|gnss_)?fix_?type|(gps_|gnss_)?fix_?mode", "0 1 2 3 4 5 6 7 8", "0 1"),
    (r"(gps_|gnss_|has_|pos\w*_)?(fix|valid|fix_ok|fix_valid|ok)", "0 1", "0"),
    (r"(gps_|gnss_|has_|pos\w*_)?(fix|valid|fix_ok|fix_valid|ok)", "true false", "false"),
    (r"(gps_|gnss_)?fix", "0 1 2 3 4 5 6", "0 1"),
    (r"((gps_|gnss_|rmc_|gll_|pos\w*_|fix_)?(status|valid|validity|fix))", "A V", "V"),
    (r"((gps_|gnss_|rmc_|gga_|pos\w*_|faa_)?mode(_indicator)?)", "A D E F M N P R S", "E M N S"),
    (r"((gps_|gnss_|nav_sat_|fix_)?status|status_status)", "-1 0 1 2", "-1"),
)


def found_status(rows: pl.DataFrame, taken: set[str]) -> list[FoundColumn]:
    """The first such column, where some row of it has no fix."""
    for name in rows.columns:
        if name in taken:
            continue
        values = text_of(rows[name]).str.strip_chars().drop_nulls()
        there = set(values.head(10_000).unique().to_list()) - {""}
        if not there or len(there) > MOST_VALUES:
            continue
        there = set(values.unique().to_list()) - {""}
        for pattern, known, none in STATUS:
            if re.fullmatch(pattern, words.bare(name)) and there <= set(known.split()):
                without = there & set(none.split())
                if without == there:
                    continue  # never a fix: it is something else, or of no use
                if without:
                    return [_status(name, none.split())]
                break
    return []


def _status(name: str, none: list[str]) -> FoundColumn:
    numbers = all(re.fullmatch(r"-?\d+", one) for one in none)
    missing = tuple(int(one) if numbers else one for one in none)
    doubt = "position and velocity are blank where it holds one of `missing`"
    return FoundColumn(name, "status", None, (doubt,), missing=missing)
