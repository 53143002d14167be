"""The standard manoeuvres, sailed by models alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from shiplog.exceptions import ModelError
from shiplog.manoeuvres import simulated
from shiplog.manoeuvres.conditions import Conditions
from shiplog.manoeuvres.entry import LABELS, Entry, drawn_of, lines_of
from shiplog.manoeuvres.quantity import Estimate
from shiplog.manoeuvres.simulated import STANDARD, Simulated
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.schedules import Manoeuvre, PullOut, Turn, Zigzag
from shiplog.training.runs.sailing_run import Sailor, without_water


def by_the_book(
    profile: Profile,
    sailors: Sequence[Sailor | None],
    deep: Sailor | None,
    scale: float,
    members: int,
) -> list[Entry]:
    """The standard manoeuvres, in calm and still water, at the run's nominal speed."""
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
            loaded = None
            if deep is not None:
                loaded = simulated.sail(deep, manoeuvre, members, speed=speed).quantities
            found.append(_sailed(manoeuvre, profile, models, loaded, speed, scale, reasons))
    return found


def _sailed(
    manoeuvre: Manoeuvre,
    profile: Profile,
    models: Sequence[Simulated | None],
    loaded: Mapping[str, Estimate] | None,
    speed: float,
    scale: float,
    reasons: Sequence[str],
) -> Entry:
    angle = getattr(manoeuvre, "angle", 0.0)
    heading = manoeuvre.heading if isinstance(manoeuvre, Zigzag) else 0.0
    side = math.copysign(1.0, angle)
    there = [(label, m) for label, m in zip(LABELS, models, strict=True) if m is not None]
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
        lines=lines_of(
            manoeuvre.kind, angle, heading, profile, speed, scale, None,
            *(None if m is None else m.quantities for m in models), full_load=loaded, astern=astern,
        ),
        drawn=tuple(drawn_of(lb, simulated.track_of(m.sailed, 0, profile), 0.0)
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
