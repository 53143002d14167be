"""`shiplog train`: choices checked and voyages split; then what trains the model is loaded."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.commands.bars import loading
from shiplog.machine.paths import refuse_run
from shiplog.models import MODELS, NETWORK, PHYSICS
from shiplog.nomenclature.channels import AUTO_WINDOW
from shiplog.training.runs.run_checks import refuse_contradicted
from shiplog.training.settings.options import TrainOptions
from shiplog.voyages.store import contradicted
from shiplog.voyages.store.store import Store
from shiplog.voyages.store.unchecked import refuse_unchecked
from shiplog.voyages.windows.split import choose_physical_split, choose_split, plan, say
from shiplog.voyages.windows.split_settings import Split

if TYPE_CHECKING:
    from shiplog.report.result import Answer

log = logging.getLogger(__name__)


def train_command(store_path: Path, out: Path, options: TrainOptions) -> Answer:
    """Raises ShiplogError, for what the user chose before anything heavy is loaded."""
    options.check()
    refuse_run(out)
    choose, train = FLOWS[MODELS[options.model].family.name]
    store = Store(store_path)
    if options.window == AUTO_WINDOW:
        options = replace(options, window=_window(store, options))
    assert isinstance(options.window, int)
    split = choose(store, options.voyages, options.validation, options.data, options.window)
    say(split)
    found = contradicted.of(store, (*split.training, *split.validation))
    warning = refuse_contradicted(found, options.unchecked)
    physical = MODELS[options.model].family is PHYSICS
    profiles = [store.profile([name]) for name in (*split.training, *split.validation)]
    refuse_unchecked(profiles, physical, options.unchecked)
    answer = train(store, out, options, split)
    return answer.after(warning, contradictions=[one.as_json() for one in found])


def _window(store: Store, options: TrainOptions) -> int:
    """How long `--window auto` is: in ship times as the paper's, while enough of them fit into the
    chosen voyages."""
    from shiplog.voyages.windows import ship_time

    names = store.select(list(options.voyages) or None)
    profile = store.profile(names)
    rows = store.seconds(names, profile)
    ship = ship_time.of(profile.ship.length_m, rows)
    seconds = ship.auto(lambda size: plan(rows, "ref", size).height)
    log.info("--window auto: %d s%s", seconds, f", {ship.words(seconds)}".rstrip(", "))
    return seconds


def _network(store: Store, out: Path, options: TrainOptions, split: Split) -> Answer:
    with loading():
        from shiplog.commands.train_networks import network_command

    return network_command(store, out, options, split)


def _physics(store: Store, out: Path, options: TrainOptions, split: Split) -> Answer:
    with loading():
        from shiplog.commands.identify import identify_command

    return identify_command(store, out, options, split)


FLOWS = {NETWORK.name: (choose_split, _network), PHYSICS.name: (choose_physical_split, _physics)}
