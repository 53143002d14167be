"""Where each channel's values stand in a log, how they become SI, and where they are measured: the
sections [sensors.<channel>] and [[actuators]] of a profile."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from shiplog.exceptions import listed
from shiplog.nomenclature import units
from shiplog.ship_profile.table_channels import (
    LEVEL,
    QUATERNION,
    SENSOR_KINDS,
    TABLE_CHANNELS,
    channels_of,
)
from shiplog.ship_profile.toml_section import Section

Clock = Literal["message", "log", "publish"]
Accuracy = Annotated[float, Field(ge=0, le=1e6)]
Unit = Annotated[str, AfterValidator(units.spelled)]  # in any letter case
FINEST = 1e-9  # in `unit`: a smaller accuracy than this, but for 0, is a slip
FACTORS = (1e-12, 1e6)  # of a raw value: from 1e-7 deg of a receiver to a count of thousands
Number = Annotated[float, Field(ge=-1e12, le=1e12)]  # in whatever unit an instrument counts

LONGEST_M = 1_000.0  # of a ship; the largest one has 460 m
Length = Annotated[float, Field(ge=1e-3, le=LONGEST_M)]
Place = Annotated[float, Field(ge=-LONGEST_M, le=LONGEST_M)]  # of a ship's part, from midship
Area = Annotated[float, Field(ge=1e-6, le=LONGEST_M * 100.0)]  # nothing on a ship is 100 m high
Turn = Annotated[float, Field(ge=-360.0, le=360.0)]
NO_ANGLE = 'needs a unit: nearly every instrument gives "deg", and without one it would be "rad"'


DERIVED = "ned"  # kind of a velocity that nobody measured: the position's change


def require_factor(sign: float) -> None:
    least, most = FACTORS
    if sign == 0.0:
        raise ValueError("`sign` is 0, and every value would be; it is 1, -1 or another factor")
    if not least <= abs(sign) <= most:
        raise ValueError(
            f"`sign` is {sign:g}; it is 1, -1 or another factor between {least:g} and {most:g}"
        )


def _require_order(limits: tuple[float, float] | None) -> None:
    if limits is not None and limits[0] >= limits[1]:
        raise ValueError(f"limits are {list(limits)}; the lower one stands first")


class Source(Section):
    """Where one channel's values stand in a log, and how they become SI."""

    topic: str = Field(description="of the log")
    fields: tuple[str, ...] = Field(
        default=(), description="where the values stand in a message, in the order of the kind; "
        "a dot goes into a part of it"
    )  # fmt: skip
    field: str | None = Field(default=None, description="the same where there is one value")
    unit: Unit | None = Field(
        default=None, description="of all values; SI where left out; a geodetic position needs it"
    )  # fmt: skip
    units: tuple[Unit, ...] = Field(default=(), description="one for each of `fields`")
    sign: float | tuple[float, ...] = Field(
        default=1.0,
        description="-1 turns the values round, and any other number is a factor on "
        "them; one number, or one for each field",
    )
    offset: Number | tuple[Number, ...] = Field(
        default=0.0, description="the raw value that stands for zero, in its unit"
    )
    clock: Clock = Field(
        default="message", description="which time is when it was measured: the message's own "
        "stamp, the recorder's, or the publisher's"
    )  # fmt: skip
    tolerance_s: float | None = Field(
        default=None, ge=1e-3, le=86_400.0, description="the longest time between two samples that "
        "are interpolated, or for which one holds, s; where left out one and a half periods, but "
        "no more than 5 s or, of a long ship, the time in which it goes its length at Fn = 0.2"
    )  # fmt: skip

    between: Literal["line", "hold"] = Field(
        default="line", description='between two samples: "line", a straight line, or "hold", the '
        "value of the former until the next one, as of an order that is sent when it changes; a "
        "motion has a line"
    )  # fmt: skip
    missing: tuple[Number, ...] = Field(
        default=(), description="raw values that stand for no value, such as 360 of an AIS course"
    )  # fmt: skip

    frame: str | None = Field(
        default=None, description="which sender's messages count where several share a topic: a "
        "frame_id, or the name of a publisher; the most frequent one where left out"
    )  # fmt: skip
    status: Literal["heed", "ignore"] = Field(
        default="heed", description='whether a field next to the values that says "no fix" or "not '
        'valid", as status, fix_type or valid, makes them blank'
    )  # fmt: skip

    @property
    def paths(self) -> tuple[str, ...]:
        return self.fields or ((self.field,) if self.field else ())

    def _each(self, value: float | tuple[float, ...]) -> tuple[float, ...]:
        return value if isinstance(value, tuple) else (value,) * len(self.paths)

    def scale(self) -> list[tuple[float, float]]:
        """(offset, factor) per field: SI value = (raw - offset) · factor."""
        given = self.units or ((self.unit,) * len(self.paths) if self.unit else ())
        named = given or ("1",) * len(self.paths)
        return [
            (offset, sign * units.factor(unit))
            for offset, sign, unit in zip(
                self._each(self.offset), self._each(self.sign), named, strict=True
            )
        ]

    @model_validator(mode="after")
    def _consistent(self) -> Source:
        if not self.paths:
            raise ValueError("neither `field` nor `fields` is given")
        if self.field and self.fields:
            raise ValueError("both `field` and `fields` are given; keep one")
        for sign in self._each(self.sign):
            require_factor(sign)
        for name in ("sign", "offset", *(["units"] if self.units else [])):
            value = getattr(self, name)
            if isinstance(value, tuple) and len(value) != len(self.paths):
                raise ValueError(f"`{name}` has {len(value)} entries for {len(self.paths)} fields")
        return self


class Sensor(Source):
    """A sensor of the ship's motion or of the wind."""

    kind: str | None = Field(default=None, description="see the kinds below; the first one")
    lever_arm_m: tuple[Place, Place] = Field(
        default=(0.0, 0.0), description="where it stands: [ahead, starboard] of midship, m"
    )
    sigma: Accuracy | Annotated[tuple[Accuracy, ...], Field(min_length=1)] | None = Field(
        default=None, description="accuracy, one standard deviation, in `unit`; of a position in m"
    )
    resolution: Accuracy | None = Field(
        default=None, description="the step in which it counts, in `unit`; of a position in m; "
        "estimated from the record where left out"
    )  # fmt: skip
    limits: tuple[Number, Number] | None = Field(
        default=None, description="[least, most] that can be, in `unit`, of a speed, a yaw rate or "
        "a wind speed; those of its kind of ship where left out"
    )  # fmt: skip

    mounting_deg: tuple[Turn, Turn, Turn] | None = Field(
        default=None, description="of a quaternion: how the sensor is turned in the ship, [roll "
        "about ahead, pitch about starboard, yaw about down], deg; [180, 0, 0] where it is upside "
        "down. Level, with x ahead, where left out"
    )  # fmt: skip

    @model_validator(mode="after")
    def _accurate(self) -> Sensor:
        given = self.sigma if isinstance(self.sigma, tuple) else (self.sigma or 0.0,)
        for sigma in given:
            if 0.0 < sigma < FINEST:
                raise ValueError(f"`sigma` is {sigma:g}; it is 0 or at least {FINEST:g}")
        _require_order(self.limits)
        return self


class Sensors(Section):
    position: Sensor
    velocity: Sensor | None = None  # derived from the position where there is none
    heading: Sensor
    yaw_rate: Sensor | None = None  # derived from the heading where there is none
    wind: Sensor | None = None

    @model_validator(mode="after")
    def _kinds(self) -> Sensors:
        for name, kinds in SENSOR_KINDS.items():
            sensor = getattr(self, name)
            if sensor is None:
                continue
            kind = sensor.kind or kinds[0]
            if kind not in kinds:
                raise ValueError(f"sensors.{name}.kind is {kind!r}; it can be {listed(kinds)}")
            if not channels_of(name, kind, len(sensor.paths)):
                counts = [len(TABLE_CHANNELS[name, kind]), *_fewer(name, kind)]
                raise ValueError(
                    f"sensors.{name} of kind {kind!r} needs {' or '.join(map(str, counts))} "
                    f"field(s), not {len(sensor.paths)}"
                )
            if sensor.mounting_deg and TABLE_CHANNELS[name, kind] != QUATERNION:
                raise ValueError(
                    f"sensors.{name} has `mounting_deg` and is of kind {kind!r}: only a quaternion "
                    "says how a sensor is turned. Leave it out"
                )
            if sensor.limits is not None and name in ("position", "heading"):
                raise ValueError(
                    f"sensors.{name} has `limits`; velocity, yaw_rate and wind have some"
                )
            if sensor.between == "hold" and name != "wind":
                raise ValueError(
                    f'sensors.{name} has between = "hold": a ship moves between two samples; it is '
                    "for orders, set-points and states"
                )
            if kind == "geodetic" and not (sensor.unit or sensor.units):
                raise ValueError(f"sensors.{name} of kind {kind!r} {NO_ANGLE}")
        return self

    def kind(self, name: str) -> str:
        """A velocity that is derived from the position is one over ground."""
        sensor = getattr(self, name)
        if sensor is None:  # of what nobody measures, only velocities are derived
            return DERIVED
        return sensor.kind or SENSOR_KINDS[name][0]

    @property
    def derived(self) -> tuple[str, ...]:
        """Channels that no instrument measures, where velocities are derived from the positions:
        with what stands in the other columns they say nothing new."""
        if self.velocity is not None:
            return ()
        return ("surge", "sway") if self.yaw_rate is not None else ("surge", "sway", "yaw_rate")

    @property
    def velocity_arm_m(self) -> tuple[float, float]:
        """Of the point whose velocity is measured; of the position's where it is derived."""
        return (self.velocity or self.position).lever_arm_m

    def noise(self, name: str) -> float:
        """Stated accuracy of a sensor in SI (position in m), 0 where none is stated."""
        sensor = getattr(self, name)
        if sensor is None or sensor.sigma is None:
            return 0.0
        first = sensor.sigma[0] if isinstance(sensor.sigma, tuple) else sensor.sigma
        return first if name == "position" else first * abs(sensor.scale()[0][1])

    def items(self) -> list[tuple[str, Sensor]]:
        return [
            (name, getattr(self, name)) for name in SENSOR_KINDS if getattr(self, name) is not None
        ]


def _fewer(name: str, kind: str) -> list[int]:
    return [LEVEL[name, kind]] if (name, kind) in LEVEL else []


class Actuator(Source):
    """One actuator value, in model order. SI: rad, rev/s, or 1 for a dimensionless command."""

    name: str = Field(
        pattern=r"^[A-Za-z_][A-Za-z0-9_]*$", description="of its column; letters, digits and _"
    )
    kind: Literal["rudder", "propeller", "azimuth", "thruster"] = Field(
        description="see the kinds below"
    )
    limits: tuple[Number, Number] | None = Field(
        default=None, description="[least, most], in `unit`; values beyond them are marked. `mmg` "
        "and `hybrid` need them of a thruster that is commanded in rpm, rev/s, deg or rad. A "
        "rudder whose limits exceed 45 deg starts in both as a fish-tail blade (Schilling, VecTwin)"
    )  # fmt: skip
    position_m: tuple[Place, Place] = Field(
        default=(0.0, 0.0), description="[ahead, starboard] of midship, m"
    )
    direction_deg: float = Field(
        default=0.0,
        ge=-360.0,
        le=360.0,
        description="direction of the force of a fixed thruster, from ahead towards starboard, deg",
    )
    diameter_m: Length | None = Field(
        default=None, description="of a propeller, m; needed for `mmg` and `hybrid`"
    )
    gear_ratio: float | None = Field(
        default=None, ge=0.1, le=100.0, description="of a propeller whose value is its engine's "
        "speed: turns of the engine a turn of the propeller"
    )  # fmt: skip
    area_m2: Area | None = Field(
        default=None, description="of a rudder, m²; estimated where left out"
    )
    span_m: Length | None = Field(
        default=None, description="of a rudder, m; estimated where left out"
    )

    @model_validator(mode="after")
    def _limited(self) -> Actuator:
        _require_order(self.limits)
        turns = self.kind in ("propeller", "thruster")
        if self.gear_ratio is not None and not turns:
            raise ValueError(
                f"`gear_ratio` is of a propeller or thruster, and this is a {self.kind}"
            )
        return self

    def scale(self) -> list[tuple[float, float]]:
        """(offset, factor) per field; behind a gear the propeller turns slower than its engine."""
        slower = self.gear_ratio or 1.0
        return [(offset, factor / slower) for offset, factor in super().scale()]

    @property
    def si_limits(self) -> tuple[float, float] | None:
        """Its limits in SI, the lower one first; None where the profile states none."""
        if self.limits is None:
            return None
        offset, factor = self.scale()[0]
        low, high = sorted((limit - offset) * factor for limit in self.limits)
        return low, high

    @property
    def circular(self) -> bool:
        """An azimuth turns through ±180°; a rudder never does."""
        return self.kind == "azimuth"

    @property
    def si_unit(self) -> str:
        unit = self.unit or "1"
        return {"deg": "rad", "rad": "rad", "rpm": "rev/s", "rps": "rev/s", "rev/s": "rev/s"}.get(
            unit, "1"
        )
