"""Voyages that were ingested by a profile which still says CHECK do not train a model."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

from shiplog.exceptions import ProfileError, ShiplogError, listed
from shiplog.ship_profile import file as profile_file
from shiplog.ship_profile.profile import Profile

# What no model computes with, or what has no other value than the drafted one where it is wrong.
HARMLESS = ("name", "sigma", "resolution", "between", "tolerance_s")
# Of a network, which sees the inputs and the motion alone: the ship's size and its parts' places.
OF_PHYSICS = ("position_m", "diameter_m", "area_m2", "span_m", "direction_deg")
SHOWN = 12  # keys that a message names

log = logging.getLogger(__name__)


def refuse_unchecked(profiles: Sequence[Profile], physical: bool, allowed: bool) -> None:
    """Raises ProfileError for keys that still say CHECK and that the model depends on.

    profiles  those that the voyages were ingested by; physical: whether the model has the ship's
    geometry in it; allowed: `--unchecked` was given, and the keys are only reported
    """
    keys = {key: profile for profile in profiles for key in _still_open(profile)}
    mattering = [key for key in keys if matters(key, physical)]
    if not mattering:
        return
    named = listed(mattering, most=SHOWN)
    source = keys[mattering[0]].source or "the profile"
    if allowed:
        log.warning("%s: CHECK still stands at %s; used as drafted", source, named)
        return
    raise ProfileError(
        f"{source} still says CHECK at {named}: what a draft has left open would go into the "
        "model.",
        hint="look at each of these lines, correct it, delete the word CHECK when you have looked, "
        "and ingest the logs again; or give --unchecked.",
    )


def matters(key: str, physical: bool) -> bool:
    """Whether a model depends on a key: `ship.length_m`, `actuators.rudder.unit`, `table.rpm`."""
    section, last = key.partition(".")[0], key.rpartition(".")[2]
    if section != "table" and last in HARMLESS:
        return False
    return physical or not (section in ("ship", "site") or last in OF_PHYSICS)


def _still_open(profile: Profile) -> tuple[str, ...]:
    """The keys that said CHECK when the voyage was ingested, and still do: where nothing but that
    word was changed in the file since, the voyage is as it would be with it."""
    if not profile.unchecked:
        return ()
    try:
        now = profile_file.load(profile.source)
    except ShiplogError:
        return profile.unchecked
    same = _bare(now) == _bare(profile)
    return now.unchecked if same else profile.unchecked


def _bare(profile: Profile) -> dict[str, Any]:
    """What is in a profile, without its accuracies: the store fills in those that it estimated."""
    content = profile.model_dump(exclude={"unchecked"})
    for sensor in content["sensors"].values():
        if sensor:
            sensor.pop("sigma")
    return content
