"""How surely one campaign tells of the next: what the least κ of `shiplog/reference.py` rests on.

    python -m pipelines.usual --case RUN STORE [--case RUN STORE ...]

Of ships with nothing hidden (`python -m pipelines.known_ship case SEED ... --cause none`, ingested,
a model trained on nominal_*): how large each cause is found in trial_* all the same, as the square
of what is found in units of its expected spread, by number, averaged over the ships. One is
right; more, and a campaign is believed too much.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from pipelines.diagnosis import trial
from shiplog import reference, runs
from shiplog.hypotheses import Found, Trial
from shiplog.reference import Reference
from shiplog.store import Store

KAPPAS = (11.0, 4.0, 2.0, 1.0)


def counted(ref: Reference, kappa: float) -> Reference:
    """The same campaign, all of it counted for 1/κ."""
    assert ref.nominal is not None and ref.modes is not None
    by = np.concatenate(([1.0], ref.columns.unit))
    total = ref.modes.total(np.ones(len(ref.nominal.e))) * np.outer(by, by)
    information, pull = reference.usual(total, kappa, ref.columns.known, ref.anchor)
    return replace(ref, information=information, pull=pull, kappa=kappa)


def square(found: Found, unit: np.ndarray) -> float:
    """χ² of a cause's numbers, by number, were nothing known of them before the trial."""
    assert found.covariance is not None
    value = found.numbers[found.name] / unit
    own = np.linalg.inv(found.covariance / np.outer(unit, unit))
    pull = own @ value
    alone = own - np.eye(len(value))  # its size is known before; that is taken off
    return float(pull @ np.linalg.lstsq(alone, pull, rcond=1e-9)[0]) / len(value)


def of_ship(run_path: Path, store: Store) -> pl.DataFrame:
    """cause, κ, square."""
    run = runs.load(run_path)
    recorded = trial.record_of(store, store.select(["trial_*"]), run.profile)
    nominal = trial.record_of(store, list(run.made_on), run.profile)
    ref = trial.trial_of(run, nominal, recorded, ())[0].reference
    rows = []
    for kappa in KAPPAS:
        tried = Trial(counted(ref, kappa), recorded)
        _, found = tried.scan(tried.begin({}), ref.model.causes)
        rows += [
            (f.name, kappa, square(f, ref.columns.unit[ref.columns.of[f.name]])) for f in found
        ]
    return pl.DataFrame(rows, schema=["cause", "kappa", "square"], orient="row")


def main(given: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", nargs=2, action="append", required=True, type=Path)
    every = [of_ship(run, Store(store)) for run, store in parser.parse_args(given).case]
    mean = pl.concat(every).group_by("cause", "kappa").agg(pl.col("square").mean())
    table = mean.pivot("kappa", index="cause", values="square").sort("4.0", descending=True)
    with pl.Config(tbl_rows=-1, float_precision=2):
        print(f"{len(every)} ships\n{table.select('cause', *map(str, KAPPAS))}")


if __name__ == "__main__":
    main()
