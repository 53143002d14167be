"""Where each kind of model stops being right: the paper's open question, on real and sample logs.

    python -m pipelines.experiments.extrapolation trials FRT-DS-ESSO --out extrapolation [--seeds 5]
    python -m pipelines.experiments.extrapolation samples --out extrapolation

With `--without network` the physics alone, in minutes instead of hours.

`trials`: the published 3 m Esso Osaka trials (NAOE-5thLab, CC BY-NC 4.0, not shipped). Published
and identified physics on Wakita's split and over five folds of whole files; then, with equal
data, physics, hybrid and the paper's network learn from two random manoeuvres and meet two others
and the turning and zigzag tests, which none of them has seen. `samples`: the same three on the
sample logs, by wind. What stands in --out already is not done again.
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Sequence
from pathlib import Path

import polars as pl

from pipelines.experiments.esso_osaka import TWIN, published_split, trials_store
from shiplog.commands.compare import comparison
from shiplog.commands.demo import sample_logs
from shiplog.commands.evaluate import evaluate_runs
from shiplog.commands.identify import identify_run
from shiplog.commands.prepare import ingest_logs
from shiplog.commands.train_networks import train_run
from shiplog.report import viewer
from shiplog.report.evaluation import tables
from shiplog.training.settings.run_config import Config
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split import choose_split
from shiplog.voyages.windows.split_settings import Split

EQUAL = Split(  # both sides learn from the same two voyages and look at the same third
    training=("random_31-Jul-2020_12_48_39", "random_06-Aug-2020_16_24_25_4"),
    validation=("random_06-Aug-2020_16_24_25_1",),
    test=("random_06-Aug-2020_16_24_25_3", "random_03-Aug-2020_11_04_37"),
    chosen_by="equal data for every model",
)
EPOCHS = 10_000
PICTURE = ("turn_14-Oct-2020_15_06_53", "zigzag_31-Jul-2020_13_42_53")


def trials(folder: Path, out: Path, seeds: int, network: bool = True) -> str:
    """The published trials: three tables in Markdown, and a recording of unseen manoeuvres."""
    store = trials_store(folder, out)
    every = tuple(n for n in store.select() if n != TWIN)
    split = published_split(folder)
    split = split.model_copy(
        update={"training": (*split.training, *split.validation), "validation": ()}
    )
    published = physics(store, out / "published", split, fit=False)
    refit = physics(store, out / "refit", split)
    folds = physics(store, out / "folds", Split(training=every, validation=()))
    held = pl.read_parquet(folds / "cross_validation.parquet").filter(held_out="voyages")
    start, found = (float(held[name].mean()) for name in ("start", "loss"))  # type: ignore[arg-type]  # polars types a mean as anything
    test = losses([published, refit], store, split.test)
    lines = [
        "Wakita's split, six test files:", "", relative(test), "",
        f"Five folds over all files, {held.height} windows: published {start:.0f}, identified on "
        f"the other folds {found:.0f} ({found / start:.3f}).", "",
    ]  # fmt: skip
    runs = [published] + [
        physics(store, out / f"equal-{model}", EQUAL, model) for model in ("mmg", "hybrid")
    ]
    if network:
        runs.append(paper(store, out / "equal-paper", seeds))
    unseen = tuple(n for n in every if n.startswith(("turn", "zigzag")))
    lines += [
        "Equal data (two random voyages): other random voyages, and manoeuvres never seen:", "",
        by_manoeuvre(runs, store, (*EQUAL.test, *unseen)),
    ]  # fmt: skip
    seen = [*runs[1:], runs[0]]  # the picture's histograms are of the first run's training data
    picture = comparison(evaluate_runs(seen, store, PICTURE), "Manoeuvres never seen in training")
    viewer.save(picture, out / "extrapolation.rrd")
    return "\n".join(lines)


def samples(out: Path, network: bool = True) -> str:
    """The sample logs: the test voyages' winds are outside of what voyages 1 and 2 met."""
    store = Store(out / "samples")
    ingest_logs(sorted(sample_logs().glob("voyage_*.mcap")), None, store)
    split = choose_split(store, (), (), "ref", 100)
    runs = []
    for model in ("feedforward", "mmg", "hybrid")[0 if network else 1 :]:
        path = out / f"samples-{model}"
        runs.append(path)
        if path.exists():
            continue
        config = Config(
            model=model, split=split, seeds=(0, 1, 2) if model == "feedforward" else (0,)
        )
        if model == "feedforward":
            train_run(config, store, path)
        else:
            identify_run(config, store, path)
    return evaluate_runs(runs, store, ("voyage_3", "voyage_4", "voyage_6")).text


def physics(store: Store, path: Path, split: Split, model: str = "mmg", fit: bool = True) -> Path:
    """A run of a physical model, made unless it is there."""
    if not path.exists():
        config = Config.model_validate({"model": model, "split": split, "physics": {"fit": fit}})
        identify_run(config, store, path)
    return path


def paper(store: Store, path: Path, seeds: int) -> Path:
    """A run of the paper's network on equal data, made unless it is there."""
    if not path.exists():
        config = {"recipe": "paper", "seeds": tuple(range(seeds)), "split": EQUAL}
        train_run(Config.model_validate(config | {"paper": {"most_epochs": EPOCHS}}), store, path)
    return path


def losses(runs: Sequence[Path], store: Store, voyages: Sequence[str]) -> pl.DataFrame:
    """run, seed, voyage, window, loss."""
    return evaluate_runs(runs, store, voyages).errors.select(
        "run", "seed", "voyage", "window", "loss"
    )


def relative(errors: pl.DataFrame) -> str:
    """Mean L of each run, and its share of the first one's."""
    mean = errors.group_by("run", maintain_order=True).agg(pl.col("loss").mean())
    first = mean["loss"][0]
    rows = [(run, loss, f"{loss / first:.3f}") for run, loss in mean.iter_rows()]
    return tables.table(("run", "L", "of the first"), rows)


def by_manoeuvre(runs: Sequence[Path], store: Store, voyages: Sequence[str]) -> str:
    """A row a run: mean L over windows and seeds, and range over seeds, for each manoeuvre."""
    errors = losses(runs, store, voyages).with_columns(
        kind=pl.col("voyage").str.split("_").list.first()
    )
    kinds = errors["kind"].unique(maintain_order=True).to_list()
    rows = []
    for run in errors["run"].unique(maintain_order=True):
        cells: list[object] = [run]
        for kind in kinds:
            mine = errors.filter(run=run, kind=kind)
            seeds = mine.group_by("seed").agg(pl.col("loss").mean())["loss"]
            text = f"{mine['loss'].mean():.0f}"
            cells.append(
                text if len(seeds) == 1 else f"{text} ({seeds.min():.0f}-{seeds.max():.0f})"
            )
        rows.append(cells)
    counts = errors.group_by("kind").agg(pl.struct("voyage", "window").n_unique().alias("n"))
    count = dict(counts.iter_rows())
    return tables.table(("run", *(f"{kind}, {count[kind]} windows" for kind in kinds)), rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("trials", "samples"))
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--without", choices=("network",))
    arguments = parser.parse_args()
    network = arguments.without != "network"
    logging.basicConfig(format="%(message)s", level=logging.INFO)
    if arguments.what == "samples":
        print(samples(arguments.out, network))
    elif arguments.folder is None:
        parser.error("trials needs the folder of FRT-DS-ESSO")
    else:
        print(trials(arguments.folder, arguments.out, arguments.seeds, network))


if __name__ == "__main__":
    main()
