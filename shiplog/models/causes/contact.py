"""A cause that pushes the ship off: a wall that it touches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from shiplog.machine.arrays import jnp
from shiplog.models.causes.base import Cause, Parameter, ParameterEstimate, Setting
from shiplog.models.causes.environment import COARSE, Bank, nearest_points, nearest_share
from shiplog.models.causes.lines import INERTIA, middle_of
from shiplog.nomenclature.numbers import figure

# Of a contact: where the hull touches, lengths ahead of midship, and the reach of its force before
# any data. A fender gives way by about its own diameter; the wall's line on a chart and the ship's
# place are wrong by more, so that the reach may be a factor of e off, either way.
SHOULDER = 0.35
REACH = 0.1  # lengths
REACH_SPREAD = 1.0  # of its logarithm
SLIDING = 0.05  # of the ship's speed, from which friction is whole
ALONGSIDE = 1.0  # lengths: a ship that never came so near to a wall touched none


@dataclass(frozen=True)
class Contact(Cause):
    """A wall of the profile pushes the ship off while it is alongside, by fenders at its shoulders.

    At either shoulder, l = ±`SHOULDER` · L, with the gap d between wall and side and the unit
    vector e away from the wall, to where the ship mostly was, and with the velocity w along it:

        F = ½ R e^(-d/δ),   f = -μ F w/√(w² + w₀²) along the wall,   N = l Y

    with numbers R, μ and log δ/δ₀. Off the end of a wall the gap is as much longer. A hull that is
    beyond the wall's line, which a chart may have some metres wrong, touches; one that is farther
    beyond than half its length is on the other side of a pier, and free.

    Size: R is what all its tugs together press a ship onto its fenders with, 0.01 N/kg (`PULL` of
    a line has the source). Fenders faced with polyethylene have a friction of 0.2 or less, bare
    rubber of 0.5 and more (PIANC 2002, report of Working Group 33).

    length  L [m]
    """

    length: float = field(default=1.0, compare=False, repr=False)

    name = "contact"
    kind = "environment"
    needs = ("bank",)
    story = "A wall pushes the ship off while it is alongside."
    equation = "F = {force:.3g} N · e^(-gap / {reach:.2f} m) off the wall; friction {friction:.2f}"
    remedy = (
        "Look for fenders, ice or another ship between hull and wall, and check the wall's line "
        "in the profile's [site]. Use the extended model only along these walls."
    )
    parameters = (
        Parameter("force", "N", 0.01, 5e-4, of="mass", low=0.0),
        Parameter("friction", "1", 0.3, 0.05, low=0.0, high=2.0),
        Parameter("reach", "1", REACH_SPREAD, 0.1, low=-2.5, high=2.5),
    )
    separated_by = {
        "bank": "the same run at twice the speed: suction grows with its square, a contact does "
        "not",
        "line": "the same run farther from the wall",
    }
    form_error = COARSE
    unit_error = INERTIA
    # Pushed off, the ship no longer comes so near: friction and reach of no force are no number.
    whole = (1.0, 1.0, 0.0)
    pushes_within = SHOULDER

    @property
    def nominal(self) -> bool:
        """Nominal voyages touch no wall."""
        return False

    def on(self, setting: Setting) -> Contact:
        return replace(self, length=float(setting.scale["length"]))

    def missing(self, setting: Setting) -> str | None:
        why = super().missing(setting)
        if why is not None:
            return why
        far = setting.to_wall > ALONGSIDE * setting.scale["length"]
        return "the ship was alongside no wall of the profile" if far else None

    def constants(self, setting: Setting) -> dict[str, np.ndarray]:
        needed = Bank().constants(setting)
        lines, slow = needed["bank.lines"], SLIDING * setting.scale["speed"]
        along = lines[:, 2:] - lines[:, :2]
        size = np.sqrt((along**2).sum(1, keepdims=True))
        off = along[:, ::-1] * [-1.0, 1.0] / size
        middle, _ = middle_of(setting)
        side = ((np.array(middle) - lines[:, :2]) * off).sum(1, keepdims=True)
        off = np.where(side < 0.0, -off, off)
        return needed | {"contact.off": off, "contact.slow": np.array([slow])}

    def force(self, p: Any, state: Any, at: dict) -> Any:
        length, breadth = at["bank.ship"][0], at["bank.ship"][1]
        slow, off = at["contact.slow"][0], at["contact.off"]
        to, distance = nearest_points(state, at["bank.lines"])
        away = -(to * off).sum(-1)
        past_end = jnp.abs(to[..., 0] * off[:, 1] - to[..., 1] * off[:, 0])  # the wall's
        touches = jnp.where(away > -0.5 * length, 1.0, 0.0)
        near = nearest_share(distance, at["bank.same"]) * touches
        c, s = jnp.cos(state[..., 4])[..., None], jnp.sin(state[..., 4])[..., None]
        ahead = c * off[:, 0] + s * off[:, 1]  # of e
        starboard = c * off[:, 1] - s * off[:, 0]
        # to starboard of e along the wall
        along = state[..., 3, None] * ahead - state[..., 1, None] * starboard
        grip = -p[1] * along / jnp.sqrt(along * along + slow * slow)
        x, y, n = 0.0, 0.0, 0.0
        for side in (-SHOULDER, SHOULDER):
            lever = side * length
            gap = away + lever * ahead - 0.5 * breadth * jnp.abs(starboard)
            gap = jnp.maximum(gap, 0.0) + past_end
            normal = 0.5 * p[0] * near * jnp.exp(-gap / (REACH * length * jnp.exp(p[2])))
            across = normal * (starboard + grip * ahead)
            x = x + (normal * (ahead - grip * starboard)).sum(-1)
            y = y + across.sum(-1)
            n = n + (lever * across).sum(-1)
        return jnp.stack((x, y, n), -1)

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        p = np.asarray(p, dtype=float)
        return {
            "force": (p[..., 0], "N"),
            "friction": (p[..., 1], "1"),
            "reach": (REACH * self.length * np.exp(p[..., 2]), "m"),
        }

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        force, reach = (figure(estimates[k].value, 3) for k in ("force", "reach"))
        return (
            f"A wall pushes the ship off with {force} N where it touches, and a third of it at a "
            f"gap of {reach} m."
        )

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        return np.asarray(np.asarray(p)[..., 0] >= setting.least(self.parameters[0]))
