"""The low-speed MMG model: one small function a force, one table of coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from shiplog.models.coefficients import Parameters
from shiplog.models.mmg.geometry import PARTS, Geometry, geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.models.mmg.parameters import estimated, load, published_file
from shiplog.models.physical import Beginning, PhysicalModel, Settings
from shiplog.ship_profile.profile import Profile

__all__ = [
    "MMG",
    "MODEL",
    "PARTS",
    "Geometry",
    "Parameters",
    "begin",
    "estimated",
    "geometry_of",
    "load",
    "opened",
    "published_file",
]


def begin(profile: Profile, settings: Settings, path: Path | None = None) -> Beginning:
    """The ship's MMG with the coefficients of a file, else those published next to the profile,
    else those that the particulars suggest. Raises ProfileError."""
    ship, main, estimates = geometry_of(profile, settings.without)
    path = path or published_file(profile.source)
    start = load(path, ship, settings.without) if path else estimated(ship, main)
    if path is None:
        estimates = (*estimates, f"no published coefficients for this ship: {start.source}")
    return Beginning(MMG(ship, settings.substeps), start, estimates)


def opened(profile: Profile, settings: Settings, arrays: Mapping[str, np.ndarray]) -> MMG:
    """The equations of a run. Raises ProfileError."""
    return MMG(geometry_of(profile, settings.without)[0], settings.substeps)


MODEL = PhysicalModel(begin, opened)
