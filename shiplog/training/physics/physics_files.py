"""One seed of a physical model as its run folder keeps it.

<seed>/model.safetensors  parameters.toml  identified.parquet    coefficients and their covariance
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.machine import files
from shiplog.simulation.sensitivities import Simulator
from shiplog.training.settings import run_files


def save(
    folder: Path,
    simulator: Simulator,
    fixed: Mapping[str, np.ndarray],
    parameters: str,
    identified: pl.DataFrame,
) -> None:
    """Write it whole.

    fixed       arrays that are no coefficients (the hybrid's scaling and anchors)
    parameters  TOML that --parameters takes
    identified  a row a coefficient: name, value, standard error, start, spread
    """
    folder.mkdir(exist_ok=True)
    arrays = {"theta": simulator.theta, "covariance": simulator.covariance, **fixed}
    run_files.save_arrays(folder / "model.safetensors", arrays)
    files.write_text(folder / "parameters.toml", parameters)
    files.write_frame(folder / "identified.parquet", identified)
