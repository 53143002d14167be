"""Voyages of a store as the tracks in which manoeuvres are looked for."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from shiplog.manoeuvres.track import Track
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows import recording
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store.store import Store

LEAST_ROWS = 20  # of an unbroken stretch at 10 Hz


def read(store: Store, name: str, profile: Profile) -> Record:
    """The 10 Hz rows of a voyage. Raises StoreError."""
    return recording.read([store.tables([name])[0].collect()], [name], profile)


def steering(profile: Profile) -> np.ndarray:
    """[A] weights whose sum is the rudder angle, positive to starboard: the mean of rudders, or of
    azimuths astern of midship where there is no rudder (thrust to starboard turns to port)."""
    rudders = np.array([a.kind == "rudder" for a in profile.actuators], dtype=float)
    if rudders.any():
        return rudders / rudders.sum()
    astern = [a.kind == "azimuth" and a.position_m[0] < 0.0 for a in profile.actuators]
    aft = np.array(astern, dtype=float)
    return -aft / max(aft.sum(), 1.0)


def driving(profile: Profile) -> np.ndarray:
    """[A] weights whose sum is the mean of what drives the ship."""
    kinds = [a.kind == "propeller" for a in profile.actuators]
    if not any(kinds):
        kinds = [a.kind == "thruster" for a in profile.actuators]
    found = np.array(kinds, dtype=float)
    return found / max(found.sum(), 1.0)


def tracks(record: Record) -> list[Track]:
    """Its unbroken stretches."""
    profile = record.profile
    edges = np.append(np.flatnonzero(record.starts), len(record))
    rudder, screw = record.actuator @ steering(profile), record.actuator @ driving(profile)
    return [
        Track(
            record.time[a:b], record.state[a:b], rudder[a:b], screw[a:b], profile.ship.length_m
        )
        for a, b in itertools.pairwise(edges)
        if b - a >= LEAST_ROWS
    ]  # fmt: skip


def voyages_of(store: Store, names: Sequence[str], profile: Profile) -> dict[str, Record]:
    return {name: read(store, name, profile) for name in names}
