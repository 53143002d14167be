"""Rollouts of windows by the kernel of their kind of ship: arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from shiplog.nomenclature.channels import VELOCITY_WEIGHTS
from shiplog.simulation.kernel import kinds
from shiplog.simulation.kernel.kinds import Kernel, Purpose, aligned, contiguous, pointer, unset
from shiplog.simulation.kernel.windows import BLOCK, STATES, Sizes, Windows
from shiplog.simulation.window_series import Normal, WindowSeries

CHUNK = 8  # steps whose rows are kept before they are summed: 24 rows of 70 are in the cache


def _write_paths(module: Any, sizes: Any) -> None:
    made = Windows(module, sizes["rates"])
    made.rollout("rates")
    made.values("rates")


def _write_slopes(module: Any, sizes: Any) -> None:
    made = Windows(module, sizes["derivatives"])
    made.slopes("derivatives")
    made.normal("derivatives", VELOCITY_WEIGHTS)


PATHS = Purpose(
    "paths", _write_paths, (("rates", ""),), (("rollout", "ppppppiiid"), ("values", "pppi"))
)
SLOPES = Purpose(
    "slopes", _write_slopes, (("derivatives", "state and θ"),),
    (("slopes_of", "ppppppppiiid"), ("normal", "ppppppppppppp" + "iiiiii" + "d")),
)  # fmt: skip


def _write_row_slopes(module: Any, sizes: Any) -> None:
    Windows(module, sizes["around"]).row_slopes("around")


ROW_SLOPES = Purpose(
    "row slopes", _write_row_slopes, (("around", "all"),), (("row_slopes", "pppi"),)
)


def _of(model: Any, purpose: Purpose, theta: np.ndarray, driven: int) -> Kernel | None:
    return kinds.kernel(model, purpose, driven, len(theta))


def values(model: Any, theta: np.ndarray, inputs: np.ndarray) -> np.ndarray | None:
    """ν̇ [n, 3] of rows (state, what drives) [n, 6 + D]."""
    of = valuer(model, theta, inputs.shape[1] - STATES)
    return None if of is None else of(inputs)


def valuer(model: Any, theta: np.ndarray, driven: int) -> Callable[[np.ndarray], np.ndarray] | None:
    """`values` of one model with its coefficients, for many calls: what depends on them alone is
    worked out once."""
    kernel = _of(model, PATHS, theta, driven)
    if kernel is None:
        return None
    c, run = kernel.prepared(model, theta), kernel.functions["values"]

    def of(inputs: np.ndarray) -> np.ndarray:
        rows = contiguous(inputs, len(inputs), STATES + driven)
        found = np.empty((len(rows), 3))
        if len(rows):
            run(pointer(c), pointer(rows), pointer(found), len(rows))
        return found

    return of


def row_slopes(model: Any, theta: np.ndarray, inputs: np.ndarray) -> tuple[np.ndarray, ...] | None:
    """ν̇ [n, 3], ∂ν̇/∂x [n, 3, 6], ∂ν̇/∂u [n, 3, D] and ∂ν̇/∂θ [n, 3, P] of rows (state, what drives)
    [n, 6 + D]."""
    driven = inputs.shape[1] - STATES
    kernel = _of(model, ROW_SLOPES, theta, driven)
    if kernel is None:
        return None
    rows = contiguous(inputs, len(inputs), STATES + driven)
    by = Sizes(driven, len(theta), STATES + driven)
    found = np.empty((len(rows), by.outputs))
    c = kernel.prepared(model, theta)
    if len(rows):
        kernel.functions["row_slopes"](pointer(c), pointer(rows), pointer(found), len(rows))
    by_inputs = found[:, by.slopes : by.by_theta].reshape(-1, 3, by.by)
    by_theta = found[:, by.by_theta :].reshape(-1, 3, len(theta))
    return found[:, :3], by_inputs[..., :STATES], by_inputs[..., STATES:], by_theta


def rollout(model: Any, theta: np.ndarray, data: WindowSeries) -> np.ndarray | None:
    """States [N, I, 6]."""
    kernel = _of(model, PATHS, theta, _driven(data))
    if kernel is None:
        return None
    count, instants = data.measured.shape[:2]
    found = np.empty((count, instants, STATES))
    c, given = kernel.prepared(model, theta), _given(data)
    if count:
        kernel.functions["rollout"](
            pointer(c), *map(pointer, given), pointer(found), count, instants, *_steps(model)
        )
    return found


def slopes(
    model: Any, theta: np.ndarray, data: WindowSeries,
    out: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray] | None:  # fmt: skip
    """States [N, I, 6] and their derivatives [N, I, 6, P]."""
    kernel = _of(model, SLOPES, theta, _driven(data))
    if kernel is None:
        return None
    count, instants = data.measured.shape[:2]
    shape, padded = (count, instants, STATES), _padded(len(theta), kernel.lanes)
    states, found = out or (np.empty(shape), unset(*shape, padded)[..., : len(theta)])
    _check_kept(states, shape, STATES)
    _check_kept(found, (*shape, len(theta)), padded)
    work = aligned(STATES * padded * kernel.lanes)
    c, given = kernel.prepared(model, theta), _given(data)
    if count:
        kernel.functions["slopes_of"](
            pointer(c), *map(pointer, given), pointer(states), found.ctypes.data, pointer(work),
            count, instants, *_steps(model),
        )  # fmt: skip
    return states, found


def normal(model: Any, theta: np.ndarray, data: WindowSeries, free: Sequence[int]) -> Normal | None:
    """Loss [N], half its gradient [N, n] and JᵀJ [n, n] by the `free` coefficients."""
    kernel = _of(model, SLOPES, theta, _driven(data))
    if kernel is None:
        return None
    count, instants = data.measured.shape[:2]
    n, lanes = len(free), kernel.lanes
    padded, blocks = _padded(n, BLOCK), -(-count // lanes)
    columns = np.ascontiguousarray(free, dtype=np.int64)
    if n and not (columns.min() >= 0 and columns.max() < len(theta)):
        raise ValueError(f"free names coefficients that are not of {len(theta)}")
    loss, pull = np.empty(blocks * lanes), np.empty((blocks, padded, lanes))
    s, rows = aligned(STATES * padded * lanes), aligned(CHUNK * 3 * padded * lanes)
    cells = padded // BLOCK * (padded // BLOCK + 1) // 2
    gram = aligned(cells, BLOCK, BLOCK, lanes)
    c, measured = kernel.prepared(model, theta), contiguous(data.measured)
    steps, weight = contiguous(data.steps, count, instants), contiguous(data.weight, count)
    given = [*_given(data)[1:], steps, weight]
    if count:
        kernel.functions["normal"](
            pointer(c), pointer(measured), *map(pointer, given), pointer(columns), pointer(loss),
            pointer(pull), pointer(s), pointer(rows), pointer(gram),
            count, instants, _steps(model)[0], n, padded, CHUNK, _steps(model)[1],
        )  # fmt: skip
    half = np.moveaxis(pull, 2, 1).reshape(-1, padded)[:count, :n]
    return Normal(loss[:count], half, _square(gram.sum(-1), padded)[:n, :n])


def _check_kept(values: np.ndarray, shape: tuple[int, ...], row: int) -> None:
    """Raises ValueError for memory that is not laid out as an earlier call has given it: rows of
    `row` numbers, of which the last ones may be hidden."""
    bytes_, strides = 8, [8]
    for size in (row, *shape[-2:0:-1]):
        bytes_ *= size
        strides.append(bytes_)
    if (
        values.shape != shape
        or values.dtype != float
        or values.strides != tuple(strides[::-1])
        or not values.flags.writeable
    ):
        raise ValueError(f"out has to be what an earlier call gave, of the shape {shape}")


def _driven(data: WindowSeries) -> int:
    return data.actuator.shape[-1] + 2


def _given(data: WindowSeries) -> list[np.ndarray]:
    """First states, actuators, wind and steps. Raises ValueError where they do not fit together."""
    count, instants, _ = data.measured.shape
    return [
        contiguous(data.measured[:, 0], count, STATES),
        contiguous(data.actuator, count, instants, data.actuator.shape[-1]),
        contiguous(data.wind, count, instants, 2),
        contiguous(data.dt, count, instants - 1),
    ]


def _steps(model: Any) -> tuple[int, float]:
    """Steps to each measured one, and the part of it that each is."""
    return model.substeps, 1.0 / model.substeps


def _padded(count: int, to: int) -> int:
    return max(-(-count // to) * to, to)


def _square(cells: np.ndarray, size: int) -> np.ndarray:
    """The whole matrix of its blocks [cells, 4, 4] at and above the diagonal."""
    found = np.zeros((size, size))
    at = 0
    for i in range(0, size, BLOCK):
        for j in range(i, size, BLOCK):
            found[i : i + BLOCK, j : j + BLOCK] = cells[at]
            if i != j:
                found[j : j + BLOCK, i : i + BLOCK] = cells[at].T
            at += 1
    return found
