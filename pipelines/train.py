"""Windows to a trained network, as a run folder.

    python -m pipelines.train SECONDS WINDOWS RUN --training V1 V2 --validation V5
        [--data sli10] [--size 100] [--recipe fast] [--seeds 1] [--width 256] [--epochs N]
        [--ray ADDRESS]

SECONDS and WINDOWS are what `pipelines.downsample` and `pipelines.windows` wrote. Each seed is a
task, on a core of this machine or of a Ray cluster; interrupted, it goes on where it stopped. The
run is the one that `shiplog train` gives, which `evaluate`, `compare` and `diagnose` take.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import polars as pl

from pipelines.downsample import rows, ship
from pipelines.stage import stage
from pipelines.windows import planned
from shiplog.commands import train_networks
from shiplog.exceptions import UsageError, listed
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.network_seeds import tasks_of
from shiplog.training.runs.run_checks import refuse_unended
from shiplog.training.settings.options import TrainOptions
from shiplog.voyages.windows.split_settings import Split


def train(
    seconds: Path, windows: Path, out: Path, options: TrainOptions, ray: str | None = None
) -> Run:
    """Every seed of a run. Raises ShiplogError."""
    options.check()
    split = Split(training=options.voyages, validation=options.validation, chosen_by="the user")
    voyages = (*split.training, *split.validation)
    table = rows(seconds)
    hashes = json.loads((seconds / "logs.json").read_text(encoding="utf-8"))
    if absent := sorted({*voyages} - {*table["voyage"]}):
        raise UsageError(f"{seconds} has no row of {listed(absent)}.", f"It has {listed(hashes)}.")
    begun = train_networks.begin_with(
        options.config(split), ship(seconds), table.filter(pl.col("voyage").is_in(voyages)), out,
        planned=planned(windows, options.data, split.training),
        hashes={name: hashes[name] for name in voyages},
    )  # fmt: skip
    tasks = tasks_of(begun.run)
    if ray is None:
        failures = train_networks.do(tasks)
    else:
        from shiplog.commands import cluster

        failures = cluster.do(tasks, ray)
    refuse_unended(failures, len(tasks))
    return train_networks.finish(begun)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name in ("seconds", "windows", "run"):
        parser.add_argument(name, type=Path)
    for name in ("training", "validation"):
        parser.add_argument(f"--{name}", nargs="+", required=True)
    parser.add_argument("--data", default="sli10")
    parser.add_argument("--recipe", default="fast")
    for name, default in (("size", 100), ("seeds", 1), ("width", 256), ("epochs", None)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--ray", metavar="ADDRESS")
    given = parser.parse_args()
    chosen = TrainOptions(
        voyages=tuple(given.training), validation=tuple(given.validation), data=given.data,
        recipe=given.recipe, window=given.size, seeds=given.seeds, width=given.width,
        epochs=given.epochs,
    )  # fmt: skip
    with stage():
        print(train(given.seconds, given.windows, given.run, chosen, given.ray).path)
