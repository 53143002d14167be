"""Values that cannot be: what no ship does and no instrument measures, and marks that stand for no
value. They are blank before anything is interpolated, with one finding a channel.

The limits are those of everything that floats, and not of a good measurement: a value within them
may be wrong. A profile's `limits` of a sensor stand in their place.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import polars as pl

from shiplog.logs.reading.read import Reading
from shiplog.nomenclature import units
from shiplog.nomenclature.channels import DEGREE
from shiplog.ship_profile.profile import Actuator, Profile, Source
from shiplog.ship_profile.table_channels import TABLE_CHANNELS
from shiplog.voyages.clocks import clocks
from shiplog.voyages.rows.left_out import LeftOut
from shiplog.voyages.samples import not_available

# Kinds of ship by their length [m], the first that is long enough; the last one's are the rest.
SMALL, BOAT = 3.0, 30.0
SPEED = {  # m/s over ground or through the water
    SMALL: (25.0, "models and small drones stay below 25 m/s"),
    BOAT: (60.0, "racing boats apart, none is faster than 60 m/s"),
    math.inf: (40.0, "the fastest ships, hydrofoils and ferries, go 30 m/s"),
}
SHAFT = {  # rev/s
    SMALL: (1_000.0, "motors of models turn at up to 60 000 rpm"),
    math.inf: (300.0, "turbines turn at up to 18 000 rpm"),
}
ENDS_M_S = 10.0  # a hull's ends athwart: a tug that spins in 15 s has 6 m/s, a 1 m drone 3 m/s
FASTEST_GYRO = math.radians(2_000.0)  # rad/s, the range of a rate gyro
WIND = (-1.0, 100.0)  # m/s: no wind at sea was stronger; an anemometer's zero may be a little off
RUDDER = math.pi  # rad, either way: a rudder does not go round
AZIMUTH = 20.0 * math.pi  # rad: a unit that counts its turns on
NEAR_M = 1_000.0  # m: a receiver's error in addition to what the ship can have gone
NO_FIX_DEG = 1e-4  # of 0 N 0 E, what receivers without a fix write
FAR_DEG = 1.0  # from the other positions: 0 N 0 E is no place where the ship is
EARTH_DEG = (90.0, 360.0)  # latitude and longitude, whichever way the latter is counted
METRE_PER_DEG = 111_195.0  # of a great circle
LARGEST = 1e12  # as the profile has it: what is beyond, as the largest float of all, is no value
WORDS = {"sog": "speed", "cog": "course"}  # of a channel in a sentence
SPEEDS = ("sog", "surge", "sway", "velocity_north", "velocity_east")


@dataclass(frozen=True, slots=True)
class Limits:
    """What a channel can be, SI, and why. `stated`: by the profile; also: another key of it that
    they are made of."""

    least: float
    most: float
    why: str = ""
    stated: bool = False
    also: str = ""


def screened(reading: Reading, profile: Profile) -> tuple[Reading, Screen]:
    """The log with blanks in place of values that cannot be or stand for none, and what they are.

    A field that two sources of the profile read is blank for both where it is for one.
    """
    screen, frames = Screen(profile), dict(reading.frames)
    sources: list[tuple[str, Source]] = [*profile.sensors.items()]
    sources += [(actuator.name, actuator) for actuator in profile.actuators]
    for name, source in sources:
        frame = frames.get(source.topic)
        if frame is None or frame.height == 0:
            continue
        times = frame[clocks.clock_columns(frame, source)[0]]
        raw = np.stack([_sent(frame[path]) for path in source.paths], axis=1)
        raw[times.is_null().to_numpy()] = np.nan
        clear = screen.clear(name, source, times.fill_null(0).to_numpy(), raw)
        for path, before, after in zip(source.paths, raw.T, clear.T, strict=True):
            gone = np.isfinite(before) & ~np.isfinite(after)
            if gone.any():
                frame = frame.with_columns(frame[path].set(pl.Series(gone), None))
        frames[source.topic] = frame
    return replace(reading, frames=frames), screen


def _sent(column: pl.Series) -> np.ndarray:
    """A field's values [n] as they were sent, NaN where there is none."""
    values = column.cast(pl.Float64, strict=False).fill_null(np.nan).to_numpy()
    return np.where(np.abs(values) <= LARGEST, values, np.nan)


@dataclass
class Screen:
    """What was left out of a log's values, source by source."""

    profile: Profile
    left_out: list[LeftOut] = field(default_factory=list)

    def clear(self, name: str, source: Source, times: np.ndarray, raw: np.ndarray) -> np.ndarray:
        """A source's values [n, k] as they were sent, NaN for what is none of them; times [n]
        ns."""
        offsets, factors = (np.array(part) for part in zip(*source.scale(), strict=True))
        si = (raw - offsets) * factors
        si[_missing(raw, source.missing)] = np.nan
        if isinstance(source, Actuator):
            names: tuple[str, ...] = (source.kind,)
        else:
            names = TABLE_CHANNELS[name, self.profile.sensors.kind(name)]
        for i, channel in enumerate(names[: len(source.paths)]):
            unit, factor = _unit(source, i), float(factors[i])
            sent = np.where(np.isfinite(si[:, i]), raw[:, i], np.nan)
            for mark, at in not_available.marked(channel, sent, factor, unit):
                self._mark(name, channel, mark, times, si, i, at, raw[:, i], unit)
            if unit == "pwm":
                self._pulses(name, times, si, raw[:, i], float(offsets[i]), i)
            limits = limits_of(self.profile, name, channel, source, i)
            if limits is not None:
                self._beyond(name, source, times, si, i, raw[:, i], limits)
        if name == "position":
            self._places(times, si, raw)
        return np.where(np.isfinite(si), raw, np.nan)

    def _mark(
        self, name: str, channel: str, mark: not_available.Mark, times: np.ndarray, si: np.ndarray,
        i: int, at: np.ndarray, raw: np.ndarray, unit: str,
    ) -> None:  # fmt: skip
        shown = f"{mark.value if mark.unit else raw[at][0]:.10g} {mark.unit or unit}".strip()
        what = WORDS.get(channel, channel.replace("_", " "))
        if channel == "cog":  # nothing is unknown of a velocity of zero
            at = at & (si[:, 1 - i] != 0.0)
        if not at.any():
            return
        si[at, i if channel in ("sog", "cog") else slice(None)] = np.nan
        self.left_out.append(LeftOut(
            "not_available", name, times[at],
            f"{name}: {at.sum()} of {len(at)} values of its {what} are {shown}, the mark "
            f"{mark.of} for a value that is not available, the first at {{first}}. They are blank.",
            float(raw[at][0]), unit,
        ))  # fmt: skip

    def _pulses(
        self, name: str, times: np.ndarray, si: np.ndarray, raw: np.ndarray, offset: float, i: int
    ) -> None:
        at = not_available.no_pulse(np.where(np.isfinite(si[:, i]), raw, np.nan), offset)
        if not at.any():
            return
        si[at, i] = np.nan
        self.left_out.append(LeftOut(
            "not_available", name, times[at],
            f"{name}: {at.sum()} of {len(at)} pulses are {raw[at][0]:g} us, which is no pulse, as "
            "of an autopilot that is not armed, the first at {first}. They are blank.",
            float(raw[at][0]), "us",
        ))  # fmt: skip

    def _beyond(
        self, name: str, source: Source, times: np.ndarray, si: np.ndarray, i: int,
        raw: np.ndarray, limits: Limits,
    ) -> None:  # fmt: skip
        value = si[:, i]
        with np.errstate(invalid="ignore"):
            at = (value < limits.least) | (value > limits.most)
        if not at.any():
            return
        offset, factor = source.scale()[i]
        low, high = sorted(limit / factor + offset for limit in (limits.least, limits.most))
        middle = 0.5 * (low + high)
        extreme = float(raw[at][np.argmax(np.abs(raw[at] - middle))])
        unit = _unit(source, i)
        si[at] = np.nan
        span = f"{low:.4g} to {high:.4g} {unit}".strip()
        section = f"[[actuators]] {name}" if isinstance(source, Actuator) else f"[sensors.{name}]"
        if limits.stated:
            why, way = f"`limits` of {section}", "if they are true, widen it"
        else:
            why = limits.why
            way = f"if they are true, set `limits` of {section}; else look at its `unit` and `sign`"
            way += limits.also
        self.left_out.append(LeftOut(
            "implausible", name, times[at],
            f"{name}: {at.sum()} of {len(at)} values are beyond {span} ({why}), at most "
            f"{extreme:.6g}, the first at {{first}}. They are blank; {way}.",
            extreme, unit, float(low), float(high),
        ))  # fmt: skip

    def _places(self, times: np.ndarray, si: np.ndarray, raw: np.ndarray) -> None:
        """Positions without a fix, on no place of the Earth, or where the ship cannot have gone."""
        geodetic = self.profile.sensors.kind("position") == "geodetic"
        place = si / DEGREE if geodetic else si
        known: np.ndarray = np.all(np.isfinite(place), axis=1)
        if not known.any():
            return
        nowhere = np.zeros(len(place), np.bool_)
        if geodetic:
            sizes = np.abs(np.nan_to_num(place))
            nowhere[:] = known & (sizes > EARTH_DEG).any(axis=1)
            if 2 * nowhere.sum() > known.sum():
                return  # these are something else: ingest says so
            zero: np.ndarray = known & np.all(sizes < NO_FIX_DEG, axis=1)
            others = known & ~nowhere & ~zero
            if others.any() and np.abs(np.median(place[others], axis=0)).max() > FAR_DEG:
                self._say_no_fix(times, si, zero)
                known = others
            known = known & ~nowhere
            place = _metres(place, known)
        if not known.any():
            return
        reach = NEAR_M + self._fastest() * np.ptp(times[known]) * 1e-9
        away = np.linalg.norm(np.nan_to_num(place - np.median(place[known], axis=0)), axis=1)
        far = nowhere | (known & (away > reach))
        if not far.any():
            return
        worst = int(np.argmax(np.where(far, np.where(nowhere, np.inf, away), -1.0)))
        shown = ", ".join(f"{one:.7g}" for one in raw[worst])
        si[far] = np.nan
        self.left_out.append(LeftOut(
            "implausible", "position", times[far],
            f"position: {far.sum()} of {len(far)} are where the ship cannot have gone, such as "
            f"{shown}, the first at {{first}}: in the time of this log it comes no further than "
            f"{reach:.0f} m. They are blank; look at `fields` and `unit` of [sensors.position] "
            "where these are many, and at `limits` of [sensors.velocity] if they are true.",
            float(away[worst]), "m", None, float(reach),
        ))  # fmt: skip

    def _say_no_fix(self, times: np.ndarray, si: np.ndarray, unfixed: np.ndarray) -> None:
        if not unfixed.any():
            return
        si[unfixed] = np.nan
        self.left_out.append(LeftOut(
            "not_available", "position", times[unfixed],
            f"position: {unfixed.sum()} of {len(unfixed)} are 0 N 0 E, as of a receiver without a "
            "fix, the first at {first}. They are blank.",
            0.0, "deg",
        ))  # fmt: skip

    def _fastest(self) -> float:
        """m/s that the ship can have."""
        sensors = self.profile.sensors
        name = TABLE_CHANNELS["velocity", sensors.kind("velocity")][0]
        limits = limits_of(self.profile, "velocity", name, sensors.velocity or sensors.position, 0)
        assert limits is not None
        return max(abs(limits.least), abs(limits.most))


def limits_of(
    profile: Profile, name: str, channel: str, source: Source, place: int
) -> Limits | None:
    """What a channel of a source can be; None where nothing is known of it.

    An actuator's own `limits` mark what is beyond them, and say more than these.
    """
    if isinstance(source, Actuator):
        return _driven(profile, source) if source.limits is None else None
    stated = getattr(source, "limits", None)
    length = _length(profile)
    if channel in SPEEDS:
        most, why = _of(SPEED, length)
        found = Limits(-most, most, why)
    elif channel == "yaw_rate":
        most = FASTEST_GYRO if length is None else min(2.0 * ENDS_M_S / length, FASTEST_GYRO)
        of = "" if length is None else f" of {length:g} m"
        why = f"the ends of a ship{of} go athwart at less than {ENDS_M_S:g} m/s"
        found = Limits(-most, most, why, also=", and at `length_m` of [ship]")
    elif channel == "wind_speed":
        found = Limits(*WIND, "no wind at sea was stronger")
    else:
        return None
    if stated is None:
        return found
    offset, factor = source.scale()[place]
    low, high = sorted((limit - offset) * factor for limit in stated)
    slack = 1e-9 * (high - low)
    return Limits(low - slack, high + slack, stated=True)


def _driven(profile: Profile, actuator: Actuator) -> Limits | None:
    measure = units.measure(actuator.unit or "1")
    offset, factor = actuator.scale()[0]
    if measure == "shaft speed":
        most, why = _of(SHAFT, _length(profile))
        return Limits(-most, most, why)
    if measure == "angle" and actuator.kind in ("rudder", "azimuth"):
        most = RUDDER if actuator.kind == "rudder" else AZIMUTH
        said = "a rudder does not go round" if actuator.kind == "rudder" else "ten turns"
        return Limits(-most, most, said)
    if measure == "servo pulse" and abs(offset) >= not_available.PULSE_US[0]:
        low, high = sorted((pulse - offset) * factor for pulse in not_available.PULSE_US)
        return Limits(low, high, "a servo takes no other pulse")
    return None


def _of(kinds: Mapping[float, tuple[float, str]], length: float | None) -> tuple[float, str]:
    """The entry of a kind of ship; the widest where nobody has looked at the length."""
    if length is None:
        return max(kinds.values())
    return next(entry for longest, entry in kinds.items() if length <= longest)


def _length(profile: Profile) -> float | None:
    """m; None where a draft's guess has not been looked at."""
    drafted = any(key.endswith("length_m") for key in profile.unchecked)
    return None if drafted else profile.ship.length_m


def _missing(raw: np.ndarray, marks: tuple[float, ...]) -> np.ndarray:
    """Where [n, k] values are those that the profile calls missing."""
    at = np.zeros(raw.shape, bool)
    for mark in marks:
        at |= np.isclose(raw, mark, rtol=not_available.EXACT, atol=1e-12)
    return at


def _unit(source: Source, place: int) -> str:
    return (source.units[place] if source.units else source.unit) or ""


def _metres(place: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Latitudes and longitudes [n, 2] deg as metres about their middle, roughly."""
    around = np.radians(place[known, 1])
    east = math.degrees(math.atan2(np.sin(around).mean(), np.cos(around).mean()))
    turned = (place[:, 1] - east + 180.0) % 360.0 - 180.0
    narrow = math.cos(math.radians(float(np.median(place[known, 0]))))
    return METRE_PER_DEG * np.stack((place[:, 0], turned * narrow), axis=1)
