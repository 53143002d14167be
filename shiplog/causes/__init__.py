"""The catalogue, in the order we report. To add a cause: its class in one of these files (or in a
file of your own, given with --cause), and a line in CATALOGUE."""

from __future__ import annotations

from shiplog.causes.base import Cause, Parameter, Setting, Shown, constants_of, si
from shiplog.causes.environment import Bank, Current, ShallowWater, WindForce
from shiplog.causes.sensors import (
    AntennaOffset,
    ClockOffset,
    HeadingOffset,
    WindDirectionOffset,
    WindSpeedScale,
    YawRateBias,
    YawRateScale,
)
from shiplog.causes.ship import (
    CrossFlowDrag,
    Fouling,
    Payload,
    RudderDelay,
    RudderForce,
    RudderLag,
    RudderOffset,
    ThrustDrift,
    ThrustLoss,
)

CATALOGUE: tuple[Cause, ...] = (
    Current(), WindForce(), ShallowWater(), Bank(),
    Fouling(), Payload(), CrossFlowDrag(), ThrustLoss(), ThrustDrift(), RudderForce(),
    RudderOffset(), RudderLag(), RudderDelay(),
    HeadingOffset(), HeadingOffset(turned=True), YawRateBias(), YawRateScale(),
    ClockOffset("position"), ClockOffset("velocity"), ClockOffset("gnss"),
    ClockOffset("yaw_rate"), ClockOffset("wind"),
    AntennaOffset(), WindDirectionOffset(), WindSpeedScale(),
)  # fmt: skip

__all__ = ["CATALOGUE", "Cause", "Parameter", "Setting", "Shown", "constants_of", "si"]
