"""What the files of coefficients have in common: which numbers, and what is not among them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import polars as pl

from shiplog.exceptions import ModelError
from shiplog.export.job import Job
from shiplog.export.trial import Difference
from shiplog.training.runs.load_model import ForeignRun

COLUMNS = ("name", "value", "unit", "low", "high", "symbol", "meaning", "cause", "free")


def frame(job: Job) -> pl.DataFrame:
    """COLUMNS, a row a coefficient: of the base, then the parameters of its causes. Raises
    ModelError for a network, which has none."""
    found = job.run.coefficients_frame
    if found.is_empty():
        raise ModelError(
            f"{job.run.name} is a network: it has no coefficients.",
            hint="--to onnx, fmu, cpp or python has its weights.",
        )
    return found.select(COLUMNS)


def losses(job: Job) -> tuple[str, ...]:
    if isinstance(job.run, ForeignRun):
        return (f"{job.run.config.foreign.name} itself: the numbers of its causes are in it.",)
    weights = any(n.startswith("network.") for n in _names(job))
    held = job.run.extension
    found = ["The equations: they are in the documentation, and in --to python, cpp and fmu."]
    if weights:
        found.append("The weights of its residual network.")
    if held is not None:
        found.append("Forces of its causes: only their numbers are in it.")
    return tuple(found)


def _names(job: Job) -> tuple[str, ...]:
    seed = job.run.config.seeds[0]
    model = getattr(job.run.simulator(seed), "model", None)
    return () if model is None else model.names


def apart(frame: pl.DataFrame, read: Mapping[str, float]) -> Difference:
    """How far the numbers that were read are from those of the run."""
    worst = 0.0
    for name, value in frame.select("name", "value").rows():
        other = read.get(name, np.inf)
        worst = max(worst, abs(other - value) if other == other else np.inf)
    return Difference({"coefficients": float(worst)}, 0.0)
