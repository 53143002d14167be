"""What a ship is to sail: orders to its actuators over time, or a standard manoeuvre.

A `Schedule` is open loop: each actuator's orders at given times. The other classes are closed loop,
since a zigzag's next order depends on the heading; `helm` carries them out. Each is frozen, and
says its `kind` (the contract's), its `name` and for how long it is sailed.

Standard manoeuvres: IMO MSC.137(76) and MSC/Circ.1053; ITTC 7.5-04-02-01 (2021).
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from shiplog.exceptions import ShiplogError, listed, nearest
from shiplog.nomenclature import units
from shiplog.ship_profile.profile import Profile

LINE, HOLD = "line", "hold"
TIME = "time_s"  # column of a schedule's file
SUFFIXES = ("deg", "rad", "rpm", "rps")  # of an actuator's column there
# How long a manoeuvre is sailed, in lengths over the approach speed. A circle of 720 degrees takes
# 25 to 35 of them, a tanker's stop 25 to 40 (track reach up to 20 lengths at half the speed).
TURN_LENGTHS = 60.0
STOP_LENGTHS = 90.0
REVERSAL_LENGTHS = 8.0  # of a zigzag, for each reversal; L/V of 8 is a sluggish ship's
STEADY_LENGTHS = 40.0  # the longest wait until a turn is steady
TURN_BY = math.radians(720.0)  # two circles: the second one shows the current (Circ.1053, 3.2)
REVERSALS = 5  # of the rudder: a second overshoot to each side, and a whole period
SPIRAL_STEPS = (15.0, 10.0, 5.0, 3.0, 1.0, 0.0)  # deg; then to the other side, and back
PULL_OUT_ANGLE = 20.0  # deg; MSC/Circ.1053 takes the turn's own angle, and 20 is its smaller one


@dataclass(frozen=True)
class Schedule:
    """Orders over time, whatever the ship does.

    time     [K] s, rising; the first order holds before its time, the last one after it
    orders   actuator → [K] in SI: rad, rev/s or 1. An actuator that is left out stays at what the
             approach speed needs, a rudder at zero
    between  "line" from one order to the next, or "hold" each until the next
    seconds  for how long it is sailed; until the last order unless given
    """

    time: tuple[float, ...]
    orders: Mapping[str, tuple[float, ...]]
    between: str = LINE
    name: str = "schedule"
    seconds: float = 0.0
    kind: str = field(default="schedule", init=False)

    def __post_init__(self) -> None:
        if not self.time or not self.orders:
            raise ShiplogError(
                f"The schedule {self.name} gives no order.",
                hint="give it a time, and an actuator with its orders.",
            )
        for label, values in (("time", self.time), *self.orders.items()):
            if len(values) != len(self.time) or not np.isfinite(values).all():
                raise ShiplogError(
                    f"The schedule {self.name} has {len(values)} finite values of {label} or fewer"
                    f", and {len(self.time)} times.",
                    hint="give each column a number in every row.",
                )
        if any(b <= a for a, b in pairwise(self.time)) or self.time[0] < 0.0:
            raise ShiplogError(
                f"The times of the schedule {self.name} do not rise from zero on.",
                hint="give every row a later time than the one before it, in seconds.",
            )
        if not self.seconds:
            object.__setattr__(self, "seconds", self.time[-1])

    def at(self, time: np.ndarray | float) -> dict[str, np.ndarray]:
        """Orders of each actuator at these times, SI."""
        if self.between == HOLD:
            row = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, None)
            return {name: np.asarray(values)[row] for name, values in self.orders.items()}
        return {
            name: np.asarray(np.interp(time, self.time, values))
            for name, values in self.orders.items()
        }

    def duration(self, length_time: float) -> float:
        """s; `length_time` is L/V [s]."""
        return self.seconds


@dataclass(frozen=True)
class Zigzag:
    """Rudder `angle` to starboard (negative: to port first) until the heading has changed by
    `heading` to that side, then the opposite angle until it has on the other one, and so on [rad].
    """

    angle: float
    heading: float
    reversals: int = REVERSALS
    kind: str = field(default="zigzag", init=False)

    @property
    def name(self) -> str:
        return f"zigzag {math.degrees(self.angle):g}/{math.degrees(self.heading):g}"

    def duration(self, length_time: float) -> float:
        size = max(1.0, self.heading / abs(self.angle))
        return (self.reversals + 1) * REVERSAL_LENGTHS * size * length_time


@dataclass(frozen=True)
class Turn:
    """Rudder `angle`, positive to starboard, until the heading has changed by `by` [rad]."""

    angle: float
    by: float = TURN_BY
    kind: str = field(default="turn", init=False)

    @property
    def name(self) -> str:
        return f"turn {math.degrees(self.angle):+g}"

    def duration(self, length_time: float) -> float:
        # of small angles the circle is as much wider as sin 35° is larger
        wider = max(1.0, math.sin(math.radians(35.0)) / abs(math.sin(self.angle)))
        return TURN_LENGTHS * wider * self.by / TURN_BY * length_time


@dataclass(frozen=True)
class Stop:
    """Propellers from the approach speed to full astern, rudders amidships, until it is stopped.
    Where none turns astern they are stopped, and the ship coasts."""

    kind: str = field(default="stop", init=False)
    name: str = field(default="stop", init=False)

    def duration(self, length_time: float) -> float:
        return STOP_LENGTHS * length_time


@dataclass(frozen=True)
class PullOut:
    """A steady turn to starboard, then rudder amidships until the yaw rate is steady; the same to
    port. What remains of the yaw rate shows an unstable ship."""

    angle: float = math.radians(PULL_OUT_ANGLE)
    kind: str = field(default="pull_out", init=False)

    @property
    def name(self) -> str:
        return f"pull-out {math.degrees(self.angle):g}"

    def duration(self, length_time: float) -> float:
        return 4.0 * STEADY_LENGTHS * length_time


@dataclass(frozen=True)
class Spiral:
    """Dieudonné's: rudder angles [rad] one after the other from starboard to port and back, each
    until the yaw rate is steady. Where both ways differ, the ship has a loop."""

    angles: tuple[float, ...] = tuple(
        math.radians(a)
        for a in (
            *SPIRAL_STEPS,
            *(-s for s in SPIRAL_STEPS[-2::-1]),
            *(-s for s in SPIRAL_STEPS[1:]),
            *SPIRAL_STEPS[-2::-1],
        )
    )
    kind: str = field(default="spiral", init=False)
    name: str = field(default="spiral", init=False)

    def duration(self, length_time: float) -> float:
        return len(self.angles) * STEADY_LENGTHS * length_time


Manoeuvre = Schedule | Zigzag | Turn | Stop | PullOut | Spiral


def zigzag(words: str) -> Zigzag:
    """Of "10/10" or "20/20" in degrees; "-10/10" begins to port. Raises ShiplogError."""
    parts = words.split("/")
    try:
        angle, heading = (float(part) for part in parts)
    except ValueError:
        angle = heading = math.nan
    if not (0.0 < abs(angle) <= 90.0 and 0.0 < heading <= 180.0):
        raise ShiplogError(
            f"{words!r} is no zigzag.",
            hint="give rudder and heading in degrees, such as 10/10 or -20/20 (to port first).",
        )
    return Zigzag(math.radians(angle), math.radians(heading))


def turn(degrees: float) -> Turn:
    """Raises ShiplogError for an angle at which nothing turns."""
    if not 0.0 < abs(degrees) <= 90.0:
        raise ShiplogError(
            f"A turn with {degrees:g} deg of rudder is none.",
            hint="give degrees such as 35, or -35 to port.",
        )
    return Turn(math.radians(degrees))


# --- schedules in files ----------------------------------------------------------------------


def read(path: Path, profile: Profile) -> Schedule:
    """A CSV with a column time_s, and one for each actuator that is ordered: its name with a unit
    after it (rudder_deg, propeller_rpm), or alone in the unit of the profile. Raises ShiplogError.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        rows = list(csv.reader(io.StringIO(text), strict=True))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise ShiplogError(
            f"The schedule {path} cannot be read: {why}.",
            hint=f"give a CSV with a column {TIME} and the actuators' orders.",
        ) from error
    rows = [row for row in rows if any(cell.strip() for cell in row)]
    if len(rows) < 2:
        raise ShiplogError(
            f"The schedule {path} has no row of orders.",
            hint=f"its first line names the columns, {TIME} and actuators such as "
            f"{_example(profile)}; each other line is a time and its orders.",
        )
    head = [cell.strip() for cell in rows[0]]
    if TIME not in head:
        raise ShiplogError(
            f"The schedule {path} has no column {TIME}; it has {listed(head)}.",
            hint=f"name the column of seconds {TIME}.",
        )
    values = [_numbers(path, number, row, len(head)) for number, row in enumerate(rows[1:], 2)]
    table = np.array(values)
    orders = {}
    for at, name in enumerate(head):
        if name == TIME:
            continue
        actuator, factor, offset = _column(path, name, profile)
        if actuator in orders:
            raise ShiplogError(
                f"The schedule {path} orders {actuator} in two columns.", hint="leave one."
            )
        orders[actuator] = tuple(((table[:, at] - offset) * factor).tolist())
    return Schedule(tuple(table[:, head.index(TIME)].tolist()), orders, name=path.stem)


def text_of(schedule: Schedule, profile: Profile) -> str:
    """The CSV that `read` reads: orders in deg or rps, or in the unit of the profile."""
    named = {a.name: a for a in profile.actuators}
    head, columns = [TIME], [np.asarray(schedule.time)]
    for name, values in schedule.orders.items():
        unit = {"rad": "deg", "rev/s": "rps"}.get(named[name].si_unit)
        offset, factor = named[name].scale()[0]
        head.append(f"{name}_{unit}" if unit else name)
        given = np.asarray(values)
        columns.append(given / units.factor(unit) if unit else given / factor + offset)
    lines = [",".join(head)]
    lines += [",".join(f"{x:.10g}" for x in row) for row in np.stack(columns, 1)]
    return "\n".join(lines) + "\n"


def _example(profile: Profile) -> str:
    return listed(profile.actuator_names, most=4)


def _numbers(path: Path, number: int, row: list[str], count: int) -> list[float]:
    try:
        if len(row) != count:
            raise ValueError
        found = [float(cell) for cell in row]
        if not np.isfinite(found).all():
            raise ValueError
    except ValueError:
        raise ShiplogError(
            f"Line {number} of the schedule {path} is not {count} numbers: {', '.join(row)}.",
            hint="give every column a number, with a point before its decimals.",
        ) from None
    return found


def _column(path: Path, name: str, profile: Profile) -> tuple[str, float, float]:
    """Actuator, factor to SI and zero of a column."""
    named = {a.name: a for a in profile.actuators}
    if name in named:
        offset, factor = named[name].scale()[0]
        return name, factor, offset
    stem, _, unit = name.rpartition("_")
    if stem in named and unit in SUFFIXES:
        return stem, units.factor(unit), 0.0
    raise ShiplogError(
        f"The schedule {path} orders {name!r}, which is no actuator of {profile.ship.name}"
        f"{nearest(name, named)}.",
        hint=f"its actuators are {listed(named)}; a unit may follow, as in rudder_deg.",
    )
