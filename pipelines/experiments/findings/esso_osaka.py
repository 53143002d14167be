"""The 3 m Esso Osaka: its sensors, its published model, its own identified one, its wind."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from pipelines.experiments.esso_osaka import TWIN, trials_store
from pipelines.experiments.extrapolation import physics
from pipelines.experiments.findings.reported import diagnosed, variant
from shiplog.commands.identify import identify_run
from shiplog.commands.prepare import expand, ingest_logs
from shiplog.report.evaluation import tables
from shiplog.training.runs import load_model
from shiplog.training.settings.run_config import Config
from shiplog.voyages.sensors import sensor_consistency
from shiplog.voyages.sensors.sensor_consistency import Estimate
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split_settings import Split

AXES = ("surge", "sway", "yaw")
MANOEUVRES = ("berthing", "random", "turn", "zigzag")
COLUMNS = {  # kind and channel of an estimate → its column
    ("clock_offset", "yaw_rate"): "yaw rate late, s",
    ("yaw_rate_scale", "yaw_rate"): "yaw rate scale",
    ("clock_offset", "velocity"): "velocity late, s",
}


def sensors(folder: Path, out: Path) -> str:
    """One row per voyage: what its instruments say of each other, in brackets what is not
    reported (`_cell`)."""
    store = trials_store(folder, out)
    reported = {name: _estimates(store, name) for name in trials(store)}
    rows = [
        (name, *(_cell(found.get(key)) for key in COLUMNS)) for name, found in reported.items()
    ]  # fmt: skip
    lines = [tables.table(("voyage", *COLUMNS.values()), rows), ""]
    for key, column in COLUMNS.items():
        for kind in MANOEUVRES:
            values = [f[key].value for n, f in reported.items() if n.startswith(kind) and key in f]
            if values:
                lines.append(
                    f"{column}, {kind}: {min(values):.3f} to {max(values):.3f} in {len(values)}"
                )
    lines += [
        f"also {name}: {e.kind} of {e.channel} {_cell(e)} {e.unit}"
        for name, found in reported.items()
        for key, e in found.items()
        if e.notable and key not in COLUMNS
    ]
    return "\n".join(lines)


def trials(store: Store, *patterns: str) -> list[str]:
    """Voyages without the one that is the beginning of another."""
    return [n for n in store.select(list(patterns) or None) if n != TWIN]


def _estimates(store: Store, name: str) -> dict[tuple[str, str], Estimate]:
    found = sensor_consistency.estimates(store.tables([name])[0].collect(), store.profile([name]))
    return {(e.kind, e.channel): e for e in found}


def _cell(e: Estimate | None) -> str:
    """Value and 90 % interval; in brackets where it is not reported, since it differs from no
    fault by no more than its practical size, or than the width of its interval."""
    if e is None:
        return "-"
    digits = 2 if e.unit == "s" else 3
    text = f"{e.value:.{digits}f} ({e.low:.{digits}f} to {e.high:.{digits}f})"
    return text if e.notable else f"[{text}]"


def published(folder: Path, out: Path) -> str:
    """The published MMG against all voyages, and against the random ones alone."""
    store = trials_store(folder, out)
    run = physics(store, out / "published", split(store), fit=False)
    return "\n\n".join(
        diagnosed(run, store, trials(store, *patterns), out / f"published-{what}", what)
        for what, patterns in (("all", ()), ("random", ("random_*",)))
    )


def refitted(folder: Path, out: Path) -> str:
    """The model identified from the very voyages that are then diagnosed."""
    store = trials_store(folder, out)
    run = physics(store, out / "refitted", split(store))
    return diagnosed(run, store, trials(store, "random_*"), out / "refitted-random", "random")


def forces(folder: Path, out: Path) -> str:
    """Forces of the identified MMG over those of the published one, at the measured motion: least
    squares through zero, Σ F F'/Σ F², of each part and axis over all rows."""
    store = trials_store(folder, out)
    found = {}
    for name, fit in (("published", False), ("refitted", True)):
        run = load_model.load(physics(store, out / name, split(store), fit=fit))
        seconds = store.seconds(trials(store), store.profile(trials(store)))
        found[name] = run.forces(seconds)
    both = found["published"].join(
        found["refitted"], on=("voyage", "time", "part"), suffix="_refitted"
    )
    ratio = {
        axis: (pl.col(axis) * pl.col(f"{axis}_refitted")).sum() / (pl.col(axis) ** 2).sum()
        for axis in AXES
    }
    rows = both.group_by("part", maintain_order=True).agg(**ratio).rows()
    cells = [(part, *(f"{value:.2f}" for value in values)) for part, *values in rows]
    return tables.table(("part", *AXES), cells)


def split(store: Store) -> Split:
    return Split(training=tuple(trials(store)), validation=())


def wind(folder: Path, out: Path) -> str:
    """The published MMG without its wind: no wind known at all, then offered as an input."""
    store = trials_store(folder, out)
    calm = Store(out / "calm")
    if not calm.entries():
        path = variant("esso-osaka", out / "esso-calm.toml", _without_wind)
        ingest_logs(expand([out / "logs"]), str(path), calm)
    reported = []
    for what, there in (("withheld", calm), ("offered", store)):
        run = out / f"no-wind-{what}"
        if not run.exists():
            off = {"fit": False, "without": ("wind",)}
            config = Config.model_validate({"model": "mmg", "split": split(there), "physics": off})
            identify_run(config, there, run)
        names = trials(there, "random_*")
        reported.append(diagnosed(run, there, names, out / f"no-wind-random-{what}", what))
    return "\n\n".join(reported)


def _without_wind(profile: dict) -> None:
    del profile["sensors"]["wind"]
