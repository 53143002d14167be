"""What one export is about: a run, and, for predictions, voyages of a store."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from shiplog.export import ship as ships
from shiplog.export import trial as trials
from shiplog.export.ship import Ship
from shiplog.export.trial import Trial
from shiplog.training.runs import sailing_run
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.sailing_run import Sailor
from shiplog.voyages.store.store import Store


@dataclass
class Job:
    """What is worked out of it is worked out once, and where it is asked for."""

    run: Run
    store: Store | None = None
    voyages: Sequence[str] = field(default_factory=tuple)

    @cached_property
    def sailor(self) -> Sailor:
        return sailing_run.of_run(self.run)

    @cached_property
    def ship(self) -> Ship:
        return ships.of_run(self.run, self.sailor)

    @cached_property
    def trial(self) -> Trial:
        return trials.of_ship(self.ship, self.sailor)
