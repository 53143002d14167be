"""What `import shiplog` gives: the commands as functions, on the same code.

A store is a `Store` or its folder, a run a `Run` or its folder. Results are what the command line
prints, frozen: `text`, `json`, and polars frames; a notebook shows the text as Markdown.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from shiplog.commands import diagnose as diagnosing
from shiplog.commands import evaluate as evaluating
from shiplog.commands import prepare
from shiplog.commands.evaluate import Comparison
from shiplog.commands.prepare import Ingested
from shiplog.report.diagnosis.diagnosis import Diagnosis
from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.training.runs import load_model
from shiplog.training.runs.load_model import Run
from shiplog.training.settings.options import TrainOptions
from shiplog.voyages.store.store import Store

Paths = str | Path | Iterable[str | Path]
Names = str | Sequence[str]
Files = str | Path | Sequence[str | Path]


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
    return done


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
    return evaluating.evaluate_runs(
        _runs(runs), Store(_path(store)), _names(voyages), _files(causes)
    )


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
    done.written()
    return done


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
    return diagnosing.diagnose_run(
        path, Store(_path(store)), _names(voyages), Path(out), extend=to, cause_files=_files(causes)
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
