"""How far the child has come: the second of the voyage, in a file that both sides map.

A process that ends in the middle of a step says nothing more. What it wrote into memory stays.
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path

DOUBLE = struct.Struct("<d")


class Progress:
    """Of one child."""

    def __init__(self) -> None:
        self.memory: mmap.mmap | None = None

    def open(self, path: Path) -> None:
        """In the child, the file that its parent made."""
        with path.open("r+b") as file:
            self.memory = mmap.mmap(file.fileno(), DOUBLE.size)

    def at(self, second: float) -> None:
        if self.memory is not None:
            DOUBLE.pack_into(self.memory, 0, second)


NOW = Progress()  # of this process


def begun(path: Path) -> None:
    """In the parent: nothing is known yet."""
    path.write_bytes(DOUBLE.pack(float("nan")))


def read(path: Path) -> float:
    """The last second that the child began; not a number where it began none."""
    return float(DOUBLE.unpack(path.read_bytes()[: DOUBLE.size])[0])
