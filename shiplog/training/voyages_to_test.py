"""Which voyages of a store a run can be tested on: those that had no part in its training."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from shiplog.exceptions import StoreError, listed
from shiplog.training.run_folder import RunFolder
from shiplog.voyages import parts
from shiplog.voyages.store import Store

log = logging.getLogger(__name__)


def held_back(run: RunFolder, store: Store, voyages: Sequence[str] = ()) -> list[str]:
    """The user's choice, else the run's own test voyages, else all that it was not trained on.

    voyages   names or patterns; a warning names those that the run was trained or validated on

    Raises StoreError where no voyage is left.
    """
    if voyages:
        names = store.select(list(voyages))
        overlap = parts.overlapping(names, run.trained_on)
        if overlap:
            log.warning(
                "%s was trained or validated on %s: its errors there are no test.",
                run.name, listed(overlap),
            )  # fmt: skip
        return names
    names = store.there(run.config.split.test)
    names = names or [n for n in store.select() if not parts.overlapping([n], run.trained_on)]
    if not names:
        raise StoreError(
            f"Every voyage in {store.path} was used to train or validate {run.name}.",
            hint="ingest voyages that it was not trained on, or name some with --voyages.",
        )
    return names
