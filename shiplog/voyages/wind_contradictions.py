"""The wind against the ship's own motion: the true wind must not turn with the ship.

With a the apparent wind (the vector to where it comes from, in body axes), V the velocity of
midship and R(ψ) the turn to earth axes, the true wind is

    W = R(ψ) (a - V)

(ITTC 7.5-04-01-01.1, 2017; velocity over ground, so that a current is part of it). While the ship
turns, W stays where it is, up to gusts and a slow change. A vane that is mirrored makes a W that
turns by twice the heading; an anemometer in knots leaves a part of V in it. So each convention h
is tried, and its spread compared with that of the record as it is:

    e_h = mean |W_h - W̄_h - Ẇ_h t|² / |W̄_h|²

A convention is reported where e is less than a quarter of that of the record, in enough parts of
the voyage that chance is excluded. Nothing is said of a voyage that hardly turns, or in a calm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.channels import UNUSABLE, Quality
from shiplog.logs.health_report import Finding
from shiplog.profile import Profile
from shiplog.voyages.resampling import RATE_HZ

SECOND_ROWS = round(RATE_HZ)  # rows of the 10 Hz table that are averaged: gusts, not noise
BLOCKS = 12  # parts of a voyage that each vote
LEAST_S = 240  # usable seconds: of fewer a gust may look like a turn
LEAST_TURNING = (
    0.03  # spread of the heading, 1 - |mean e^{iψ}|: of a swing with 14 deg of deviation
)
RATIO = 4.0  # times the spread must fall: gusts of a third of the wind do not make that
ALIKE = 1.5  # times the least spread, and still as good
VOTES_T = 3.5  # Student's t of the parts' votes: chance of 1 in 400 with 12 of them, of 60 tries
GUSTS = 0.15  # of the wind: what turbulence at sea is in any case; less spread says no more
# Measured over free speed at a mast: a fifth more above a bridge, and less in its lee (Moat,
# Yelland and Molland, 2004). Whatever lies within is no other unit.
FLOW = (0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3)
WIND_MPS = 1.0  # mean true wind below which there is no direction to compare
MOST_SPREAD = 0.35  # e of a convention that can be right: the wind's own turbulence is less


@dataclass(frozen=True)
class Convention:
    """One way to read an anemometer: what was recorded, and how the profile says so."""

    name: str
    true_wind: Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    key: str
    reason: str


def _from_body(turn: Callable[[np.ndarray], np.ndarray]) -> Callable:
    """Of an apparent wind whose angle from the bow is `turn` of the recorded one."""

    def true_wind(speed, angle, heading, velocity):
        return (speed * np.exp(1j * turn(angle)) - velocity) * np.exp(1j * heading)

    return true_wind


_SIGN = "set `sign = [1.0, -1.0]` on [sensors.wind]"
_TOWARDS = "set `offset = [0.0, 180.0]` on [sensors.wind]"
_NO_KIND = "shiplog takes the apparent wind from the bow: name its topic and fields"
CONVENTIONS = (
    Convention("as it is", _from_body(lambda angle: angle), "", "none known"),
    Convention("positive to port", _from_body(lambda angle: -angle), _SIGN, "sign"),
    Convention("where it blows to", _from_body(lambda angle: angle + math.pi), _TOWARDS, "frame"),
    Convention(
        "where it blows to, positive to port", _from_body(lambda angle: math.pi - angle),
        f"{_SIGN}, and `offset = [0.0, 180.0]`", "frame",
    ),
    Convention(
        "radians, read as degrees", _from_body(lambda angle: angle * 180.0 / math.pi),
        'set the unit of the angle to "rad" on [sensors.wind]', "unit",
    ),
    Convention(
        "apparent, counted from north",
        lambda s, g, psi, v: s * np.exp(1j * g) - v * np.exp(1j * psi), _NO_KIND, "frame",
    ),
    Convention(
        "the true wind, from the bow", lambda s, g, psi, v: s * np.exp(1j * (g + psi)), _NO_KIND,
        "frame",
    ),
    Convention(
        "the true wind, from north", lambda s, g, psi, v: s * np.exp(1j * g) + 0.0 * v, _NO_KIND,
        "frame",
    ),
)  # fmt: skip
FACTORS = {  # what the recorded speed is multiplied by, and the unit that it then was
    1.0: "", 1852 / 3600: "kn", 3600 / 1852: "m/s, where kn is said", 1 / 3.6: "km/h",
    3.6: "m/s, where km/h is said", 0.44704: "mph",
}  # fmt: skip


def wind_findings(table: pl.DataFrame, profile: Profile) -> list[Finding]:
    """One contradiction where another reading of the wind fits the ship's motion far better."""
    if not profile.has_wind:
        return []
    seconds = _seconds(table)
    if seconds is None:
        return []
    speed, angle, heading, velocity = seconds
    count = len(speed)
    turning = 1.0 - abs(np.exp(1j * heading).mean())
    if count < LEAST_S or turning < LEAST_TURNING:
        return []
    readings = {
        (convention, factor): _least_spread(convention, factor * speed, angle, heading, velocity)
        for convention in CONVENTIONS
        for factor in FACTORS
    }
    as_it_is = readings[CONVENTIONS[0], 1.0]
    if as_it_is is None:
        return []
    nothing = CONVENTIONS[0], 1.0
    one = [(c, 1.0) for c in CONVENTIONS] + [(CONVENTIONS[0], f) for f in FACTORS]
    chosen = _unless_better(readings, nothing, _best(readings, one))
    both = [(chosen[0], f) for f in FACTORS] + [(c, chosen[1]) for c in CONVENTIONS]
    chosen = _unless_better(readings, chosen, _best(readings, both))
    spread = readings[chosen]
    if chosen == nothing or spread is None or spread.mean() > MOST_SPREAD:
        return []
    times = math.sqrt(as_it_is.mean() / max(float(spread.mean()), 1e-12))
    return [_finding(*chosen, times, table)]


Reading = tuple[Convention, float]
Readings = dict[Reading, np.ndarray | None]


def _best(readings: Readings, asked: Iterable[Reading]) -> Reading:
    """The reading whose true wind turns least, or the first that is as good but for `ALIKE`."""
    known = {one: float(spread.mean()) for one in asked if (spread := readings[one]) is not None}
    least = ALIKE * max(min(known.values()), GUSTS**2)
    return next(reading for reading, spread in known.items() if spread <= least)


def _unless_better(readings: Readings, one: Reading, other: Reading) -> Reading:
    """`other` where its spread is less than 1/RATIO of that of `one` in most of the voyage."""
    before, after = readings[one], readings[other]
    if before is None or after is None:
        return one
    if before.mean() < RATIO * max(float(after.mean()), GUSTS**2):
        return one
    votes = np.array([part.mean() for part in np.array_split(before / RATIO - after, BLOCKS)])
    t = votes.mean() / max(float(votes.std(ddof=1)) / math.sqrt(BLOCKS), 1e-12)
    return other if t > VOTES_T else one


def _seconds(table: pl.DataFrame) -> tuple[np.ndarray, ...] | None:
    """Means over whole usable seconds: wind speed [n] and angle, heading, velocity as u + iv."""
    rows = table.height // SECOND_ROWS * SECOND_ROWS
    bad = (table["quality"].to_numpy() & int(UNUSABLE | Quality.HELD)) != 0
    names = ("wind_speed", "wind_angle", "heading", "surge", "sway")
    values = {name: table[name].cast(pl.Float64).fill_null(np.nan).to_numpy() for name in names}
    for column in values.values():
        bad |= ~np.isfinite(column)
    if rows == 0:
        return None

    def mean(value: np.ndarray) -> np.ndarray:
        return value[:rows].reshape(-1, SECOND_ROWS).mean(axis=1)

    good = ~bad[:rows].reshape(-1, SECOND_ROWS).any(axis=1)
    air = mean(values["wind_speed"] * np.exp(1j * values["wind_angle"]))[good]
    velocity = mean(values["surge"] + 1j * values["sway"])[good]
    heading = np.angle(mean(np.exp(1j * values["heading"])))[good]
    return np.abs(air), np.angle(air), heading, velocity


def _least_spread(convention: Convention, speed, angle, heading, velocity) -> np.ndarray | None:
    """Of the speeds that a free wind may have had which hull and mast slow down or speed up."""
    spreads = [
        _spread(convention.true_wind(speed / flow, angle, heading, velocity)) for flow in FLOW
    ]
    known = [spread for spread in spreads if spread is not None]
    if len(known) < len(spreads):  # it may be a calm
        return None
    return min(known, key=lambda spread: float(spread.mean()))


def _spread(true_wind: np.ndarray) -> np.ndarray | None:
    """|W - W̄ - Ẇ t|² / |W̄|² of each second [n]; None in a calm."""
    mean = true_wind.mean()
    if abs(mean) < WIND_MPS:
        return None if np.sqrt(np.mean(np.abs(true_wind) ** 2)) < WIND_MPS else (
            np.abs(true_wind - mean) ** 2 / WIND_MPS**2
        )  # fmt: skip
    t = np.linspace(-1.0, 1.0, len(true_wind))
    trend = (true_wind * t).mean() / (t**2).mean()
    return np.abs(true_wind - mean - trend * t) ** 2 / abs(mean) ** 2


def _finding(convention: Convention, factor: float, times: float, table: pl.DataFrame) -> Finding:
    unit = FACTORS[factor]
    what = [] if convention.name == "as it is" else [f"its angle is {convention.name}"]
    what += [f"its speed is in {unit}"] if unit else []
    keys = [convention.key] if convention.key else []
    keys += [f"correct the unit of the speed ({unit}) on [sensors.wind]"] if unit else []
    sentence = (
        f"wind contradicts the ship's own motion: the true wind turns with the ship, {times:.1f} "
        f"times as much as it would if {' and '.join(what)}. Look at the anemometer; if so, "
        f"{'; '.join(keys)}."
    )
    reason = "unit" if convention.name == "as it is" else convention.reason
    return Finding(
        "contradiction", "wind", sentence, start_s=0.0, end_s=round((table.height - 1) * 0.1, 3),
        value=round(times, 3), unit="1", reason=reason,
    )  # fmt: skip
