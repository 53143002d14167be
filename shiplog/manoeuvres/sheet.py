"""The sheet: each manoeuvre with its conditions, and each quantity measured, simulated, extended,
and its limit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from shiplog.exceptions import ModelError, listed
from shiplog.manoeuvres import conditions as sailed_in
from shiplog.manoeuvres import drift, loading, measure, recognition, simulated, stretches
from shiplog.manoeuvres.by_the_book import by_the_book
from shiplog.manoeuvres.entry import LABELS, Entry, drawn_of, lines_of
from shiplog.manoeuvres.loading import Loaded
from shiplog.manoeuvres.measure import Measured
from shiplog.manoeuvres.quantity import Estimate
from shiplog.manoeuvres.recognition import Found
from shiplog.manoeuvres.simulated import Simulated
from shiplog.ship_profile.profile import Profile
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.sailing_run import MEMBERS, Sailor, of_run
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store.store import Store


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
    full_load: bool = False


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
    full_load: bool = False,
) -> Sheet:
    """Of these voyages by these runs; without voyages, what the runs sail by the book.

    full_load   also R = T F/B of the plain run, at the profile's second draught. Raises
                ProfileError where there is none
    """
    if not (scale > 0.0 and math.isfinite(scale)):
        raise ModelError(
            f"A scale of {scale:g} is none.", hint="give --scale how many times the ship is longer."
        )
    plain, more = chosen(runs)
    sailors = tuple(None if run is None else of_run(run) for run in (plain, more))
    deep = loading.loaded(sailors[0]) if full_load else None
    found: list[tuple[Found, Record]] = []
    for name in names:
        assert store is not None
        record = stretches.read(store, name, profile)
        tracks = stretches.tracks(record)
        found += [(one, record) for one in recognition.recognise(name, tracks)]
    speeds = [one.approach.speed for one, _ in found if one.approach is not None]
    nominal = max(speeds, default=0.0)
    entries = [
        _recorded(one, rec, profile, sailors, deep, nominal, scale, members) for one, rec in found
    ]
    entries += by_the_book(profile, sailors, deep, scale, members)
    return Sheet(
        profile, scale, tuple(entries), _notes(scale, sailors, deep), _engine(sailors),
        (None if plain is None else plain.name, None if more is None else more.name), tuple(names),
        full_load,
    )  # fmt: skip


ENGINE = (1.0, 0.75, 0.5, 0.25)  # of the run's nominal speed: full, half, slow and dead slow ahead


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


def _notes(scale: float, sailors: Sequence[Sailor | None], deep: Loaded | None) -> tuple[str, ...]:
    notes = ["Heel is not modelled: no angle of heel is given, and its effect on turning is not."]
    if scale != 1.0:
        notes.append(
            f"Scaled by Froude's law with {scale:g}: lengths by {scale:g}, times and speeds by "
            f"{math.sqrt(scale):.4g}. It was sailed at the model's own self-propulsion point, "
            "without a correction for skin friction: the model's screw is loaded more than the "
            "ship's, its rudder is in a faster slipstream, and overshoots and circles come out "
            "smaller than the ship's."
        )
    if deep is not None:
        notes.append(deep.note)
    for sailor in sailors:
        if sailor is not None and sailor.ignored:
            notes.append(
                f"{sailor.run.name} was extended by {listed(sailor.ignored)}, which is about "
                "what is recorded: it does not change how the ship sails."
            )
        if sailor is not None and sailor.fitted_band:
            notes.append(
                f"{sailor.run.name} has no voyages that were held out: its discrepancy is that of "
                "those that it was fitted to, and its intervals are narrower than its errors on "
                "others."
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
    deep: Loaded | None,
    nominal: float,
    scale: float,
    members: int,
) -> Entry:
    own = measure.measured(found, profile, record.step)
    models = [
        simulated.as_recorded(s, found, record, own.drift, members)
        if s is not None and own.quantities
        else None
        for s in sailors
    ]
    full = _full_load(deep, models[0], found, record, own, members)
    covered = next((1.0 - m.outside.share for m in models if m is not None), None)
    cond = sailed_in.of(found, record, profile, covered)
    notes = [f"{label}: {m.note}" for label, m in zip(LABELS, models, strict=True) if m and m.note]
    moved = own.drift
    path = found.track if moved is None else found.track.without(moved.velocity)
    drawn = [drawn_of("measured", path, found.begin)]
    for label, m in zip(LABELS, models, strict=True):
        if m is not None:
            path = simulated.track_of(m.sailed, 0, profile)
            own_drift = None
            if moved is not None:
                own_drift = drift.of_turn(path, 0.0, found.side)
            path = path if own_drift is None else path.without(own_drift.velocity)
            drawn.append(drawn_of(label, path, 0.0))
    return Entry(
        voyage=found.voyage, start=found.begin, kind=found.kind, name=found.name,
        angle=found.angle, heading=found.heading, side=found.side, conditions=cond,
        why_not=sailed_in.why_not(found, cond, profile, nominal, scale),
        notes=tuple(notes),
        drift=None if moved is None else (moved.speed, moved.direction_deg),
        lines=lines_of(
            found.kind, found.angle, found.heading, profile, cond.speed, scale,
            own.quantities, *(None if m is None else m.quantities for m in models),
            full_load=full, astern=bool((found.track.screw < 0.0).any()),
        ),
        drawn=tuple(drawn),
    )  # fmt: skip


def _full_load(
    deep: Loaded | None, ballast: Simulated | None, found: Found, record: Record, own: Measured,
    members: int,
) -> Mapping[str, Estimate] | None:  # fmt: skip
    """R = T F/B; None where it is not asked for, or cannot be worked out."""
    if deep is None or ballast is None:
        return None
    loaded = simulated.as_recorded(deep, found, record, own.drift, members, revolutions=False)
    if loaded is None:
        return None
    return loading.full_load(own.quantities, ballast.each, loaded.each)
