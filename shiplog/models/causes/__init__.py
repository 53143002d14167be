"""The catalogue, in the order we report. To add a cause: its class in one of these files (or in a
file of your own, given with --cause), and a line in CATALOGUE."""

from __future__ import annotations

from collections.abc import Iterable

from shiplog.models.causes.actuator_pairs import ActuatorCoupling, ActuatorsExchanged
from shiplog.models.causes.actuators import (
    ActuatorDeadBand,
    ActuatorLimit,
    ActuatorRate,
    ActuatorStuck,
)
from shiplog.models.causes.base import (
    Cause,
    Orders,
    Parameter,
    ParameterEstimate,
    Setting,
    constants_of,
    si,
)
from shiplog.models.causes.contact import Contact
from shiplog.models.causes.environment import Bank, Current, ShallowWater, WindForce
from shiplog.models.causes.lines import Line, Tow
from shiplog.models.causes.sensors import (
    AntennaOffset,
    ClockOffset,
    HeadingOffset,
    WindDirectionOffset,
    WindSpeedScale,
    YawRateBias,
    YawRateScale,
)
from shiplog.models.causes.ship import (
    CrossFlowDrag,
    Fouling,
    Payload,
    RudderForce,
    ThrustDrift,
    ThrustLoss,
)
from shiplog.models.causes.steering import RudderDelay, RudderLag, RudderOffset

CATALOGUE: tuple[Cause, ...] = (
    Current(), WindForce(), ShallowWater(), Bank(),
    Line(), Tow(), Contact(),
    Fouling(), Payload(), CrossFlowDrag(), ThrustLoss(), ThrustDrift(), RudderForce(),
    RudderOffset(), RudderLag(), RudderDelay(),
    ActuatorLimit(), ActuatorRate(), ActuatorDeadBand(), ActuatorStuck(), ActuatorCoupling(),
    ActuatorsExchanged(),
    HeadingOffset(), HeadingOffset(turned=True), YawRateBias(), YawRateScale(),
    ClockOffset("position"), ClockOffset("velocity"), ClockOffset("gnss"),
    ClockOffset("velocity", turned=True), ClockOffset("gnss", turned=True),
    ClockOffset("yaw_rate"), ClockOffset("wind"),
    AntennaOffset(), WindDirectionOffset(), WindSpeedScale(),
)  # fmt: skip


def testable(
    setting: Setting, causes: Iterable[Cause] = CATALOGUE, fitted: str = ""
) -> tuple[list[Cause], dict[str, str]]:
    """Causes that can be tested on this ship, and label → why not of the others.

    The first list has every cause as this ship has it, in the catalogue's order; a cause of one of
    several units stands there once for each unit.

    fitted   what was fitted to the very voyages in question, because no nominal campaign was there
             before: "physics", "network", or "" for neither
    """
    chosen: list[Cause] = []
    untested: dict[str, str] = {}
    for cause in causes:
        missing = cause.missing(setting)
        if missing is not None:
            untested[cause.label] = missing
            continue
        for one in cause.each(setting):
            if fitted and one.absorbed:
                untested[one.label] = "a model fitted to these voyages absorbs it"
            elif fitted == "network" and one.renames:
                untested[one.label] = "a network fitted to these voyages absorbs it"
            else:
                chosen.append(one)
    return chosen, untested


__all__ = [
    "CATALOGUE",
    "Cause",
    "Orders",
    "Parameter",
    "ParameterEstimate",
    "Setting",
    "constants_of",
    "si",
    "testable",
]
