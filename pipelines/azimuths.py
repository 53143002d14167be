"""Two causes of one's own, for `shiplog diagnose --cause`: azimuth thrusters that follow late.

The catalogue's rudder_lag and rudder_delay, of the columns that turn a thruster.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from shiplog.causes import Setting
from shiplog.causes.ship import RudderDelay, RudderLag
from shiplog.record import Record


class _OnAzimuths:
    """Where the rudders' causes find their columns, here the azimuths'."""

    def missing(self, setting: Setting) -> str | None:
        turned = any(a.kind == "azimuth" for a in setting.profile.actuators)
        return None if turned else "the ship has no azimuth"

    def _columns(self, record: Record) -> list[int]:
        return [i for i, a in enumerate(record.profile.actuators) if a.kind == "azimuth"]

    def _recorded(self, record: Record) -> np.ndarray:
        return record.actuator[:, self._columns(record)]

    def _with(self, record: Record, acting: np.ndarray) -> Record:
        actuator = record.actuator.copy()
        actuator[:, self._columns(record)] = acting
        return replace(record, actuator=actuator)


@dataclass(frozen=True)
class AzimuthLag(_OnAzimuths, RudderLag):
    name = "azimuth_lag"
    story = "The azimuths follow what is recorded with a lag of the first order."
    equation = "T α̇ = α_recorded - α,  T = {time:.2f} s"
    separated_by: ClassVar[Mapping[str, str]] = {
        "azimuth_delay": "azimuths turned to and fro at constant revolutions"
    }


@dataclass(frozen=True)
class AzimuthDelay(_OnAzimuths, RudderDelay):
    name = "azimuth_delay"
    story = "The azimuths act later than they are recorded."
    equation = "α(t) = α_recorded(t - {time:.2f} s)"
    separated_by: ClassVar[Mapping[str, str]] = {
        "azimuth_lag": "azimuths turned to and fro at constant revolutions"
    }
