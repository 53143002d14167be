"""Causes in an actuator: it does not do what was recorded of it. One number of its model each.

`actuator_response` has the model and its equations, `actuator_pairs` the causes of two units. Each
cause is tested of every unit by itself, and of all units of a kind together. What is tested is an
order that moved: of a unit that stood still nothing is known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from shiplog.models.causes import actuator_response as response
from shiplog.models.causes.base import Cause, ParameterEstimate, Setting
from shiplog.models.mmg.estimate import GRAVITY
from shiplog.nomenclature.numbers import figure
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.recording import Record

TURNING, PUSHING = ("rudder", "azimuth"), ("propeller", "thruster")
GROUPS = tuple(f"{kind}s" for kind in (*TURNING, *PUSHING))
SPOKEN = {"rad": ("deg", np.radians(1.0)), "rev/s": ("rev/s", 1.0), "1": ("1", 1.0)}
# Share of an actuator's force that these equations leave wrong: a limit is not sharp, a band is not
# even, a rate is not one from end to end.
SHARPNESS = 0.1
STILL = 1e-9  # of an order's unit: it has not moved
STRETCHES = 4  # of a campaign, in which a unit may be stuck


@dataclass(frozen=True)
class OnUnits(Cause):
    """Of these units of one kind.

    actuator   the unit's name, or the kind's in the plural
    units      the profile's names
    unit       of the recorded order, SI
    """

    actuator: str = ""
    units: tuple[str, ...] = ()
    unit: str = "1"

    kind = "ship"
    form_error = SHARPNESS
    kinds: ClassVar[tuple[str, ...]] = (*TURNING, *PUSHING)
    still = "no actuator's order moves in these voyages"

    @property
    def label(self) -> str:
        return f"{self.name}:{self.actuator}" if self.actuator else self.name

    @property
    def count(self) -> int:
        return max(len(self.parameters), 1)  # a number of its own unit

    @property
    def nominal(self) -> bool:
        return False  # what of it the nominal voyages have, coefficients and discrepancy have

    def compatible(self, label: str) -> bool:
        """With another one of its name where both are of single units."""
        name, _, unit = label.partition(":")
        apart = self.actuator not in ("", *GROUPS) and unit not in (self.actuator, "", *GROUPS)
        return name != self.name or apart

    def on(self, setting: Setting) -> Cause:
        """Of the first units that it can be tested of."""
        return next(iter(self.each(setting)), self)

    def missing(self, setting: Setting) -> str | None:
        return None if self.each(setting) else self.still

    def each(self, setting: Setting) -> tuple[Cause, ...]:
        found: list[Cause] = []
        for kind in self.kinds:
            moved = [i for i in setting.columns(kind) if setting.extent(i) > STILL]
            of = [setting.profile.actuators[i] for i in moved]
            if len(of) > 1 and len({one.si_unit for one in of}) == 1:
                found.append(self._made(f"{kind}s", of))
            found += [self._made(one.name, [one]) for one in of]
        return tuple(found)

    def _made(self, name: str, of: Sequence) -> Self:
        return replace(self, actuator=name, units=tuple(one.name for one in of), unit=of[0].si_unit)

    def columns_of(self, names: Sequence[str]) -> list[int]:
        """Columns of its units among the profile's actuators."""
        return [i for i, name in enumerate(names) if name in self.units]

    def orders(self, profile: Profile) -> frozenset[int]:
        return frozenset(self.columns_of(profile.actuator_names))

    def reach(self, setting: Setting) -> float:
        """Largest recorded order of its units, either way."""
        columns = self.columns_of(setting.profile.actuator_names)
        return max((setting.extent(i) for i in columns), default=1.0)

    def read(self, record: Record, p: np.ndarray) -> Record:
        columns = self.columns_of(record.profile.actuator_names)
        if not columns or not np.any(p):
            return record
        actuator = record.actuator.copy()
        actuator[:, columns] = self.acting(record, actuator[:, columns], p)
        return replace(record, actuator=actuator)

    def acting(self, record: Record, recorded: np.ndarray, p: np.ndarray) -> np.ndarray:
        """What acts [n, k] of what was recorded of its units."""
        raise NotImplementedError

    def does(self, verb: str, more: str) -> str:
        """A sentence of its units, with a verb of one or of several."""
        if self.actuator in GROUPS:
            return f"The {self.actuator} {verb} {more}."
        single = {"have": "has", "are": "is", "go": "goes"}.get(verb, f"{verb}s")
        return f"The actuator {self.units[0] if self.units else ''} {single} {more}."

    def spoken(self, value: np.ndarray, per: str = "") -> tuple[np.ndarray, str]:
        """A value in the unit that people use, and that unit."""
        unit, size = SPOKEN[self.unit]
        return value / size, unit + per


@dataclass(frozen=True)
class ActuatorLimit(OnUnits):
    """It turns, or pushes, no farther: L = 1/q.

    Size: a third of what was ordered is left. No figure is published: it is a rudder of 35 deg that
    stops at 12, or an engine that its protection slows down to dead slow."""

    name = "actuator_limit"
    kinds = ("rudder", *PUSHING)
    story = "An actuator goes no farther than a limit."
    equation = "u = min(max(u_recorded, -{limit:.3g}), {limit:.3g})"
    remedy = (
        "Drive this unit to its ends and see how far it goes: end switches, the pump, a limit that "
        "is set in its controller. Until then simulate with the extended model."
    )
    parameters = ()
    realistic, least = 3.0, 0.05  # over the largest order; of it, that a limit takes away
    first_step = 0.7  # about half of what was ordered: a smaller one limits nothing
    separated_by = {
        "thrust_loss": "runs at small and at large orders: a limit leaves the small ones as they "
        "were",
        "rudder_force": "small rudder angles: a limit leaves them as they were",
    }

    @property
    def renames(self) -> bool:
        return True

    def sizes(self, setting: Setting) -> np.ndarray:
        return np.array([self.realistic / self.reach(setting)])

    def bounds(self, setting: Setting) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(1), np.array([50.0 / self.reach(setting)])

    def acting(self, record: Record, recorded: np.ndarray, p: np.ndarray) -> np.ndarray:
        return response.limited(recorded, float(p[0]))

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        return np.asarray(p[..., 0] * self.reach(setting) * (1.0 - self.least) > 1.0)

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        return {"limit": self.spoken(1.0 / np.maximum(p[..., 0], 1e-6))}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        limit = estimates["limit"]
        return self.does("go", f"no farther than {worded(limit)}, whatever is recorded")


@dataclass(frozen=True)
class ActuatorRate(OnUnits):
    """It moves slower than recorded: R = 1/q.

    Size: twice as slow as a steering machine may be, 28 s for 65 deg (SOLAS II-1/29.3): 30 s from
    amidships to its end on a ship of 100 m, by Froude 10 √(length/g)."""

    name = "actuator_rate"
    story = "An actuator moves slower than recorded."
    equation = "|u̇| ≤ {rate:.3g}"
    remedy = (
        "Time this unit from end to end: the pump, the voltage, a ramp in its controller. An order "
        "is no feedback. Until then simulate with the extended model."
    )
    parameters = ()
    realistic, least = 10.0, 0.5  # √(length/g), from amidships to its end
    first_step = 1.0
    separated_by = {
        "rudder_lag": "small and large orders: a rate delays the large ones, a lag all alike",
        "rudder_delay": "small and large orders: a rate delays the large ones, a delay all alike",
    }

    def _time(self, setting: Setting) -> float:
        """√(length/g) over the reach of its units [s/unit]."""
        return math.sqrt(setting.scale["length"] / GRAVITY) / self.reach(setting)

    def sizes(self, setting: Setting) -> np.ndarray:
        return np.array([self.realistic * self._time(setting)])

    def bounds(self, setting: Setting) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(1), np.array([300.0 * self._time(setting)])

    def acting(self, record: Record, recorded: np.ndarray, p: np.ndarray) -> np.ndarray:
        return response.rate_limited(record, recorded, float(p[0]))

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        return np.asarray(p[..., 0] > self.least * self._time(setting))

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        return {"rate": self.spoken(1.0 / np.maximum(p[..., 0], 1e-6), "/s")}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return self.does("move", f"no faster than {worded(estimates['rate'])}")


@dataclass(frozen=True)
class ActuatorDeadBand(OnUnits):
    """Backlash of what turns (play), dead zone of what pushes: nothing acts near zero.

    Size: a tenth of what is ordered. The pulse width of a small electric thruster has a zone of
    50 µs of 800 in which it stands still; a steering gear's play is a degree or two of 35."""

    name = "actuator_dead_band"
    story = "An actuator has a dead band."
    equation = "u = band(u_recorded), ±{half_width:.3g} wide"
    remedy = (
        "Move the order of this unit slowly through zero, and see when it follows: worn joints, or "
        "the dead zone of its drive. Set that zone in the profile where it is its drive's."
    )
    parameters = ()
    realistic, least = 0.15, 0.02  # of the largest order
    separated_by = {"rudder_lag": "large orders: a lag delays them, a dead band hardly"}

    @property
    def _turns(self) -> bool:
        return self.unit == "rad"

    @property
    def renames(self) -> bool:
        return not self._turns

    def sizes(self, setting: Setting) -> np.ndarray:
        return np.array([self.realistic * self.reach(setting)])

    def bounds(self, setting: Setting) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(1), np.array([2.0 * self.reach(setting)])

    def acting(self, record: Record, recorded: np.ndarray, p: np.ndarray) -> np.ndarray:
        if self._turns:
            return response.play(record, recorded, float(p[0]))
        return response.dead_zone(recorded, float(p[0]))

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        return np.asarray(p[..., 0] > self.least * self.reach(setting))

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        return {"half_width": self.spoken(0.5 * p[..., 0])}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        what = "play" if self._turns else "a dead zone about zero"
        return self.does("have", f"{what} of ±{worded(estimates['half_width'])}")


@dataclass(frozen=True)
class ActuatorStuck(OnUnits):
    """It stays at one value for a stretch: in each quarter of the campaign a share h of its order
    is lost, and h times the value c acts instead.

    Size: all of it, h = 1, at a value of half its reach."""

    name = "actuator_stuck"
    story = "An actuator is stuck for a stretch."
    equation = "u = (1 - h) u_recorded + h {value:.3g}"
    remedy = (
        "Look at this unit in the stretch that is named: it did not follow its order. Leave that "
        "stretch out where it was repaired."
    )
    parameters = ()
    separated_by = {"thrust_loss": "the same order in the stretch and outside it"}

    def each(self, setting: Setting) -> tuple[Cause, ...]:
        return tuple(c for c in super().each(setting) if len(c.units) == 1)  # type: ignore[attr-defined]

    @property
    def count(self) -> int:
        return STRETCHES + 1

    def sizes(self, setting: Setting) -> np.ndarray:
        return np.append(np.ones(STRETCHES), 0.5 * self.reach(setting))

    def bounds(self, setting: Setting) -> tuple[np.ndarray, np.ndarray]:
        reach = self.reach(setting)
        return (
            np.append(np.full(STRETCHES, -0.5), -1.5 * reach),
            np.append(np.full(STRETCHES, 1.5), 1.5 * reach),
        )

    def acting(self, record: Record, recorded: np.ndarray, p: np.ndarray) -> np.ndarray:
        at = np.minimum((record.share * STRETCHES).astype(int), STRETCHES - 1)
        lost = p[at][:, None]
        return (1.0 - lost) * recorded + lost * p[-1]

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        return np.asarray(p[..., :STRETCHES].max(-1) > 0.2)

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        return {
            "value": self.spoken(p[..., -1]),
            "share": (p[..., :STRETCHES].max(-1), "1"),
            "part": (1.0 + p[..., :STRETCHES].argmax(-1).astype(float), "1"),
        }

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        part = round(estimates["part"].value)
        share = min(max(estimates["share"].value, 0.0), 1.0)
        return self.does(
            "are", f"stuck at {worded(estimates['value'])} for {share:.0%} of quarter {part} of "
            "the campaign",
        )  # fmt: skip


def worded(one: ParameterEstimate) -> str:
    """A value with its unit."""
    return f"{figure(one.value, 3)} {one.unit}" if one.unit != "1" else figure(one.value, 3)
