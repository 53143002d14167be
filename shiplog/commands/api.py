"""What `import shiplog` gives: the commands as functions, on the same code.

A store is a `Store` or its folder, a run a `Run` or its folder. Results are dataclasses that hold
polars frames; printed, they say what the command says, and a notebook shows that as Markdown.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from shiplog.commands import diagnose as diagnosing
from shiplog.commands import evaluate as evaluating
from shiplog.commands import prepare
from shiplog.exceptions import ShiplogError
from shiplog.logs.health.health_report import VoyageReport
from shiplog.report.diagnosis import page
from shiplog.report.diagnosis.verdict import Verdict
from shiplog.report.evaluation import tables
from shiplog.report.evaluation.text_table import inert
from shiplog.training.runs import load_model
from shiplog.training.runs.load_model import Run
from shiplog.training.settings.options import TrainOptions
from shiplog.voyages.store.store import Store

Paths = str | Path | Iterable[str | Path]
Names = str | Sequence[str]
Files = str | Path | Sequence[str | Path]


class _Printed:
    """Prints as the command's text; a notebook shows it as Markdown."""

    def _repr_markdown_(self) -> str:
        return inert(str(self))


@dataclass(frozen=True, repr=False)
class Ingested(_Printed):
    """What became of logs: `store` holds those in `reports`; `refused` says why of the others."""

    store: Store
    reports: list[VoyageReport]
    refused: dict[str, ShiplogError]

    def __str__(self) -> str:
        lines = [line for report in self.reports for line in tables.voyage_lines(report)]
        lines += [f"{Path(path).name} refused: {error}" for path, error in self.refused.items()]
        return "\n".join(lines)


@dataclass(frozen=True, repr=False)
class Evaluation(_Printed):
    """Runs on measured voyages.

    errors     one row per run, seed and window: voyage, elapsed [s], loss (L, Eq. 8 of Wakita et
               al. 2024), RMSE of surge and sway [m/s] and yaw rate [rad/s], and how far off the end
               is [m], [deg]
    rollouts   one row per run, seed, voyage, window and second: time [s], the simulated
               state (m, m/s, rad, rad/s) and the error d of Eq. 5
    coverage   one row per window: share of its seconds inside the training data
    """

    errors: pl.DataFrame
    rollouts: pl.DataFrame
    coverage: pl.DataFrame
    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, repr=False)
class Comparison(_Printed):
    """`recording` is a Rerun file of measured and simulated voyages; `text` what it shows."""

    recording: Path
    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, repr=False)
class Diagnosis(_Printed):
    """What the simulation gets wrong, and why.

    verdict    named, none, undecided, unknown, coverage or external, with its sentence
    causes     one row per named cause: name, probability and sentence
    ranking    one row per answer: name and probability
    report     the page, as Markdown; recording: its pictures, where there are any
    extended   the run with the causes in it, where `extend` was given and a cause is named
    """

    verdict: Verdict
    causes: pl.DataFrame
    ranking: pl.DataFrame
    report: Path
    recording: Path | None
    extended: Run | None

    def __str__(self) -> str:
        return page.markdown(self.verdict)


def ingest(
    logs: Paths, store: str | Path = "store", *, profile: str | None = None, correct: bool = False
) -> Ingested:
    """MCAP logs, or folders of them, into a store: a 10 Hz table a voyage, its faults marked.

    profile   a shipped profile's name or a TOML's path; found by the log's topics unless given
    correct   also correct each fault of a sensor that the other sensors make certain

    Raises ShiplogError where no log could be taken.
    """
    into = Store(Path(store))
    found = prepare.expand(map(Path, [logs] if isinstance(logs, str | Path) else logs))
    done = prepare.ingest_logs(found, profile, into, correct)
    if done.refused and not done.reports:
        raise next(iter(done.refused.values()))
    return Ingested(into, done.reports, done.refused)


def open_store(path: str | Path) -> Store:
    """Voyages that were ingested. Raises StoreError where there is no store."""
    store = Store(Path(path))
    store.select([])
    return store


def train(store: Store | str | Path, out: str | Path, **options: Any) -> Run:
    """A model of the voyages, as the run folder `out`. The options are those of `TrainOptions`, as
    `shiplog train` has them:

        shiplog.train(store, "runs/mmg", model="mmg", voyages=["june_*"])

    Raises ShiplogError for voyages that cannot be trained on, for options that exclude each other
    and for a folder that is taken; TypeError for an option that there is not.
    """
    from shiplog.commands.train import train_command

    several = ("voyages", "validation", "without", "free")
    names = {name: tuple(_names(options.pop(name, ()))) for name in several}
    if (given := options.pop("parameters", None)) is not None:
        options["parameters"] = Path(given)
    into = Path(out)
    train_command(_path(store), into, TrainOptions(**names, **options))
    return load_model.load(into)


def load(path: str | Path, causes: Files = ()) -> Run:
    """A finished run. `causes`: Python files of its causes that are not in the catalogue, which
    are executed. Raises RunError."""
    from shiplog.models.causes import user

    return load_model.load(Path(path), user.load(_files(causes)))


def evaluate(
    runs: Run | str | Path | Sequence[Run | str | Path],
    store: Store | str | Path,
    voyages: Names = (),
    *,
    causes: Files = (),
) -> Evaluation:
    """Simulated against measured, window by window, with baselines. Without `voyages`, those that
    the run kept for its test. `causes`: as for `load`. Raises ShiplogError."""
    found = evaluating.evaluate_runs(
        _runs(runs), Store(_path(store)), _names(voyages), _files(causes)
    )
    return Evaluation(found.errors, found.rollouts, found.coverage, found.text())


def compare(
    runs: Run | str | Path | Sequence[Run | str | Path],
    store: Store | str | Path,
    voyages: Names = (),
    *,
    save: str | Path | None = None,
    causes: Files = (),
) -> Comparison:
    """The same as a Rerun recording: `save`, or compare.rrd in the first run. Raises
    ShiplogError."""
    to = None if save is None else Path(save)
    done = evaluating.compare_runs(
        _runs(runs), Store(_path(store)), _names(voyages), to, _files(causes)
    )
    return Comparison(done.written(), done.text)


def diagnose(
    run: Run | str | Path,
    store: Store | str | Path,
    voyages: Names = (),
    *,
    out: str | Path = "diagnosis",
    extend: str | Path | None = None,
    causes: Files = (),
) -> Diagnosis:
    """What the model gets wrong on these voyages, why, and what the causes gain on held-out ones.

    extend   write the model with the named causes as this run
    causes   Python files with causes of your own, which are executed

    Raises ShiplogError.
    """
    to = None if extend is None else Path(extend)
    (path,) = _runs(run)
    done = diagnosing.diagnose_run(
        path, Store(_path(store)), _names(voyages), Path(out), extend=to, cause_files=_files(causes)
    )
    answer = done.verdict.as_json()
    named = [(c["name"], c.get("probability"), c.get("sentence")) for c in answer["causes"]]
    ranked = [(r["name"], r["probability"]) for r in answer["ranking"]]
    return Diagnosis(
        done.verdict,
        pl.DataFrame(
            named,
            {"name": pl.String, "probability": pl.Float64, "sentence": pl.String},
            orient="row",
        ),
        pl.DataFrame(ranked, {"name": pl.String, "probability": pl.Float64}, orient="row"),
        done.folder / "report.md",
        done.recording,
        load(to, causes) if to is not None and to.exists() else None,
    )


def _path(store: Store | str | Path) -> Path:
    return store.path if isinstance(store, Store) else Path(store)


def _names(voyages: Names) -> list[str]:
    return [voyages] if isinstance(voyages, str) else list(voyages)


def _files(files: Files) -> list[Path]:
    return [Path(one) for one in ([files] if isinstance(files, str | Path) else files)]


def _runs(runs: Run | str | Path | Sequence[Run | str | Path]) -> list[Path]:
    every = [runs] if isinstance(runs, Run | str | Path) else list(runs)
    return [run.path if isinstance(run, Run) else Path(run) for run in every]
