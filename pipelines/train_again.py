"""`shiplog train --again`: a finished run once more, from its folder alone."""

from __future__ import annotations

from pathlib import Path

from pipelines.bars import loading
from shiplog.models import NETWORK, PHYSICS
from shiplog.paths import refuse_run
from shiplog.training import run_folder
from shiplog.training.provenance import Answer
from shiplog.training.run_checks import refuse_extended
from shiplog.training.run_folder import RunFolder


def again_command(store_path: Path, out: Path, path: Path) -> Answer:
    """The same settings, rows and windows as the run `path`. Raises ShiplogError."""
    refuse_run(out)
    old = run_folder.open_finished(path)
    refuse_extended(path)
    return FLOWS[old.kind.family.name](old, out, store_path)


def _network(old: RunFolder, out: Path, store_path: Path) -> Answer:
    with loading():
        from pipelines import train_networks

    return train_networks.answer(train_networks.train_network_again(old, out), store_path)


def _physics(old: RunFolder, out: Path, store_path: Path) -> Answer:
    with loading():
        from pipelines import identify

    run, notes = identify.identify_again(old, out)
    return identify.answer(run, notes, store_path)


FLOWS = {NETWORK.name: _network, PHYSICS.name: _physics}
