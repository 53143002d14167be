"""Causes in the ship itself: hull, load, screws, the force of rudders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from shiplog.models.causes.base import Cause, Parameter, ParameterEstimate, Setting
from shiplog.nomenclature.numbers import figure

K_T = ("k0", "k1", "k2", "c3", "c6", "c7")  # a screw's thrust is their sum of products


def _thrust(c: dict, factor: Any, unit: str = "") -> dict:
    """Coefficients with the thrust of all screws and thrusters, or of one unit, times a factor.

    Thrusters have coefficients of their own. Screws share one set: "propeller.<name>.factor" says
    how many times that thrust one of them has (`models.mmg.model`).
    """
    if unit and f"thruster.{unit}_ahead" not in c:
        name = f"propeller.{unit}.factor"
        return c | {name: c.get(name, 1.0) * factor} if "propeller.k0" in c else c
    found = [f"thruster.{unit}_{way}" for way in ("ahead", "astern")] if unit else [
        name for name in c
        if name in {f"propeller.{key}" for key in K_T}
        or (name.startswith("thruster.") and name.endswith(("_ahead", "_astern")))
    ]  # fmt: skip
    return _times(c, tuple(found), factor)


def _times(c: dict, names: tuple[str, ...], factor: Any) -> dict:
    return c | {name: c[name] * factor for name in names if name in c}


@dataclass(frozen=True)
class _Factor(Cause):
    """Coefficients times one factor."""

    scaled: ClassVar[tuple[str, ...]]
    kind = "ship"

    @property
    def absorbed(self) -> bool:
        return True

    def coefficients(self, c: dict, p: Any, state: Any, share: Any, at: dict) -> dict:
        return _times(c, self.scaled, 1.0 + p[0])

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        return {"factor": (1.0 + p[..., 0], "1")}


@dataclass(frozen=True)
class Fouling(_Factor):
    """Size: a frigate's resistance at 15 kn grows by 0.11 with light slime, 0.20 with heavy slime,
    and 0.34, 0.52 and 0.80 with more and more shells (Schultz 2007): 0.46 in the mean square."""

    name = "fouling"
    drifts = True
    story = "The hull resistance has changed by fouling."
    equation = "X'₀, X'_u·{factor:.2f}"
    remedy = (
        "Inspect and clean the hull. Until then simulate with the extended model, and "
        "diagnose again after the cleaning."
    )
    scaled = ("hull.x_0f", "hull.x_0a", "hull.x_u")
    parameters = (Parameter("factor", "1", 0.45, 0.06, low=-1.0),)
    separated_by = {
        "thrust_loss": "bollard pull (high revolutions at rest) against coasting (propeller "
        "stopped)"
    }

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return f"The hull resistance is {estimates['factor'].value:.2f} times the model's."


@dataclass(frozen=True)
class CrossFlowDrag(_Factor):
    """Size: of a section with the breadth-to-draught ratio of a laden ship (2.5), drag is a quarter
    more than with that of one in ballast (5), by Hoerner's curve (Fossen 2011, Sec. 6.4)."""

    name = "cross_flow_drag"
    story = "The cross-flow drag differs from the model's."
    equation = "C_D·{factor:.2f}"
    remedy = (
        "Look for what changed the underwater side: draught, trim, bilge keels, "
        "something towed or caught. Until then simulate with the extended model."
    )
    scaled = ("hull.c_d",)
    parameters = (Parameter("factor", "1", 0.25, 0.03, low=-1.0),)
    separated_by = {
        "shallow_water": "the same manoeuvre at two places",
        "payload": "step of the propeller from rest (inertia) against a pure decay of sway",
    }

    def compatible(self, label: str) -> bool:
        """Not with shallow water, which raises it in places by a coarse map."""
        return super().compatible(label) and label != "shallow_water"

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return f"Cross-flow drag is {estimates['factor'].value:.2f} times the model's."


@dataclass(frozen=True)
class RudderForce(_Factor):
    """Size: the hull adds a share a_H of 0.16 to 0.41 to a rudder's force (Kijima et al. 1990, C_b
    of 0.5 to 0.9), and what a blade in a jet has differs as much with its place (Molland & Turnock
    2007): a quarter."""

    name = "rudder_force"
    needs = ("rudder",)
    story = "The rudder force differs from the model's."
    equation = "F_N, F_T·{factor:.2f}"
    remedy = (
        "Inspect the rudder: its area, fouling, and what stands in front of it. Until "
        "then simulate with the extended model."
    )
    scaled = ("rudder.f_alpha", "rudder.f_t")
    parameters = (Parameter("factor", "1", 0.25, 0.02, low=-1.0),)
    separated_by = {"thrust_loss": "steady speed on a straight course, rudders amidships"}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return f"The rudders' force is {estimates['factor'].value:.2f} times the model's."


@dataclass(frozen=True)
class ThrustLoss(Cause):
    """Of all screws and thrusters together, or of one of several.

    Size: fouled blades lose 0.12 to 0.30 of their efficiency (Owen et al. 2018), and air that a
    screw draws takes up to 0.7 of its thrust (Smogeli 2006): three tenths.

    actuator   the profile's name of the unit; empty for all
    """

    actuator: str = ""

    name = "thrust_loss"
    kind = "ship"
    needs = ("thrust",)
    story = "The thrust has decreased."
    equation = "K_T·{factor:.2f}"
    remedy = (
        "Inspect the propeller: damage, fouling, ropes, ventilation at this draught. "
        "Until then simulate with the extended model."
    )
    parameters = (Parameter("factor", "1", 0.3, 0.02, low=-1.0),)
    separated_by = {
        "fouling": "bollard pull (high revolutions at rest) against coasting (propeller stopped)",
        "payload": "step of the propeller from rest (inertia) against steady speed",
        "thrust_drift": "the same run at the beginning and at the end",
        "thrust_loss": "the same step by one unit after the other, the others stopped",
    }

    @property
    def label(self) -> str:
        return f"{self.name}:{self.actuator}" if self.actuator else self.name

    @property
    def absorbed(self) -> bool:
        return True

    def each(self, setting: Setting) -> tuple[Cause, ...]:
        """All together, and where there are several units each of them."""
        units = setting.columns("propeller", "thruster")
        names = [setting.profile.actuators[i].name for i in units] if len(units) > 1 else []
        return (replace(self, actuator=""), *(replace(self, actuator=name) for name in names))

    def compatible(self, label: str) -> bool:
        """The loss of all units is not tested together with that of one."""
        same = label.partition(":")[0] == self.name
        return not same or (bool(self.actuator) and ":" in label and label != self.label)

    def coefficients(self, c: dict, p: Any, state: Any, share: Any, at: dict) -> dict:
        return _thrust(c, 1.0 + p[0], self.actuator)

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        return {"factor": (1.0 + p[..., 0], "1")}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        whose = f"thrust of {self.actuator}" if self.actuator else "thrust"
        return f"The {whose} is {estimates['factor'].value:.2f} times the model's."


@dataclass(frozen=True)
class ThrustDrift(Cause):
    """Size: within a campaign, two thirds of what a screw loses for good (`ThrustLoss`)."""

    name = "thrust_drift"
    drifts = over_trial = True
    kind = "ship"
    needs = ("thrust",)
    story = "The thrust changes from voyage to voyage."
    equation = "K_T·(1 {slope:+.2f} · share of the campaign)"
    remedy = (
        "Follow it: diagnose each new season, and inspect the propeller when the loss "
        "matters to you."
    )
    parameters = (Parameter("slope", "1", 0.2, 0.025, low=-1.0),)
    separated_by = {"thrust_loss": "the same run at the beginning and at the end"}

    def coefficients(self, c: dict, p: Any, state: Any, share: Any, at: dict) -> dict:
        return _thrust(c, 1.0 + p[0] * share)

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        slope = 100.0 * estimates["slope"].value
        return (
            f"The thrust changes by {slope:+.0f} % from the beginning of the campaign to its end."
        )


@dataclass(frozen=True)
class Payload(Cause):
    """A load on board: mass, and with it inertia, where it stands. The draught stays.

    Size: deadweight is half of a cargo ship's displacement and more (Schneekluth & Bertram 1998);
    of that, as much as leaves the draught about what it was, a quarter of the length off midship.
    Motion tells it as a share of the inertia with added masses, which formulas know to a tenth.
    """

    name = "payload"
    kind = "ship"
    story = "The ship carries a load."
    equation = "m + {mass:.1f} kg at {position:+.2f} m"
    remedy = (
        "Weigh the ship or read its draughts, and correct mass and centre of gravity in "
        "the profile."
    )
    unit_error = 0.1
    parameters = (
        Parameter("mass", "kg", 0.2, 0.015, of="mass", low=-0.5),
        Parameter("moment", "kg m", 0.05, 0.004, of="moment"),
    )
    separated_by = {
        "thrust_loss": "step of the propeller from rest (inertia) against steady speed",
        "cross_flow_drag": "step of the propeller from rest (inertia) against a pure decay of sway",
    }

    @property
    def absorbed(self) -> bool:
        return True

    def farthest(self, setting: Setting) -> float:
        return 0.5 * setting.scale["length"]  # a load is on board

    def coefficients(self, c: dict, p: Any, state: Any, share: Any, at: dict) -> dict:
        return c | {"load.mass": p[0], "load.moment": p[1]}

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        mass = p[..., 0]
        return {
            "mass": (mass, "kg"),
            "position": (p[..., 1] / np.where(np.abs(mass) > 1e-9, mass, 1.0), "m"),
        }

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        at = estimates["position"].value
        return (
            f"A load of {figure(estimates['mass'].value, 3)} kg, {abs(at):.2f} m "
            f"{'ahead of' if at >= 0 else 'abaft'} midship."
        )
