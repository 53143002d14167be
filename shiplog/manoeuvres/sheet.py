"""The sheet: each manoeuvre with its conditions, and each quantity measured, simulated, extended,
and its limit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.exceptions import ModelError, listed
from shiplog.manoeuvres import conditions as sailed_in
from shiplog.manoeuvres import criteria, drift, measure, recognition, simulated, stretches
from shiplog.manoeuvres.conditions import Conditions
from shiplog.manoeuvres.criteria import Limit
from shiplog.manoeuvres.quantity import QUANTITIES, Estimate, Kind
from shiplog.manoeuvres.recognition import Found
from shiplog.manoeuvres.simulated import STANDARD, Simulated
from shiplog.manoeuvres.track import Track
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.schedules import Manoeuvre, PullOut, Turn, Zigzag
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.sailing_run import MEMBERS, Sailor, of_run, without_water
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store.store import Store

MOST_POINTS = 400  # of a drawn track


@dataclass(frozen=True)
class Line:
    """One quantity; None where it is not known."""

    name: str
    measured: Estimate | None
    simulated: Estimate | None
    extended: Estimate | None
    limit: Limit | None

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
            "extended": one(self.extended),
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


@dataclass(frozen=True)
class Sheet:
    """ship      L, name; `scale` λ by which times and speeds are those of a ship from a model
    entries   by voyage and time, then those that the models alone sail
    notes     about all of it
    engine    (speed through the water, its actuators in SI) at which the model keeps it
    runs      labels of the simulated and the extended run; None where there is none
    """

    profile: Profile
    scale: float
    entries: tuple[Entry, ...]
    notes: tuple[str, ...]
    engine: tuple[tuple[float, tuple[float, ...]], ...]
    runs: tuple[str | None, str | None]
    voyages: tuple[str, ...]


def chosen(runs: Sequence[Run]) -> tuple[Run | None, Run | None]:
    """The plain and the extended one. Raises ModelError for two of a kind."""
    plain = [run for run in runs if run.extension is None]
    more = [run for run in runs if run.extension is not None]
    if len(plain) > 1 or len(more) > 1:
        raise ModelError(
            f"The sheet has one column for a model and one for an extended one, and is given "
            f"{listed(run.name for run in runs)}.",
            hint="give one run, and one that a diagnosis extended.",
        )
    return plain[0] if plain else None, more[0] if more else None


def make(
    profile: Profile,
    store: Store | None,
    names: Sequence[str],
    runs: Sequence[Run],
    scale: float = 1.0,
    members: int = MEMBERS,
) -> Sheet:
    """Of these voyages by these runs; without voyages, what the runs sail by the book."""
    if not (scale > 0.0 and math.isfinite(scale)):
        raise ModelError(
            f"A scale of {scale:g} is none.", hint="give --scale how many times the ship is longer."
        )
    plain, more = chosen(runs)
    sailors = tuple(None if run is None else of_run(run) for run in (plain, more))
    found: list[tuple[Found, Record]] = []
    for name in names:
        assert store is not None
        record = stretches.read(store, name, profile)
        tracks = stretches.tracks(record)
        found += [(one, record) for one in recognition.recognise(name, tracks)]
    speeds = [one.approach.speed for one, _ in found if one.approach is not None]
    usual = max(speeds, default=0.0)
    entries = [_recorded(one, rec, profile, sailors, usual, scale, members) for one, rec in found]
    entries += _by_the_book(profile, sailors, scale, members)
    return Sheet(
        profile, scale, tuple(entries), _notes(scale, sailors), _engine(sailors),
        (None if plain is None else plain.name, None if more is None else more.name), tuple(names),
    )  # fmt: skip


ENGINE = (1.0, 0.75, 0.5, 0.25)  # of the run's usual speed: full, half, slow and dead slow ahead


def _engine(sailors: Sequence[Sailor | None]) -> tuple[tuple[float, tuple[float, ...]], ...]:
    sailor = next((s for s in sailors if s is not None), None)
    if sailor is None:
        return ()
    found = []
    for share in ENGINE:
        speed = share * sailor.speed
        try:
            sticks = sailor.controls(speed)
        except ModelError:
            return ()
        if sticks.balanced:
            found.append((speed, tuple(sticks.approach.tolist())))
    return tuple(found)


def _notes(scale: float, sailors: Sequence[Sailor | None]) -> tuple[str, ...]:
    notes = ["Heel is not modelled: no angle of heel is given, and its effect on turning is not."]
    if scale != 1.0:
        notes.append(
            f"Scaled by Froude's law with {scale:g}: lengths by {scale:g}, times and speeds by "
            f"{math.sqrt(scale):.4g}. It was sailed at the model's own self-propulsion point, "
            "without a correction for skin friction: the model's screw is loaded more than the "
            "ship's, its rudder is in a faster slipstream, and overshoots and circles come out "
            "smaller than the ship's."
        )
    for sailor in sailors:
        if sailor is not None and sailor.ignored:
            notes.append(
                f"{sailor.run.name} was extended by {listed(sailor.ignored)}, which is about "
                "what is recorded: it does not change how the ship sails."
            )
        if sailor is not None and not sailor.spreads:
            notes.append(
                f"{sailor.run.name} has neither an uncertainty of its numbers nor held-out "
                "voyages: its values have no interval."
            )
    return tuple(notes)


# --- recorded --------------------------------------------------------------------------------


def _recorded(
    found: Found,
    record: Record,
    profile: Profile,
    sailors: Sequence[Sailor | None],
    usual: float,
    scale: float,
    members: int,
) -> Entry:
    own = measure.measured(found, profile, record.step)
    models = [
        simulated.beside(s, found, record, own.corrected, members)
        if s is not None and own.quantities
        else None
        for s in sailors
    ]
    covered = next((1.0 - m.outside.share for m in models if m is not None), None)
    cond = sailed_in.of(found, record, profile, covered)
    labels = ("simulated", "extended")
    notes = [f"{label}: {m.note}" for label, m in zip(labels, models, strict=True) if m and m.note]
    moved = own.drift
    path = found.track if moved is None else found.track.without(moved.velocity)
    drawn = [_drawn("measured", path, found.begin)]
    for label, m in zip(labels, models, strict=True):
        if m is not None:
            path = simulated.track_of(m.sailed, 0, profile)
            own_drift = None
            if moved is not None:
                own_drift = drift.of_turn(path, 0.0, found.side)
            path = path if own_drift is None else path.without(own_drift.velocity)
            drawn.append(_drawn(label, path, 0.0))
    return Entry(
        voyage=found.voyage, start=found.begin, kind=found.kind, name=found.name,
        angle=found.angle, heading=found.heading, side=found.side, conditions=cond,
        why_not=sailed_in.why_not(found, cond, profile, usual, scale),
        notes=tuple(notes),
        drift=None if moved is None else (moved.speed, moved.direction_deg),
        lines=_lines(
            found.kind, found.angle, found.heading, profile, cond.speed, scale,
            own.quantities, *(None if m is None else m.quantities for m in models),
            astern=bool((found.track.screw < 0.0).any()),
        ),
        drawn=tuple(drawn),
    )  # fmt: skip


def _lines(
    kind: str,
    angle: float,
    heading: float,
    profile: Profile,
    speed: float,
    scale: float,
    *columns: Mapping[str, Estimate] | None,
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
            for column in (measured, one, more)
        ]
        best = values[0] if measured is not None else values[1] or values[2]
        if best is not None:
            limit = criteria.limit(name, kind, abs(angle), heading, length, fast, astern)
            found.append(Line(name, values[0], values[1], values[2], limit))
    return tuple(found)


def _drawn(label: str, track: Track, begin: float) -> Drawn:
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


# --- by the book -----------------------------------------------------------------------------


def _by_the_book(
    profile: Profile, sailors: Sequence[Sailor | None], scale: float, members: int
) -> list[Entry]:
    """The standard manoeuvres, in calm and still water, at the run's usual speed."""
    calm = [None if s is None else without_water(s) for s in sailors]
    speed = next((s.speed for s in calm if s is not None), 0.0)
    found = []
    for manoeuvre in STANDARD if any(calm) else ():
        models: list[Simulated | None] = []
        reasons: list[str] = []
        for sailor in calm:
            try:
                one = None if sailor is None else simulated.sail(
                    sailor, manoeuvre, members, speed=speed
                )  # fmt: skip
            except ModelError as error:
                one = None
                reasons.append(error.message)
            models.append(one)
        if any(m is not None for m in models):
            found.append(_sailed(manoeuvre, profile, models, speed, scale, reasons))
    return found


def _sailed(
    manoeuvre: Manoeuvre,
    profile: Profile,
    models: Sequence[Simulated | None],
    speed: float,
    scale: float,
    reasons: Sequence[str],
) -> Entry:
    angle = getattr(manoeuvre, "angle", 0.0)
    heading = manoeuvre.heading if isinstance(manoeuvre, Zigzag) else 0.0
    side = math.copysign(1.0, angle)
    labels = ("simulated", "extended")
    there = [(label, m) for label, m in zip(labels, models, strict=True) if m is not None]
    astern = any(bool((m.sailed.actuator[0] < 0.0).any()) for _, m in there)
    return Entry(
        voyage=None, start=0.0, kind=manoeuvre.kind, name=_name(manoeuvre), angle=abs(angle),
        heading=heading, side=side,
        conditions=Conditions(
            speed, 0.0, None, profile.site.depth_m, 1.0 - there[0][1].outside.share, ()
        ),
        why_not=("sailed by the model alone",),
        notes=(*(f"{label}: {m.note}" for label, m in there if m.note), *reasons),
        drift=None,
        lines=_lines(
            manoeuvre.kind, angle, heading, profile, speed, scale, None,
            *(None if m is None else m.quantities for m in models), astern=astern,
        ),
        drawn=tuple(_drawn(lb, simulated.track_of(m.sailed, 0, profile), 0.0)
                    for lb, m in there),
    )  # fmt: skip


def _name(manoeuvre: Manoeuvre) -> str:
    match manoeuvre:
        case Turn():
            where = "starboard" if manoeuvre.angle > 0.0 else "port"
            return f"turn with {abs(math.degrees(manoeuvre.angle)):.0f} deg to {where}"
        case Zigzag():
            where = "starboard" if manoeuvre.angle > 0.0 else "port"
            a, b = abs(math.degrees(manoeuvre.angle)), math.degrees(manoeuvre.heading)
            return f"zigzag {a:.0f}/{b:.0f}, {where} first"
        case PullOut():
            return "pull-out after turns to both sides"
    return manoeuvre.kind.replace("_", "-")
