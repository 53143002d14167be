"""What the data hold, in the few words of a comment in a draft."""

from __future__ import annotations

import polars as pl

FIRST_VALUES = 3  # values in a comment
ASKED = 8  # vessels named where a draft has to ask


def of_values(values: pl.Series) -> str:
    """Range and first values of a column; `nothing` where it is blank."""
    if values.dtype == pl.String or not (values.dtype.is_numeric() or values.dtype == pl.Boolean):
        return "first " + ", ".join(repr(str(v)) for v in values.drop_nulls().head(FIRST_VALUES))
    number = values.cast(pl.Float64, strict=False).fill_nan(None).drop_nulls()
    if number.is_empty():
        return "holds nothing"
    first = ", ".join(f"{v:.7g}" for v in number.head(FIRST_VALUES))
    return f"{number.min():.7g} to {number.max():.7g}; first {first}"


def of_times(times: pl.Series) -> str:
    """Rate and count of messages at `times` [ns]."""
    step = times.sort().diff().drop_nulls().median()
    if not isinstance(step, (int, float)) or step <= 0:
        return f"{len(times)} messages"
    return f"{1e9 / step:.3g} Hz, {len(times)} messages"


def counted(counts: dict[str, int], what: str) -> str:
    """The largest of many, for a question."""
    most = sorted(counts, key=lambda name: -counts[name])[:ASKED]
    text = ", ".join(f"{name} ({counts[name]} {what})" for name in most)
    return text + (f", and {len(counts) - len(most)} more" if len(counts) > len(most) else "")
