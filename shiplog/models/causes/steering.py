"""Causes in the steering: zero, lag and delay of a rudder, between its record and what acts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from shiplog.models.causes import actuator_response as response
from shiplog.models.causes.base import Cause, Parameter, ParameterEstimate, Setting
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.recording import Record


def _columns(profile: Profile, kind: str) -> list[int]:
    return [i for i, a in enumerate(profile.actuators) if a.kind == kind]


@dataclass(frozen=True)
class _OnRudders(Cause):
    """Of rudders, or of azimuths where the model has no rudder."""

    what: str = field(default="rudders", kw_only=True)

    kind = "ship"
    needs = ("steering",)

    def on(self, setting: Setting) -> Self:
        return replace(self, what="rudders" if setting.columns("rudder") else "azimuths")

    def _steering(self, profile: Profile) -> list[int]:
        return _columns(profile, "rudder" if self.what == "rudders" else "azimuth")

    def orders(self, profile: Profile) -> frozenset[int]:
        return frozenset(self._steering(profile))

    def _with(self, record: Record, acting: np.ndarray) -> Record:
        actuator = record.actuator.copy()
        actuator[:, self._steering(record.profile)] = acting
        return replace(record, actuator=actuator)

    def _recorded(self, record: Record) -> np.ndarray:
        return record.actuator[:, self._steering(record.profile)]


@dataclass(frozen=True)
class RudderOffset(_OnRudders):
    """Up to two groups of rudders: those to port of the centreline, and the others.

    Size: what stays below the 5 deg at which a steering failure has to be alarmed (46 CFR 113.43).
    """

    groups: tuple[str, ...] = ("port", "starboard")

    realistic, least = np.radians(4.0), np.radians(0.3)

    name = "rudder_offset"
    story = "The rudders have an offset from their recorded angles."
    equation = "δ = δ_recorded + offset"
    remedy = (
        "Check the rudder's zero at the dock, and correct its offset in the profile. "
        "Then ingest these logs again. Where the zero is right, a side force of the screw acts "
        "alike as long as it turns."
    )
    parameters = ()
    separated_by = {
        "heading_offset": "hover and coasting with the propeller stopped: the offset then vanishes"
    }

    @property
    def renames(self) -> bool:
        return True

    @property
    def count(self) -> int:
        return len(self.groups)

    def on(self, setting: Setting) -> Self:
        made = super().on(setting)
        columns = made._steering(setting.profile)
        aside = [setting.profile.actuators[i].position_m[1] for i in columns]
        paired = min(aside, default=0.0) < 0.0 < max(aside, default=0.0)
        groups = ("port", "starboard") if paired else ("angle",)
        return replace(made, groups=groups)

    def sizes(self, setting: Setting) -> np.ndarray:
        return np.full(self.count, self.realistic)

    def bounds(self, setting: Setting) -> tuple[np.ndarray, np.ndarray]:
        return np.full(self.count, -np.radians(40.0)), np.full(self.count, np.radians(40.0))

    def read(self, record: Record, p: np.ndarray) -> Record:
        columns = self._steering(record.profile)
        if self.count == 1:
            each = np.full(len(columns), p[0])
        else:
            aside = [record.profile.actuators[i].position_m[1] for i in columns]
            each = np.array([p[0] if y < 0.0 else p[1] for y in aside])
        return self._with(record, self._recorded(record) + each)

    def displayed(self, p: np.ndarray) -> dict[str, tuple[np.ndarray, str]]:
        return {name: (np.degrees(p[..., i]), "deg") for i, name in enumerate(self.groups)}

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        angles = " and ".join(
            f"{v.value:+.1f} deg" + (f" ({name})" if self.count > 1 else "")
            for name, v in estimates.items()
        )
        return f"The {self.what} have an offset of {angles} from the recorded angle."

    def practical(self, p: np.ndarray, setting: Setting) -> np.ndarray:
        return np.asarray(np.abs(p).max(-1) > self.least)


@dataclass(frozen=True)
class RudderLag(_OnRudders):
    """Size: steering machines are of the first order with 1 to 2.5 s (van Amerongen 1982; Fossen
    2011, Sec. 9.5), and the record of the order lacks all of that."""

    name = "rudder_lag"
    story = "The rudders follow their recorded angle with a first-order lag."
    equation = "T δ̇ = δ_recorded - δ,  T = {time:.2f} s"
    remedy = (
        "Check the steering gear and where the rudder angle is measured: an order is no "
        "feedback. Until then simulate with the extended model."
    )
    parameters = (Parameter("time", "s", 1.6, 0.1, low=0.0, high=20.0),)
    separated_by = {"rudder_delay": "rudder doublets of 2 to 4 s at constant revolutions"}

    def read(self, record: Record, p: np.ndarray) -> Record:
        return self._with(record, response.lagged(record, self._recorded(record), float(p[0])))

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        lag = estimates["time"].value
        return f"The {self.what} follow the recorded angle with a lag of {lag:.2f} s."


@dataclass(frozen=True)
class RudderDelay(_OnRudders):
    """Size: a second, the interval at which an autopilot's sentences come (IEC 61162-1)."""

    name = "rudder_delay"
    story = "The rudders act later than recorded."
    equation = "δ(t) = δ_recorded(t - {time:.2f} s)"
    remedy = (
        "Check the clock of the rudder angle and where it is measured: an order is no "
        "feedback. Then ingest these logs again."
    )
    parameters = (Parameter("time", "s", 1.0, 0.1, low=0.0, high=10.0),)
    separated_by = {"rudder_lag": "rudder doublets of 2 to 4 s at constant revolutions"}

    @property
    def nominal(self) -> bool:
        return False  # a small one is a small lag

    def read(self, record: Record, p: np.ndarray) -> Record:
        return self._with(record, response.delayed(record, self._recorded(record), float(p[0])))

    def sentence(self, estimates: Mapping[str, ParameterEstimate]) -> str:
        return f"The {self.what} act {estimates['time'].value:.2f} s later than recorded."
