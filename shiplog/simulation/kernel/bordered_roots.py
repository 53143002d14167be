"""Cholesky roots of many small bordered matrices at once, a matrix a lane.

    [[A, b], [bᵀ, c]] = L Lᵀ,  A = K + Q⁻¹:   c - bᵀ A⁻¹ b = L²ₙₙ,   log|A| = 2 Σ_{i<n} log Lᵢᵢ

The likelihood of a noise needs them for every segment, hundreds of times, of the same K, b and c
under another Q: these are packed once (`Packed`). Block by block of four rows, left-looking
(Golub & Van Loan 2013, Matrix Computations, Sec. 4.2.6).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from shiplog.simulation.kernel import kinds
from shiplog.simulation.kernel.kinds import Kernel, aligned, contiguous, pointer
from shiplog.simulation.kernel.writer import INT, POINTER, Function, Module, Value

ROWS = 4  # of a block, and columns: sixteen sums in registers


@dataclass(frozen=True)
class Packed:
    """Lower triangles of S bordered matrices, rows of a block as long as its last one; `places`
    are where their elements stand in a square that is filled up to whole blocks."""

    lanes: np.ndarray  # [blocks of lanes, places, lanes]
    places: np.ndarray
    count: int
    n: int


def packed(kk: np.ndarray, kd: np.ndarray, dd: np.ndarray) -> Packed:
    """K [S, n, n], b [S, n] and c [S]."""
    lanes = _kernel().lanes
    count, n = kd.shape
    size = -(-(n + 1) // ROWS) * ROWS
    whole = np.zeros((-(-count // lanes) * lanes, size, size))
    whole[:, range(size), range(size)] = 1.0
    whole[:count, :n, :n], whole[:count, n, :n], whole[:count, n, n] = kk, kd, dd
    places = _places(size)
    flat = whole.reshape(-1, lanes, size * size)[..., places]
    return Packed(np.ascontiguousarray(np.moveaxis(flat, 1, 2)), places, count, n)


@cache
def _places(size: int) -> np.ndarray:
    rows = [
        i * size + np.arange((i // ROWS + 1) * ROWS) for i in range(size)
    ]  # a block's rows are as long as its last
    return np.concatenate(rows)


def roots(
    of: Packed, inverse: np.ndarray, which: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """c - bᵀ A⁻¹ b and log|A|, each [S], of Q⁻¹ [U, n, n], the one `which` [S] of them each has, or
    the first. c - bᵀ A⁻¹ b is never negative: what rounding makes so is zero. Raises
    np.linalg.LinAlgError where an A is not positive definite, or anything not finite."""
    kernel, n = _kernel(), of.n
    size = -(-(n + 1) // ROWS) * ROWS
    whole = np.zeros((len(inverse), size, size))
    whole[:, :n, :n] = inverse
    added = contiguous(whole.reshape(len(inverse), -1)[:, of.places])
    blocks = len(of.lanes)
    each = np.zeros(blocks * kernel.lanes, dtype=np.int64)
    if which is not None:
        each[: of.count] = which
        each[of.count :] = which[-1]
    work = aligned(len(of.places) * kernel.lanes)
    diagonal = np.empty((blocks, size, kernel.lanes))
    arrays = (of.lanes, added, each, work, diagonal)
    kernel.functions["roots"](*map(pointer, arrays), blocks, len(of.places), size // ROWS)
    found = np.moveaxis(diagonal, 2, 1).reshape(-1, size)[: of.count, : n + 1]
    lead, last = found[:, :n], found[:, n]
    rounded = np.isnan(last)  # the root of less than nothing
    sound = np.isfinite(lead).all() and (lead > 0.0).all() and not np.isinf(last).any()
    if not sound or (rounded.any() and not np.isfinite(of.lanes).all()):
        raise np.linalg.LinAlgError("a matrix is not positive definite, or not finite")
    return np.where(rounded, 0.0, last) ** 2, 2.0 * np.log(lead).sum(1)


@cache
def _kernel() -> Kernel:
    return kinds.plain("bordered roots", _write, (("roots", "pppppiii"),))


def _write(module: Module) -> None:
    """`roots` of matrices, Q⁻¹, which, work and diagonal, of so many blocks of lanes, places of a
    matrix, and blocks of rows."""
    names = ("given", "added", "which", "work", "diagonal")
    counts = ("blocks", "places", "rows")
    arguments = [(n, POINTER) for n in names] + [(n, INT) for n in counts]
    with module.function("roots", arguments) as (f, values):
        one: dict[str, Value] = dict(zip((*names, *counts), values, strict=True))
        with f.loop(one["blocks"], outer=True) as block:
            _begin(f, one, block)
            with f.loop(one["rows"], outer=True) as b:
                inverse = _diagonal(f, one, block, b)
                with f.loop(one["rows"], b + 1, outer=True) as below:
                    _below(f, one["work"], b, below, inverse)


def _begin(f: Function, one: dict[str, Value], block: Value) -> None:
    """A = K + Q⁻¹ into `work`."""
    lanes, places = f.module.lanes, one["places"]
    which = [f.load(one["which"], block * lanes + lane, INT) for lane in range(lanes)]
    first = which[0].compared("eq", which[0])
    for other in which[1:]:
        same = which[0].compared("eq", other)
        first = f.put(f"and i1 {first.text}, {same.text}", "i1")
    unlike = f.put(f"xor i1 {first.text}, true", "i1")
    rows = [f.at(one["added"], u * places) for u in which]
    with f.when(first), f.loop(places) as i:
        value = f.load_lanes(one["given"], block * places + i)
        f.store_lanes(value + f.spread(f.load(rows[0], i)), one["work"], i)
    with f.when(unlike), f.loop(places) as i:
        value = f.load_lanes(one["given"], block * places + i)
        f.store_lanes(value + f.together([f.load(row, i) for row in rows]), one["work"], i)


def _row(b: Value, row: int) -> Value:
    """Where a row of block b begins: 4 rows of 4 (j + 1) for each block j before it."""
    return b * (b + 1) * (ROWS * ROWS // 2) + (b + 1) * (ROWS * row)


def _diagonal(f: Function, one: dict[str, Value], block: Value, b: Value) -> list[Value]:
    """Root of the block on the diagonal; one over its diagonal elements."""
    work, cells = one["work"], [(p, q) for p in range(ROWS) for q in range(p + 1)]
    rows, at = [_row(b, p) for p in range(ROWS)], b * ROWS
    sums = {cell: f.reserve() for cell in cells}
    for p, q in cells:
        f.store_lanes(f.load_lanes(work, rows[p] + at + q), sums[p, q])
    with f.loop(at) as k:
        left = [f.load_lanes(work, row + k) for row in rows]
        for p, q in cells:
            f.store_lanes(f.load_lanes(sums[p, q]) - left[p] * left[q], sums[p, q])
    a = {cell: f.load_lanes(place) for cell, place in sums.items()}
    inverse: list[Value] = []
    for q in range(ROWS):
        for k in range(q):
            a[q, q] = a[q, q] - a[q, k] * a[q, k]
        a[q, q] = f.intrinsic("sqrt", a[q, q])
        inverse.append(f.lanes(1.0) / a[q, q])
        for p in range(q + 1, ROWS):
            for k in range(q):
                a[p, q] = a[p, q] - a[p, k] * a[q, k]
            a[p, q] = a[p, q] * inverse[q]
    for p, q in cells:
        f.store_lanes(a[p, q], work, rows[p] + at + q)
    for p in range(ROWS):
        place = (block * one["rows"] + b) * ROWS + p
        f.store_lanes(a[p, p], one["diagonal"], place)
    return inverse


def _below(f: Function, work: Value, b: Value, below: Value, inverse: list[Value]) -> None:
    """The block of rows `below` in the columns of block b."""
    cells = [(p, q) for p in range(ROWS) for q in range(ROWS)]
    left, right = ([_row(of, p) for p in range(ROWS)] for of in (below, b))
    at = b * ROWS
    sums = {cell: f.reserve() for cell in cells}
    for p, q in cells:
        f.store_lanes(f.load_lanes(work, left[p] + at + q), sums[p, q])
    with f.loop(at) as k:
        x = [f.load_lanes(work, row + k) for row in left]
        for q in range(ROWS):
            y = f.load_lanes(work, right[q] + k)
            for p in range(ROWS):
                f.store_lanes(f.load_lanes(sums[p, q]) - x[p] * y, sums[p, q])
    a = {cell: f.load_lanes(place) for cell, place in sums.items()}
    for q in range(ROWS):
        for k in range(q):
            y = f.load_lanes(work, right[q] + at + k)
            for p in range(ROWS):
                a[p, q] = a[p, q] - a[p, k] * y
        for p in range(ROWS):
            a[p, q] = a[p, q] * inverse[q]
            f.store_lanes(a[p, q], work, left[p] + at + q)
