"""The terms of a verdict, one by one: what docs/science/season2.md walks through.

python -m pipelines.experiments.site.worked_case demo/runs/mmg --store demo/store \\
    --voyages 'season2_*' --out worked

Of each hypothesis the log evidence over that of no change, log prior, placebo, allowance, score
and probability, as Markdown tables.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from unittest.mock import patch

import numpy as np

from shiplog.commands.diagnose import diagnose_run
from shiplog.diagnosis.hypotheses.hypothesis import Hypothesis
from shiplog.diagnosis.hypotheses.search import Search
from shiplog.diagnosis.noise.remainder import NOMINAL
from shiplog.diagnosis.verdict import posterior, refutation
from shiplog.report.evaluation import tables
from shiplog.voyages.store.store import Store

ROWS = 12  # hypotheses of the table


def text(search: Search) -> str:
    """All tables."""
    return "\n\n".join((sizes(search), each_alone(search), weighed(search), numbers(search)))


def sizes(search: Search) -> str:
    """How large the arrays of the equations are, and the nominal noise."""
    trial, grid = search.table.trial, search.table.trial.grid
    noise, columns = trial.reference.process_noise, trial.reference.columns
    rows = [
        ("segments S", len(trial.rows)),
        ("seconds of a segment", grid.seconds),
        ("s of a bin; between nodes", f"{noise.bin:g}; {noise.node_step:g}"),
        ("numbers of the nominal reference", len(trial.reference.pull)),
        ("columns of J in all", len(columns.unit)),
        ("share of itself that the trial counts", f"{trial.reference.counts:.3g}"),
        ("process noise, m/s², m/s², rad/s²", ", ".join(f"{x:.2g}" for x in noise.acceleration)),
        ("its correlation time, s", f"{noise.time:.3g}"),
        ("noise of a bin: x0, u, y0, v, psi, r", ", ".join(f"{x:.2g}" for x in noise.noise)),
        ("trial's noise factor with no change", f"{search.table.nothing.noise_factor:.3g}"),
        ("log evidence of no change, nats", f"{search.table.nothing.evidence:.1f}"),
    ]
    return tables.table(("what", "value"), rows)


def each_alone(search: Search) -> str:
    """Log Bayes factor of each cause by itself, over no change, before any is linearised again."""
    nothing = search.table.nothing.score
    rows = [(f"`{n}`", f"{s - nothing:+.1f}") for n, s in search.scanned.items()]
    return tables.table(("cause", "score over no change, nats"), rows[:8])


def weighed(search: Search) -> str:
    """The most probable hypotheses, term by term."""
    table = search.table
    found = posterior.posterior(search)
    rows = [
        _row(search, one, share)
        for place, (one, share) in enumerate(zip(found.hypotheses, found.probability, strict=True))
        if place < ROWS or (len(one.causes) <= 1 and one.kind == NOMINAL)
    ]
    head = (
        "causes", "remainder", "log evidence", "log prior", "placebo", "allowance", "score", "P",
        "noise",
    )  # fmt: skip
    return tables.table(head, rows) + f"\n\n{len(table.found)} hypotheses"


def _row(search: Search, one: Hypothesis, share: float) -> tuple[object, ...]:
    table = search.table
    misfit = sum(table.placebo.get(n, 0.0) for n in (*one.causes, one.kind))
    prior = table.priors.hypothesis(one.causes, one.kind)
    allowance = one.evidence + prior - misfit - one.score
    return (
        " + ".join(one.causes) or "none", one.kind,
        f"{one.evidence - table.nothing.evidence:.1f}",
        f"{prior:.1f}", f"{misfit:.1f}", f"{abs(allowance):.1f}",
        f"{one.score - table.nothing.score:.1f}", f"{share:.2g}", f"{one.noise_factor:.2f}",
    )  # fmt: skip


def numbers(search: Search) -> str:
    """The causes' numbers of the best hypothesis, SI, and their standard deviations."""
    best = search.table.ranked()[0]
    covariance = best.estimate.covariance
    assert covariance is not None
    deviations = np.sqrt(np.diagonal(covariance))
    values = np.concatenate([np.asarray(v) for v in best.estimate.numbers.values()])
    names = [f"`{n}` {i}" for n, v in best.estimate.numbers.items() for i in range(len(v))]
    rows = [(n, f"{v:.5g}", f"{d:.3g}") for n, v, d in zip(names, values, deviations, strict=True)]
    return tables.table(("number", "value", "standard deviation"), rows)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path)
    parser.add_argument("--store", type=Path, default=Path("store"))
    parser.add_argument("--voyages", action="append", default=[])
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    searches: list[Search] = []
    judged = refutation.judge

    def noted(search: Search, judge: refutation.Judge | None):
        searches.append(search)
        print(text(search))
        return judged(search, judge)

    with patch.object(refutation, "judge", noted):
        diagnose_run(given.run, Store(given.store), given.voyages, given.out)


if __name__ == "__main__":
    main()
