"""Known faults, written into measured voyages.

The ship and its model, the waves, the wind and the noise are not ours; one thing is changed in what
two of its voyages recorded. Its model was trained on the others. What is written is worked out
here from the table alone, and shares nothing with the causes that are to find it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from pipelines.experiments.esso_osaka import trials_store
from pipelines.experiments.extrapolation import physics
from pipelines.experiments.findings.reported import parameters, unit
from shiplog.commands.diagnose import diagnose_run
from shiplog.commands.prepare import expand, ingest_logs
from shiplog.report.evaluation import tables
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split_settings import Split

Columns = dict[str, np.ndarray]  # of a voyage's table, as they are to become

DEGREE = np.pi / 180.0
SHARES = (1.0, 0.3)  # of a size that a yard would find
# What is written at a share of its size: in the contract's words, and how
Fault = tuple[Callable[[float], str], Callable[[Columns, np.ndarray, float], None]]
FAULTS: dict[str, Fault] = {
    "none": (lambda s: "", lambda c, t, s: None),
    "heading_offset": (
        lambda s: f"angle {3 * s:.2g} deg", lambda c, t, s: _add(c, "heading", 3.0 * s * DEGREE)),
    "yaw_rate_bias": (
        lambda s: f"value {0.3 * s:.2g} deg/s",
        lambda c, t, s: _add(c, "yaw_rate", 0.3 * s * DEGREE)),
    "yaw_rate_scale": (
        lambda s: f"value {1 + 0.06 * s:.3f}", lambda c, t, s: _scale(c, "yaw_rate", 1 + 0.06 * s)),
    "clock_offset, position": (
        lambda s: f"time {0.5 * s:.2g} s", lambda c, t, s: delay(c, t, 0.5 * s, "x0", "y0")),
    "clock_offset, velocity": (
        lambda s: f"time {0.5 * s:.2g} s", lambda c, t, s: delay(c, t, 0.5 * s, "surge", "sway")),
    "antenna_offset": (
        lambda s: f"x {0.3 * s:.2g} m, y {-0.25 * s:.2g} m",
        lambda c, t, s: move_antenna(c, 0.3 * s, -0.25 * s)),
    "rudder_offset": (
        lambda s: f"{3 * s:.2g} deg each", lambda c, t, s: _add(c, "rudder", -3.0 * s * DEGREE)),
    "rudder_delay": (
        lambda s: f"time {s:.2g} s", lambda c, t, s: delay(c, t, -s, "rudder")),
    "rudder_lag": (
        lambda s: f"time {1.2 * s:.2g} s", lambda c, t, s: hold_back(c, t, 1.2 * s, "rudder")),
    "thrust_loss": (
        lambda s: f"factor about {1 - 0.15 * s:.3g}",
        lambda c, t, s: _scale(c, "prop", (1 - 0.15 * s) ** -0.5)),
    "wind_direction_offset": (
        lambda s: f"angle {12 * s:.2g} deg",
        lambda c, t, s: _add(c, "wind_angle", 12.0 * s * DEGREE)),
    "wind_speed_scale": (
        lambda s: f"value {1 + 0.15 * s:.3f}",
        lambda c, t, s: _scale(c, "wind_speed", 1 + 0.15 * s)),
}  # fmt: skip

ESSO_TRIAL = ("random_06-Aug-2020_16_24_25_4", "random_06-Aug-2020_16_24_25_6")
OTHER_TRIAL = ("nominal_4", "nominal_6")


def esso_osaka(folder: Path, out: Path) -> str:
    """Two random voyages of 22 minutes together; the six others are the nominal campaign."""
    own = out / "faults"  # with faults written into voyages, no other finding reads this store
    store = trials_store(folder, own)
    return written_table(store, expand([own / "logs"]), "random_*", ESSO_TRIAL, own)


def other_ship(folder: Path, out: Path) -> str:
    """Two nominal voyages of 50 minutes together, of another simulator's ship; the four others are
    the nominal campaign."""
    store, logs = Store(out / "other" / "store"), sorted(folder.glob("*.mcap"))
    if not store.entries():
        ingest_logs(logs, str(next(folder.glob("*.toml"))), store)
    return written_table(store, logs, "nominal_*", OTHER_TRIAL, out / "other")


def written_table(
    store: Store, logs: Sequence[Path], nominal: str, trial: Sequence[str], out: Path,
    faults: Mapping[str, Fault] = FAULTS,
) -> str:  # fmt: skip
    """A row a fault and share: what was written, and what was reported of it."""
    of = {path.stem: path for path in logs}
    others = tuple(n for n in store.select([nominal]) if n not in trial and "+" not in n)
    run = physics(store, out / "base", Split(training=others, validation=()))
    profile = store.profile(trial)
    rows = []
    for fault, (size, write) in faults.items():
        for share in SHARES if fault != "none" else (1.0,):
            label = fault.replace(", ", "-") + ("" if share == 1.0 else f"-{share:g}")
            folder = out / label
            if not (folder / "verdict.json").exists():
                names = [written(store, of[n], profile, label, write, share) for n in trial]
                diagnose_run(run, store, names, folder)
            reported = json.loads((folder / "verdict.json").read_text("utf-8"))
            rows.append((fault, size(share), *_reported(reported, fault)))
    return tables.table(("written", "size", "reported", "smallest detectable change"), rows)


def written(store: Store, log: Path, profile: Profile, label: str, write, share: float) -> str:
    """The voyage with that share of a fault in the store, under a name of its own."""
    voyage = ingest(log, profile)
    seconds = voyage.table["time"].dt.epoch("ns").to_numpy() / 1e9
    columns = {c.name: c.to_numpy().copy() for c in voyage.table if c.dtype == pl.Float64}
    write(columns, seconds - seconds[0], share)
    columns["heading"] = np.angle(np.exp(1j * columns["heading"]))
    name = f"{voyage.name}+{label}"
    table = voyage.table.with_columns(pl.Series(n, v) for n, v in columns.items())
    report = replace(voyage.report, name=name)
    store.add(replace(voyage, name=name, table=table, report=report))
    return name


def _reported(reported: dict, fault: str) -> tuple[str, str]:
    causes = [
        f"{c['name']} ({c['probability']:.2f}): {parameters(c['parameters'])}"
        for c in reported["causes"]
    ]
    name, _, channel = fault.partition(", ")
    least = [
        ", ".join(f"{k} {p['value']:.2g} {unit(p)}".strip() for k, p in one["parameters"].items())
        for one in reported["limits"]
        if one["name"] == name and one.get("channel", channel) == channel
    ]
    structure = reported.get("structure") or {}
    word = f"{reported['verdict']} {structure.get('family', '')}".strip()
    return "; ".join(causes) or word, "" if causes else "; ".join(least)


def _of(c: Columns, name: str) -> list[str]:
    """Columns of that name or beginning: a ship may have two rudders."""
    return [n for n in c if n.startswith(name)]


def _add(c: Columns, name: str, value: float) -> None:
    for n in _of(c, name):
        c[n] += value


def _scale(c: Columns, name: str, factor: float) -> None:
    for n in _of(c, name):
        c[n] *= factor


def delay(c: Columns, t: np.ndarray, seconds: float, *names: str) -> None:
    """What is shown was so many seconds ago; negative: it is shown before it is so."""
    for name in names:
        for n in _of(c, name):
            c[n] = np.interp(t - seconds, t, c[n])


def hold_back(c: Columns, t: np.ndarray, seconds: float, name: str) -> None:
    """What is shown, that the ship's own follows with this time constant; of its own averaged twice
    over three samples, or what is shown would be a row of spikes. Over a second, the ship's own
    would no longer follow what is shown as a lag does: it would run ahead of its mean."""
    three = np.ones(3) / 3.0
    for n in _of(c, name):
        ends = np.pad(c[n], 2, mode="edge")
        smooth = np.convolve(np.convolve(ends, three, "valid"), three, "valid")
        c[n] = smooth + seconds * np.gradient(smooth, t)


def move_antenna(c: Columns, ahead: float, aside: float) -> None:
    """It stands so far from where the profile has it: position and velocity are of there."""
    cos, sin = np.cos(c["heading"]), np.sin(c["heading"])
    c["x0"] += ahead * cos - aside * sin
    c["y0"] += ahead * sin + aside * cos
    c["surge"] -= c["yaw_rate"] * aside
    c["sway"] += c["yaw_rate"] * ahead
