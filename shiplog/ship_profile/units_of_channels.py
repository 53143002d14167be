"""Which units a channel takes: an angle in knots is a slip, and its numbers would look fine."""

from __future__ import annotations

from collections.abc import Iterator

from shiplog.exceptions import ProfileError
from shiplog.nomenclature import units
from shiplog.ship_profile.profile import Profile
from shiplog.ship_profile.table_channels import QUATERNION, channels_of

MEASURE = {  # what each channel of a sensor measures
    "latitude": "angle", "longitude": "angle", "x0": "length", "y0": "length",
    "sog": "speed", "cog": "angle", "surge": "speed", "sway": "speed",
    "velocity_north": "speed", "velocity_east": "speed",
    "heading": "angle", **dict.fromkeys(QUATERNION, "ratio"),
    "yaw_rate": "rate of turn", "wind_speed": "speed", "wind_angle": "angle", "time": "time",
}  # fmt: skip
DRIVEN = {  # of an actuator: its value, or the share or the pulse that commands it
    "rudder": ("angle", "ratio", "servo pulse"),
    "azimuth": ("angle", "ratio", "servo pulse"),
    "propeller": ("shaft speed", "ratio", "servo pulse"),
    "thruster": ("shaft speed", "ratio", "servo pulse", "angle"),  # an angle of its lever or blades
}
ADVICE = {  # for a unit that is often meant for another
    "us": 'a servo\'s pulses in µs are unit = "pwm"',
    "rad/s": 'a shaft in rad/s is unit = "rps" with sign = 0.1591549',
}


def require_fitting(profile: Profile) -> None:
    """Raises ProfileError for a unit of another kind than its channel takes.

    What has no unit is SI, and is not looked at.
    """
    for place, unit, wanted in _stated(profile):
        measure = units.measure(unit)
        if measure is None or measure in wanted:
            continue
        known = ", ".join(one for name in wanted for one in units.MEASURES[name])
        meant = ADVICE.get(unit, "") if "shaft speed" in wanted else ""
        raise ProfileError(
            f"The profile {profile.source} gives {place} in {unit!r}, a unit of {measure}; it "
            f"takes {' or '.join(wanted)}: {known}.",
            hint=meant
            or "correct `unit` there; of two fields that differ, `units` names each "
            "one's in the order of `fields`.",
        )


def _stated(profile: Profile) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """(where it stands, unit, what it may measure) of every unit that the profile states."""
    for name, sensor in profile.sensors.items():
        given = sensor.units or ((sensor.unit,) * len(sensor.paths) if sensor.unit else ())
        channels = channels_of(name, profile.sensors.kind(name), len(sensor.paths))
        for channel, path, unit in zip(channels, sensor.paths, given, strict=False):
            yield f"the field {path!r} of sensors.{name}", unit, (MEASURE[channel],)
    for actuator in profile.actuators:
        for unit in actuator.units or ((actuator.unit,) if actuator.unit else ()):
            yield f"the {actuator.kind} {actuator.name!r}", unit, DRIVEN[actuator.kind]
    kinds = {actuator.name: actuator.kind for actuator in profile.actuators}
    for column, entry in profile.table.items():
        takes = DRIVEN[kinds[entry.channel]] if entry.channel in kinds else ()
        takes = takes or ((MEASURE[entry.channel],) if entry.channel in MEASURE else ())
        if entry.unit and takes:
            yield f"the column {column!r} of [table]", entry.unit, takes
