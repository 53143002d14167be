"""Steering by Nomoto's first-order equation, with surge: the model of a ship's two indices.

    T ṙ + r = K δ                                   (Nomoto, Taguchi, Honda & Hirano 1957)
    u̇ = -a u|u| + b n|n| + c v r - d δ²
    T_v v̇ + v = -x_P r                              the ship turns about x_P ahead of midship

T, K and T_v hold at any speed as T' = T U/L, K' = K L/U and T'_v = T_v U/L. U does not vanish:
1 % of √(gL) stands under its root. The rudder meets the flow U_R² = u² + s (nD)², so that it steers
at rest with the propeller ahead; sin δ stands for δ, since harbour orders are large. Two rudders
are their mean. Thrusters, and propellers off the centre line, turn a ship whose radius of gyration
is L/4. No wind and no side force of a propeller acts on it.

K. Nomoto, T. Taguchi, K. Honda and S. Hirano, On the Steering Qualities of Ships, International
Shipbuilding Progress 4 (35), 1957.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from shiplog.exceptions import ProfileError, listed, nearest
from shiplog.models import coefficients
from shiplog.models.coefficients import ParameterEntry as Entry
from shiplog.models.mmg.estimate import GRAVITY
from shiplog.models.mmg.geometry import Geometry, geometry_of
from shiplog.models.mmg.model import named
from shiplog.models.physical import Beginning, PhysicalModel, Settings
from shiplog.ship_profile.profile import Profile

TABLE = {  # the entry of each coefficient, and where it starts: a merchant ship's
    "steering.k": (Entry("K'", "turning ability", 0.5, 0.2, 0.0, 10.0), 1.2),
    "steering.t": (Entry("T'", "time constant of turning", 0.5, 0.2, 0.05, 20.0), 1.5),
    "steering.slipstream": (
        Entry("s", "rudder inflow from the propeller", 1.0, 0.1, 0.0, 5.0),
        0.3,
    ),
    "sway.x_p": (Entry("x'_P", "pivot point ahead of midship", 0.5, 0.1, -1.0, 2.0), 0.4),
    "sway.t": (Entry("T'_v", "time constant of drifting", 0.5, 0.2, 0.05, 20.0), 0.7),
    "surge.a": (Entry("a'", "resistance", 0.5, 0.03, 0.0, 2.0), 0.08),
    "surge.c": (Entry("c", "speed lost in a turn", 0.3, 0.3, 0.0, 5.0), 1.5),
    "surge.d": (Entry("d'", "speed lost by the rudder", 1.0, 0.05, 0.0, 5.0), 0.15),
    "propeller.ahead": (Entry("b₊", "thrust ahead", 0.5, 0.0, 0.0, 2.0), 0.25),
    "propeller.astern": (Entry("b₋", "thrust astern", 0.5, 0.0, 0.0, 2.0), 0.2),
}
THRUST = Entry("T'_T", "thrust over weight", 1.0, 0.0, 0.0, 1.0)
THRUST_START = 0.05  # of all units together, as of an MMG that nobody measured
STILL = 0.01  # √(gL) under which a ship's speed no longer sets its time constants
GYRATION = 0.25  # L


@jax.tree_util.register_static
@dataclass(frozen=True, slots=True)
class KT:
    """A ship's equations; hashable, its numbers come as a vector θ in order of `names`."""

    geometry: Geometry
    substeps: int = 1

    @property
    def smooth(self) -> float:
        """s between which its derivatives change little: a rudder is put over in a second."""
        return 0.0

    @property
    def fixed(self) -> dict[str, np.ndarray]:
        """Arrays that are no coefficients and belong to a run of it: none."""
        return {}

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(_table(self.geometry))

    def acceleration(self, theta: Array, state: Array, actuator: Array, true_wind: Array) -> Array:
        """ν̇ [..., 3]; arguments as for MMG.acceleration."""
        return reduce(jnp.add, self._parts(theta, state, actuator).values())

    def forces(
        self, theta: Array, state: Array, actuator: Array, true_wind: Array
    ) -> dict[str, Array]:
        """As MMG.forces: accelerations times the ship's mass and moment of inertia."""
        g = self.geometry
        inertia = g.mass * jnp.array([1.0, 1.0, (GYRATION * g.length) ** 2])
        return {name: inertia * a for name, a in self._parts(theta, state, actuator).items()}

    def _parts(self, theta: Array, state: Array, actuator: Array) -> dict[str, Array]:
        """Part → what it adds to ν̇ [..., 3]."""
        p, g, length = named(self.names, theta), self.geometry, self.geometry.length
        u, v, r = state[..., 1], state[..., 3], state[..., 5]
        speed = jnp.sqrt(u * u + v * v + STILL**2 * GRAVITY * length)
        surge = p["surge.c"] * v * r - p["surge.a"] * u * jnp.abs(u) / length
        sway = -(v + p["sway.x_p"] * length * r) * speed / (length * p["sway.t"])
        yaw = -r * speed / (length * p["steering.t"])
        parts = {"hull": jnp.stack((surge, sway, yaw), -1)}
        jet = jnp.zeros_like(u)
        for s in g.propellers:
            nd = actuator[..., s.column] * s.diameter
            b = jnp.where(nd >= 0.0, p["propeller.ahead"], p["propeller.astern"])
            ahead = b * g.density * s.diameter**2 * nd * jnp.abs(nd) / g.mass
            added = self._accelerated(ahead, jnp.zeros_like(u), s.ahead, s.starboard)
            parts["propeller"] = parts.get("propeller", 0.0) + added
            jet = jet + jnp.maximum(nd, 0.0) ** 2 / len(g.propellers)
        if g.rudders:
            order = sum(jnp.sin(actuator[..., b.column]) for b in g.rudders) / len(g.rudders)
            flow = jnp.maximum(u, 0.0) ** 2 + p["steering.slipstream"] * jet
            turning = p["steering.k"] / p["steering.t"] * flow / length**2 * order
            drag = sum(jnp.sin(actuator[..., b.column]) ** 2 for b in g.rudders) / len(g.rudders)
            slowing = -p["surge.d"] * flow / length * drag
            parts["rudder"] = jnp.stack((slowing, jnp.zeros_like(u), turning), -1)
        for t in g.thrusters:
            command = actuator[..., t.column] / t.full
            angle = t.direction if t.turned_by is None else actuator[..., t.turned_by]
            thrust = p[f"thruster.{t.name}"] * GRAVITY * command * jnp.abs(command)
            added = self._accelerated(
                thrust * jnp.cos(angle), thrust * jnp.sin(angle), t.ahead, t.starboard
            )
            parts["thruster"] = parts.get("thruster", 0.0) + added
        return parts

    def _accelerated(self, x: Array, y: Array, ahead: float, starboard: float) -> Array:
        """ν̇ of a force per mass at a place."""
        turning = (ahead * y - starboard * x) / (GYRATION * self.geometry.length) ** 2
        return jnp.stack((x, y, turning), -1)


def _table(g: Geometry) -> dict[str, tuple[Entry, float]]:
    """Name → entry and start of the coefficients that a ship of this geometry has."""
    lacking = set() if g.rudders else {"steering.k", "steering.slipstream", "surge.d"}
    if not g.propellers:
        lacking |= {"steering.slipstream", "propeller.ahead", "propeller.astern"}
    found = {name: row for name, row in TABLE.items() if name not in lacking}
    share = THRUST_START / max(len(g.thrusters), 1)
    return found | {f"thruster.{t.name}": (THRUST, share) for t in g.thrusters}


def begin(profile: Profile, settings: Settings, path: Path | None) -> Beginning:
    """The ship's equations with the coefficients of a file, else a merchant ship's. Raises
    ProfileError."""
    geometry, _, estimates = geometry_of(profile, settings.without)
    table, source = _table(geometry), "a merchant ship's indices"
    content: dict[str, dict[str, float]] = {}
    for name, (_, start) in table.items():
        part, key = name.split(".", 1)
        content.setdefault(part, {})[key] = start
    if path is not None:
        content, source = coefficients.read(path, "K-T")
        for name in (f"{part}.{key}" for part, keys in content.items() for key in keys):
            if name not in table:
                raise ProfileError(
                    f"{path}: {name} is not a coefficient{nearest(name, table)}.",
                    hint=f"they are {listed(table, most=40)}.",
                )
    wanted = {name: entry for name, (entry, _) in table.items()}
    start = coefficients.parameters(wanted, content, source, where=str(path or ""))
    return Beginning(KT(geometry, settings.substeps), start, estimates)


def opened(profile: Profile, settings: Settings, arrays: Mapping[str, np.ndarray]) -> KT:
    """The equations of a run. Raises ProfileError."""
    return KT(geometry_of(profile, settings.without)[0], settings.substeps)


MODEL = PhysicalModel(
    begin, opened,
    lacks="a K-T model has no forces of hull, propeller and rudder in newtons: causes that change "
    "forces cannot be identified",
)  # fmt: skip
