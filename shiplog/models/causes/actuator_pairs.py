"""Causes of two actuators of one kind: one follows the other's order, or each the other's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from shiplog.models.causes.actuators import OnUnits
from shiplog.models.causes.base import Cause, Parameter, ParameterEstimate, Setting
from shiplog.voyages.rows.recording import Record

ALIKE = 0.02  # share of the extent by which two orders have to differ, to be distinguished


@dataclass(frozen=True)
class _OnPairs(OnUnits):
    """Of two units of one kind, whose orders differ: `actuator` and the second of `units`."""

    still = "no two actuators of a kind have orders that differ"

    @property
    def second(self) -> str:
        """The profile's name of the other one."""
        return self.units[1] if self.units else ""

    @property
    def label(self) -> str:
        return f"{self.name}:{self._joint.join(self.units)}" if self.units else self.name

    @property
    def renames(self) -> bool:
        return True

    def compatible(self, label: str) -> bool:
        return label.partition(":")[0] != self.name

    def each(self, setting: Setting) -> tuple[Cause, ...]:
        found = []
        for kind in self.kinds:
            columns = setting.columns(kind)
            for i in columns:
                for j in columns:
                    one, two = (setting.profile.actuators[k] for k in (i, j))
                    apart = setting.apart(i, j) > ALIKE * max(setting.extent(i), setting.extent(j))
                    if self._pair(i, j) and apart and one.si_unit == two.si_unit:
                        pair = replace(
                            self, actuator=one.name, units=(one.name, two.name), unit=one.si_unit,
                        )  # fmt: skip
                        found.append(pair)
        return tuple(found)

    _joint: ClassVar[str] = "+"

    def _pair(self, i: int, j: int) -> bool:
        return i < j


@dataclass(frozen=True)
class ActuatorCoupling(_OnPairs):
    """It follows a share q of the order of another unit; of its own order a part of q is lost,
    between none (both orders add) and all (one takes the other's place), ½ + g of it.

    Size: a third. No figure is published; it is what a crossed wire or a shared shaft leaves."""

    name = "actuator_coupling"
    story = "An actuator follows a share of another one's order."
    equation = "u₁ = u₁,recorded + {share:.2f} (u₂,recorded - (½ + g) u₁,recorded)"
    remedy = (
        "Move the other unit alone, and see whether this one follows: mixed signals, an allocation "
        "that the recorder does not know, a linkage."
    )
    parameters = (Parameter("share", "1", 0.35, 0.03, low=-1.5, high=1.5),)
    separated_by = {"thrust_loss": "one unit at a time, the other at zero"}
    _joint = "/"

    @property
    def of(self) -> str:
        """The unit that it follows."""
        return self.second

    @property
    def count(self) -> int:
        return 2

    def sizes(self, setting: Setting) -> np.ndarray:
        return np.array([self.parameters[0].prior, 0.5])

    def bounds(self, setting: Setting) -> tuple[np.ndarray, np.ndarray]:
        one = self.parameters[0]
        return np.array([one.low, -1.0]), np.array([one.high, 1.0])

    def _pair(self, i: int, j: int) -> bool:
        return i != j

    def read(self, record: Record, p: np.ndarray) -> Record:
        return _mixed(record, self.units, ((float(p[0]), float(p[0] * (0.5 + p[1]))), (0.0, 0.0)))

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        share = estimates["share"].value
        return self.does("follow", f"{share:.0%} of the order of {self.second}")


@dataclass(frozen=True)
class ActuatorsExchanged(_OnPairs):
    """Each of two units does what is recorded of the other one: q = 1; between, a share of it.

    Size: all of it."""

    name = "actuators_exchanged"
    story = "Two actuators are exchanged."
    equation = "u₁ = u₂,recorded,  u₂ = u₁,recorded"
    remedy = "Exchange their two names in the profile, and ingest these logs again."
    parameters = (Parameter("share", "1", 1.0, 0.5, low=-0.5, high=1.5),)
    whole = (1.0,)  # half of an exchange is worse than none
    separated_by = {"actuator_coupling": "one unit at a time, the other at zero"}

    @property
    def other(self) -> str:
        """The unit that it is exchanged with."""
        return self.second

    def read(self, record: Record, p: np.ndarray) -> Record:
        share = float(p[0])
        return _mixed(record, self.units, ((share, share), (share, share)))

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return f"The actuators {self.actuator} and {self.second} are exchanged."


def _mixed(
    record: Record, units: Sequence[str], shares: tuple[tuple[float, float], tuple[float, float]]
) -> Record:
    """Each of two units with a share of the other one's order, and less by a share of its own."""
    names = record.profile.actuator_names
    if not units or not any(map(any, shares)) or any(one not in names for one in units):
        return record
    i, j = (names.index(one) for one in units)
    actuator = record.actuator.copy()
    one, two = record.actuator[:, i], record.actuator[:, j]
    actuator[:, i] = one + shares[0][0] * two - shares[0][1] * one
    actuator[:, j] = two + shares[1][0] * one - shares[1][1] * two
    return replace(record, actuator=actuator)
