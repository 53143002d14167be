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
the voyage that chance is excluded. The ship's own speed gives the unit and the vane's zero
(`wind_slope`); what it does not exclude is listed as not compared. Nothing is said of a voyage that
hardly turns.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.logs.health.health_report import Finding, NotCompared
from shiplog.nomenclature.channels import UNUSABLE, Quality
from shiplog.ship_profile.profile import Profile
from shiplog.ship_profile.profile_lines import (
    converted_twice,
    offset_line,
    other_unit,
    sign_line,
    unit_line,
)
from shiplog.voyages.contradictions.wind_slope import FLOW, SLOPES, Slope, slope
from shiplog.voyages.rows.resampling import RATE_HZ

SECOND_ROWS = round(RATE_HZ)  # rows of the 10 Hz table that are averaged: gusts, not noise
BLOCKS = 12  # parts of a voyage that each vote
LEAST_S = 240  # usable seconds: of fewer a gust may look like a turn
LEAST_TURNING = (
    0.03  # spread of the heading, 1 - |mean e^{iψ}|: of a swing with 14 deg of deviation
)
RATIO = 4.0  # times the spread must fall: gusts of a third of the wind do not make that
ALIKE = 1.5  # times the least spread, and still as good
VOTES_T = 3.5  # Student's t of the parts' votes: chance of 1 in 400 with 12 of them
GUSTS = 0.15  # of the wind: what turbulence at sea is in any case; less spread says no more
WIND_MPS = 1.0  # mean true wind below which there is no direction to compare
MOST_SPREAD = 0.35  # e of a convention that can be right: the wind's own turbulence is less


@dataclass(frozen=True)
class Convention:
    """One way to read an anemometer: what was recorded, and how the profile says so."""

    name: str
    true_wind: Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    key: Callable[[Profile], str] | None
    reason: str


def _from_body(turn: Callable[[np.ndarray], np.ndarray]) -> Callable:
    """Of an apparent wind whose angle from the bow is `turn` of the recorded one."""

    def true_wind(speed, angle, heading, velocity):
        return (speed * np.exp(1j * turn(angle)) - velocity) * np.exp(1j * heading)

    return true_wind


def _sign(profile: Profile) -> str:
    return f"set `{sign_line(profile, 'wind', 1)}`"


def _zero(profile: Profile, degrees: float = 180.0) -> str:
    return f"set `{offset_line(profile, 'wind', degrees, 1)}`"


def _unit(profile: Profile, known: float) -> str:
    """Of a speed that is `known` times what it should be."""
    if unit := other_unit(profile, "wind", known, known, known):
        return f"set `{unit_line(profile, 'wind', unit)}`"
    twice = converted_twice(profile, "wind", known, known, known)
    return f"set `{twice}`" if twice else "correct the unit of the speed on [sensors.wind]"


_NO_KIND = "shiplog takes the apparent wind from the bow: name its topic and fields"
CONVENTIONS = (
    Convention("as it is", _from_body(lambda angle: angle), None, "none known"),
    Convention("positive to port", _from_body(lambda angle: -angle), _sign, "sign"),
    Convention("where it blows to", _from_body(lambda angle: angle + math.pi), _zero, "frame"),
    Convention(
        "where it blows to, positive to port", _from_body(lambda angle: math.pi - angle),
        lambda profile: f"{_sign(profile)}, and {_zero(profile)}", "frame",
    ),
    Convention(
        "counted from the starboard side", _from_body(lambda angle: angle + 0.5 * math.pi),
        lambda profile: _zero(profile, -90.0), "frame",
    ),
    Convention(
        "counted from the port side", _from_body(lambda angle: angle - 0.5 * math.pi),
        lambda profile: _zero(profile, 90.0), "frame",
    ),
    Convention(
        "in radians, read as degrees", _from_body(lambda angle: angle * 180.0 / math.pi),
        lambda profile: f"set `{unit_line(profile, 'wind', 'rad', 1)}`", "unit",
    ),
    Convention(
        "counted from north",
        lambda s, g, psi, v: s * np.exp(1j * g) - v * np.exp(1j * psi), None, "frame",
    ),
    Convention(
        "the true wind, from the bow", lambda s, g, psi, v: s * np.exp(1j * (g + psi)), None,
        "frame",
    ),
    Convention(
        "the true wind, from north", lambda s, g, psi, v: s * np.exp(1j * g) + 0.0 * v, None,
        "frame",
    ),
)  # fmt: skip
LEAST_GAIN = 2.0  # times by which another unit lessens what varies of the wind


@dataclass(frozen=True)
class WindComparison:
    """One contradiction at most, and what this voyage's motion does not say of its wind."""

    findings: tuple[Finding, ...] = ()
    not_compared: tuple[NotCompared, ...] = ()


HARDLY_TURNS = WindComparison(not_compared=(
    NotCompared("wind", "the ship hardly turns", "turns to both sides, for minutes"),
))  # fmt: skip


def compare(table: pl.DataFrame, profile: Profile) -> WindComparison:
    """Whether another reading of the wind fits the ship's motion far better."""
    if not profile.has_wind:
        return WindComparison()
    seconds = _seconds(table)
    if seconds is None:
        return HARDLY_TURNS
    heading = seconds[2]
    if len(heading) < LEAST_S or 1.0 - abs(np.exp(1j * heading).mean()) < LEAST_TURNING:
        return HARDLY_TURNS
    of = slope(*seconds)
    found = _contradiction(seconds, of, profile, table)
    return WindComparison((found,)) if found else WindComparison(not_compared=of.open_)


def _contradiction(
    seconds: tuple[np.ndarray, ...], of: Slope, profile: Profile, table: pl.DataFrame
) -> Finding | None:
    speed, angle, heading, velocity = seconds
    as_it_is, *others = CONVENTIONS
    spreads = {as_it_is: _least_spread(as_it_is, speed, angle, heading, velocity)}
    before = spreads[as_it_is]
    if before is not None and before.mean() >= RATIO * GUSTS**2:  # else none is so much better
        spreads |= {c: _least_spread(c, speed, angle, heading, velocity) for c in others}
    air = speed * np.exp(1j * angle)

    def gain(beta: complex) -> float:
        """Times by which this β lessens what varies of the wind."""
        return _left(air - velocity, heading) / max(_left(air - beta * velocity, heading), 1e-12)

    known = of.known
    beta = known or (np.exp(1j * of.turned) if of.turned else None)
    if beta is not None and gain(beta) < LEAST_GAIN:
        beta = None  # something else turns with the ship
    best = _best(spreads)
    after = spreads[best] if best else None
    turned = after is not None and before is not None and _better(before, after)
    if beta is not None and turned and best:
        # the one that leaves less, in m/s, of what turns with the ship
        of_speed = _left(air - beta * velocity, heading)
        of_angle = _left(best.true_wind(speed, angle, heading, velocity))
        turned = of_angle * ALIKE < of_speed
    if turned and best and after is not None and before is not None:
        times = math.sqrt(before.mean() / max(float(after.mean()), 1e-12))
        return _of_angle(best, times, profile, table)
    if beta is None:
        return None
    return _of_slope(of, known, profile, table) if known else _of_zero(of, profile, table)


def _left(wind: np.ndarray, heading: np.ndarray | float = 0.0) -> float:
    """Variance [m²/s²] of a true wind, in earth axes once it is turned by the heading."""
    return float(np.var(wind * np.exp(1j * heading)))


def _best(spreads: dict[Convention, np.ndarray | None]) -> Convention | None:
    """The convention whose true wind turns least, or the first that is as good but for `ALIKE`;
    None where none can be right."""
    known = {c: float(spread.mean()) for c, spread in spreads.items() if spread is not None}
    if not known or min(known.values()) > MOST_SPREAD:
        return None
    least = ALIKE * max(min(known.values()), GUSTS**2)
    return next(convention for convention, spread in known.items() if spread <= least)


def _better(before: np.ndarray, after: np.ndarray) -> bool:
    """Whether the spread falls to less than 1/RATIO, in most of the voyage."""
    if before.mean() < RATIO * max(float(after.mean()), GUSTS**2):
        return False
    votes = np.array([part.mean() for part in np.array_split(before / RATIO - after, BLOCKS)])
    return bool(votes.mean() > VOTES_T * votes.std(ddof=1) / math.sqrt(BLOCKS))


def _of_slope(of: Slope, known: float, profile: Profile, table: pl.DataFrame) -> Finding:
    words, reason = SLOPES[known]
    key = _zero(profile) if known < 0.0 else _unit(profile, known)
    beta, half = of.value.real, of.half(of.error)
    low, high = beta - half, beta + half
    sentence = (
        f"wind contradicts the ship's own motion: the apparent wind grows by {beta:.2f} m/s for "
        f"each m/s of the ship's velocity ({low:.2f} to {high:.2f}), and not by 1, as if it were "
        f"{words}. Look at the anemometer; if so, {key}."
    )
    return Finding(
        "contradiction", "wind", sentence, start_s=0.0, end_s=_end(table), value=round(beta, 3),
        low=round(low, 3), high=round(high, 3), unit="1", reason=reason,
    )  # fmt: skip


def _of_zero(of: Slope, profile: Profile, table: pl.DataFrame) -> Finding:
    value = math.degrees(of.turned)
    half = math.degrees(of.half(max(of.error, of.error_aside)) / abs(of.value))
    side = "starboard" if value > 0 else "port"
    sentence = (
        "wind contradicts the ship's own motion: the ship's headway comes from "
        f"{abs(value):.0f} deg ({abs(value) - half:.0f} to {abs(value) + half:.0f}) to {side}, and "
        f"not from ahead. Look at the vane's zero; if so, {_zero(profile, round(value))}."
    )
    return Finding(
        "contradiction", "wind", sentence, start_s=0.0, end_s=_end(table), value=round(value, 2),
        low=round(value - half, 2), high=round(value + half, 2), unit="deg", reason="frame",
    )  # fmt: skip


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


def _of_angle(
    convention: Convention, times: float, profile: Profile, table: pl.DataFrame
) -> Finding:
    key = convention.key(profile) if convention.key else _NO_KIND
    sentence = (
        f"wind contradicts the ship's own motion: the true wind turns with the ship, {times:.1f} "
        f"times as much as it would if the recorded angle is {convention.name}. Look at the "
        f"anemometer; if so, {key}."
    )
    # A vane that is stuck looks like one that counts from north: then it is a question.
    kind = "contradiction" if convention.key else "implausible"
    return Finding(
        kind, "wind", sentence, start_s=0.0, end_s=_end(table), value=round(times, 3), unit="1",
        reason=convention.reason,
    )  # fmt: skip


def _end(table: pl.DataFrame) -> float:
    return round((table.height - 1) / RATE_HZ, 3)
