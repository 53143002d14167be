"""An entry of the sheet: a manoeuvre, its quantities in columns, and its picture's lines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from shiplog.manoeuvres import criteria
from shiplog.manoeuvres.conditions import Conditions
from shiplog.manoeuvres.criteria import Limit
from shiplog.manoeuvres.quantity import QUANTITIES, Estimate, Kind
from shiplog.manoeuvres.track import Track
from shiplog.ship_profile.profile import Profile

MOST_POINTS = 400  # of a drawn track
LABELS = ("simulated", "extended")


@dataclass(frozen=True)
class Line:
    """One quantity; None where it is not known."""

    name: str
    measured: Estimate | None
    simulated: Estimate | None
    extended: Estimate | None
    limit: Limit | None
    full_load: Estimate | None = None

    @property
    def kind(self) -> Kind:
        return QUANTITIES[self.name]

    @property
    def json(self) -> dict:
        def one(estimate: Estimate | None) -> dict | None:
            return None if estimate is None else estimate.json

        limit = self.limit
        return {
            "name": self.name, "unit": self.kind.unit,
            "measured": one(self.measured), "simulated": one(self.simulated),
            "extended": one(self.extended), "full_load": one(self.full_load),
            "limit": None if limit is None else limit.value,
            "clause": None if limit is None else limit.clause,
            "applies": None if limit is None else limit.applies,
            "why_not": "" if limit is None else limit.why_not,
        }  # fmt: skip


@dataclass(frozen=True)
class Drawn:
    """A path in L from the order, the approach's heading up: [n, 2] ahead and to starboard; and
    time [s], heading and rudder [deg] there."""

    label: str
    path: np.ndarray
    time: np.ndarray
    heading: np.ndarray
    rudder: np.ndarray


@dataclass(frozen=True)
class Entry:
    """A manoeuvre of a voyage, or, where `voyage` is None, one that only the model sails.

    why_not   everything that keeps it from being the standard's
    notes     what is to be known of the models' values
    drift     speed [m/s] and direction [deg] of what was taken out as a current
    """

    voyage: str | None
    start: float
    kind: str
    name: str
    angle: float
    heading: float
    side: float
    conditions: Conditions
    why_not: tuple[str, ...]
    notes: tuple[str, ...]
    drift: tuple[float, float] | None
    lines: tuple[Line, ...]
    drawn: tuple[Drawn, ...]

    @property
    def standard(self) -> bool:
        return not self.why_not

    @property
    def json(self) -> dict:
        found: dict = {
            "voyage": self.voyage, "start_s": self.start, "kind": self.kind, "name": self.name,
            "angle_deg": math.degrees(self.angle) * self.side,
            "standard": self.standard, "why_not": "; ".join(self.why_not),
            "conditions": self.conditions.json, "notes": list(self.notes),
            "quantities": [line.json for line in self.lines],
        }  # fmt: skip
        if self.kind == "zigzag":
            found["heading_deg"] = math.degrees(self.heading)
        if self.drift is not None:
            found["drift"] = {"speed": self.drift[0], "direction_deg": self.drift[1]}
        return found


def lines_of(
    kind: str,
    angle: float,
    heading: float,
    profile: Profile,
    speed: float,
    scale: float,
    *columns: Mapping[str, Estimate] | None,
    full_load: Mapping[str, Estimate] | None = None,
    astern: bool = True,
) -> tuple[Line, ...]:
    """Of measured, simulated and extended, each in the scale asked for."""
    measured, one, more = columns
    length, fast = profile.ship.length_m * scale, speed * math.sqrt(scale)
    found = []
    for name, quantity in QUANTITIES.items():
        factor = scale**quantity.froude
        values = [
            column[name].times(factor) if column and name in column else None
            for column in (measured, one, more, full_load)
        ]
        best = values[0] if measured is not None else values[1] or values[2]
        if best is not None:
            limit = criteria.limit(name, kind, abs(angle), heading, length, fast, astern)
            found.append(Line(name, values[0], values[1], values[2], limit, values[3]))
    return tuple(found)


def drawn_of(label: str, track: Track, begin: float) -> Drawn:
    """From a little before the order on; a drift that was taken out is taken out of the path."""
    first, start = track.heading_at(begin), track.place_at(begin)
    every = max(1, len(track) // MOST_POINTS)
    gone = (track.place[::every] - start) / track.length
    c, s = math.cos(first), math.sin(first)
    path = np.stack((gone @ (c, s), gone @ (-s, c)), -1)
    return Drawn(
        label, path, track.time[::every] - begin, np.degrees(track.heading[::every] - first),
        np.degrees(track.rudder[::every]),
    )  # fmt: skip
