"""What `plausibility` asks of a profile and of a voyage's rows: the values of its ratios.

A voyage is asked on its moving rows, by the 95 % quantile: a single wrong sample is another
finding's, and a ship at its berth says nothing of its speed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import polars as pl

from shiplog.logs.health.health_report import Finding, NotCompared
from shiplog.nomenclature.channels import UNUSABLE
from shiplog.ship_profile.profile import Actuator, Profile
from shiplog.voyages.contradictions import twins
from shiplog.voyages.contradictions.plausibility import LEAST_BLOCK, SHIP, Asked, findings
from shiplog.voyages.rows.resampling import RATE_HZ

GRAVITY = 9.80665  # m/s²
SALT, FRESH, LONG_M = 1025.0, 998.0, 20.0  # kg/m³; a longer ship is taken as at sea
QUANTILE = 0.95  # of the moving rows
MOVING = 0.1  # m/s: a receiver at rest shows less
WAY = 0.3  # m/s: a slower ship manoeuvres, and may turn on the spot
WORKING = 0.5  # share of the speed's quantile, from which a ship is under way
LEAST_ROWS = 300  # 30 s of 10 Hz rows: of fewer nothing is asked
STEADY_ROWS = 50  # 5 s over which a steady motion changes little
STEADY = 0.1  # share by which it may change over that time
TURNING_ROWS = 20  # 2 s over which a rate of turn is taken from the heading
TURNS = 0.2  # r L/U from which a ship turns hard: a rudder of 5 to 10 deg
K_T = 0.3  # thrust coefficient of a propeller at rest: 0.2 to 0.5 (Carlton, 2018)
TURN = ("heading", "yaw_rate", "velocity")  # what a turning rate r L/U is made of
APART = ("place", "rudder ahead")  # asked of each unit, said of the worst
LENGTH_OPEN = NotCompared(
    "the ship's length", "no channel shows it, and of mass, breadth, draught and block coefficient "
    "the profile lacks some", "all four of them in the profile",
)  # fmt: skip


def of_log(table: pl.DataFrame, profile: Profile, found: Sequence[Finding] = ()) -> list[Finding]:
    """What is implausible of a profile and the 10 Hz rows read through it.

    found   what the sensors say of each other: a channel that is contradicted already is not asked
            again
    """
    known = {one.channel for one in found if one.kind == "contradiction"}
    asked = [*of_profile(profile), *of_voyage(table, profile)]
    of_ratios = findings(one for one in asked if not known & {one.channel, *one.of})
    return [*of_ratios, *twins.find_exchanged(table, profile)]


def not_compared(profile: Profile) -> tuple[NotCompared, ...]:
    """What nothing of the profile bounds: a length in feet is 3.3 times that in metres, and is seen
    by the displacement alone, m = ρ C_B L B T."""
    return () if any(one.row == "floating" for one in _particulars(profile)) else (LENGTH_OPEN,)


def of_profile(profile: Profile) -> list[Asked]:
    """What the particulars and places of a profile say by themselves."""
    return [*_particulars(profile), *_units(profile)]


def of_model(profile: Profile) -> list[Asked]:
    """In addition, of a profile that a model is made of: whether anything can turn the ship."""
    arms = {one.name: _arm(one) for one in profile.actuators}
    if not arms:
        return []
    name, arm = max(arms.items(), key=lambda pair: pair[1])
    return [Asked("steering", arm / profile.ship.length_m, name, name)]


def density(profile: Profile) -> float:
    """kg/m³ of the water; by the ship's length where the profile does not say."""
    return profile.site.density or (SALT if profile.ship.length_m > LONG_M else FRESH)


def _particulars(profile: Profile) -> Iterator[Asked]:
    ship, rho = profile.ship, density(profile)
    length, breadth, draught, mass = ship.length_m, ship.breadth_m, ship.draught_m, ship.mass_kg
    block = ship.block_coefficient
    one_hull = block is not None and block >= LEAST_BLOCK
    if breadth:
        yield Asked("length over breadth", length / breadth, SHIP)
    if draught:
        yield Asked("length over draught", length / draught, SHIP)
    if mass:
        yield Asked("slenderness", mass / (rho * length**3), SHIP)
    if mass and breadth and draught:
        ratio = mass / (rho * length * breadth * draught)
        yield Asked(f"displacement{' of a monohull' if one_hull else ''}", ratio, SHIP)
        if one_hull and block:
            yield Asked("floating", ratio / block, SHIP)
    if ship.x_g_m is not None:
        yield Asked("centre of gravity", abs(ship.x_g_m) / length, SHIP)
    if ship.frontal_area_m2 and breadth:
        yield Asked("frontal area", ship.frontal_area_m2 / breadth**2, SHIP)
    if ship.lateral_area_m2:
        yield Asked("lateral area", ship.lateral_area_m2 / length**2, SHIP)


def _units(profile: Profile) -> list[Asked]:
    """Of actuators and sensors; of several alike, the worst: what is asked once is enough."""
    ship = profile.ship
    length, draught = ship.length_m, ship.draught_m
    asked: list[Asked] = []
    both_ends = {one.position_m[0] > 0.0 for one in profile.actuators if one.kind == "rudder"}
    for one in profile.actuators:
        name, (ahead, starboard) = one.name, one.position_m
        place = Asked("place", math.hypot(ahead, starboard) / length, name,
                      f"actuators.{name}.position_m")  # fmt: skip
        asked.append(place)
        if one.kind == "rudder":
            if len(both_ends) == 1:
                asked.append(Asked("rudder ahead", ahead / length, name, name))
            if one.area_m2 and draught:
                asked.append(Asked("rudder area", one.area_m2 / (length * draught), name, name))
            if one.limits and one.si_unit == "rad":
                asked.append(Asked("rudder at all", math.degrees(_reach(one)), name, name))
        elif one.diameter_m:
            asked.append(Asked("propeller", one.diameter_m / length, name, name))
            if one.kind == "propeller" and draught:
                ratio = one.diameter_m / draught
                asked.append(Asked("propeller in the draught", ratio, name, name))
    for name, sensor in profile.sensors.items():
        arm = math.hypot(*sensor.lever_arm_m) / length
        asked.append(Asked("place", arm, name, f"sensors.{name}.lever_arm_m"))
    worst = {
        row: max((a for a in asked if a.row == row), key=lambda a: a.value, default=None)
        for row in APART
    }
    return [a for a in asked if a.row not in APART or a is worst[a.row]]


def _reach(actuator: Actuator) -> float:
    """The larger of its limits from zero, in SI."""
    return max(map(abs, actuator.si_limits or (0.0,)))


def _arm(actuator: Actuator) -> float:
    """m, of the force of an actuator about midship at its best angle."""
    ahead, starboard = actuator.position_m
    if actuator.kind == "rudder":
        return abs(ahead)
    if actuator.kind == "azimuth":
        return math.hypot(ahead, starboard)
    along = math.radians(actuator.direction_deg)
    return abs(ahead * math.sin(along) - starboard * math.cos(along))


def of_voyage(table: pl.DataFrame, profile: Profile) -> list[Asked]:
    """What the rows of a voyage say: speed, turning, revolutions, angles, wind.

    table   10 Hz: the profile's columns, SI, and quality
    """
    good = (table["quality"].to_numpy() & int(UNUSABLE)) == 0
    every = {n: table[n].cast(pl.Float64).fill_null(np.nan).to_numpy() for n in profile.columns}
    rows = _Rows(every, good & np.isfinite(every["surge"]) & np.isfinite(every["sway"]))
    asked = [*_wind(rows, profile), *_angles(rows, profile), *_commands(rows, profile)]
    if rows.moving.sum() < LEAST_ROWS:
        return asked
    if not _allows_speed(profile, rows.speed_quantile):
        froude = rows.speed_quantile / math.sqrt(GRAVITY * profile.ship.length_m)
        by = "velocity" if profile.sensors.velocity is not None else "position"
        asked.append(Asked("Froude number", froude, by))
    return [*asked, *_turning(rows, profile), *_propellers(rows, profile)]


class _Rows:
    """Columns [n] of a voyage, and which rows are good, moving, under way."""

    def __init__(self, columns: dict[str, np.ndarray], good: np.ndarray) -> None:
        self.columns = columns
        self.good = good
        self.speed = np.where(good, np.hypot(columns["surge"], columns["sway"]), 0.0)
        self.moving = good & (self.speed > MOVING)
        moving = self.speed[self.moving]
        self.speed_quantile = float(np.quantile(moving, QUANTILE)) if len(moving) else 0.0
        self.under_way = self.moving & (self.speed >= WORKING * self.speed_quantile)
        turned = np.full(len(good), np.nan)
        if len(good) > TURNING_ROWS:
            change = columns["heading"][TURNING_ROWS:] - columns["heading"][:-TURNING_ROWS]
            change = np.arctan2(np.sin(change), np.cos(change))
            turned[:-TURNING_ROWS] = np.abs(change) * RATE_HZ / TURNING_ROWS
        self.rate = turned  # rad/s, of the heading

    def of(self, name: str) -> np.ndarray:
        """[m] a column's values on the moving rows."""
        values = self.columns[name][self.moving]
        return values[np.isfinite(values)]


def _allows_speed(profile: Profile, speed: float) -> bool:
    """Whether the profile's own limits of the velocity allow this speed."""
    sensor = profile.sensors.velocity
    if sensor is None or sensor.limits is None:
        return False
    return speed <= max(abs(limit * sensor.scale()[0][1]) for limit in sensor.limits)


def _wind(rows: _Rows, profile: Profile) -> Iterator[Asked]:
    if not profile.has_wind:
        return
    speed = rows.columns["wind_speed"][rows.good]
    speed = speed[np.isfinite(speed)]
    if len(speed) >= LEAST_ROWS:
        yield Asked("apparent wind", float(np.quantile(speed, QUANTILE)), "wind")


def _angles(rows: _Rows, profile: Profile) -> Iterator[Asked]:
    """Rudders: beyond 180 deg; and hardly moved by a ship that turns and has no other means."""
    rudders = [one for one in profile.actuators if one.kind == "rudder" and one.si_unit == "rad"]
    alone = not any(one.kind in ("azimuth", "thruster") for one in profile.actuators)
    turning = rows.rate * profile.ship.length_m / np.maximum(rows.speed, MOVING)
    turns = rows.under_way & (turning > TURNS)
    for one in rudders:
        angle = np.abs(rows.of(one.name))
        if len(angle) < LEAST_ROWS:
            continue
        yield Asked("rudder at all", math.degrees(np.quantile(angle, QUANTILE)), one.name, one.name)
        moves = alone and rows.speed_quantile >= WAY and turns.sum() >= LEAST_ROWS
        if moves and angle.max() > 0.0:
            most = math.degrees(angle.max())
            yield Asked("rudder hard over", most, one.name, one.name, TURN)


def _commands(rows: _Rows, profile: Profile) -> Iterator[Asked]:
    for one in profile.actuators:
        if one.kind != "thruster" or (one.si_unit != "1" and one.limits is None):
            continue
        values = np.abs(rows.columns[one.name][rows.good])
        values = values[np.isfinite(values)]
        if len(values) >= LEAST_ROWS:
            full = _reach(one) if one.limits else 1.0
            yield Asked("command", float(np.quantile(values, QUANTILE)) / full, one.name, one.name)


def _turning(rows: _Rows, profile: Profile) -> Iterator[Asked]:
    """r L/U of a ship under way, with the rate of turn of its heading. One that turns on the spot
    says nothing of its length."""
    if rows.speed_quantile < WAY:
        return
    kept = rows.under_way & np.isfinite(rows.rate)
    if kept.sum() >= LEAST_ROWS:
        rate = rows.rate[kept] * profile.ship.length_m / rows.speed[kept]
        yield Asked("turning", float(np.quantile(rate, QUANTILE)), SHIP, of=TURN)


def _propellers(rows: _Rows, profile: Profile) -> Iterator[Asked]:
    surge = rows.columns["surge"]
    fast_enough = rows.under_way & (np.abs(surge) >= WORKING * rows.speed_quantile)
    steady = fast_enough & _steady(surge, rows.speed_quantile)
    mass, rho = profile.ship.mass_kg, density(profile)
    for one in profile.actuators:
        if one.kind != "propeller" or one.si_unit != "rev/s" or not one.diameter_m:
            continue
        turns = np.abs(np.nan_to_num(rows.columns[one.name]))
        fast = float(np.quantile(turns[rows.good], QUANTILE))
        if fast <= 0.0:
            continue
        if mass:
            thrust = K_T * rho * fast**2 * one.diameter_m**4
            yield Asked("thrust", thrust / (mass * GRAVITY), one.name, one.name)
        kept = steady & (turns > WORKING * fast) & _steady(turns, fast)
        if kept.sum() >= LEAST_ROWS:
            ratio = np.abs(surge[kept]) / (turns[kept] * one.diameter_m)
            yield Asked("advance ratio", float(np.median(ratio)), one.name, one.name, ("velocity",))


def _steady(values: np.ndarray, unit: float) -> np.ndarray:
    """[n] bool: rows about which a column changes by less than a share of `unit`."""
    half = STEADY_ROWS // 2
    change = np.full(len(values), np.inf)
    if len(values) > STEADY_ROWS:
        change[half:-half] = np.abs(values[2 * half :] - values[: -2 * half])
    return change < STEADY * unit
