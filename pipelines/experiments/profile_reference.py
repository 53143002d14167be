"""The reference of the profile format, from the code that reads profiles: docs/reference/profile.md
and units.md in the same folder.

python -m pipelines.experiments.profile_reference --markdown docs/reference/profile.md
"""

from __future__ import annotations

import argparse
import types
import typing
from collections.abc import Sequence
from pathlib import Path

from pydantic.fields import FieldInfo

from shiplog.nomenclature import units
from shiplog.report.evaluation import tables
from shiplog.ship_profile import file as profile_file
from shiplog.ship_profile import profile
from shiplog.ship_profile.profile import Section
from shiplog.ship_profile.table_channels import LEVEL, SENSOR_KINDS, TABLE_CHANNELS, TABLE_LABELS
from shiplog.ship_profile.units_of_channels import DRIVEN

HEAD = """# The ship profile

A profile is a TOML file. It says which topic and field of a log is which channel of the ship, in
which unit, and where it is measured. `shiplog profile LOG` drafts one from a log or a table; look
over every line that says CHECK. Such a line's key is kept with the voyage, and `train` refuses it
by name: delete the word when you have looked, or give `--unchecked`. A key that is not listed here
is refused, and the message names the nearest one that is. Where `sigma` or `resolution` is left
out, `ingest` estimates it from each record, and `voyage.json` has what it found.

    [ship]
    name = "my ship"
    length_m = 12.0

    [sensors.position]
    kind = "geodetic"
    topic = "/gnss/fix"
    fields = ["latitude", "longitude"]
    unit = "deg"
    lever_arm_m = [3.2, 0.0]

    [sensors.velocity]
    kind = "sog_cog"
    topic = "/gnss/velocity"
    fields = ["sog_mps", "cog_deg"]
    units = ["m/s", "deg"]
    lever_arm_m = [3.2, 0.0]

    [sensors.heading]
    topic = "/gyro"
    field = "heading_deg"
    unit = "deg"

    [[actuators]]
    name = "rudder"
    kind = "rudder"
    topic = "/rudder/main"
    field = "angle_deg"
    unit = "deg"
    limits = [-35.0, 35.0]

Position and heading are needed. Without a velocity, it and the yaw rate are
[derived](../use/pose_only.md) from them; without a yaw rate sensor alone the heading is
differentiated; without a wind sensor no model has the force of the wind. Without actuators a log
can be ingested and its sensors checked, and no model can be trained.

Axes: x0 to the north, y0 to the east, x ahead, y to starboard, angles clockwise; a positive rudder
turns the bow to starboard; the wind's angle is where it blows from, clockwise from the bow.

The [units](units.md) of a value and the channels of a table's columns have a page of their own.
[Catalogue](catalogue.md) lists what a cause of a diagnosis needs of a profile, and
[coefficients](coefficients.md) the file `my-ship.mmg.toml` that may stand next to it.
"""

MEANT = {  # each kind of a sensor in words
    "geodetic": "latitude and longitude", "local": "x0 and y0, metres north and east of a datum",
    "sog_cog": "speed over ground, and course over ground clockwise from north",
    "body": "ahead and to starboard", "ned": "to the north and to the east",
    "enu": "to the east and to the north", "angle": "clockwise from north",
    "quaternion_enu": "x, y, z, w of a quaternion whose yaw counts from east towards north (ROS: "
    "x ahead, z up); z and w alone of what is mounted level",
    "quaternion_ned": "x, y, z, w of a quaternion whose yaw counts from north towards east (x "
    "ahead, z down); z and w alone of what is mounted level",
    "rate": "positive where the bow turns to starboard",
    "from_bow": "apparent wind: speed, and where it blows from, clockwise from the bow",
}  # fmt: skip

ACTUATORS = {  # kind → what its value is, in which units, and what `mmg` and `hybrid` make of it
    "rudder": (
        "angle, positive where it turns the bow to starboard", "deg, rad",
        "it stands in the slipstream of the nearest propeller, if that is within one propeller "
        "diameter athwart",
    ),
    "propeller": (
        "revolutions of a fixed shaft, positive ahead", "rpm, rev/s", "its `diameter_m` is needed",
    ),
    "azimuth": (
        "angle of a unit that turns all the way round, from ahead towards starboard", "deg, rad",
        "it turns the thruster whose `position_m` is the same; that is a section of its own",
    ),
    "thruster": (
        "command of a fixed thruster, or of an azimuth's: -1 to 1, positive ahead or along "
        "`direction_deg`", "1, %, pwm; rpm, rev/s, deg, rad with `limits`",
        "full thrust is at the larger of its limits, else at 1",
    ),
}  # fmt: skip


UNITS = "units.md"  # the second page


def text() -> str:
    """The page of keys and kinds."""
    source = set(profile.Source.model_fields)
    actuator = [name for name in profile.Actuator.model_fields if name not in source]
    sensor = [name for name in profile.Sensor.model_fields if name not in source]
    return "\n".join(
        (
            HEAD,
            "Profiles to start from, in `shiplog/profiles/`: "
            + ", ".join(f"`{name}`" for name in profile_file.shipped())
            + ".\n",
            "## [ship]\n",
            "Missing values are estimated where they are needed, and reported.\n",
            _keys(profile.Ship),
            "\n## [sensors.*] and [[actuators]]\n",
            "These keys say where the values stand in a log. `field` or `fields` is needed.\n",
            _keys(profile.Source),
            "\n### Only of sensors\n",
            _keys(profile.Sensor, sensor),
            "\n### Kinds of sensors\n",
            _kinds(),
            "\n### Only of actuators\n",
            "One section each, in the order in which a model takes them.\n",
            _keys(profile.Actuator, actuator),
            "\n### Kinds of actuators\n",
            _actuators(),
            "\n## [site]\n",
            "What a chart shows; all optional.\n",
            _keys(profile.Site),
            "\n## [table]\n",
            "For `shiplog convert`: what the columns of a table hold. A key is a column's name; "
            '`"column" = "channel"`\nis short for a column in SI units.\n',
            _keys(profile.Column),
            "",
        )
    )


def units_text() -> str:
    """The page of channels and units."""
    return "\n".join(
        (
            "# Channels and units of a profile\n",
            "The keys of a profile are on the page [profile](profile.md).\n",
            "## Channels of a table\n",
            "What a column of `[table]` can be.\n",
            _channels(),
            "\n## Units\n",
            "Factors to SI; propellers are in rev/s. `pwm` is a servo pulse in µs: `offset` is the "
            "neutral pulse, and\n400 µs more or less is full command, 1 or -1. "
            "Letter case does not matter (`M/S`, `Deg`), but `kN` and `M` are\nrefused: they are "
            "kilonewtons and nautical miles.\n",
            _units(),
            "\nA unit that measures something else than its channel is refused. An actuator may be "
            "given as its\nvalue, or as the share or servo pulse that commands it:\n",
            _driven(),
            "\n`mmg` and `hybrid` compute with angles and revolutions. They take a command of 1 of "
            "a rudder or azimuth\nas 1 rad, and of a propeller as 1 rev/s. Give another size of "
            "full command as a factor in `sign`: 0.61 for a\nrudder that stands at 35 deg (0.61 "
            "rad) then, 12.5 for a shaft that turns at 12.5 rev/s.\n",
        )
    )


def _keys(section: type[Section], names: Sequence[str] = ()) -> str:
    fields = section.model_fields
    rows = [(f"`{n}`", *_key(fields[n])) for n in names or fields]
    return tables.table(("key", "value", "left out", "what it is"), rows)


def _key(field: FieldInfo) -> tuple[str, str, str]:
    if field.is_required():
        left_out = "needed"
    elif field.default is None or field.default == ():
        left_out = "-"
    else:
        left_out = f"`{_toml(field.default)}`"
    return _value(field.annotation), left_out, field.description or ""


def _value(kind: object) -> str:
    """A type in a user's words."""
    origin, inside = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return _value(inside[0])
    if origin is typing.Literal:
        return " or ".join(f"`{_toml(value)}`" for value in inside)
    if origin in (types.UnionType, typing.Union):
        each = dict.fromkeys(_value(one) for one in inside if one is not type(None))
        return " or ".join(each)
    if origin is tuple:
        of = "list" if inside[-1] is Ellipsis else "pair"
        first, *rest = _value(inside[0]).split(" ")
        return " ".join((of, "of", f"{first}s", *rest))
    return {str: "text", float: "number", int: "number"}.get(typing.cast(type, kind), str(kind))


def _toml(value: object) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    return str(list(value)) if isinstance(value, tuple) else str(value)


def _kinds() -> str:
    rows = [
        (f"`{sensor}`", f"`{_toml(kind)}`", _count(sensor, kind), MEANT[kind])
        for sensor, kinds in SENSOR_KINDS.items()
        for kind in kinds
    ]
    return tables.table(("sensor", "kind", "fields", "what they are"), rows)


def _count(sensor: str, kind: str) -> str:
    """How many fields a kind has."""
    fewer = LEVEL.get((sensor, kind))
    return str(len(TABLE_CHANNELS[sensor, kind])) + (f" or {fewer}" if fewer else "")


def _actuators() -> str:
    rows = [
        (f"`{_toml(kind)}`", *ACTUATORS[kind])
        for kind in typing.get_args(profile.Actuator.model_fields["kind"].annotation)
    ]
    return tables.table(
        ("kind", "what its value is", "units of this value", "in `mmg` and `hybrid`"), rows
    )


def _channels() -> str:
    rows = [
        (" and ".join(f"`{c}`" for c in names), f"`{sensor}` of kind `{_toml(kind)}`")
        for (sensor, kind), names in TABLE_CHANNELS.items()
    ]
    rows += [(f"`{name}`", what) for name, what in TABLE_LABELS.items()]
    rows.append(("an actuator's name", "that actuator"))
    return tables.table(("channel", "what it is for"), rows)


def _units() -> str:
    rows = [
        (f"`{unit}`", units.measure(unit) or "", f"{factor:.7g}")
        for unit, factor in units.TO_SI.items()
    ]
    return tables.table(("unit", "measures", "factor"), rows)


def _driven() -> str:
    rows = [(f"`{kind}`", ", ".join(measures)) for kind, measures in DRIVEN.items()]
    return tables.table(("actuator", "takes a unit of"), rows)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--markdown", type=Path, metavar="PATH", help="write it there")
    path = parser.parse_args().markdown
    if path is None:
        print(text(), units_text(), sep="\n")
    else:
        path.write_text(text(), encoding="utf-8")
        path.with_name(UNITS).write_text(units_text(), encoding="utf-8")


if __name__ == "__main__":
    main()
