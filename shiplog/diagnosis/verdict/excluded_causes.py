"""Which faults of the sensors the sensors exclude by themselves, without any model of the ship.

Position, velocity, heading and yaw rate of one voyage are compared in `voyages/sensors`. Where the
interval of an error there, widened to SURE half intervals, holds nothing of a practical size, the
sensor has no such fault. A model that describes the ship badly may still gain by one: it is not
tested. A cause is a change between two campaigns, and both have to exclude it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import polars as pl

from shiplog.models.causes import CATALOGUE, Cause
from shiplog.nomenclature import units
from shiplog.nomenclature.numbers import figure
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.sensors import sensor_consistency
from shiplog.voyages.sensors.campaign_consistency import join
from shiplog.voyages.sensors.sensor_findings import SURE_HALF_INTERVALS, Estimate

# Label of a cause → kind and channel of the estimates of its parameters, in their order.
ESTIMATED: Mapping[str, tuple[tuple[str, str], ...]] = {
    "heading_offset": (("heading_offset", "heading"),),
    "yaw_rate_bias": (("yaw_rate_bias", "yaw_rate"),),
    "yaw_rate_scale": (("yaw_rate_scale", "yaw_rate"),),
    "clock_offset:yaw_rate": (("clock_offset", "yaw_rate"),),
    "antenna_offset": (
        ("antenna_offset", "position ahead"), ("antenna_offset", "position starboard"),
    ),
}  # fmt: skip


def excluded_causes(
    campaigns: Sequence[Mapping[str, pl.DataFrame]], profile: Profile
) -> dict[str, str]:
    """Label of a cause → why it is not tested: every campaign excludes it.

    campaigns   voyage → its table at 10 Hz, of the trial first; those without voyages are left out
    """
    why: dict[str, str] = {}
    labels = list(ESTIMATED)
    for tables in filter(None, campaigns):
        motion = join([sensor_consistency.measured(table, profile) for table in tables.values()])
        found = sensor_consistency.of_motion(motion, profile).estimates
        of = {(e.kind, e.channel): e for e in found}
        labels = [label for label in labels if _excludes(of, label, profile)]
        for label in labels:
            ranges = " and ".join(_range(of[key]) for key in ESTIMATED[label])
            why.setdefault(label, f"the sensors alone exclude it: {ranges}")
        if not labels:
            break
    return {label: why[label] for label in labels if label in why}


def _excludes(of: Mapping[tuple[str, str], Estimate], label: str, profile: Profile) -> bool:
    """Whether no parameter of the cause can be of practical size."""
    (cause,) = (one for one in CATALOGUE if one.label == label)
    found = [of.get(key) for key in ESTIMATED[label]]
    return all(
        e is not None and not e.rival and _farthest(e) < _least(cause, number, profile)
        for number, e in enumerate(found)
    )


def _farthest(e: Estimate) -> float:
    """max |value - none ± SURE half intervals|, SI."""
    half = SURE_HALF_INTERVALS * 0.5 * (e.high - e.low)
    return (abs(e.value - e.none) + half) * units.factor(e.unit)


def _least(cause: Cause, number: int, profile: Profile) -> float:
    """Practical size of a parameter, SI: those of sensors are absolute, or shares of the length."""
    parameter = cause.parameters[number]
    return parameter.least * (profile.ship.length_m if parameter.of == "length" else 1.0)


def _range(e: Estimate) -> str:
    """`heading -0.0087 to 0.013 deg`."""
    unit = "" if e.unit == "1" else f" {e.unit}"
    return f"{e.channel.replace('_', ' ')} {figure(e.low)} to {figure(e.high)}{unit}"
