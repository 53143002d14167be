"""`shiplog train --again`: a finished run once more, from its folder alone."""

from __future__ import annotations

from pathlib import Path

from shiplog.commands.bars import loading
from shiplog.foreign import source
from shiplog.machine.paths import refuse_run
from shiplog.models import FOREIGN, NETWORK, PHYSICS
from shiplog.report.result import Answer
from shiplog.training.runs import run_folder
from shiplog.training.runs.run_checks import refuse_extended, refuse_sheet
from shiplog.training.runs.run_folder import RunFolder


def again_command(store_path: Path, out: Path, path: Path) -> Answer:
    """The same settings, rows and windows as the run `path`. Raises ShiplogError."""
    refuse_run(out)
    old = run_folder.open_finished(path)
    refuse_extended(path)
    refuse_sheet(path)
    return FLOWS[old.kind.family.name](old, out, store_path)


def _network(old: RunFolder, out: Path, store_path: Path) -> Answer:
    with loading():
        from shiplog.commands import train_networks

    return train_networks.answer(train_networks.train_network_again(old, out), store_path)


def _physics(old: RunFolder, out: Path, store_path: Path) -> Answer:
    with loading():
        from shiplog.commands import identify

    _, found = identify.identify_again(old, out)
    return found.answer(store_path)


def _foreign(old: RunFolder, out: Path, store_path: Path) -> Answer:
    source.refuse_again(old.name, old.config.foreign.name)


FLOWS = {NETWORK.name: _network, PHYSICS.name: _physics, FOREIGN.name: _foreign}
