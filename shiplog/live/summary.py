"""What a watch says in words: when it begins, of each event, and of the whole at its end."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from shiplog.live.alarm import Alarm
from shiplog.live.calibration import Calibration
from shiplog.live.error_now import Point
from shiplog.live.events import Event, RowsCame, SegmentDone, as_json, clock, sentence
from shiplog.live.health import Notice
from shiplog.live.session import Watch
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted
from shiplog.nomenclature.units import SECOND_NS
from shiplog.training.runs.load_model import Run

SHOWN_S = 10.0  # s of rows between two lines of text about the error
MOST_LISTED = 200  # alarms and notices that the answer holds


@dataclass
class Counts:
    """Of one watch."""

    rows: int = 0
    revised: int = 0
    shown: int = 0
    inside: int = 0
    points: int = 0
    segments: int = 0
    alarms: list[dict[str, Any]] = field(default_factory=list)
    notices: list[dict[str, Any]] = field(default_factory=list)

    def note(self, event: Event) -> None:
        if isinstance(event, RowsCame):
            self.rows += event.final.height
            self.shown += event.provisional.height
            self.revised += event.revised
        elif isinstance(event, Point) and event.inside is not None and not event.provisional:
            self.points += 1
            self.inside += event.inside
        elif isinstance(event, SegmentDone):
            self.segments += 1
        for kind, kept in ((Alarm, self.alarms), (Notice, self.notices)):
            if isinstance(event, kind):
                kept.append(as_json(event) or {})
                del kept[:-MOST_LISTED]


@dataclass(frozen=True)
class Watched:
    """The answer of `shiplog watch`, once it has ended."""

    run: str
    source: str
    counts: Counts
    alarm: bool  # whether there could be one

    @property
    def json(self) -> dict[str, Any]:
        c = self.counts
        return {
            "contract": CONTRACT, "kind": "end", "run": self.run, "source": self.source,
            "rows": c.rows, "revised": c.revised, "segments": c.segments,
            "inside": round(c.inside / c.points, 4) if c.points else None,
            "alarms": len(c.alarms), "health": len(c.notices), "could_alarm": self.alarm,
        }  # fmt: skip

    @property
    def text(self) -> str:
        return "\n".join(self.lines)

    @property
    def lines(self) -> list[str]:
        c = self.counts
        share = f", {100.0 * c.inside / c.points:.0f} % of the seconds inside the band" if (
            c.points
        ) else ""  # fmt: skip
        raised = counted(len(c.alarms), "alarm") if self.alarm else "no alarm was possible"
        return [
            f"Watched {self.source} with {self.run}: {counted(c.rows, 'row')}{share}; "
            f"{counted(c.segments, 'segment')}, {raised}, "
            f"{counted(len(c.notices), 'message')} on health."
        ]

    def __str__(self) -> str:
        return self.text


Fact = tuple[dict[str, Any], str]


def begun(found: Calibration, per_day: float) -> Fact:
    """What the alarm is set to."""
    watcher = found.watcher(per_day)
    beyond = watcher.thresholds.extrapolated
    note = (
        "; the nominal campaign is too short to show that rate, which is extrapolated"
        if beyond else ""
    )  # fmt: skip
    fact = {
        "contract": CONTRACT, "kind": "start", "false_alarms_per_day": per_day,
        "segment_s": found.segment_s, "threshold": round(watcher.thresholds.change, 3),
        "extrapolated": beyond,
    }  # fmt: skip
    words = (
        f"An alarm is raised from {watcher.thresholds.change:.1f} nats on, at most "
        f"{per_day:g} a day by error{note}. A segment lasts {found.segment_s:.0f} s."
    )
    return fact, words


def without_alarm(why: str) -> Fact:
    """Why there is none."""
    reason = why or "its nominal campaign is too short"
    return (
        {"contract": CONTRACT, "kind": "start", "false_alarms_per_day": None, "why": reason},
        f"There is no alarm with this run: {reason}. The error is shown in its band.",
    )


def resumed(watch: Watch) -> Fact:
    """Where it goes on."""
    begin = watch.segments.begin if watch.segments is not None else 0
    return {"kind": "resumed", "time": clock(begin)}, f"Goes on from {clock(begin)}."


def proposed(name: str, run: Path, store: Path) -> Fact:
    """The next command."""
    command = f"shiplog diagnose {run} --store {store} --voyages {name} --out {name}"
    return (
        {"kind": "kept", "voyage": name, "command": command},
        f"The rows since then are the voyage {name}. For a verdict: {command}",
    )


def watched(watch: Watch, counts: Counts, source: str, run: Run) -> Watched:
    return Watched(run.name, source, counts, watch.watcher is not None)


def line(event: Event) -> str | None:
    """A line of text; None of what is only counted."""
    if isinstance(event, Alarm):
        return f"{clock(event.time)}  ALARM  {sentence(event)}"
    if isinstance(event, Notice):
        return f"{clock(event.time)}  health  {event.sentence}"
    if isinstance(event, Point) and event.time % round(SHOWN_S * SECOND_NS) < SECOND_NS // 20:
        band = f" (band {event.band_m:.2f} m, {event.band_deg:.1f} deg)" if (
            event.band_m is not None and event.band_deg is not None
        ) else ""  # fmt: skip
        return (
            f"{clock(event.time)}  off by {event.position_m:.2f} m, {event.heading_deg:+.1f} deg "
            f"after {event.since:.0f} s{band}"
        )
    return None
