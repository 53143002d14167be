"""Single files of a run folder: arrays, tables and JSON, written whole, and named where spoilt."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from safetensors import SafetensorError
from safetensors.numpy import load_file, save_file

from shiplog.exceptions import UnreadableError
from shiplog.machine import files


def unreadable(path: Path, why: object) -> UnreadableError:
    return UnreadableError(f"{path} cannot be read: {why}.", hint="train the run again.")


def json_of(path: Path) -> Any:
    """Raises UnreadableError."""
    try:
        return json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise unreadable(path, error) from error


def table(path: Path) -> pl.DataFrame:
    """Raises UnreadableError."""
    try:
        return pl.read_parquet(path)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise unreadable(path, error) from error


def arrays(path: Path) -> dict[str, np.ndarray]:
    """Raises UnreadableError."""
    try:
        return load_file(path)
    except (OSError, SafetensorError) as error:
        raise unreadable(path, error) from error


def save_arrays(path: Path, values: Mapping[str, np.ndarray]) -> None:
    with files.whole(path) as partial:
        plain = {name: np.array(a, dtype=float, order="C") for name, a in values.items()}
        save_file(plain, partial)
