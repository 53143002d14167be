"""What the compiled loops leave behind (64 bits a number, extents of texts) as polars columns."""

from __future__ import annotations

import numpy as np
import polars as pl
import pyarrow as pa

from . import kernels


def numbers(bits: np.ndarray, kind: str) -> pl.Series:
    """Numbers of a numpy kind ("f8", "i4", "?"), from their bits; single floats become double."""
    if kind == "f8":
        return pl.Series(bits.view(np.float64))
    if kind == "f4":
        return pl.Series(bits.astype(np.uint32).view(np.float32).astype(np.float64))
    if kind == "?":
        return pl.Series(bits != 0)
    return pl.Series(bits.astype(kind))  # keeps the low bits, as protobuf does


def texts(data: np.ndarray, start: np.ndarray, length: np.ndarray, dtype: pl.DataType) -> pl.Series:
    """Texts or bytes from where they stand in a block."""
    packed, offsets = kernels.gather(data, start, length)
    buffers: list[pa.Buffer | None] = [None, pa.py_buffer(offsets), pa.py_buffer(packed)]
    raw = pa.LargeBinaryArray.from_buffers(pa.large_binary(), len(start), buffers)
    if dtype == pl.Binary:
        return pl.Series(pl.from_arrow(raw))
    try:
        return pl.Series(pl.from_arrow(raw.cast(pa.large_string())))
    except pa.ArrowInvalid:  # not UTF-8, against the rules: keep what can be shown
        return pl.Series([b.decode(errors="replace") for b in raw.to_pylist()], dtype=pl.String)


def lists(values: pl.Series, counts: np.ndarray, dtype: pl.DataType) -> pl.Series:
    """Values in a row as lists of `counts` values each."""
    offsets = pa.array(np.concatenate(([0], np.cumsum(counts))), pa.int64())
    made = pl.from_arrow(pa.LargeListArray.from_arrays(offsets, values.to_arrow()))
    made = pl.Series(made)
    return made if made.dtype == dtype else made.cast(dtype)


def blanked(column: pl.Series, missing: np.ndarray) -> pl.Series:
    """Null where a message did not have the field."""
    if not missing.any():
        return column
    present = pl.Series(~missing)
    return column.to_frame("x").select(pl.when(present).then(pl.col("x"))).to_series()
