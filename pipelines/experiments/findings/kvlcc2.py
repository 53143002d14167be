"""KVLCC2: a model of one facility at another."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl

from pipelines.experiments.findings.reported import diagnosed
from shiplog.commands.convert import convert
from shiplog.commands.evaluate import evaluate_runs
from shiplog.commands.identify import identify_run
from shiplog.commands.prepare import expand, ingest_logs
from shiplog.ship_profile import file as profiles
from shiplog.training.settings.run_config import Config
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split_settings import Split

HSVA, MARIN = "hsva_cpmc_zigzag_20hz_model.parquet", "marin_free_fullscale.parquet"
SCALE = 45.7
WINDOW = 50
SPEED, RATE = np.sqrt(SCALE), np.sqrt(SCALE)  # Froude: speeds grow and rates fall by as much
REVERSED = "reversed_"


def kvlcc2(folder: Path, out: Path) -> str:
    """A model identified at HSVA, against MARIN's tests brought to HSVA's scale; then the same with
    MARIN's rudder left in the facility's own sense."""
    store = Store(out / "kvlcc2")
    if not store.entries():
        logs = out / "kvlcc2-logs"
        logs.mkdir(parents=True, exist_ok=True)
        scaled = at_model_scale(pl.read_parquet(folder / MARIN))
        turned = scaled.with_columns(
            pl.format("{}{}", pl.lit(REVERSED), "run_id").alias("run_id"), -pl.col("delta_deg")
        )
        scaled.write_parquet(logs / "marin.parquet")
        turned.write_parquet(logs / "reversed.parquet")
        tables = [folder / HSVA, logs / "marin.parquet", logs / "reversed.parquet"]
        convert(tables, profiles.load("kvlcc2"), logs)
        ingest_logs(expand([logs]), "kvlcc2", store)
    there = [e.name for e in store.entries()]
    hsva = tuple(n for n in there if n.startswith("HSVA"))
    marin = [n for n in there if n.startswith("MARIN")]
    run = out / "kvlcc2-run"
    if not run.exists():
        config = {"model": "mmg", "window": WINDOW, "split": Split(training=hsva, validation=())}
        identify_run(Config.model_validate(config), store, run)
    reversed_ = [n for n in there if n.startswith(REVERSED)]
    return "\n\n".join(
        (
            evaluate_runs([run], store, marin).text,
            diagnosed(run, store, marin, out / "kvlcc2-marin", "MARIN"),
            diagnosed(run, store, reversed_, out / "kvlcc2-reversed", "rudder reversed"),
        )
    )


def at_model_scale(full: pl.DataFrame) -> pl.DataFrame:
    """MARIN's values, scaled up there, at HSVA's scale by Froude's law, in HSVA's columns."""
    return full.select(
        "run_id",
        pl.col("t_rec_s") / RATE,
        *(pl.col(n) / SCALE for n in ("x0_m", "y0_m")),
        *(pl.col(n) / SPEED for n in ("u_body_mps", "v_body_mps")),
        "psi_deg",
        "delta_deg",
        pl.col("r_degps") * RATE,
        n_rps=pl.col("n_rpm") / 60.0 * RATE,
    ).rename({"t_rec_s": "t_s"})
