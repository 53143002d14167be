"""Parts of a voyage by time, as names: `trip[0:1200]` is the first 1200 s of `trip`."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

NAME = re.compile(r"^(?P<whole>.+)\[(?P<begin>\d+):(?P<end>\d+)\]$")


@dataclass(frozen=True)
class Part:
    """Seconds `begin` up to, and without, `end` of a whole voyage."""

    whole: str
    begin: int
    end: int

    def __str__(self) -> str:
        return f"{self.whole}[{self.begin}:{self.end}]"


def parse(name: str) -> Part | None:
    """None where a name is not that of a part, or of one without seconds."""
    found = NAME.match(name)
    if found is None or int(found["begin"]) >= int(found["end"]):
        return None
    return Part(found["whole"], int(found["begin"]), int(found["end"]))


def overlap(one: str, other: str) -> bool:
    """Whether two names share seconds: the same voyage, a part of it, or two parts that meet."""
    if one == other:
        return True
    a, b = parse(one), parse(other)
    if a is None and b is None:
        return False
    if a is None or b is None:
        part, whole = (b, one) if a is None else (a, other)
        assert part is not None
        return part.whole == whole
    return a.whole == b.whole and a.begin < b.end and b.begin < a.end


def overlapping(names: Iterable[str], others: Iterable[str]) -> list[str]:
    """Those of `names` that share seconds with any of the others."""
    others = list(others)
    return [name for name in names if any(overlap(name, other) for other in others)]
