"""Which causes a channel that contradicts the others could be taken for.

While the contradiction stands none of them is named: knots called m/s look like an offset of the
rudders, and a vane that counts the other way like a weak wind.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from shiplog.models.causes import CATALOGUE
from shiplog.ship_profile.profile import Profile

# Names of the catalogue's causes that a wrong channel imitates; the forces' causes are imitated by
# all channels of the motion.
HULL = ("fouling", "payload", "cross_flow_drag", "shallow_water", "bank")
STEERING = ("rudder_force", "rudder_offset", "rudder_lag", "rudder_delay")
DRIVE = ("thrust_loss", "thrust_drift", "fouling")
AIR = ("wind_force", "wind_direction_offset", "wind_speed_scale")
AROUND = ("current", "line", "tow", "contact")
OF_CHANNELS: Mapping[str, tuple[str, ...]] = {
    "position": (*AROUND, "antenna_offset", "clock_offset", *HULL, *STEERING, *DRIVE),
    "velocity": (*AROUND, "antenna_offset", "clock_offset", *HULL, *STEERING, *DRIVE),
    "heading": ("heading_offset", "clock_offset", *AROUND, *HULL, *STEERING, *DRIVE, *AIR),
    "yaw_rate": ("yaw_rate_bias", "yaw_rate_scale", "clock_offset", *HULL, *STEERING),
    "wind": (*AIR, "clock_offset"),
    "rudder": (*STEERING, "antenna_offset", "payload", "cross_flow_drag"),
    "propeller": (*DRIVE, "rudder_force", *AROUND),
    "thruster": (*DRIVE, *STEERING, *AROUND),
    "azimuth": (*STEERING, *DRIVE),
}
OF_COLUMNS = {"x0": "position", "y0": "position", "surge": "velocity", "sway": "velocity",
              "wind_speed": "wind", "wind_angle": "wind"}  # fmt: skip
COMPARED = "the rows that it would be fitted to contradict each other"


def barred_causes(channels: Iterable[str], profile: Profile) -> dict[str, str]:
    """Name of a cause → why it is not named: what it acts on is contradicted.

    channels   of findings: sensors, columns or actuators; what is none of these bars every cause
    """
    kinds = {actuator.name: actuator.kind for actuator in profile.actuators}
    why: dict[str, str] = {}
    for channel in channels:
        of = OF_COLUMNS.get(channel, kinds.get(channel, channel))
        for name in OF_CHANNELS.get(of, tuple(cause.name for cause in CATALOGUE)):
            why.setdefault(name, f"{channel.replace('_', ' ')} contradicts other channels")
    return why


def all_causes_barred(channels: Iterable[str], profile: Profile) -> dict[str, str]:
    """The same for all causes of the catalogue, where nothing can be compared."""
    why = barred_causes(channels, profile)
    return {cause.name: why.get(cause.name, COMPARED) for cause in CATALOGUE}
