"""Answers of `diagnose`, and evaluations of a run, as a gate holds limits against them."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import polars as pl

from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.report.gate import diagnosed

LENGTH = 3.0  # m
VOYAGES = ("a", "a", "a", "a", "b", "b", "b", "b")


def number(value, low, high, unit):
    return {"value": value, "low": low, "high": high, "unit": unit}


CURRENT = {
    "name": "current", "probability": 0.97, "sentence": "A steady current of 0.10 m/s.",
    "parameters": {"speed": number(0.10, 0.08, 0.12, "m/s"),
                   "direction": number(200.0, 190.0, 210.0, "deg")},
}  # fmt: skip
LATE = {
    "name": "clock_offset", "probability": 0.95, "sentence": "Position is 0.3 s late.",
    "parameters": {"time": number(-0.3, -0.4, -0.2, "s"),
                   "channel": number("gnss", "gnss", "gnss", "")},
}  # fmt: skip
FOULED = {
    "name": "fouling", "probability": 0.95, "sentence": "Fouled.",
    "parameters": {"factor": number(1.2, 1.1, 1.3, "1")},
}  # fmt: skip


def detectable(name, share=0.2, channel=None, **sizes):
    parameters = {key: {"value": value, "unit": unit} for key, (value, unit) in sizes.items()}
    one = {"name": name, "share": share, "parameters": parameters}
    return one | ({"channel": channel} if channel else {})


LIMITS = (
    detectable("current", north=(0.02, "m/s"), east=(0.03, "m/s")),
    detectable("fouling", factor=(0.1, "1")),
    detectable("bank", share=40.0),
    detectable("clock_offset", channel="gnss", time=(0.2, "s")),
    detectable("clock_offset", channel="wind", time=(0.9, "s")),
)


def answer(verdict="none", **keys):
    """The keys of `verdict.json` that matter here."""
    return {
        "contract": 1, "verdict": verdict, "sentence": f"It is {verdict}.", "causes": [],
        "ranking": [{"name": "none", "probability": 0.96}], "traces": [], "limits": [*LIMITS],
        "unavailable": [], "base": {"run": "mmg", "before_effect": True},
    } | keys  # fmt: skip


def found(verdict="none", **keys):
    return diagnosed.of(answer(verdict, **keys))


def folder(path, hashes, verdict="none", *, run="published", began="2126-01-01T00:00:00+00:00",
           **keys):  # fmt: skip
    """A folder as `diagnose` writes it."""
    path.mkdir()
    content = answer(verdict, **keys) | {"base": {"run": run, "before_effect": True}}
    (path / "verdict.json").write_text(json.dumps(content), encoding="utf-8")
    origin = {"logs_sha256": hashes, "began": began}
    (path / "provenance.json").write_text(json.dumps(origin), encoding="utf-8")
    return path


def evaluation(loss, *, hold=100.0, squares=10.0, covered=0.5, inside=None, voyages=VOYAGES,
               seeds=(0,)):  # fmt: skip
    """Of one run with these L of each window; what else is measured is the same in all of them.

    The distance at the end is 2 m, the heading 5 deg off; RMSE of surge 0.1 and of sway 0.2 m/s, of
    yaw rate 1 deg/s.
    """
    count = len(voyages)
    window = [voyages[:i].count(name) for i, name in enumerate(voyages)]
    errors = pl.concat([
        pl.DataFrame({
            "run": ["mmg"] * count, "seed": [seed] * count, "voyage": voyages, "window": window,
            "loss": np.broadcast_to(np.asarray(loss, dtype=float), count),
            "rmse_surge": [0.1] * count, "rmse_sway": [0.2] * count,
            "rmse_yaw_rate": [np.radians(1.0)] * count, "end_position_m": [2.0] * count,
            "end_heading_deg": [5.0] * count,
        })
        for seed in seeds
    ])  # fmt: skip
    coverage = errors.filter(pl.col("seed") == seeds[0]).select("voyage", "window").with_columns(
        coverage=pl.lit(covered)
    )  # fmt: skip
    profile = SimpleNamespace(ship=SimpleNamespace(length_m=LENGTH))
    run = SimpleNamespace(name="mmg", profile=profile, config=SimpleNamespace(window=100))
    shares = [("mmg", name, share) for name, share in (inside or {}).items()]
    schema = {"run": pl.String, "channel": pl.String, "share": pl.Float64}
    return Evaluation(
        runs=(run,), voyages=tuple(dict.fromkeys(voyages)), too_short=(), rows=pl.DataFrame(),  # type: ignore[arg-type]
        errors=errors, rollouts=pl.DataFrame(), coverage=coverage,
        baseline_losses={"hold": np.full(count, hold), "least_squares": np.full(count, squares)},
        inside=pl.DataFrame(shares, schema, orient="row"), forces=None,
    )  # fmt: skip
