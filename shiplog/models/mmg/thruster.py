"""A thruster that is known by its command alone: azimuths, tunnels, outboards of small craft."""

from __future__ import annotations

from collections.abc import Mapping

from shiplog.machine.arrays import Array, jnp
from shiplog.models.mmg.geometry import Geometry, Thruster


def thruster(
    p: Mapping[str, Array], g: Geometry, unit: Thruster, u: Array, v: Array, r: Array, at: Array
) -> Array:
    """X_T, Y_T, N_T [..., 3] at midship of the actuator row `at` [..., A].

    T = T₊ c|c| ahead, T₋ c|c| astern, c the command over the full one; less ℓ_T |T| u_T of the
    flow u_T along its axis, the linear fall of thrust with speed (Fossen 2011, Sec. 9.2).
    """
    command = at[..., unit.column] / unit.full
    angle = unit.direction if unit.turned_by is None else at[..., unit.turned_by]
    c, s = jnp.cos(angle), jnp.sin(angle)
    strength = jnp.where(
        command >= 0.0, p[f"thruster.{unit.name}_ahead"], p[f"thruster.{unit.name}_astern"]
    )
    bollard = strength * command * jnp.abs(command)
    along = c * (u - unit.starboard * r) + s * (v + unit.ahead * r)
    thrust = bollard - p[f"thruster.{unit.name}_loss"] * jnp.abs(bollard) * along
    x, y = thrust * c, thrust * s
    x, y = jnp.broadcast_arrays(x, y)
    return jnp.stack((x, y, unit.ahead * y - unit.starboard * x), axis=-1)
