"""Which voyages of a store runs can be tested on: those that none of them was fitted to."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import polars as pl

from shiplog.exceptions import StoreError, listed
from shiplog.training.runs.run_folder import RunFolder
from shiplog.voyages.rows import one_hertz
from shiplog.voyages.store import parts
from shiplog.voyages.store.store import Store

log = logging.getLogger(__name__)


def held_back(runs: Sequence[RunFolder], store: Store, voyages: Sequence[str] = ()) -> list[str]:
    """The user's choice, else the first run's own test voyages, else all; of the latter two those
    that no run was fitted to.

    voyages   names or patterns; a warning names those that a run was fitted to

    Raises StoreError where no voyage is left.
    """
    if voyages:
        names = store.select(list(voyages))
        for run in runs:
            _say_fitted(run, parts.overlapping(names, run.fitted_to))
        return names
    used = [name for run in runs for name in run.fitted_to]

    def unused(names: Sequence[str]) -> list[str]:
        return [name for name in names if not parts.overlapping([name], used)]

    names = unused(store.there(runs[0].config.split.test)) or unused(store.select())
    if not names:
        raise StoreError(
            f"Every voyage in {store.path} was used to train or validate "
            f"{listed(run.name for run in runs)}.",
            hint="ingest voyages that it was not trained on, or name some with --voyages.",
        )
    return names


def say_twins(run: RunFolder, rows: pl.DataFrame) -> None:
    """Warn of voyages, among the 1 Hz `rows`, that a run was trained on under another name."""
    columns = ("voyage", *one_hertz.COMPARED)
    tested = set(rows["voyage"])
    tested -= {*parts.overlapping(tested, run.fitted_to)}  # those are named as they are
    known = run.training().select(columns)
    both = pl.concat((known, rows.select(columns).filter(pl.col("voyage").is_in(list(tested)))))
    pairs = one_hertz.shared_rows(both).select("left", "right").rows()
    trained = set(known["voyage"])
    twins = {name for pair in pairs if trained & {*pair} for name in tested & {*pair}}
    _say_fitted(run, sorted(twins))


def _say_fitted(run: RunFolder, names: Sequence[str]) -> None:
    if names:
        log.warning(
            "%s was trained or validated on %s: its errors there are no test.",
            run.name, listed(names),
        )  # fmt: skip
