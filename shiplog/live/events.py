"""What a watch reports: frozen events, each one line of JSON and one of text."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import polars as pl

from shiplog.live.alarm import Alarm
from shiplog.live.error_now import Point
from shiplog.live.health import Notice
from shiplog.nomenclature.units import SECOND_NS

# ns, 1990-01-01. No recorder is older: stamps before it count from 1970, or from when the recorder
# was switched on, and say nothing as a date.
DATED_FROM = 631_152_000 * SECOND_NS


@dataclass(frozen=True)
class RowsCame:
    """Rows of one look: the final ones, the provisional ones, how many of those shown before are
    revised, and how long after the newest message of the look the first of them was there."""

    final: pl.DataFrame
    provisional: pl.DataFrame
    revised: int
    delay_s: float

    @property
    def time(self) -> int:
        last = self.provisional if self.provisional.height else self.final
        return int(last["time"].to_physical()[-1]) if last.height else 0


@dataclass(frozen=True)
class SegmentDone:
    """A finished segment: log Z_n and its threshold, log χ²_s/χ̃², and the first suspect so far."""

    time: int
    statistic: float
    threshold: float
    unexplained: float
    leading: str


Event = Point | Notice | Alarm | SegmentDone | RowsCame


def clock(time: int) -> str:
    """UTC with tenths, of ns."""
    return datetime.fromtimestamp(time / SECOND_NS, UTC).strftime("%Y-%m-%dT%H:%M:%S.%f")[:-5] + "Z"


def as_json(event: Event) -> dict[str, Any] | None:
    """As a line of JSON; None of what is only drawn."""
    if isinstance(event, Point):
        return {
            "kind": "point", "time": clock(event.time), "since_s": round(event.since, 1),
            "position_m": _digits(event.position_m), "heading_deg": _digits(event.heading_deg),
            "band_m": _digits(event.band_m), "band_deg": _digits(event.band_deg),
            "inside": event.inside, "provisional": event.provisional,
        }  # fmt: skip
    if isinstance(event, Notice):
        return {
            "kind": "health", "time": clock(event.time), "what": event.what,
            "channel": event.channel, "over": event.over, "sentence": event.sentence,
        }  # fmt: skip
    if isinstance(event, SegmentDone):
        return {
            "kind": "segment", "time": clock(event.time), "statistic": _digits(event.statistic),
            "threshold": _digits(event.threshold), "unexplained": _digits(event.unexplained),
            "leading": event.leading,
        }  # fmt: skip
    if isinstance(event, Alarm):
        return {
            "kind": "alarm", "time": clock(event.time), "statistic": _digits(event.statistic),
            "threshold": _digits(event.threshold), "again": event.again,
            "suspects": [
                {"name": one.name, "log_factor": _digits(one.log_factor),
                 "began": clock(one.began)} for one in event.suspects
            ],
            "sentence": sentence(event),
        }  # fmt: skip
    return None


def sentence(alarm: Alarm) -> str:
    """A suspicion in words: what fits best, what comes next, and that it is no verdict."""
    again = "Still: the" if alarm.again else "The"
    if not alarm.suspects:
        return (
            f"{again} ship moves as the model does not, and no cause of the bank explains how. "
            "A suspicion, not a verdict."
        )
    first, *others = alarm.suspects
    near = [o.name for o in others if o.log_factor > 0.5 * first.log_factor > 0.0]
    also = f", or {' or '.join(near)}" if near else ""
    return (
        f"{again} ship differs from its model since about {since(first.began, alarm.voyage)}. "
        f"Suspected: {first.name}{also}. A suspicion, not a verdict."
    )


def since(time: int, voyage: int | None) -> str:
    """A time [ns] in words: UTC, or the second of the voyage that began at `voyage` where the
    stamps are no date."""
    if time >= DATED_FROM:
        return clock(time)
    if voyage is not None:
        return f"{(time - voyage) / SECOND_NS:.0f} s into the voyage"
    return f"{time / SECOND_NS:.1f} s of the recorder's clock"


def _digits(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.5g}")
