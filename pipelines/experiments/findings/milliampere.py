"""milliAmpere: azimuths ordered and measured."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl
from scipy.signal import lfilter

from pipelines.experiments.extrapolation import physics
from pipelines.experiments.findings.reported import diagnosed, variant
from shiplog.commands.convert import convert
from shiplog.commands.prepare import ingest_logs
from shiplog.nomenclature import frames
from shiplog.report.evaluation import tables
from shiplog.ship_profile import file as profiles
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split_settings import Split

UNITS = (1, 2, 3, 4)
FILES = ("actuator_ref_{}.parquet", "actuators__actuator_{}__azimuth_angle.parquet")
STEP = 0.1  # s
OBEYED = 30.0  # deg: an order farther than this from where the unit stands is another branch
DELAYS, LAGS = np.arange(0.0, 1.51, 0.1), (0.02, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.2, 1.6, 2.4)


def milliampere(folder: Path, out: Path) -> str:
    """Ordered against measured azimuths, by themselves; then what the motion says of the orders."""
    rows = []
    voyages = sorted(p.name for p in folder.iterdir() if p.is_dir())
    for voyage in voyages:
        for unit in UNITS:
            rows.append((voyage, unit, *follows(folder / voyage, unit)))
    head = (
        "voyage", "unit", "used", "as ordered, deg", "delay alone, s", "deg", "dead time, s",
        "lag, s", "deg",
    )  # fmt: skip
    return f"{tables.table(head, rows)}\n\n{_from_motion(folder, out, voyages)}"


def follows(folder: Path, unit: int) -> tuple[str, str, str, str, str, str, str]:
    """Share of the time used; RMS of measured less ordered; the best delay; the best dead time
    with a lag of the first order. Only where the order stays near where the unit stands."""
    order, stood = (pl.read_parquet(folder / name.format(unit)) for name in FILES)
    begin = max(order["log_time_ns"][0], stood["log_time_ns"][0])
    end = min(order["log_time_ns"][-1], stood["log_time_ns"][-1])
    time_ = np.arange(0.0, (end - begin) * 1e-9, STEP)
    ordered_at, stood_at = ((t["log_time_ns"].to_numpy() - begin) * 1e-9 for t in (order, stood))
    measured = np.unwrap(np.radians(stood["data"].to_numpy()))
    measured = np.interp(time_, stood_at, measured)
    held = np.clip(np.searchsorted(ordered_at, time_, side="right") - 1, 0, None)
    ordered = np.radians(order["angle_reference"].to_numpy().astype(float))[held]
    ordered = measured + frames.wrap(ordered - measured)
    near = np.abs(ordered - measured) < np.radians(OBEYED)
    reach = int(4.0 / STEP)
    good = np.convolve(near, np.ones(reach), "full")[: len(near)] > reach - 0.5

    def rms(value: np.ndarray) -> float:
        return float(np.degrees(np.sqrt(np.mean((value - measured)[good] ** 2))))

    late = {d: rms(_late(ordered, d)) for d in np.arange(0.0, 3.01, 0.1)}
    both = {(d, t): rms(_lagged(_late(ordered, d), t)) for d in DELAYS for t in LAGS}
    delay = min(late, key=lambda d: late[d])
    dead, lag = min(both, key=lambda k: both[k])
    return (
        f"{good.mean():.0%}", f"{rms(ordered):.2f}", f"{delay:.1f}", f"{late[delay]:.2f}",
        f"{dead:.1f}", f"{lag:.1f}", f"{both[(dead, lag)]:.2f}",
    )  # fmt: skip


def _late(values: np.ndarray, seconds_: float) -> np.ndarray:
    rows = round(seconds_ / STEP)
    return np.concatenate((np.full(rows, values[0]), values[: len(values) - rows]))


def _lagged(values: np.ndarray, time_: float) -> np.ndarray:
    decay = np.exp(-STEP / time_)
    start = [decay * values[0]]
    return lfilter([1.0 - decay], [1.0, -decay], values, zi=start)[0]


def _from_motion(folder: Path, out: Path, voyages: Sequence[str]) -> str:
    """A model identified with the azimuths as measured, against the same voyages driven by the
    azimuths as ordered: what changed is how they follow."""
    store = Store(out / "milliampere")
    if not store.entries():
        out.mkdir(parents=True, exist_ok=True)
        ordered = variant("milliampere", out / "milliampere-ordered.toml", _as_ordered)
        for name, prefix in (("milliampere", ""), (str(ordered), "ordered_")):
            logs = out / f"milliampere-logs{prefix}"
            made = convert([folder / v for v in voyages], profiles.load(name), logs).logs
            named = [p.rename(p.with_name(f"{prefix}{p.name}")) for p in made]
            ingest_logs(named, name, store)
    there = [e.name for e in store.entries()]
    measured = tuple(n for n in there if not n.startswith("ordered_"))
    split = Split(training=measured, validation=())
    run = physics(store, out / "milliampere-run", split)
    names = [n for n in there if n.startswith("ordered_")]
    return diagnosed(run, store, names, out / "milliampere-ordered", "ordered")


def _as_ordered(profile: dict) -> None:
    for actuator in profile["actuators"]:
        if actuator["kind"] == "azimuth":
            unit = actuator["name"].removeprefix("azimuth_")
            actuator |= {"topic": f"/actuator_ref_{unit}", "field": "angle_reference"}
