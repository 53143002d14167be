"""A run in a file of another program, compared with itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from shiplog.commands.bars import staged
from shiplog.export import exported, targets
from shiplog.export.exported import Exported
from shiplog.export.job import Job
from shiplog.training.runs.load_model import Run
from shiplog.voyages.store.store import Store

STAGES = {"exporting": 10.0}


@staged("exporting", STAGES)
def export_run(
    run: Run, to: str, out: Path, store: Store | None = None, voyages: Sequence[str] = ()
) -> Exported:
    """Written, loaded again by the program that it is for, and compared. Raises ShiplogError."""
    return exported.export(Job(run, store, tuple(voyages)), to, targets.of_name(to), out)
