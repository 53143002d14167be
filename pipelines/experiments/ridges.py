"""Does a validation voyage know how firm the ridge should be? On trials that no table tests on.

    python -m pipelines.experiments.ridges FRT-DS-ESSO --out extrapolation

Of the 3 m Esso Osaka's random voyages, six are not tested on in the table with equal data. Each two
of them are learned from with ridges of every firmness; of the other four each validates in turn,
and the remaining three say what its choice was worth. Two minutes.
"""

from __future__ import annotations

import argparse
from itertools import combinations, permutations
from pathlib import Path

import numpy as np

from pipelines.experiments.esso_osaka import trials_store
from pipelines.experiments.extrapolation import EQUAL
from shiplog.report.evaluation import tables
from shiplog.simulation.sensitivities import losses
from shiplog.training.physics import regularisation
from shiplog.training.physics.model_selection import physics
from shiplog.training.physics.setup import prepare
from shiplog.training.settings.run_config import Config
from shiplog.voyages.windows.split import plan
from shiplog.voyages.windows.split_settings import Split


def least(judged: dict[float, np.ndarray]) -> float:
    """The best on the validation windows, by however little."""
    return min(judged, key=lambda factor: float(judged[factor].mean()))


RULES = {
    "the nearest to 1 within one standard error": regularisation.choose,
    "the least": least,
    "always 0.5": lambda judged: 0.5,
    "always 2": lambda judged: 2.0,
}


def ridges(folder: Path, out: Path) -> str:
    """A row a rule: L against that of the plausible ridge, geometric mean and worst."""
    store = trials_store(folder, out)
    names = tuple(n for n in store.select(["random_*"]) if n not in EQUAL.test)
    config = Config(model="mmg", split=Split(training=names, validation=()))
    profile = store.profile(list(names))
    rows = store.seconds(list(names), profile)
    planned = plan(rows, config.data, config.window)
    ready = prepare(config, profile, rows, rows.clear(), planned, None)
    voyage = np.array(ready.voyages)
    told: dict[str, list[float]] = {rule: [] for rule in RULES}
    kept = dict.fromkeys(RULES, 0)
    for pair in combinations(names, 2):
        part = ready.data._replace(weight=np.isin(voyage, pair).astype(float))
        found = regularisation.ladder(
            lambda factor, begin, part=part: physics(ready, part, factor, begin),
            config.physics.ridges,
        )
        loss = {f: losses(ready.model, one.values, ready.data) for f, one in found.items()}
        for held, test in permutations([n for n in names if n not in pair], 2):
            judged = {f: each[voyage == held] for f, each in loss.items()}
            mean = {f: float(each[voyage == test].mean()) for f, each in loss.items()}
            for rule, choose in RULES.items():
                chosen = choose(judged)
                told[rule].append(np.log(mean[chosen] / mean[regularisation.PLAUSIBLE]))
                kept[rule] += chosen == regularisation.PLAUSIBLE
    lines = [
        (rule, f"{np.exp(np.mean(log)):.3f}", f"{np.exp(np.max(log)):.2f}",
         f"{kept[rule] / len(log):.0%}")
        for rule, log in told.items()
    ]  # fmt: skip
    return tables.table(("rule", "L, of the plausible ridge's", "worst", "ridge kept"), lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    print(ridges(arguments.folder, arguments.out))


if __name__ == "__main__":
    main()
