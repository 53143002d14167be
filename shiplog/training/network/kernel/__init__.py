"""The compiled kernel: loss and gradient of a network's rollouts in C++, where it was built.

`pip install` builds it where a C++ compiler is at hand, and does without it elsewhere. One file
holds it for every processor; AVX-512, AVX2 or plain instructions are chosen when it is loaded.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Tensor

LEVELS = ("portable", "avx2", "avx512")
SWITCH = "SHIPLOG_KERNEL"  # environment: one of LEVELS, or "off"

_POINTER = ctypes.c_void_p
_LONG = ctypes.c_int64


class _Network(ctypes.Structure):
    _fields_ = [
        ("depth", _LONG), ("width", _LONG), ("inputs", _LONG), ("input_tanh", _LONG),
        ("weights", ctypes.POINTER(_POINTER)), ("input_mean", _POINTER), ("input_std", _POINTER),
        ("output_mean", _POINTER), ("output_std", _POINTER), ("error_weights", _POINTER),
    ]  # fmt: skip


class _Windows(ctypes.Structure):
    _fields_ = [
        ("steps", _LONG), ("count", _LONG), ("velocity", _POINTER), ("driven", _POINTER),
        ("dt", _POINTER),
    ]  # fmt: skip


@cache
def _library() -> ctypes.CDLL | None:
    found = find_spec(f"{__name__}._rollouts")
    if found is None or found.origin is None:
        return None
    try:
        library = ctypes.CDLL(found.origin)
    except OSError:  # built for another machine
        return None
    for name in ("f32", "f64"):
        call = getattr(library, f"shiplog_rollouts_{name}")
        call.restype = ctypes.c_double
        call.argtypes = [
            ctypes.c_int, ctypes.POINTER(_Network), ctypes.POINTER(_Windows),
            ctypes.POINTER(_POINTER), ctypes.c_int,
        ]  # fmt: skip
        update = getattr(library, f"shiplog_adam_{name}")
        update.restype = None
        update.argtypes = [ctypes.c_int, *[_POINTER] * 4, _LONG, _LONG, *[ctypes.c_double] * 2]
    return library


def level() -> str | None:
    """One of LEVELS: the instructions that the kernel runs on; None where it was not built, or is
    switched off."""
    library, wanted = _library(), os.environ.get(SWITCH, "")
    if library is None or wanted == "off":
        return None
    highest = library.shiplog_level()
    return LEVELS[min(LEVELS.index(wanted), highest) if wanted in LEVELS else highest]


def loss_and_gradient(
    weights: Sequence[Tensor],
    velocity: Tensor,
    driven: Tensor,
    dt: Tensor,
    scales: Sequence[Tensor],
    input_tanh: bool,
    gradient: bool,
    at: str,
    threads: int = 1,
) -> tuple[float, list[Tensor]]:
    """L of Eq. 8, a mean over windows, and its gradient for each weight (none where not asked for).

    weights   W₁ [H, inputs], b₁ [H], ..., W [3, H], b [3]
    velocity  [I, N, 3], driven [I, N, inputs - 3] standardised, dt [I - 1, N]
    scales    mean and standard deviation of the velocities, then of the accelerations, then the
              squared weights of the velocity errors; each [3]
    at        the level to run on

    All tensors have one type, float32 or float64. The result's bits do not depend on `threads`.
    Without a window the loss is not a number. Raises MemoryError, and TypeError for mixed types.
    """
    library = _library()
    assert library is not None
    if {t.dtype for t in (*weights, velocity, driven, dt, *scales)} != {velocity.dtype}:
        raise TypeError("the kernel takes tensors of one type")
    kept = [t.contiguous() for t in (velocity, driven, dt, *scales)]
    own = [w.contiguous() for w in weights]
    slopes = [w.new_empty(w.shape) for w in own] if gradient else []
    pointers = (_POINTER * len(own))(*(w.data_ptr() for w in own))
    into = (_POINTER * len(own))(*(g.data_ptr() for g in slopes)) if gradient else None
    at_ = [t.data_ptr() for t in kept]
    network = _Network(
        len(own) // 2 - 1, own[0].shape[0], own[0].shape[1], int(input_tanh), pointers, *at_[3:]
    )
    windows = _Windows(dt.shape[0], dt.shape[1], *at_[:3])
    single = velocity.dtype.itemsize == 4
    call = library.shiplog_rollouts_f32 if single else library.shiplog_rollouts_f64
    loss = call(LEVELS.index(at), network, windows, into, threads)
    if loss == -1.0:
        raise MemoryError
    return loss, slopes


def adam(
    weights: Sequence[Tensor],
    means: Sequence[Tensor],
    squares: Sequence[Tensor],
    gradients: Sequence[Tensor],
    step: int,
    rate: float,
    decay: float,
    at: str,
) -> None:
    """One update of Adam (Kingma and Ba, 2015; β = 0.9, 0.999; ε = 1e-8), in place.

    `step` counts from 1; `decay` times the weight is added to its gradient, as in torch's
    `weight_decay`. All tensors are contiguous and of one type.
    """
    library = _library()
    assert library is not None
    single = weights[0].dtype.itemsize == 4
    call = library.shiplog_adam_f32 if single else library.shiplog_adam_f64
    for of in zip(weights, means, squares, gradients, strict=True):
        pointers = [t.data_ptr() for t in of]
        call(LEVELS.index(at), *pointers, of[0].numel(), step, rate, decay)
