"""Messages that are logged far ahead of those around them, and a recorder's clock that is set back.

A window of the last minutes ends at its latest log time: one message of tomorrow would make every
other one too old. So a message more than FAR_S ahead of all before it waits for the next of its
topic. Where that one is as far ahead, the clock was set, or the source paused, and both count; else
the first is left out. A clock was set back where half of the topics that are heard send messages
more than FAR_S older than the latest, and none a later one: a topic handed over late is one of
many.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np
import polars as pl

from shiplog.live import messages
from shiplog.live.messages import Frames
from shiplog.nomenclature.units import SECOND_NS

FAR_S = 30.0  # s: slower than any source that a row at 10 Hz is made of, less than a window holds
MOST_OLD = 0.5  # of the topics


@dataclass(frozen=True)
class Ordered:
    """frames    without what is left out or waits
    left_out  topic → s by which a message was ahead
    back_s    s by which the clock was set back; 0 where it was not
    """

    frames: Frames
    left_out: dict[str, float] = field(default_factory=dict)
    back_s: float = 0.0


class ClockSteps:
    """Of one source.

    newest   ns, the latest log time that counts; 0 before the first
    waiting  topic → its last message, far ahead of all others
    old      topics that sent older messages since the last one that was not old
    """

    def __init__(self) -> None:
        self.newest = 0
        self.waiting: dict[str, pl.DataFrame] = {}
        self.old: set[str] = set()

    def order(self, frames: Frames, heard: Collection[str]) -> Ordered:
        """Messages of one look, topic by topic in the order in which they came; `heard` are the
        topics of the window."""
        before, kept, left_out = self.newest, {}, {}
        for topic, frame in frames.items():
            if not frame.height:
                continue
            if (first := self.waiting.pop(topic, None)) is not None:
                frame = pl.concat((first, frame), how="diagonal_relaxed")
            frame, ahead = self._without_lone(topic, frame, before)
            if ahead:
                left_out[topic] = ahead
            if frame.height:
                kept[topic] = frame
        back = self._back(kept, before, heard)
        self.newest = messages.newest(kept) if back else max(before, messages.newest(kept))
        return Ordered(kept, left_out, back)

    def _without_lone(
        self, topic: str, frame: pl.DataFrame, newest: int
    ) -> tuple[pl.DataFrame, float]:
        """Without messages that are ahead of the one before and the one after; the last one waits
        where it is ahead of all. By how much the furthest was ahead [s]."""
        times = frame["log_time"].fill_null(0).to_numpy()
        if newest == 0:  # nothing to compare the first with
            earlier = np.concatenate((times[:1], times[:-1]))
        else:
            earlier = np.maximum(np.concatenate(([newest], times[:-1])), newest)
        up = (times - earlier) / SECOND_NS
        down = np.append((times[:-1] - times[1:]) / SECOND_NS, np.inf)
        lone = (up > FAR_S) & (down > FAR_S)
        if not lone.any():
            return frame, 0.0
        if lone[-1]:
            self.waiting[topic] = frame[-1:]
        left_out = lone.copy()
        left_out[-1] = False
        return frame.filter(pl.Series(~lone)), float(up[left_out].max(initial=0.0))

    def _back(self, kept: Frames, newest: int, heard: Collection[str]) -> float:
        """By how much the clock was set back [s], or 0."""
        if not newest or not kept:
            return 0.0
        latest = {topic: messages.last_time(frame) for topic, frame in kept.items()}
        behind = (newest - max(latest.values())) / SECOND_NS
        if behind <= FAR_S:
            self.old.clear()
            return 0.0
        self.old |= set(latest)
        if len(self.old & set(heard)) < MOST_OLD * len(heard):
            return 0.0
        self.old.clear()
        return behind
