"""Causes outside the ship: the water, the wind, the bottom, the shore."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from shiplog.machine.arrays import jnp
from shiplog.models.causes.base import (
    FORM_DEVIATIONS,
    Cause,
    Parameter,
    ParameterEstimate,
    Setting,
)


@dataclass(frozen=True)
class Current(Cause):
    """Size: PIANC 2014 (report 121) designs channels for cross-currents of 0.5 to 1.5 kn and more
    along the channel, passed at 5 to 8 kn: 0.1 to 0.4 of the ship's speed, each way."""

    name = "current"
    kind = "environment"
    story = "The water moves with a steady current."
    equation = "ν̇ = f(ν - RᵀV, u, ω) + d(RᵀV)/dt,  V = ({north:+.3f}, {east:+.3f}) m/s"
    remedy = (
        "Give the simulation this current on these voyages. It is the water and not the "
        "ship: do not change the model for other days."
    )
    parameters = (
        Parameter("north", "m/s", 0.25, 0.015, of="speed"),
        Parameter("east", "m/s", 0.25, 0.015, of="speed"),
    )
    separated_by = {
        "heading_offset": "one full slow turn, or the same course out and back",
        "wind_force": "repeat in calm, or turn: wind force follows the wind, a current does not",
        "wind_direction_offset": "one full slow turn; a drifting stop shows the current alone",
    }

    def water(self, p: Any) -> tuple[Any, Any]:
        return p[0], p[1]

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        towards = np.degrees(np.arctan2(p[..., 1], p[..., 0])) % 360.0
        return {"speed": (np.hypot(p[..., 0], p[..., 1]), "m/s"), "direction": (towards, "deg")}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return (
            f"A steady current of {estimates['speed'].value:.3g} m/s towards "
            f"{round(estimates['direction'].value) % 360} deg."
        )


# Standard deviation of the logarithm of the change of surge or yaw over that of sway, where one
# thing changes them together. No figure is published: a quarter, as coefficients of ship types
# differ.
ALIKE = 0.25


@dataclass(frozen=True)
class WindForce(Cause):
    """Of a model that has no wind force, that of such a ship times its numbers.

    Its three forces may differ independently, as coefficients do. A load on deck, a draught or the
    density of the air changes them `alike`: its numbers are then the change of sway, and the
    logarithms of those of surge and yaw over it. An anemometer's scale has the same effect, and
    must not be preferred because three independent numbers seldom agree.

    Size: coefficients ahead of ship types differ by a quarter from their mean (Blendermann 1994, as
    in Fossen 2011, Table 8.1), and areas above water by as much with the load on deck.

    lacking   the coefficients that the model has not
    alike     whether one thing changes all three
    """

    lacking: tuple[str, ...] = ()
    alike: bool = False

    name = "wind_force"
    kind = "environment"
    needs = ("wind",)
    story = "The wind force differs from the model's."
    equation = "X_A·{surge_factor:.2f}, Y_A·{sway_factor:.2f}, N_A·{yaw_factor:.2f}"
    remedy = (
        "Use the extended model in wind like this, and look for what changed the "
        "windage: cargo, containers, a raised structure."
    )
    parameters = (
        Parameter("surge_factor", "1", 0.3, 0.03, low=-1.0),
        Parameter("sway_factor", "1", 0.3, 0.03, low=-1.0),
        Parameter("yaw_factor", "1", 0.3, 0.03, low=-1.0),
    )
    separated_by = {
        "wind_speed_scale": "a second anemometer, or fast straight runs in calm",
        "current": "repeat in calm, or turn: wind force follows the wind, a current does not",
    }

    @property
    def label(self) -> str:
        return f"{self.name}:alike" if self.alike else self.name

    @property
    def special(self) -> bool:
        return self.alike

    @property
    def absorbed(self) -> bool:
        return not self.lacking

    def on(self, setting: Setting) -> WindForce:
        return WindForce(tuple(n for n in setting.lacking if n.startswith("wind.")))

    def each(self, setting: Setting) -> tuple[Cause, ...]:
        """Independent forces, and forces that change alike where the model has any."""
        one = self.on(setting)
        return (one,) if one.lacking else (one, replace(one, alike=True))

    def compatible(self, label: str) -> bool:
        return label.partition(":")[0] != self.name

    def constants(self, setting: Setting) -> dict[str, np.ndarray]:
        values = [setting.lacking[name] for name in self.lacking]
        return {"wind.of_such_a_ship": np.array(values)} if values else {}

    def sizes(self, setting: Setting) -> np.ndarray:
        if self.alike:
            return np.array([setting.prior(self.parameters[1]), ALIKE, ALIKE])
        return np.ones(3) if self.lacking else super().sizes(setting)

    def bounds(self, setting: Setting) -> tuple[np.ndarray, np.ndarray]:
        if self.alike:
            most = FORM_DEVIATIONS * ALIKE
            return np.array([-1.0, -most, -most]), np.array([np.inf, most, most])
        if self.lacking:  # which way the wind turns the ship depends on what stands on deck
            return np.array([0.0, 0.0, -3.0]), np.full(3, np.inf)
        return super().bounds(setting)

    def coefficients(self, c: dict, p: Any, state: Any, share: Any, at: dict) -> dict:
        if self.lacking:
            had, already = dict(zip(self.lacking, at["wind.of_such_a_ship"], strict=True)), 0.0
        else:
            had, already = {k: v for k, v in c.items() if k.startswith("wind.")}, 1.0
        factor = dict(zip("xyn", already + self._added(jnp.stack(list(p)), jnp), strict=True))
        return c | {k: v * factor[k.removeprefix("wind.")[0]] for k, v in had.items()}

    def scales(self, p: np.ndarray) -> dict[str, np.ndarray]:
        """All wind force grows, what the model describes of it and what it does not; where the
        model has none, nothing of it grows."""
        return {} if self.lacking else {"wind": 1.0 + self._added(np.asarray(p))}

    def _added(self, p: Any, xp: Any = np) -> Any:
        """[..., 3] of numbers [..., 3]: what is added to the factors of surge, sway and yaw."""
        if not self.alike:
            return p
        of_sway = p[..., 0]
        return xp.stack((of_sway * xp.exp(p[..., 1]), of_sway, of_sway * xp.exp(p[..., 2])), -1)

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        factors = (0.0 if self.lacking else 1.0) + self._added(np.asarray(p))
        return {q.name: (factors[..., i], "1") for i, q in enumerate(self.parameters)}

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        return super().practical(self._added(np.asarray(p)), setting)

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        x, y, n = (estimates[q.name].value for q in self.parameters)
        whose = "of a ship of this kind; the model has none" if self.lacking else "in the model"
        return (
            f"The wind force is {x:.2f} times that {whose} ahead, {y:.2f} times athwart, and its "
            f"yaw moment {n:.2f} times."
        )


# Share of the force of a bank or of shallow water, that is left wrong with the uncertain factors of
# their equations fitted: a map of a dozen places, or a straight wall, is not the ground itself.
COARSE = 0.2

# What grows in shallow water, by how much per unit of the map. Y_v, N_v and N_r are of a full ship
# by the formulas of Kijima et al. 1990, the others are estimates.
GROWS = (
    (("hull.c_d",), 1.2),
    (("hull.x_0f", "hull.x_0a"), 0.3),
    (("hull.y_v",), 0.8),
    (("hull.n_v",), 1.4),
    (("hull.n_r",), 0.5),
    (("body.m_y",), 0.7),
    (("body.i_j",), 0.2),
)


@dataclass(frozen=True)
class ShallowWater(Cause):
    """Hull forces and added masses grow where the water is shallow; a map of how much, since no
    chart says. Which force grows how fast: Kijima, Katsuno, Nakiri & Furukawa 1990. Growths differ
    from hull to hull. All but that of the cross-flow drag, in which the map is measured, have an
    uncertain factor.

    Size: theirs has a full ship's sway damping a quarter larger at a depth of twice the draught,
    which is 0.3 here; PIANC 2014 begins to count shallow water at 3 draughts, and ends at 1.1."""

    places: int = 12

    realistic, least = 0.3, 0.05

    name = "shallow_water"
    kind = "environment"
    story = "The water is shallow in places."
    equation = "X₀, Y_v, N_v, N_r, C_D, m_y, J grow with a map of depth; at most {strength:.2f}"
    remedy = (
        "Use the extended model where it is as shallow as here. In deep water the model "
        "before it stands."
    )
    parameters = ()
    separated_by = {"cross_flow_drag": "the same manoeuvre at two places"}

    forms = len(GROWS) - 1
    form_error = COARSE

    @property
    def count(self) -> int:
        return self.places + super().count

    def missing(self, setting: Setting) -> str | None:
        return None if len(setting.places) == self.places else "the ship stayed in one place"

    def constants(self, setting: Setting) -> dict[str, np.ndarray]:
        return {"shallow.places": setting.places, "shallow.spacing": np.array(setting.spacing)}

    def sizes(self, setting: Setting) -> np.ndarray:
        return np.append(np.full(self.places, self.realistic), super().sizes(setting))

    def bounds(self, setting: Setting) -> tuple[np.ndarray, np.ndarray]:
        low, high = super().bounds(setting)
        of_map = np.ones(self.places)
        return np.append(-0.5 * of_map, low), np.append(5.0 * of_map, high)

    def coefficients(self, c: dict, p: Any, state: Any, share: Any, at: dict) -> dict:
        near = _bumps(state, at["shallow.places"], at["shallow.spacing"])
        depth = (near * jnp.stack(p[: self.places])).sum(-1)
        depth = jnp.where(depth >= 0.0, depth, 0.0)  # no water is deeper than deep
        grown = {}
        for (names, grows), form in zip(GROWS, (0.0, *p[self.places :]), strict=True):
            factor = 1.0 + grows * jnp.exp(form) * depth
            grown |= {name: c[name] * factor for name in names if name in c}
        return c | grown

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        return {"strength": (p[..., : self.places].max(-1), "1")}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return (
            "Shallow water: at the shallowest place, cross-flow drag is "
            f"{1.0 + 1.2 * estimates['strength'].value:.2f} times that of deep water."
        )

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        return np.asarray(p[..., : self.places].max(-1) > self.least)


def _bumps(state: Any, places: Any, spacing: Any) -> Any:
    """[..., K] Gaussian bumps around the places, that add up to about one between them."""
    north = state[..., 0, None] - places[:, 0]
    east = state[..., 2, None] - places[:, 1]
    return jnp.exp(-0.5 * (north**2 + east**2) / (0.8 * spacing) ** 2)


@dataclass(frozen=True)
class Bank(Cause):
    """Suction towards a wall and the moment that turns the bow from it (Norrbin 1974). Its reach
    and the lever of its moment have uncertain factors.

    Size: all of it. The profile shows the bank and the model has none; published formulas differ
    from each other by about a factor of two (Vantorre, Delefortrie et al. 2003)."""

    name = "bank"
    kind = "environment"
    needs = ("bank",)
    story = "A bank attracts the ship."
    equation = "Y = {strength:.2f} · 0.15 · ½ρLd u² / (1 + (gap/reach)³), N bow out"
    remedy = (
        "Use the extended model along these banks only, and check their lines in the "
        "profile's [site]."
    )
    parameters = (Parameter("strength", "1", 1.0, 0.08),)
    separated_by = {"shallow_water": "the same run farther from the bank"}

    forms = 2
    form_error = COARSE

    def constants(self, setting: Setting) -> dict[str, np.ndarray]:
        banks = setting.profile.site.banks
        lines = [[*a, *b] for bank in banks for a, b in pairwise(bank)]
        of = [i for i, bank in enumerate(banks) for _ in pairwise(bank)]
        ship = setting.profile.ship
        breadth = ship.breadth_m or 0.15 * setting.scale["length"]
        draught = ship.draught_m or 0.07 * setting.scale["length"]
        density = setting.profile.site.density or 1000.0
        return {
            "bank.lines": np.array(lines),
            "bank.same": np.equal.outer(of, of).astype(float),
            "bank.ship": np.array([setting.scale["length"], breadth, draught, density]),
        }

    def force(self, p: Any, state: Any, at: dict) -> Any:
        lines = at["bank.lines"]
        length, breadth, draught, density = (at["bank.ship"][i] for i in range(4))
        to, distance = nearest_points(state, lines)
        gap = jnp.maximum(distance - 0.5 * breadth, 0.0)
        reach, lever = 3.0 * length * jnp.exp(p[1]), 0.25 * length * jnp.exp(p[2])
        near = nearest_share(distance, at["bank.same"]) / (1.0 + (gap / reach) ** 3)
        c, s = jnp.cos(state[..., 4])[..., None], jnp.sin(state[..., 4])[..., None]
        ahead = (c * to[..., 0] + s * to[..., 1]) / distance
        starboard = (c * to[..., 1] - s * to[..., 0]) / distance
        u = state[..., 1, None]
        pull = 0.15 * 0.5 * density * length * draught * (u * starboard) ** 2 * near * p[0]
        lead = u / jnp.sqrt(u * u + 1e-4)
        turn = -lever * pull * starboard * lead
        return jnp.stack(((pull * ahead).sum(-1), (pull * starboard).sum(-1), turn.sum(-1)), -1)

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        strength = estimates["strength"].value
        return (
            f"The bank attracts the ship with {strength:.2f} times the suction of the reference "
            "formula."
        )


def nearest_points(state: Any, lines: Any) -> tuple[Any, Any]:
    """From midship to the nearest point of each straight piece [..., n, 2] along x₀ and y₀, and how
    far that is [..., n].

    lines  [n, 4] where each piece begins and ends
    """
    a, along = lines[:, :2], lines[:, 2:] - lines[:, :2]
    here = jnp.stack((state[..., 0], state[..., 2]), -1)[..., None, :]
    part = ((here - a) * along).sum(-1) / (along**2).sum(-1)
    to = a + jnp.clip(part, 0.0, 1.0)[..., None] * along - here
    return to, jnp.sqrt((to**2).sum(-1) + 1e-6)


def to_wall(state: np.ndarray, banks: Sequence[Sequence[tuple[float, float]]]) -> float:
    """How near midship came to a wall [m], in states [n, 6]; infinite without one."""
    lines = [[*a, *b] for bank in banks for a, b in pairwise(bank)]
    if not lines or not len(state):
        return math.inf
    return float(nearest_points(state, np.array(lines))[1].min())


def nearest_share(distance: Any, same: Any) -> Any:
    """[..., n] share 1 of the piece of each bank that is nearest, shared where pieces are as near:
    a wall attracts as much however many points its line has.

    distance  [..., n] of the pieces of all banks; same [n, n] whether two are of one bank
    """
    others = jnp.where(same > 0.0, distance[..., None, :], jnp.inf).min(-1)
    nearest = jnp.where(distance <= others, 1.0, 0.0)
    return nearest / (nearest @ same)
