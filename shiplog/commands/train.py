"""`shiplog train`: choices checked and voyages split; then what trains the model is loaded."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.commands.bars import loading
from shiplog.machine.paths import refuse_run
from shiplog.models import MODELS, NETWORK, PHYSICS
from shiplog.training.runs.run_checks import refuse_contradicted
from shiplog.training.settings.options import TrainOptions
from shiplog.voyages.store import contradicted
from shiplog.voyages.store.store import Store
from shiplog.voyages.store.unchecked import refuse_unchecked
from shiplog.voyages.windows.split import choose_physical_split, choose_split, say
from shiplog.voyages.windows.split_settings import Split

if TYPE_CHECKING:
    from shiplog.report.result import Answer


def train_command(store_path: Path, out: Path, options: TrainOptions) -> Answer:
    """Raises ShiplogError, for what the user chose before anything heavy is loaded."""
    options.check()
    refuse_run(out)
    choose, train = FLOWS[MODELS[options.model].family.name]
    store = Store(store_path)
    split = choose(store, options.voyages, options.validation, options.data, options.window)
    say(split)
    found = contradicted.list_contradicted(store, (*split.training, *split.validation))
    warning = refuse_contradicted(found, options.unchecked)
    physical = MODELS[options.model].family is PHYSICS
    profiles = [store.profile([name]) for name in (*split.training, *split.validation)]
    refuse_unchecked(profiles, physical, options.unchecked)
    answer = train(store, out, options, split)
    return answer.after(warning, contradictions=[one.as_json() for one in found])


def _network(store: Store, out: Path, options: TrainOptions, split: Split) -> Answer:
    with loading():
        from shiplog.commands.train_networks import network_command

    return network_command(store, out, options, split)


def _physics(store: Store, out: Path, options: TrainOptions, split: Split) -> Answer:
    with loading():
        from shiplog.commands.identify import identify_command

    return identify_command(store, out, options, split)


FLOWS = {NETWORK.name: (choose_split, _network), PHYSICS.name: (choose_physical_split, _physics)}
