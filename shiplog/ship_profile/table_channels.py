"""What a sensor of a profile may be, and what a column of a table may hold."""

from __future__ import annotations

SENSOR_KINDS = {  # what each sensor may be, the first being meant where `kind` is left out
    "position": ("geodetic", "local"),
    "velocity": ("sog_cog", "body", "ned", "enu"),
    "heading": ("angle", "quaternion_enu", "quaternion_ned"),
    "yaw_rate": ("rate",),
    "wind": ("from_bow",),
}
NEEDED = {  # sensors without which there is no table, and what records them
    "position": "a GNSS fix or a local position",
    "heading": "a gyro or a GNSS compass (the course over ground is not the heading)",
}
QUATERNION = ("quaternion_x", "quaternion_y", "quaternion_z", "quaternion_w")
# What a table's column may hold, sensor by sensor and kind by kind, in the order of its fields.
TABLE_CHANNELS = {
    ("position", "geodetic"): ("latitude", "longitude"),
    ("position", "local"): ("x0", "y0"),
    ("velocity", "sog_cog"): ("sog", "cog"),
    ("velocity", "body"): ("surge", "sway"),
    ("velocity", "ned"): ("velocity_north", "velocity_east"),
    ("velocity", "enu"): ("velocity_east", "velocity_north"),
    ("heading", "angle"): ("heading",),
    ("heading", "quaternion_enu"): QUATERNION,
    ("heading", "quaternion_ned"): QUATERNION,
    ("yaw_rate", "rate"): ("yaw_rate",),
    ("wind", "from_bow"): ("wind_speed", "wind_angle"),
}
LEVEL = {  # kinds that do with their last fields alone, and how many: of what is mounted level
    ("heading", "quaternion_enu"): 2,
    ("heading", "quaternion_ned"): 2,
}
TABLE_LABELS = {  # columns of a table that say whose row it is, and when
    "time": "the row's time; one without a zone is taken as UTC",
    "date": "belongs to a `time` that is a time of day",
    "voyage": "cuts the table into one log per value",
    "vessel": "tells the ships of a table apart",
    "status": "says which rows have a fix: position and velocity are blank where it holds one of "
    "its `missing`",
}


def channels_of(sensor: str, kind: str, fields: int) -> tuple[str, ...]:
    """What each of so many fields of a sensor holds; no channel where there cannot be so many."""
    channels = TABLE_CHANNELS[sensor, kind]
    if fields == LEVEL.get((sensor, kind)):
        return channels[-fields:]
    return channels if fields == len(channels) else ()
