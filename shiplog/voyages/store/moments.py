"""VOYAGE:SECONDS, the moment at which a comparison is opened."""

from __future__ import annotations

import math
from collections.abc import Sequence

import polars as pl

from shiplog.exceptions import ShiplogError
from shiplog.voyages.store.store import Store

HINT = "give it as VOYAGE:SECONDS, such as --at 'voyage_6:120'."


def parse(text: str) -> tuple[str, float]:
    """A voyage's name and the seconds from its start. Raises ShiplogError."""
    voyage, colon, seconds = text.rpartition(":")
    try:
        at = float(seconds)
    except ValueError:
        at = math.nan
    if not colon or not voyage or not math.isfinite(at):
        raise ShiplogError(f"--at {text!r} is no voyage and seconds.", hint=HINT)
    return voyage, at


def check(store: Store, voyage: str, seconds: float) -> None:
    """Raises ShiplogError for a voyage that is not in the store, and for a second outside it."""
    if not store.there([voyage]):
        raise ShiplogError(
            f"--at names the voyage {voyage!r}, which is not in the store {store.path}.",
            hint="`shiplog voyages --store DIR` lists its voyages.",
        )
    (table,) = store.tables([voyage])
    span = (pl.col("time").max() - pl.col("time").min()).dt.total_nanoseconds()
    length = float(table.select(span).collect().item() or 0) * 1e-9
    if not 0.0 <= seconds <= math.ceil(length):  # pages round to whole seconds
        raise ShiplogError(
            f"--at {voyage}:{seconds:g} is outside the voyage, which is {length:.0f} s long.",
            hint=f"give it a second between 0 and {length:.0f}.",
        )


def among(store: Store, voyage: str, patterns: Sequence[str]) -> list[str]:
    """The voyages to compare: those that were chosen, or this one alone. Raises ShiplogError where
    the chosen ones are without it."""
    if not patterns:
        return [voyage]
    chosen = store.select(patterns)
    if voyage not in chosen:
        raise ShiplogError(
            f"--at names the voyage {voyage!r}, which is not among those of --voyages.",
            hint="choose it with --voyages, too, or leave --voyages out.",
        )
    return chosen
