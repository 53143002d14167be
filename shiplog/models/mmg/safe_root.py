"""Functions whose derivative must exist where the formula has a corner at rest."""

from __future__ import annotations

from shiplog.machine.arrays import Array, jnp

STANDSTILL = 1e-12  # m²/s²: below, the ship stands


def root(square: Array, least: float = STANDSTILL) -> Array:
    """√s for s ≥ 0 with a finite derivative at 0, where it is √least instead of 0."""
    return jnp.sqrt(jnp.maximum(square, least))


def speed(u: Array, v: Array) -> Array:
    """√(u² + v²)."""
    return root(u * u + v * v)
