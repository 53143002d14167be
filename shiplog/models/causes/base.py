"""What a cause is: a name, a story, numbers that are zero where it is absent, and a hook.

A cause extends any dynamic model. It may correct the measurements of instruments and actuators
(`read`), set the water in motion (`water`), change coefficients of the ship (`coefficients`), or
add a force (`force`). With all numbers zero the model is exactly as before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from shiplog.nomenclature.channels import DEGREE
from shiplog.nomenclature.numbers import figure
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.recording import Record

# Standard deviation of the logarithm of an uncertain factor in a cause's equations: a factor of
# 1.6. Published formulas for one force differ by as much.
FORM_SPREAD = 0.5
FORM_DEVIATIONS = 4.0  # standard deviations that such a logarithm is off, at most
FORM_BOUND = FORM_DEVIATIONS * FORM_SPREAD


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of a cause, in SI; zero where the cause is absent.

    prior      its realistic size: the standard deviation of a change that is found between two
               campaigns, from the literature that its cause's docstring names
    least      below this it is there but does not matter: a trace
    of         "speed", "length", "mass": prior and least are shares of the ship's
    low, high  beyond, it means nothing
    """

    name: str
    unit: str
    prior: float
    least: float
    of: str = ""
    low: float = -math.inf
    high: float = math.inf


@dataclass(frozen=True)
class Orders:
    """What was recorded of actuators.

    extent  [A]     largest order, either way, SI; 0 where it stayed at one value
    apart   [A, A]  root mean square of the difference of two of them
    """

    extent: np.ndarray
    apart: np.ndarray

    @classmethod
    def of(cls, record: Record) -> Orders:
        """Of the rows of a record."""
        u = record.actuator
        extent = np.abs(u).max(0, initial=0.0) * (np.ptp(u, axis=0) > 0.0 if len(u) else 0.0)
        mean = u.T @ u / max(len(u), 1)
        square = np.diagonal(mean)
        return cls(extent, np.sqrt(np.maximum(square[:, None] + square - 2.0 * mean, 0.0)))


@dataclass(frozen=True)
class Setting:
    """The ship and the place of a cause, in addition to its numbers.

    scale   "speed" (root mean square of the campaigns, m/s), "length" (m), "mass" (kg) and
            "moment", their product
    places  [K, 2]  points x₀, y₀ that cover where the ship was, and `spacing` between them [m]
    lacking coefficients of the forces that the model has not, as they are of such a ship
    parts   forces that the model has (mmg.PARTS); None for all that the profile can have
    to_wall how near midship came to a wall of the profile [m]
    orders  what was recorded of the actuators; None where that is not known
    """

    profile: Profile
    scale: Mapping[str, float]
    places: np.ndarray
    spacing: float
    lacking: Mapping[str, float] = field(default_factory=dict)
    parts: tuple[str, ...] | None = None
    to_wall: float = 0.0
    orders: Orders | None = None

    def extent(self, column: int) -> float:
        """Largest recorded order of an actuator, either way; 0 where it never moved."""
        if self.orders is not None:
            return float(self.orders.extent[column])
        limits = self.profile.actuators[column].si_limits
        return 1.0 if limits is None else max(abs(one) for one in limits)

    def apart(self, one: int, other: int) -> float:
        """Root mean square of the difference of two actuators' orders."""
        return math.inf if self.orders is None else float(self.orders.apart[one, other])

    def columns(self, *kinds: str) -> list[int]:
        """Columns of the actuators of these kinds, whose force the model has."""
        off = () if self.parts is None else {"rudder", "propeller", "thruster"} - {*self.parts}
        return [
            i for i, a in enumerate(self.profile.actuators) if a.kind in kinds and a.kind not in off
        ]

    def prior(self, parameter: Parameter) -> float:
        return parameter.prior * self.scale.get(parameter.of, 1.0)

    def least(self, parameter: Parameter) -> float:
        return parameter.least * self.scale.get(parameter.of, 1.0)

    def bounds(self, parameter: Parameter) -> tuple[float, float]:
        by = self.scale.get(parameter.of, 1.0)
        return parameter.low * by, parameter.high * by


def _unless(met: Callable[[Setting], bool], reason: str) -> Callable[[Setting], str | None]:
    return lambda setting: None if met(setting) else reason


# What a cause can need of ship and place, and why it cannot be tested where that is not there.
NEEDS: Mapping[str, Callable[[Setting], str | None]] = {
    "yaw rate": _unless(
        lambda s: s.profile.sensors.yaw_rate is not None, "no yaw rate is recorded"
    ),
    "velocity": _unless(
        lambda s: s.profile.sensors.velocity is not None,
        "no velocity is recorded: it is derived from the position, and has its clock",
    ),
    "body velocity": lambda s: (
        None
        if s.profile.sensors.kind("velocity") == "body"
        else (
            "no velocity is recorded"
            if s.profile.sensors.velocity is None
            else "the velocity is recorded over ground"
        )
    ),
    "wind": _unless(lambda s: s.profile.has_wind, "no wind is recorded"),
    "wind force": _unless(lambda s: not s.lacking, "the model feels no wind"),
    "rudder": _unless(lambda s: bool(s.columns("rudder")), "the ship has no rudder"),
    "steering": _unless(
        lambda s: bool(s.columns("rudder")) or bool(s.columns("thruster") and s.columns("azimuth")),
        "the ship has no rudder",
    ),
    "thrust": _unless(
        lambda s: bool(s.columns("propeller", "thruster")), "the ship has no propeller or thruster"
    ),
    "bank": _unless(lambda s: bool(s.profile.site.banks), "the profile's [site] shows no bank"),
}


@dataclass(frozen=True)
class ParameterEstimate:
    """One of the contract's parameters, from fitted numbers."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Cause:
    """Frozen and hashable: a model extended by causes is compiled once."""

    name: ClassVar[str]
    kind: ClassVar[str]  # environment, ship or sensor
    story: ClassVar[str]
    equation: ClassVar[str]  # what it adds to the equations of motion or of the instruments
    remedy: ClassVar[str] = ""  # what its owner is to do when it is named, in a sentence or two
    parameters: ClassVar[tuple[Parameter, ...]]
    needs: ClassVar[tuple[str, ...]] = ()  # words of NEEDS, without which it cannot be tested
    separated_by: ClassVar[Mapping[str, str]] = {}  # other cause → manoeuvre that tells them apart
    user: ClassVar[bool] = False
    shifts: ClassVar[bool] = False  # the motion in time: what it changes is a derivative
    # Of a reading that is linearised where the cause is absent: its step, in realistic sizes; 0 for
    # that of every other one. A limit that is far away changes nothing.
    first_step: ClassVar[float] = 0.0
    # Of a cause whose derivative where it is absent says little of it: its numbers, in realistic
    # sizes, at which it is looked at, too.
    whole: ClassVar[tuple[float, ...]] = ()
    # Lengths ahead and astern of midship, between which its force pushes athwart now and then.
    pushes_within: ClassVar[float] = 0.0
    unit_error: ClassVar[float] = 0.0  # share by which the unit of its numbers may be wrong
    form_error: ClassVar[float] = 0.0  # share of its force that its equations may leave wrong
    drifts: ClassVar[bool] = False  # it grows with time: it has a slope, and no onset
    over_trial: ClassVar[bool] = False  # its first number is a change over the trial
    forms: ClassVar[int] = 0  # of its equations, factors that are uncertain: `FORM_SPREAD`

    @property
    def label(self) -> str:
        """Unique in the catalogue: the name, and what of it where there are several."""
        return self.name

    @property
    def count(self) -> int:
        """Of its numbers: the parameters, then the logarithms of the uncertain factors."""
        return len(self.parameters) + self.forms

    @property
    def special(self) -> bool:
        """Whether it is a special case of the cause of its name, and not listed by itself."""
        return False

    @property
    def absorbed(self) -> bool:
        """Whether any model that is fitted to the affected data absorbs it."""
        return False

    @property
    def renames(self) -> bool:
        """Whether it only changes an input of the model or the point of measurement: a network that
        is fitted to the affected data, without symmetry or origin, absorbs that, too."""
        return False

    @property
    def nominal(self) -> bool:
        """Whether its nominal value may differ from zero: false where it is an alias of
        coefficients or of another cause."""
        return not self.absorbed

    @property
    def varies(self) -> bool:
        """Whether parts of the nominal campaign may differ in it. That of an alias of several other
        causes does where they vary together: each by itself would vary by as much."""
        return self.nominal

    def farthest(self, setting: Setting) -> float:
        """How many times the first number the second one may be: it is a moment, of a force or a
        mass that acts on the ship [m]."""
        return math.inf

    @property
    def changes_ship(self) -> bool:
        """Whether it changes coefficients of the ship."""
        return type(self).coefficients is not Cause.coefficients

    @property
    def reads(self) -> bool:
        """Whether it changes what was recorded, and not the ship's motion."""
        return type(self).read is not Cause.read

    def on(self, setting: Setting) -> Cause:
        """The cause as this ship has it: one rudder has one offset, two have two."""
        return self

    def each(self, setting: Setting) -> tuple[Cause, ...]:
        """The cause as this ship has it, once for each unit of which it is tested on its own."""
        return (self.on(setting),)

    def compatible(self, label: str) -> bool:
        """Whether it may be in one hypothesis with this cause."""
        return label != self.label

    def missing(self, setting: Setting) -> str | None:
        """Why it cannot be tested on this ship; None where it can."""
        return next((why for need in self.needs if (why := NEEDS[need](setting))), None)

    def constants(self, setting: Setting) -> dict[str, np.ndarray]:
        """Numbers that the force needs and nobody fits."""
        return {}

    def sizes(self, setting: Setting) -> np.ndarray:
        """[count] realistic size of each number."""
        return np.array([setting.prior(p) for p in self.parameters] + [FORM_SPREAD] * self.forms)

    def bounds(self, setting: Setting) -> tuple[np.ndarray, np.ndarray]:
        both = [setting.bounds(p) for p in self.parameters]
        both += [(-FORM_BOUND, FORM_BOUND)] * self.forms
        return np.array([b[0] for b in both]), np.array([b[1] for b in both])

    # --- hooks ---

    def read(self, record: Record, p: np.ndarray) -> Record:
        """The true record, from the measured one: sensors corrected, actuators as they acted."""
        return record

    def orders(self, profile: Profile) -> frozenset[int] | None:
        """Actuators, by their place in the profile, whose orders are all that its `read` depends on
        and changes; None where it may be anything that was recorded."""
        return None

    def inverse(self, p: np.ndarray) -> np.ndarray:
        """The numbers whose `read` inverts this one's: from true values to measurements."""
        return -p

    def water(self, p: Any) -> tuple[Any, Any] | None:
        """Velocity of the water along x₀ and y₀ [m/s]."""
        return None

    def coefficients(self, c: dict, p: Any, state: Any, share: Any, at: dict) -> dict:
        """The ship's coefficients with the cause in them. `share`: of the campaign, 0 to 1."""
        return c

    def force(self, p: Any, state: Any, at: dict) -> Any | None:
        """X, Y, N [..., 3] at midship, in addition to the ship's own [N, N, N m]."""
        return None

    def scales(self, p: np.ndarray) -> Mapping[str, np.ndarray]:
        """Family of the discrepancy → factor [3] (1) of X, Y and N that depend on its inputs, with
        numbers p [count], SI: what the model gets wrong of a force grows with it."""
        return {}

    # --- words ---

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        """The contract's parameters and units, of numbers [..., count]."""
        return {q.name: (p[..., i] / si(q.unit), q.unit) for i, q in enumerate(self.parameters)}

    def estimates(
        self, p: np.ndarray, covariance: np.ndarray, freedom: float = math.inf, draws: int = 4000
    ) -> dict[str, ParameterEstimate]:
        """The contract's parameters with 90 % intervals.

        freedom   degrees of it with which the covariance's size is known: Student's t
        """
        many = self.displayed(p + deviations(covariance, freedom, draws))
        found = {}
        for name, (value, unit) in self.displayed(np.asarray(p, dtype=float)).items():
            spread = many[name][0] - value
            if unit == "deg":
                spread = (spread + 180.0) % 360.0 - 180.0
            low, high = np.quantile(spread, (0.05, 0.95))
            middle = float(value)
            found[name] = ParameterEstimate(
                middle, middle + min(float(low), 0.0), middle + max(float(high), 0.0), unit
            )
        return found

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        numbers = ", ".join(
            f"{k} {figure(v.value, 3)} {v.unit}".strip() for k, v in estimates.items()
        )
        return f"{self.story} {numbers}."

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        """Whether any of its numbers [..., Q] is large enough to matter: [...] bool."""
        least = np.array([setting.least(q) for q in self.parameters])
        return np.asarray((np.abs(p[..., : len(least)]) >= least).any(-1))


def deviations(covariance: np.ndarray, freedom: float, draws: int) -> np.ndarray:
    """[draws, Q] from the most probable numbers, SI; the same ones at each call.

    covariance   [Q, Q], SI
    freedom      degrees of it with which the covariance's size is known: Student's t

    Raises np.linalg.LinAlgError where the covariance is none.
    """
    rng = np.random.default_rng(0)
    root = np.linalg.cholesky(covariance + 1e-18 * np.eye(len(covariance)))
    drawn = rng.standard_normal((draws, len(covariance))) @ root.T
    if math.isfinite(freedom):
        drawn *= np.sqrt(freedom / rng.chisquare(freedom, (draws, 1)))
    return drawn


def constants_of(causes: Iterable[Cause], setting: Setting) -> dict[str, np.ndarray]:
    """What all their forces need and nobody fits."""
    needed: dict[str, np.ndarray] = {}
    for cause in causes:
        needed |= cause.constants(setting)
    return needed


def si(unit: str) -> float:
    """How many of the SI's one of these is."""
    return {"deg": DEGREE, "deg/s": DEGREE}.get(unit, 1.0)
