"""The low-speed MMG model: hull, screws, rudders, thrusters and wind on a rigid body."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from shiplog.machine import trees
from shiplog.machine.arrays import Array, jnp, numbers
from shiplog.models.mmg import body, hull, parameters, propeller, rudder, thruster, wind
from shiplog.models.mmg.geometry import Geometry, joined, split


@dataclass(frozen=True, slots=True)
class MMG:
    """A ship's equations of motion; its numbers come as a vector θ in order of `names`.

    A JAX pytree of the geometry's sizes and places: what is compiled for one ship serves another
    with the same actuators.

    The assembly is Miyauchi et al. 2022; each force names its own authors.
    """

    geometry: Geometry
    substeps: int = 1  # Euler steps within each measured second; small craft are stiff

    @property
    def smooth(self) -> float:
        return 0.0  # a rudder is put over in a second

    @property
    def names(self) -> tuple[str, ...]:
        return parameters.names(self.geometry)

    @property
    def fixed(self) -> dict[str, np.ndarray]:
        """Arrays that are no coefficients and belong to a run of it: none."""
        return {}

    def forces(
        self, theta: Array, state: Array, actuator: Array, true_wind: Array
    ) -> dict[str, Array]:
        """Part → X, Y, N [..., 3] at midship, N and N m.

        theta      [P]        in order of `names`
        state      [..., 6]   channels.STATE
        actuator   [..., A]   the profile's order [rad, rev/s or 1]
        true_wind  [..., 2]   where it comes from, along x₀ and y₀ [m/s]
        """
        return self.forces_of(named(self.names, theta), state, actuator, true_wind)

    def forces_of(
        self, p: Mapping[str, Array], state: Array, actuator: Array, true_wind: Array
    ) -> dict[str, Array]:
        """The same of coefficients by name; the wind's may join where the ship has none."""
        g = self.geometry
        u, v, heading, r = state[..., 1], state[..., 3], state[..., 4], state[..., 5]
        found = {"hull": hull.hull(p, g, u, v, r)}
        screws = [_screw(p, g, s, u, v, r, actuator) for s in g.propellers]
        if screws:
            found["propeller"] = total(s[0] for s in screws)
        if g.rudders:
            found["rudder"] = total(_blade(p, g, b, screws, u, v, r, actuator) for b in g.rudders)
        if g.thrusters:
            found["thruster"] = total(
                thruster.thruster(p, g, t, u, v, r, actuator) for t in g.thrusters
            )
        if g.wind or "wind.x1" in p:
            found["wind"] = wind.wind(p, g, *wind.apparent(true_wind, heading, u, v))
        return found

    def acceleration(self, theta: Array, state: Array, actuator: Array, true_wind: Array) -> Array:
        """ν̇ [..., 3] in m/s² and rad/s²; arguments as for `forces`."""
        return self.acceleration_of(named(self.names, theta), state, actuator, true_wind)

    def acceleration_of(
        self, p: Mapping[str, Array], state: Array, actuator: Array, true_wind: Array
    ) -> Array:
        """The same of coefficients by name; "load.mass" and "load.moment" [kg, kg m] may join."""
        force = total(self.forces_of(p, state, actuator, true_wind).values())
        u, v, r = state[..., 1], state[..., 3], state[..., 5]
        return body.accelerations(p, self.geometry, u, v, r, force)


def _flat(model: MMG) -> tuple[list[Any], tuple[Geometry, int]]:
    numbers, left = split(model.geometry)
    return numbers, (left, model.substeps)


def _whole(fixed: tuple[Geometry, int], numbers: Iterable[Any]) -> MMG:
    geometry, substeps = fixed
    return MMG(joined(geometry, iter(numbers)), substeps)


trees.register(MMG, _flat, _whole)


def named(names: Sequence[str], theta: Array) -> dict[str, Array]:
    """θ [P] as name → number."""
    return dict(zip(names, numbers(theta, len(names)), strict=True))


def total(forces: Iterable[Array]) -> Array:
    return reduce(jnp.add, forces)


def _screw(
    p: Mapping[str, Array], g: Geometry, screw, u: Array, v: Array, r: Array, actuator: Array
) -> tuple[Array, Array, Array, Array]:
    """Force, 1 - w_P, K_T and n of one screw. "propeller.<name>.factor" may join p: how many times
    the thrust that the coefficients say this one of several screws has."""
    n = actuator[..., screw.column]
    arriving = propeller.inflow(p, g, screw, u, v, r)
    k_t, effective = propeller.thrust_coefficient(p, screw, u, arriving, n)
    factor = p.get(f"propeller.{screw.name}.factor")
    if factor is not None:
        k_t, effective = factor * k_t, factor * effective
    return propeller.propeller(p, g, screw, u, n, effective), arriving, k_t, n


def _blade(
    p: Mapping[str, Array], g: Geometry, blade, screws, u: Array, v: Array, r: Array, actuator
) -> Array:
    if blade.behind is None:
        screw, arriving, k_t, n = None, jnp.ones_like(u), jnp.zeros_like(u), jnp.zeros_like(u)
    else:
        screw = g.propellers[blade.behind]
        _, arriving, k_t, n = screws[blade.behind]
    u_r = rudder.ahead_inflow(p, blade, screw, u, arriving, k_t, n)
    return rudder.rudder(p, g, blade, u_r, v, r, actuator[..., blade.column])
