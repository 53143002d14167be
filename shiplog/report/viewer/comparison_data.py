"""What a comparison consists of: plain tables that `evaluate` fills and `viewer` draws.

SI and radians throughout; the viewer converts when it labels an axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import polars as pl

from shiplog.nomenclature import channels
from shiplog.nomenclature.channels import Channel

TIMELINE = "sim_time"  # seconds from a voyage's start, in every recording
BAND = ("_low", "_high")  # of a simulated state: the ends of its 90 % band


@dataclass(frozen=True, slots=True)
class DrawnActuator:
    """One actuator's column: its name, what it is, and the SI unit it is in."""

    name: str
    kind: str  # rudder | propeller | azimuth | thruster
    unit: str  # rad, rev/s or 1

    @property
    def channel(self) -> Channel:
        """The actuator as a channel, so that it is scaled and labelled as the others are."""
        symbol = {"rudder": "δ", "propeller": "n", "azimuth": "α"}.get(self.kind, "u")
        return Channel(self.name, symbol, self.unit, circular=self.kind == "azimuth")


@dataclass(frozen=True, slots=True)
class Moment:
    """What a recording is opened at: its voyage is in front, and its charts are about the moment.

    window   length of what they show [s], the moment in its middle
    """

    voyage: str
    seconds: float  # from the voyage's start
    window: float

    @property
    def span(self) -> tuple[float, float]:
        """The beginning and the end of what is shown [s]."""
        return self.seconds - self.window / 2.0, self.seconds + self.window / 2.0


@dataclass(frozen=True, slots=True)
class Current:
    """A current that a diagnosis named."""

    speed: float  # m/s
    direction: float  # rad, towards, clockwise from north


@dataclass(frozen=True, slots=True)
class MadeFast:
    """The point that a line goes to, which a diagnosis named: (x₀, y₀), and the low and the high
    ends of its 90 % interval [m]."""

    point: tuple[float, float]
    low: tuple[float, float]
    high: tuple[float, float]

    def scaled(self, by: float) -> MadeFast:
        """In a unit of so many metres."""
        ends = ((x / by, y / by) for x, y in (self.point, self.low, self.high))
        return MadeFast(*ends)

    @property
    def cross(self) -> list[list[tuple[float, float]]]:
        """Two lines through the point, along x₀ and along y₀, as long as its interval."""
        (x, y), (south, west), (north, east) = self.point, self.low, self.high
        return [[(south, y), (north, y)], [(x, west), (x, east)]]


@dataclass(frozen=True)
class ComparisonData:
    """Measured voyages, and the simulations of every model and seed.

    measured    voyage, time [s from the voyage's start], the six states, one column per
                actuator, wind_speed and wind_angle if `has_wind`
    simulated   model (label), seed, voyage, window, time, the six states, d [Eq. 5]; of a model
                that knows its doubt also each state with _low and _high, the 90 % band
    training    what a model was trained on: the channels of `measured`
    trained     which model that is, where there are several
    summary     Markdown: errors, baselines, coverage, findings
    banks       lines of (x0, y0) points a chart shows
    ship_outline  (ahead, starboard) of midship, m; a pointed box of length and breadth if empty
    extended    those of the models that a diagnosis extended, which have a colour of their own
    datums      voyage → latitude and longitude [deg] of x₀ = y₀ = 0, where its log had them
    current     the one that a diagnosis named
    made_fast   where the line goes to that a diagnosis named, if it has a place
    moment      what it is opened at; the beginning of the first voyage unless given
    forces      model, voyage, time, part (hull, propeller, ... total), surge [N], sway [N],
                yaw [N m] about midship: the force components along the measured voyage
    """

    title: str
    ship_length: float  # m
    ship_breadth: float  # m
    actuators: tuple[DrawnActuator, ...]
    has_wind: bool
    measured: pl.DataFrame
    simulated: pl.DataFrame
    training: pl.DataFrame
    summary: str
    banks: tuple[tuple[tuple[float, float], ...], ...] = ()
    trained: str = ""
    ship_outline: tuple[tuple[float, float], ...] = ()
    forces: pl.DataFrame | None = None
    extended: tuple[str, ...] = ()
    datums: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    current: Current | None = None
    made_fast: MadeFast | None = None
    moment: Moment | None = None

    @property
    def voyages(self) -> list[str]:
        """The voyages in the order in which they were given."""
        return self.measured["voyage"].unique(maintain_order=True).to_list()

    @property
    def models(self) -> list[str]:
        """The models in the order in which they were given, which fixes their colours."""
        return self.simulated["model"].unique(maintain_order=True).to_list()

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Every channel that `measured` and `training` must carry."""
        driven = tuple(actuator.channel for actuator in self.actuators)
        return channels.STATE + driven + (channels.WIND if self.has_wind else ())
