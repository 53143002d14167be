"""The low-speed MMG model: one small function a force, one table of coefficients."""

from __future__ import annotations

from shiplog import jit_cache  # noqa: F401  # JAX in double precision
from shiplog.models.mmg.geometry import PARTS, Geometry, geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.models.mmg.parameters import Parameters, beside, estimated, load, meaning, neutral

__all__ = [
    "MMG",
    "PARTS",
    "Geometry",
    "Parameters",
    "beside",
    "estimated",
    "geometry_of",
    "load",
    "meaning",
    "neutral",
]
