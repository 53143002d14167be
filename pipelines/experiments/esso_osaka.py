"""The published trials of the 3 m Esso Osaka, from tables to the error on the published test set.

    python -m pipelines.experiments.esso_osaka FRT-DS-ESSO --out esso [--seeds 3]

FRT-DS-ESSO (NAOE-5thLab, CC BY-NC 4.0) is not shipped: give the folder with its `runs.csv`.
"""

from __future__ import annotations

import argparse
import logging
from pathlib import Path

import polars as pl

from shiplog.commands.convert import convert
from shiplog.commands.evaluate import evaluate_runs
from shiplog.commands.prepare import expand, ingest_logs
from shiplog.commands.train_networks import train_run
from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.ship_profile import file as profiles
from shiplog.training.settings.run_config import Config
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split_settings import Split

TRAINING, TEST = "wakita2022_trainTZRBplus", "wakita2022_test"  # columns of runs.csv
VALIDATION = "random_06-Aug-2020_16_24_25_1"
TWIN = "turn_cut_14-Sep-2020_15_58_08"  # the first 287 s of turn_14-Sep-2020_15_58_08


def published_split(folder: Path) -> Split:
    """Wakita's split (2022), without the duplicate file, one random voyage validating."""
    runs = pl.read_csv(folder / "runs.csv")
    training = runs.filter(pl.col(TRAINING) & ~pl.col("run_id").is_in([VALIDATION, TWIN]))
    return Split(
        training=tuple(training["run_id"]),
        validation=(VALIDATION,),
        test=tuple(runs.filter(pl.col(TEST))["run_id"]),
        chosen_by="Wakita et al., 2022",
    )


def trials_store(folder: Path, out: Path) -> Store:
    """The tables as logs, and the logs as a store, in `out`."""
    store = Store(out / "store")
    if not store.entries():
        convert(sorted(folder.glob("*/*.parquet")), profiles.load("esso-osaka"), out / "logs")
        ingest_logs(expand([out / "logs"]), "esso-osaka", store)
    return store


def run(folder: Path, out: Path, seeds: int, recipe: str) -> Evaluation:
    """Convert, ingest, train and evaluate; what stands in `out` already is not done again."""
    split, store = published_split(folder), trials_store(folder, out)
    path = out / f"feedforward-{recipe}"
    if not path.exists():
        config = {"recipe": recipe, "seeds": tuple(range(seeds)), "split": split}
        train_run(Config.model_validate(config), store, path)
    return evaluate_runs([path], store, split.test)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--recipe", choices=("fast", "paper"), default="fast")
    arguments = parser.parse_args()
    logging.basicConfig(format="%(message)s", level=logging.INFO)
    print(run(arguments.folder, arguments.out, arguments.seeds, arguments.recipe))


if __name__ == "__main__":
    main()
