"""How far a few causes could get, fitted to the error itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipelines.diagnosis.trial import record_of, setting_of, windows_of
from pipelines.esso_osaka import trials_store
from pipelines.extrapolation import physics
from pipelines.findings.esso_osaka import split, trials
from shiplog import report, runs
from shiplog.causes import CATALOGUE
from shiplog.direct import MOST, Search, search_of
from shiplog.store import Store

SHOWN = 4


def direct(folder: Path, out: Path) -> str:
    """Each cause, and each beside the best, fitted to the windows' L itself: how far could naming
    get, with no evidence, no prior and no unrest in the way?"""
    store = trials_store(folder, out)
    run = physics(store, out / "published", split(store), fit=False)
    return "\n\n".join(
        f"{what}:\n\n{_direct(_search(run, store, trials(store, *patterns)))}"
        for what, patterns in (("all", ()), ("random", ("random_*",)))
    )


def _direct(search: Search) -> str:
    every = np.ones(len(search.cut), dtype=bool)
    found: dict[tuple[str, ...], np.ndarray] = {}
    for label in search.at:
        found[(label,)] = search.fit([label], np.zeros(len(search.at[label])), every)
    loss = {labels: search.loss(labels, x).mean() for labels, x in found.items()}
    first = sorted(loss, key=lambda labels: loss[labels])[:2]
    for one in first:
        for label in search.at:
            labels = tuple(sorted((*one, label)))
            if label in one or labels in found or len(search.where(labels)) > MOST:
                continue
            start = np.concatenate([found[one] if n in one else found[(n,)] for n in labels])
            found[labels] = search.fit(labels, start, every)
            loss[labels] = search.loss(labels, found[labels]).mean()
    start = search.loss((), np.zeros(0)).mean()
    rows = []
    for count in (1, 2):
        best = sorted((n for n in loss if len(n) == count), key=lambda n: loss[n])[:SHOWN]
        for labels in best:
            held = search.held_out(labels, found[labels]).mean()
            rows.append(
                (" + ".join(labels), _numbers(search, labels, found[labels]), f"{loss[labels]:.0f}",
                 f"{held:.0f}", f"{held / start:.3f}")
            )  # fmt: skip
    head = ("causes", "numbers, SI", "L", "L held out", "of published")
    return f"Published: L {start:.0f}, {len(search.cut)} windows.\n\n{report.table(head, rows)}"


def _numbers(search: Search, labels: Sequence[str], x: np.ndarray) -> str:
    return ", ".join(f"{v:+.2f}" for v in x * search.size[search.where(labels)])


def _search(run_path: Path, store: Store, names: Sequence[str]) -> Search:
    run = runs.load(run_path)
    profile = store.profile(names)
    recorded = record_of(store, names, profile)
    setting = setting_of(run, recorded, recorded)
    causes = [c.on(setting) for c in CATALOGUE if c.missing(setting) is None]
    cut = windows_of(run, store, names, profile)
    assert cut is not None
    return search_of(run.extended(run.config.seeds[0], recorded), causes, setting, cut)
