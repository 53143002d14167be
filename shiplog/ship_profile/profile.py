"""The ship profile: which topic and field is which channel, in which unit, measured where.

A TOML of sections [ship], [sensors.<channel>], [[actuators]], [site] and [table]; keys in the
contract's words. `profile_sources` has the sensors and actuators; `profile_file` reads one.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from shiplog.exceptions import ProfileError, listed, nearest
from shiplog.nomenclature import channels
from shiplog.ship_profile.sources import (
    FINEST,
    LONGEST_M,
    NO_ANGLE,
    Actuator,
    Area,
    Length,
    Number,
    Place,
    Sensor,
    Sensors,
    Source,
    Unit,
    require_factor,
)
from shiplog.ship_profile.table_channels import TABLE_CHANNELS, TABLE_LABELS
from shiplog.ship_profile.toml_section import Section

__all__ = [
    "FINEST", "Actuator", "Column", "Profile", "Sensor", "Sensors", "Ship", "Site", "Source"
]  # fmt: skip

# What can be at all, so that a slip of the decimal point is reported: the largest ship has 460 m
# and 660 000 t, models of ships begin at half a metre.
SHORTEST_M, LIGHTEST_KG, HEAVIEST_KG = 0.1, 0.01, 2e9
Latitude = Annotated[float, Field(ge=-90.0, le=90.0)]
Longitude = Annotated[float, Field(ge=-180.0, le=360.0)]
Chart = Annotated[float, Field(ge=-1e7, le=1e7)]  # m, a quarter of the Earth's girth


class Ship(Section):
    """Particulars. Missing values are estimated where they are needed, and reported."""

    name: str = Field(description="identifies the ship")
    length_m: float = Field(
        ge=SHORTEST_M, le=LONGEST_M, description="between perpendiculars, m"
    )  # fmt: skip
    breadth_m: Length | None = Field(default=None, description="m")
    draught_m: Length | None = Field(default=None, description="m")
    full_load_draught_m: Length | None = Field(
        default=None, description="at full load, m, where `draught_m` is that of a ballast "
        "condition; for `manoeuvres --full-load`"
    )  # fmt: skip
    mass_kg: float | None = Field(
        default=None, ge=LIGHTEST_KG, le=HEAVIEST_KG, description="kg"
    )  # fmt: skip
    x_g_m: Place | None = Field(
        default=None, description="centre of gravity ahead of midship, m; negative where astern"
    )
    block_coefficient: float | None = Field(default=None, ge=0.01, le=1, description="1")
    frontal_area_m2: Area | None = Field(default=None, description="above water, m²")
    lateral_area_m2: Area | None = Field(default=None, description="above water, m²")
    outline: tuple[tuple[Place, Place], ...] | None = Field(
        default=None, description="of the hull as it is drawn: points [ahead, starboard], m"
    )

    @model_serializer(mode="wrap")
    def _as_it_was(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without what is new and left out: a stored voyage is known by its profile's text."""
        found = plain(self)
        if self.full_load_draught_m is None:
            del found["full_load_draught_m"]
        return found

    @property
    def breadth(self) -> float:
        """m; a sixth of the length where the profile does not say."""
        return self.breadth_m or self.length_m / 6.0


class Site(Section):
    """What a chart shows; all optional."""

    banks: tuple[tuple[tuple[Chart, Chart], ...], ...] = Field(
        default=(), description="vertical walls: lines of points [x0, y0], m"
    )
    depth_m: float | None = Field(
        default=None, ge=0.01, le=12_000.0, description="of the water, m; for a chart: no model "
        "and no cause uses it"
    )  # fmt: skip
    density: float | None = Field(
        default=None, ge=900.0, le=1_300.0, description="of the water, kg/m³; where left out 998 "
        "for a ship of up to 20 m, else 1025"
    )  # fmt: skip
    datum: tuple[Latitude, Longitude] | None = Field(
        default=None, description="[latitude, longitude] of x0 = y0 = 0, deg; the first fix where "
        "left out"
    )  # fmt: skip

    @model_validator(mode="after")
    def _walls(self) -> Site:
        """A wall has a direction between any two of its points."""
        for number, line in enumerate(self.banks, 1):
            if len(line) < 2 or any(a == b for a, b in pairwise(line)):
                raise ValueError(
                    f"bank {number} needs two points at least, and none twice in a row"
                )
        return self


class Column(Section):
    """One column of a table that `convert` turns into a log: a key of [table] is its name."""

    channel: str = Field(description="what it holds; see the channels below")
    unit: Unit | None = Field(
        default=None, description='of numbers, such as "deg" or "kn"; SI where left out; a '
        'latitude or longitude needs it. Of a time "s", "ms", "us", "ns", "min", "h" '
        'or "d" (days, also those that a spreadsheet, MATLAB or astronomers count); without one it '
        "is Unix time by its size, a time of day where it counts as hhmmss, or else seconds from "
        "any start"
    )  # fmt: skip
    sign: float = Field(
        default=1.0, description="-1 turns the column round, and any other number is a factor on it"
    )
    offset: Number = Field(
        default=0.0, description="the value that stands for zero, in the column's unit"
    )
    format: str | None = Field(
        default=None, description="of a time or date that is no ISO text, in strptime's letters: "
        '"%d.%m.%Y %H:%M:%S.%f"; of a number, too: "%H%M%S". Read are %Y %y %m %d %j %b %B %a %A '
        "%H %I %p %M %S %f (any number of digits) %z %Z (of UTC) %%"
    )  # fmt: skip
    decimal: Literal[",", "."] | None = Field(
        default=None, description='the sign before decimals, where the table does not show it: "," '
        "or \".\"; the other one then groups digits"
    )  # fmt: skip
    missing: tuple[Number | str, ...] = Field(
        default=(), description='values that stand for no value, such as -999 or "n/a"'
    )  # fmt: skip
    only: str | int | None = Field(
        default=None, description="of a `vessel` column: the one value whose rows are this ship's"
    )

    @model_validator(mode="after")
    def _scaled(self) -> Column:
        require_factor(self.sign)
        return self


class Profile(Section):
    """A ship, its sensors and actuators, and where they are measured.

    Without actuators a log can be ingested and its sensors checked; no model can be trained.
    """

    ship: Ship
    sensors: Sensors
    actuators: tuple[Actuator, ...] = ()
    site: Site = Site()
    table: dict[str, Column] = Field(default_factory=dict)
    unchecked: tuple[str, ...] = ()  # keys whose line in the file still says CHECK
    source: str = Field(default="", exclude=True)  # name or path it was loaded from

    @model_validator(mode="after")
    def _names(self) -> Profile:
        names = [actuator.name for actuator in self.actuators]
        canonical = {c.name for c in (*channels.STATE, *channels.WIND)} | {"quality"}
        columns = {name for pair in TABLE_CHANNELS.values() for name in pair} | {*TABLE_LABELS}
        taken = canonical | columns
        doubled = {name for name in names if names.count(name) > 1 or name in taken}
        if doubled:
            raise ValueError(f"actuator name(s) already taken: {listed(doubled)}")
        known = columns | set(names)
        for column, entry in self.table.items():
            if entry.channel not in known:
                raise ValueError(
                    f"[table] {column!r} is meant for the channel {entry.channel!r}, which this "
                    f"ship does not have{nearest(entry.channel, known)}. "
                    f"Its channels: {listed(known, most=len(known))}"
                )
            if entry.channel in ("latitude", "longitude") and entry.unit is None:
                raise ValueError(f"[table] {column!r} {NO_ANGLE}")
        return self

    @property
    def actuator_names(self) -> tuple[str, ...]:
        return tuple(actuator.name for actuator in self.actuators)

    def require_actuators(self) -> None:
        """Raises ProfileError where there is none: a model's inputs are the actuators."""
        if not self.actuators:
            raise ProfileError(
                f"The profile of {self.ship.name} has no actuators, and a model needs at least "
                "one: without them its voyages can be ingested and its sensors checked, no more.",
                hint="add an [[actuators]] section for each rudder, propeller or thruster to "
                f"{self.source or 'the profile'}, and ingest the logs again.",
            )

    @property
    def has_wind(self) -> bool:
        return self.sensors.wind is not None

    @property
    def wind_names(self) -> tuple[str, ...]:
        return tuple(c.name for c in channels.WIND) if self.has_wind else ()

    @property
    def azimuths(self) -> tuple[int, ...]:
        """Columns of the actuators that turn through ±180 deg."""
        return tuple(i for i, one in enumerate(self.actuators) if one.circular)

    @property
    def circular(self) -> frozenset[str]:
        """Columns whose mean is a circular one."""
        states = {c.name for c in (*channels.STATE, *channels.WIND) if c.circular}
        return frozenset(states | {a.name for a in self.actuators if a.circular})

    @property
    def columns(self) -> tuple[str, ...]:
        """Every value column of this ship's tables, in order."""
        state = tuple(c.name for c in channels.STATE)
        return (*state, *self.actuator_names, *self.wind_names)

    def wanted(self) -> dict[str, set[str]]:
        """Topic → field paths that this profile reads from a log."""
        wanted: dict[str, set[str]] = {}
        for source in (*(s for _, s in self.sensors.items()), *self.actuators):
            wanted.setdefault(source.topic, set()).update(source.paths)
        return wanted
