"""The low-speed MMG model: one small function a force, one table of coefficients."""

from __future__ import annotations

import jax

from shiplog.models.mmg.geometry import PARTS, Geometry, geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.models.mmg.parameters import Parameters, beside, estimated, load, meaning, neutral

jax.config.update("jax_enable_x64", True)  # sensitivities in float32 do not tell causes apart

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
