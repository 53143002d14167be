"""A dynamic model and the causes that were found to be missing in it.

Coefficients are those of an MMG. Around a model that has none (a network), the same change of an
MMG of the ship's sizes is added to what the model says: ν̇ = f + [g(c') - g(c)].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shiplog.machine import trees
from shiplog.machine.arrays import Array, jnp, numbers
from shiplog.models.causes.base import Cause
from shiplog.models.mmg import body
from shiplog.models.mmg.model import MMG, named, total
from shiplog.nomenclature.frames import in_body_axes


@trees.tree(
    data=["base", "constants", "stand_in", "stand_in_values"],
    fixed=["causes"],
)
@dataclass(frozen=True)
class Extended:
    """θ is the base's, then the causes' numbers, one cause after another.

    base             any equations; those with `acceleration_of` take coefficients by name, and
                     are an MMG's
    stand_in         an MMG of the ship, whose coefficients the causes change
    stand_in_values  [P'] its coefficients where the base is no MMG
    constants        what the causes' forces need and nobody fits

    Its actuators carry one column more than the ship's: the share of the campaign, 0 to 1.
    """

    base: Any
    causes: tuple[Cause, ...]
    stand_in: MMG
    stand_in_values: np.ndarray | Array
    constants: Mapping[str, np.ndarray | Array]

    @property
    def own(self) -> bool:
        """Whether causes change the base's own coefficients, and not those of the stand-in."""
        return hasattr(self.base, "acceleration_of")

    @property
    def bends(self) -> bool:
        """Whether the base is a network: it has no coefficients, and weights bend it."""
        return hasattr(self.base, "bend")

    @property
    def names(self) -> tuple[str, ...]:
        return (
            *self.base.names,
            *(f"{c.label}.{i}" for c in self.causes for i in range(c.count)),
        )

    @property
    def substeps(self) -> int:
        return self.base.substeps

    @property
    def smooth(self) -> float:
        return self.base.smooth

    def numbers(self, theta: Array) -> list[tuple[Array, ...]]:
        """Of each cause."""
        at, found = len(self.base.names), []
        parts = numbers(theta, len(theta))
        for cause in self.causes:
            found.append(tuple(parts[at : at + cause.count]))
            at += cause.count
        return found

    def acceleration(self, theta: Array, state: Array, actuator: Array, true_wind: Array) -> Array:
        """ν̇ [..., 3] over ground; arguments as for MMG.acceleration."""
        count = len(self.base.names)
        values = theta[:count]
        numbers = self.numbers(theta)
        share, actuator = actuator[..., -1], actuator[..., :-1]
        north = east = 0.0
        for cause, p in zip(self.causes, numbers, strict=True):
            water = cause.water(p)
            if water is not None:
                north, east = north + water[0], east + water[1]
        cos, sin = jnp.cos(state[..., 4]), jnp.sin(state[..., 4])
        ahead, starboard = in_body_axes(north, east, cos, sin)
        x0, u, y0, v, heading, r = (state[..., i] for i in range(6))
        wet = jnp.stack((x0, u - ahead, y0, v - starboard, heading, r), -1)
        wind = true_wind + jnp.stack((north, east), -1)
        at = {**self.constants, "share": share}
        before = named(
            self.stand_in.names,
            values if self.own else jnp.asarray(self.stand_in_values),
        )
        after = before
        for cause, p in zip(self.causes, numbers, strict=True):
            after = cause.coefficients(after, p, wet, share, at)
        if self.own:
            acceleration = self.base.acceleration_of(after, wet, actuator, wind)
        else:
            acceleration = self.base.acceleration(values, wet, actuator, wind)
            if after is not before:
                acceleration = acceleration + (
                    self.stand_in.acceleration_of(after, wet, actuator, wind)
                    - self.stand_in.acceleration_of(before, wet, actuator, wind)
                )
        forces = [cause.force(p, wet, at) for cause, p in zip(self.causes, numbers, strict=True)]
        forces = [f for f in forces if f is not None]
        if forces:
            at_rest = jnp.zeros_like(u)
            acceleration = acceleration + body.accelerations(
                after, self.stand_in.geometry, at_rest, at_rest, at_rest, total(forces)
            )
        turning = jnp.stack((r * starboard, -r * ahead, jnp.zeros_like(r)), -1)
        return acceleration + turning
