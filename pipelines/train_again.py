"""`shiplog train --again`: a finished run once more, from its folder alone."""

from __future__ import annotations

from pathlib import Path

from pipelines import identify, train_networks
from shiplog.models import PHYSICS
from shiplog.paths import refuse_taken
from shiplog.training import run_folder
from shiplog.training.provenance import Answer
from shiplog.training.run_checks import refuse_extended


def again_command(store_path: Path, out: Path, path: Path) -> Answer:
    """The same settings, rows and windows as the run `path`. Raises ShiplogError."""
    refuse_taken(out)
    old = run_folder.open_finished(path)
    refuse_extended(path)
    if old.kind.family is PHYSICS:
        run, notes = identify.identify_again(old, out)
        return identify.answer(run, notes, store_path)
    return train_networks.answer(train_networks.train_network_again(old, out), store_path)
