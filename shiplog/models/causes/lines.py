"""Causes that hold or pull the ship from outside: a line, a tow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from shiplog.machine.arrays import jnp
from shiplog.models.causes.base import Cause, Parameter, ParameterEstimate, Setting, deviations
from shiplog.nomenclature.numbers import figure

# N per kg of the ship. A ship of 100 000 t is berthed by tugs with a pull of 100 t together, one of
# 20 000 t by 52 t (60 t for each 100 000 t, and 40 t; Hensen 2003, Ch. 5): one of two or three
# pulls with 0.003 to 0.013 N/kg. A mooring line that carries a fifth of the breaking load that
# ES-TRIN 2023, Art. 13.02 asks of a barge of 3500 t has 0.011 N/kg.
PULL = 0.006
LEAST_PULL = 3e-4  # N/kg, of which a ship under way drifts no farther than in a light air

# Share of such a force that its equations leave wrong: no rope is a spring all the way.
ROPE = 0.1

# Share of a force or of its lever: motion tells both by the inertia with added masses, which
# formulas know to a tenth (as of a load, `ship.Payload`).
INERTIA = 0.1

# Lengths of the ship. Where it went no farther from its middle than this, a line's force is the
# same everywhere.
LEAST_REACH = 0.5

# Times as far as the ship went from its middle: a point beyond is a direction and no place.
FAR = 20.0

# Share of the distance at which a line pulls as it does on average: nearer to its point it hangs
# slack, and the pull turns over.
SLACK = 0.1

DOUBT = 0.05  # share of the draws that may lie beyond FAR, for a point to be a place

_POSITION = Parameter("position", "m", 0.3, 0.05, of="length", low=-0.6, high=0.6)


def _on_board(north: Any, east: Any, c: Any, s: Any, ahead: Any) -> Any:
    """X, Y, N [..., 3] of a force in earth axes that acts so far `ahead` of midship; `c` and `s`
    are of the heading."""
    across = c * east - s * north
    return jnp.stack((c * north + s * east, across, ahead * across), -1)


def _degrees(north: np.ndarray, east: np.ndarray) -> np.ndarray:
    """Towards where, clockwise from north or x0."""
    return np.degrees(np.arctan2(east, north)) % 360.0


def _made_fast(at: ParameterEstimate) -> str:
    if at.low <= 0.0 <= at.high:
        return "made fast near midship"
    way = "ahead of" if at.value >= 0.0 else "abaft"
    return f"made fast {abs(at.value):.2f} m {way} midship"


@dataclass(frozen=True)
class Line(Cause):
    """A line to a point, of an elastic rope to a constant pull.

    With x_c the middle of where the ship was, r how far it went from there (root mean square), the
    bow's direction e, and the numbers a (2), k, s and l:

        g = a - k (x + l e - x_c),   G² = |a|² + k² r²
        F = g (|g|/G)^-s,   N = l Y

    This is a spring of stiffness k to the point x_c + a/k where s is 0, and a pull of constant size
    G to that point where s is 1; near the point the line is slack (`SLACK`). It is linear in a and
    k where s and l are 0. As k goes to zero, the point goes to infinity, and the pull is a constant
    a. A rope that stiffens has an s below zero (Faltinsen 1990, Ch. 8).

    Size: `PULL` each way; a stiffness that changes the pull by as much over r. Where it is made
    fast: anywhere on the length, 0.29 of it in the root mean square.

    middle  x_c [m, m]; reach  r [m]
    """

    middle: tuple[float, float] = field(default=(0.0, 0.0), compare=False, repr=False)
    reach: float = field(default=1.0, compare=False, repr=False)

    name = "line"
    kind = "environment"
    story = "A line pulls the ship towards a point."
    equation = "X, Y towards a point, {pull:.3g} N; N = {position:+.2f} m · Y"
    remedy = (
        "Cast off what still holds the ship, or look for what caught it: a mooring line, an "
        "anchor, a net. Use the extended model only with the line."
    )
    parameters = (
        Parameter("pull_north", "N", PULL, LEAST_PULL, of="mass"),
        Parameter("pull_east", "N", PULL, LEAST_PULL, of="mass"),
        Parameter("stiffness", "N/m", PULL, LEAST_PULL, of="mass", low=0.0),
        Parameter("bend", "1", 0.7, 0.1, low=-1.0, high=1.0),
        _POSITION,
    )
    separated_by = {
        "current": "a stop at two places: a line pulls towards its point, a current is the same",
        "tow": "the same manoeuvre at two places, on either side of the point",
        "wind_force": "repeat in calm, or at another place",
        "shallow_water": "a drifting stop: a line moves the ship, shallow water does not",
    }
    form_error = ROPE
    unit_error = INERTIA

    @property
    def nominal(self) -> bool:
        """Nominal voyages have no line."""
        return False

    @property
    def varies(self) -> bool:
        """Forces that depend on the place do: wind shadow, eddies."""
        return True

    def on(self, setting: Setting) -> Line:
        middle, reach = middle_of(setting)
        return replace(self, middle=middle, reach=reach)

    def compatible(self, label: str) -> bool:
        """Not with a tow: far away both are one constant force."""
        return super().compatible(label) and label != "tow"

    def missing(self, setting: Setting) -> str | None:
        _, reach = middle_of(setting)
        near = reach < LEAST_REACH * setting.scale["length"]
        return "the ship stayed in one place" if near else None

    def constants(self, setting: Setting) -> dict[str, np.ndarray]:
        middle, reach = middle_of(setting)
        little = 1e-3 * setting.least(self.parameters[0])
        return {"line.place": np.array([*middle, reach, little])}

    def sizes(self, setting: Setting) -> np.ndarray:
        return super().sizes(setting) * self._by_reach(setting)

    def _by_reach(self, setting: Setting) -> np.ndarray:
        """A stiffness is a pull over how far the ship went."""
        _, reach = middle_of(setting)
        return np.array([1.0, 1.0, 1.0 / max(reach, 1e-3), 1.0, 1.0])

    def force(self, p: Any, state: Any, at: dict) -> Any:
        x, y, reach, little = (at["line.place"][i] for i in range(4))
        north, east, k, bend, ahead = p
        c, s = jnp.cos(state[..., 4]), jnp.sin(state[..., 4])
        to_north = north - k * (state[..., 0] + ahead * c - x)
        to_east = east - k * (state[..., 2] + ahead * s - y)
        typical = north * north + east * east + (k * reach) ** 2 + little * little
        here = to_north * to_north + to_east * to_east + SLACK**2 * typical
        bent = jnp.exp(-0.5 * bend * jnp.log(here / typical))
        return _on_board(bent * to_north, bent * to_east, c, s, ahead)

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        north, east, k, bend, ahead = np.moveaxis(np.asarray(p, dtype=float), -1, 0)
        pull = self._pull(p)
        firm = np.maximum(k, pull / (FAR * self.reach) + 1e-12)
        return {
            "x0": (self.middle[0] + north / firm, "m"),
            "y0": (self.middle[1] + east / firm, "m"),
            "direction": (_degrees(north, east), "deg"),
            "pull": (pull, "N"),
            "stiffness": (np.maximum(k * (1.0 - bend), 0.0), "N/m"),
            "position": (ahead, "m"),
        }

    def _pull(self, p: np.ndarray) -> np.ndarray:
        """G [...] of numbers [..., 5]."""
        p = np.asarray(p, dtype=float)
        return np.sqrt(p[..., 0] ** 2 + p[..., 1] ** 2 + (p[..., 2] * self.reach) ** 2)

    def estimates(
        self, p: np.ndarray, covariance: np.ndarray, freedom: float = math.inf, draws: int = 4000
    ) -> dict[str, ParameterEstimate]:
        """With a place where there is one, else with a direction."""
        found = super().estimates(p, covariance, freedom, draws)
        drawn = np.asarray(p, dtype=float) + deviations(covariance, freedom, draws)
        beyond = drawn[:, 2] * FAR * self.reach <= self._pull(drawn)
        if float(beyond.mean()) > DOUBT:
            return {k: found[k] for k in ("direction", "pull", "position")}
        return {k: v for k, v in found.items() if k != "direction"}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        pull = f"{figure(estimates['pull'].value, 3)} N"
        fast = _made_fast(estimates["position"])
        if "x0" not in estimates:
            towards = round(estimates["direction"].value) % 360
            return (
                f"A line, or a tow that does not turn, pulls with {pull} towards {towards} deg, "
                f"{fast}; its point is too far away, or too uncertain, to have a place."
            )
        north, east = (
            f"{estimates[k].value:.1f} ({estimates[k].low:.1f} to {estimates[k].high:.1f}) m"
            for k in ("x0", "y0")
        )
        return (
            f"A line pulls towards the point x0 = {north}, y0 = {east} with about {pull}, {fast}."
        )

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        return np.asarray(self.on(setting)._pull(p) >= setting.least(self.parameters[0]))


def middle_of(setting: Setting) -> tuple[tuple[float, float], float]:
    """x_c of where the ship was [m, m], and how far it went from there, root mean square [m]."""
    places = np.asarray(setting.places, dtype=float)
    if not len(places):
        return (0.0, 0.0), 0.0
    middle = places.mean(0)
    reach = float(np.sqrt(((places - middle) ** 2).sum(1).mean()))
    return (float(middle[0]), float(middle[1])), reach


@dataclass(frozen=True)
class Tow(Cause):
    """A force whose direction changes slowly in earth axes: a tug's, or that of what is towed.

    With τ the share of the campaign, 0 to 1, and forces F₀, F½ and F₁ at its begin, middle and end:

        F(τ) = ½ (1 + cos πτ - sin πτ) F₀ + sin πτ F½ + ½ (1 - cos πτ - sin πτ) F₁,   N = l Y

    A force of constant size that turns by up to 180 deg, evenly, is one of these; one that neither
    turns nor grows is a line whose point is far away, with fewer numbers.

    Size: `PULL` each way. Where it is made fast: anywhere on the length, 0.29 of it in the root
    mean square.
    """

    name = "tow"
    kind = "environment"
    story = "A tow pulls the ship in a direction that changes slowly."
    equation = "X, Y towards {direction:.0f} deg, {pull:.3g} N; N = {position:+.2f} m · Y"
    remedy = (
        "Look in the ship's journal for a tug or for what it towed. Leave these voyages out of "
        "training, or use the extended model for them only."
    )
    parameters = (
        *(
            Parameter(f"{when}_{way}", "N", PULL, LEAST_PULL, of="mass")
            for when in ("begin", "middle", "end")
            for way in ("north", "east")
        ),
        _POSITION,
    )
    separated_by = {
        "current": "a run ahead and a stop: a current's force grows with speed, a tow's does not",
        "wind_force": "repeat in calm, or turn: wind force follows the wind",
    }
    form_error = ROPE
    unit_error = INERTIA

    @property
    def nominal(self) -> bool:
        """Nominal voyages have no tow."""
        return False

    @property
    def varies(self) -> bool:
        """Forces that last for a voyage do: the water's, the wind's on what is on deck."""
        return True

    def compatible(self, label: str) -> bool:
        """Not with a line: far away both are one constant force."""
        return super().compatible(label) and label != "line"

    def force(self, p: Any, state: Any, at: dict) -> Any:
        cos, sin = jnp.cos(math.pi * at["share"]), jnp.sin(math.pi * at["share"])
        begin, middle, end = 0.5 * (1.0 + cos - sin), sin, 0.5 * (1.0 - cos - sin)
        north = begin * p[0] + middle * p[2] + end * p[4]
        east = begin * p[1] + middle * p[3] + end * p[5]
        c, s = jnp.cos(state[..., 4]), jnp.sin(state[..., 4])
        return _on_board(north, east, c, s, p[6])

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        north, east, way = self._nodes(p)
        steps = (np.diff(way, axis=-1) + np.pi) % (2.0 * np.pi) - np.pi
        return {
            "pull": (np.sqrt((north**2 + east**2).mean(-1)), "N"),
            "direction": (_degrees(north[..., 1], east[..., 1]), "deg"),
            "turn": (np.degrees(steps.sum(-1)), "deg"),
            "position": (np.asarray(p, dtype=float)[..., 6], "m"),
        }

    @staticmethod
    def _nodes(p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Forces [..., 3] at begin, middle and end, and their directions [rad]."""
        p = np.asarray(p, dtype=float)
        north, east = p[..., 0:6:2], p[..., 1:6:2]
        return north, east, np.arctan2(east, north)

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        turn = estimates["turn"].value
        return (
            f"A tow pulls with {figure(estimates['pull'].value, 3)} N, in the middle of the "
            f"campaign towards {round(estimates['direction'].value) % 360} deg, and turns by "
            f"{abs(turn):.0f} deg {'clockwise' if turn >= 0.0 else 'anticlockwise'} in all; "
            f"{_made_fast(estimates['position'])}."
        )

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        pull = self.displayed(p)["pull"][0]
        return np.asarray(pull >= setting.least(self.parameters[0]))
