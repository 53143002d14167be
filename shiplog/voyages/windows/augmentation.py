"""Slicing and jittering of the paper: how many windows are made of the same rows (Table 3)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Augmentation:
    """How many times over the same rows are used: every `step` rows, `copies` noisy ones."""

    step: int
    copies: int = 0


AUGMENTATIONS = {  # Table 3 of the paper: step S and copies M, for windows of I = 100
    "ref": Augmentation(100), "sli2": Augmentation(50), "sli10": Augmentation(10),
    "jit2": Augmentation(100, 2), "jit10": Augmentation(100, 10),
    "sli2xjit2": Augmentation(50, 2), "sli10xjit10": Augmentation(10, 10),
    "d-ref": Augmentation(100),
}  # fmt: skip
