"""One random stream per purpose: more jitter must not change the initial weights."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Generator


def number(seed: int, purpose: str) -> int:
    """Where the stream of a seed and a purpose begins, in [0, 2⁶³)."""
    digest = hashlib.sha256(f"{purpose}:{seed}".encode()).digest()
    return int.from_bytes(digest[:8], "little") >> 1


def generator(seed: int, purpose: str) -> Generator:
    """A stream of its own for each seed and purpose ("weights", "batches", "jitter")."""
    import torch  # only networks draw from it; a hybrid needs the number alone

    return torch.Generator().manual_seed(number(seed, purpose))
