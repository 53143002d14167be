"""Where a simulation leaves the data that its run was trained on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from shiplog.simulation import coverage


@dataclass(frozen=True)
class Outside:
    """Where a simulation left the run's training data.

    share      of its seconds
    distance   mean over them, in limits of the coverage; 1 where all are inside
    channels   name → share of the seconds in which that channel is beyond what was recorded
    """

    share: float
    distance: float
    channels: Mapping[str, float]

    @property
    def anywhere(self) -> bool:
        return self.share >= coverage.OUTSIDE

    @property
    def sentence(self) -> str:
        """Empty where it is inside."""
        if not self.anywhere:
            return ""
        where = [
            f"{name.replace('_', ' ')} ({share:.0%})"
            for name, share in sorted(self.channels.items(), key=lambda one: -one[1])
            if share >= coverage.OUTSIDE
        ]
        named = f": {', '.join(where)}" if where else ""
        return f"outside the training data in {self.share:.0%} of the seconds{named}"
