"""What is changed in a voyage's record: one unit, sign, frame, clock, order or value at a time.

A change says which words a finding has to name, and to which class it belongs:

    sensors       the sensors contradict each other
    plausibility  the profile or the physics of ships exclude it
    undetermined  nothing in one voyage's record shows it
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import polars as pl

from pipelines.experiments.stored_values.instruments import GROUPS, Recorded
from pipelines.experiments.stored_values.motion import Motion

KNOT = 1852.0 / 3600.0
NOT_NMEA = ("mcap", "csv", "european csv", "parquet", "folder of tables", "ros 2 bag")
ROWS = ("csv", "european csv", "parquet")
STAMPED = ("mcap", "folder of tables", "ros 2 bag")
How = dict[str, Any]
Act = Callable[[Recorded, How, Motion, np.random.Generator], None]


@dataclass(frozen=True)
class Change:
    """One change.

    act     writes into the record, or into how its file is made
    words   a finding, or a refusal, names the changed thing where it has one of these
    needs   columns without which it cannot be made
    least   what the ship must do for it to matter: of the turning [rad/s] and the speed [m/s]
    """

    name: str
    family: str
    act: Act
    words: tuple[str, ...]
    seen_by: str = "sensors"
    needs: tuple[str, ...] = ()
    recorders: tuple[str, ...] = ()
    turning: float = 0.0
    speed: float = 0.0
    kinds: tuple[str, ...] = field(default=())

    def fits(self, motion: Motion, seen: Recorded, recorder: str) -> bool:
        return (
            all(name in seen.columns for name in self.needs)
            and (not self.recorders or recorder in self.recorders)
            and (not self.kinds or motion.kind.name in self.kinds)
            and motion.kind.turning >= self.turning
            and abs(motion.kind.speed) >= self.speed
        )


def _column(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Act:
    def act(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
        seen.columns[name] = change(seen.columns[name])

    return act


def _times(factor: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda value: value * factor


def _half_turns(value: np.ndarray) -> np.ndarray:
    """deg to rad in [-π, π], as most recorders of radians have it."""
    return np.angle(np.exp(1j * np.radians(value)))


def _mirrored(value: np.ndarray) -> np.ndarray:
    return -value % 360.0


def _turned(angle: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda value: (value + angle) % 360.0


def _from_east(value: np.ndarray) -> np.ndarray:
    """Counted anticlockwise from east, as mathematics has it."""
    return (90.0 - value) % 360.0


def _whole_numbers(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
    for name in ("latitude", "longitude"):
        seen.columns[name] = np.round(seen.columns[name] * 1e7)


def _exchanged(one: str, other: str) -> Act:
    def act(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
        c = seen.columns
        c[one], c[other] = c[other], c[one]

    return act


def _mirror_about_datum(name: str, at: int) -> Act:
    """West counted positive: the record's own datum stands at its place."""

    def act(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
        seen.columns[name] = 2.0 * motion.datum[at] - seen.columns[name]

    return act


def _swapped_about_datum(
    seen: Recorded, how: How, motion: Motion, rng: np.random.Generator
) -> None:
    """East called north and north east, by a converter to a local plane."""
    c, (latitude, longitude) = seen.columns, motion.datum
    stretch = np.cos(np.radians(latitude))
    north, east = c["latitude"] - latitude, (c["longitude"] - longitude) * stretch
    c["latitude"], c["longitude"] = latitude + east, longitude + north / stretch


def _later(groups: tuple[str, ...], seconds: float) -> Act:
    """The stamps of these instruments are so late; the recorder's own are right."""

    def act(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
        for group in groups:
            if group in seen.time:
                how.setdefault("logged", {})[group] = seen.time[group] + 0.02
                seen.time[group] = seen.time[group] + seconds

    return act


def _wrapping(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
    """Microseconds since the start of the recorder in 32 bits, wrapping in mid-voyage."""
    start = 2**32 / 1e6 - rng.uniform(0.3, 0.7) * motion.kind.seconds

    def text(unix: np.ndarray) -> pl.Series:
        count = np.round((unix - motion.unix + start) * 1e6).astype(np.int64) % 2**32
        return pl.Series(count)

    how["time"], how["time unit"] = text, "us"
    how["relative"] = True


def _midnight(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
    """Times of day without a date, over midnight: right, once it is counted on."""
    begin = 86_400.0 - rng.uniform(0.3, 0.7) * motion.kind.seconds

    def text(unix: np.ndarray) -> pl.Series:
        of_day = np.round((unix - motion.unix + begin) % 86_400.0 * 1e6).astype(np.int64)
        return (
            pl.Series(of_day)
            .cast(pl.Duration("us"))
            .cast(pl.Int64)
            .map_elements(_clock_text, return_dtype=pl.String)
        )

    how["time"], how["relative"] = text, True


def _clock_text(microseconds: int) -> str:
    seconds, rest = divmod(microseconds, 1_000_000)
    return f"{seconds // 3600 % 24:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}.{rest:06d}"


def _restarted(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
    """The recorder was started again and counts its seconds from zero; both runs in one file."""
    begins = float(rng.uniform(0.3, 0.7)) * motion.kind.seconds

    def text(unix: np.ndarray) -> pl.Series:
        t = unix - motion.unix
        return pl.Series(np.round(np.where(t < begins, t, t - begins), 3))

    how["time"], how["time unit"], how["relative"], how["two"] = text, "s", True, True


def _set_clock(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
    """The recorder's clock is set while it records: its stamps step by 2.5 s, UTC goes on."""
    at = motion.unix + float(rng.uniform(0.3, 0.7)) * motion.kind.seconds
    step = float(rng.choice((-2.5, 2.5)))
    how["received"] = lambda time: time + 0.02 + np.where(time > at, step, 0.0)


def _doubled(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
    """One row in fifty is written twice."""

    def rows(frame: pl.DataFrame) -> pl.DataFrame:
        twice = np.sort(np.concatenate((np.arange(len(frame)), np.arange(0, len(frame), 50))))
        return frame[twice]

    how["rows"] = rows


def _newest_first(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
    how["rows"] = lambda frame: frame.reverse()


def _shifted_rows(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
    """A remark with a comma that nobody quoted: these rows have one field more."""

    def lines(text: str) -> str:
        head, *rows = text.rstrip("\n").split("\n")
        for i in range(7, len(rows), 25):
            first, rest = rows[i].split(",", 1)
            rows[i] = f"{first},1.0,{rest}"
        return "\n".join([head, *rows]) + "\n"

    how["lines"] = lines


def _minus_sign(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
    """U+2212 for minus, as word processors and typesetters write it: right, once it is read."""
    how["lines"] = lambda text: text.replace(",-", ",\u2212")


def _in_stretch(values: dict[str, float], seconds: float) -> Act:
    def act(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
        begin = motion.unix + float(rng.uniform(0.2, 0.7)) * motion.kind.seconds
        for group, names in GROUPS.items():
            for name in names:
                if name in values:
                    time = seen.time[group]
                    inside = (time >= begin) & (time < begin + seconds)
                    inside[np.searchsorted(time, begin).clip(max=len(time) - 1)] = True
                    seen.columns[name] = np.where(inside, values[name], seen.columns[name])

    return act


def _frozen(name: str, seconds: float) -> Act:
    def act(seen: Recorded, how: How, motion: Motion, rng: np.random.Generator) -> None:
        group = next(g for g, names in GROUPS.items() if name in names)
        time, begin = seen.time[group], motion.unix + 0.4 * motion.kind.seconds
        first = int(np.searchsorted(time, begin))
        inside = (time >= begin) & (time < begin + seconds)
        seen.columns[name] = np.where(inside, seen.columns[name][first], seen.columns[name])

    return act


SLOW_TURN = np.radians(2.0)
VELOCITY, POSITION = ("velocity",), ("position",)
CHANGES = (
    Change("speed: knots as m/s", "unit", _column("sog", _times(1 / KNOT)), VELOCITY, speed=0.4),
    Change("speed: km/h as m/s", "unit", _column("sog", _times(3.6)), VELOCITY, speed=0.4),
    Change("speed: m/s as knots", "unit", _column("sog", _times(KNOT)), VELOCITY, speed=0.4),
    Change("speed: cm/s as m/s", "unit", _column("sog", _times(100.0)), VELOCITY, speed=0.4),
    Change("course: radians as degrees", "unit", _column("cog", _half_turns), VELOCITY,
           recorders=NOT_NMEA, speed=0.4),
    Change("course: degrees as radians", "unit", _column("cog", np.degrees), VELOCITY,
           recorders=NOT_NMEA, speed=0.4),
    Change("heading: radians as degrees", "unit", _column("heading", _half_turns), ("heading",),
           recorders=NOT_NMEA, speed=0.4),
    Change("heading: degrees as radians", "unit", _column("heading", np.degrees), ("heading",),
           recorders=NOT_NMEA, speed=0.4),
    Change("yaw rate: rad/s as deg/s", "unit", _column("yaw_rate", np.radians),
           ("yaw_rate", "yaw rate"), needs=("yaw_rate",), speed=0.4),
    Change("yaw rate: deg/s as rad/s", "unit", _column("yaw_rate", np.degrees),
           ("yaw_rate", "yaw rate"), needs=("yaw_rate",), speed=0.4),
    Change("yaw rate: deg/min as deg/s", "unit", _column("yaw_rate", _times(60.0)),
           ("yaw_rate", "yaw rate"), needs=("yaw_rate",), speed=0.4),
    Change("rudder: degrees as radians", "unit", _column("rudder", np.degrees), ("rudder",),
           "plausibility", ("rudder",), speed=0.4),
    Change("shaft: rpm as rps", "unit", _column("rps", _times(60.0)), ("rps", "propeller"),
           "plausibility", ("rps",), speed=0.4),
    Change("shaft: rps as rpm", "unit", _column("rps", _times(1 / 60.0)), ("rps", "propeller"),
           "plausibility", ("rps",), speed=0.4),
    Change("position: whole numbers of 1e-7 deg", "unit", _whole_numbers, POSITION,
           recorders=NOT_NMEA),
    Change("wind: knots as m/s", "unit", _column("wind_speed", _times(1 / KNOT)), ("wind",),
           "undetermined"),
    Change("yaw rate to port", "sign", _column("yaw_rate", np.negative), ("yaw_rate", "yaw rate"),
           needs=("yaw_rate",), speed=0.4),
    Change("rudder to port", "sign", _column("rudder", np.negative), ("rudder",),
           needs=("rudder",), speed=0.4),
    Change("course anticlockwise", "sign", _column("cog", _mirrored), VELOCITY, speed=0.4),
    Change("heading anticlockwise", "sign", _column("heading", _mirrored), ("heading",), speed=0.4),
    Change("longitude counted to the west", "sign", _mirror_about_datum("longitude", 1), POSITION,
           speed=0.4),
    Change("latitude counted to the south", "sign", _mirror_about_datum("latitude", 0), POSITION,
           speed=0.4),
    Change("course from east, anticlockwise", "frame", _column("cog", _from_east), VELOCITY,
           speed=0.4),
    Change("heading from east, anticlockwise", "frame", _column("heading", _from_east),
           ("heading",), speed=0.4),
    Change("course + 90", "frame", _column("cog", _turned(90.0)), VELOCITY, speed=0.4),
    Change("course reversed", "frame", _column("cog", _turned(180.0)), VELOCITY, speed=0.4),
    Change("course + 20, magnetic", "frame", _column("cog", _turned(20.0)), VELOCITY, speed=0.4),
    Change("heading + 90", "frame", _column("heading", _turned(90.0)), ("heading",), speed=0.4,
           kinds=("model ship", "usv", "planing usv", "blueboat", "yacht in waves", "coaster")),
    Change("heading reversed", "frame", _column("heading", _turned(180.0)), ("heading",),
           speed=0.4, kinds=("model ship", "usv", "planing usv", "yacht in waves", "coaster")),
    Change("north and east of the position exchanged", "swapped", _swapped_about_datum, POSITION,
           speed=0.4),
    Change("latitude and longitude exchanged", "swapped", _exchanged("latitude", "longitude"),
           POSITION, recorders=NOT_NMEA, speed=0.4),
    Change("speed and course exchanged", "swapped", _exchanged("sog", "cog"), VELOCITY,
           recorders=NOT_NMEA, speed=0.4),
    Change("wind mirrored", "sign", _column("wind_angle", _mirrored), ("wind",), "undetermined"),
    Change("wind: where it blows to", "frame", _column("wind_angle", _turned(180.0)), ("wind",),
           "undetermined"),
    Change("GNSS in GPS time", "clock", _later(("position", "velocity"), 18.0),
           ("clock", "position", "velocity", "gnss"), recorders=STAMPED, speed=0.4,
           turning=SLOW_TURN),
    Change("rudder's PLC an hour ahead", "clock", _later(("rudder",), 3600.0), ("rudder",),
           needs=("rudder",), recorders=STAMPED),
    Change("heading late by 5 s", "clock", _later(("heading",), 5.0),
           ("clock", "heading", "position", "velocity", "yaw_rate"), recorders=STAMPED, speed=0.4,
           turning=SLOW_TURN),
    Change("yaw rate late by 4 s", "clock", _later(("yaw_rate",), 4.0), ("yaw_rate", "yaw rate"),
           needs=("yaw_rate",), recorders=STAMPED, speed=0.4, turning=SLOW_TURN),
    Change("32-bit microseconds wrap", "clock", _wrapping, ("time", "clock"), recorders=("csv",)),
    Change("times of day over midnight", "clock", _midnight, ("time", "clock"), recorders=("csv",)),
    Change("recorder started again", "clock", _restarted, ("time", "clock", "start"),
           recorders=("csv",)),
    Change("recorder's clock set", "clock", _set_clock, ("clock", "time"), recorders=("nmea",)),
    Change("rows twice", "order", _doubled, ("time", "rows", "duplicate"), recorders=ROWS),
    Change("newest row first", "order", _newest_first, ("time", "rows"), recorders=ROWS),
    Change("a field too many in some rows", "order", _shifted_rows, ("row", "field"),
           recorders=("csv",)),
    Change("typographic minus", "value", _minus_sign, ("minus",), recorders=("csv",)),
    Change("lost fix: 0 N 0 E for 1.2 s", "value",
           _in_stretch({"latitude": 0.0, "longitude": 0.0}, 1.2), POSITION, "plausibility"),
    Change("AIS marks for 20 s", "value", _in_stretch({"sog": 102.3 * KNOT, "cog": 360.0}, 20.0),
           VELOCITY, "plausibility", speed=0.4),
    Change("speed of 2500 m/s once", "value", _in_stretch({"sog": 2500.0}, 0.0), VELOCITY,
           "plausibility"),
    Change("heading spike", "value", _in_stretch({"heading": 200.0}, 0.0), ("heading",)),
    Change("heading frozen for 200 s", "value", _frozen("heading", 200.0), ("heading",), speed=0.4,
           turning=np.radians(0.7)),
)  # fmt: skip
