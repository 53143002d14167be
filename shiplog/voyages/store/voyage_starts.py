"""When voyages of a store began, as their recorders know it."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime

from shiplog.voyages.store.store import Store

NO_DATE = 1970  # the year of a recorder that counts from its own start


def dated(store: Store, names: Iterable[str]) -> dict[str, datetime]:
    """Voyage → its start; without those whose recorder knows no date."""
    every = {name: datetime.fromisoformat(store.origin(name)[0]) for name in names}
    return {name: start for name, start in every.items() if start.year > NO_DATE}
