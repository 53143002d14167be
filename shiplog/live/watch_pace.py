"""When a watch looks again, and when it ends by itself."""

from __future__ import annotations

from dataclasses import dataclass

from shiplog.live.session import Watch
from shiplog.nomenclature.units import SECOND_NS

LOOK_S = 0.05  # between two looks at a source that has nothing new: half a row


@dataclass
class Pace:
    """stop_after_s  s without a message, after which the watch ends; None: never"""

    stop_after_s: float | None

    def over(self, watch: Watch, clock: int) -> bool:
        if self.stop_after_s is None or watch.last_arrival is None or watch.busy:
            return False
        return clock - watch.last_arrival > self.stop_after_s * SECOND_NS
