"""Units and signs of a table's columns, by the motion that its other columns show."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import polars as pl

from shiplog.drafting.column_names import UNIT_UNSTATED, FoundColumn, with_doubts
from shiplog.drafting.motion import Motion
from shiplog.exceptions import ShiplogError
from shiplog.logs.conversion import cells, clock
from shiplog.nomenclature import units

METRE = 111_320.0  # m, a degree of latitude
APART_S = 1e4  # s between two voyages of one table, whose times begin again
ROWS = 50  # positions that are compared
TURNS = 3.0  # times as far to the next position as to the one after it: a ship goes on
Chosen = list[tuple[str, str, list[FoundColumn]]]


def seconds_of(labels: list[FoundColumn], rows: pl.DataFrame) -> np.ndarray | None:
    """When each row was [n] s, voyages one after another; None where no time is understood."""
    label = next((f for f in labels if f.channel == "time"), None)
    if label is None:
        return None
    try:
        instants = clock.instants(rows[label.column], label.unit)
    except clock.DateOpen as which:
        instants = which.either  # how fast a ship goes does not depend on its date
    except ShiplogError:
        return None
    time = instants.cast(pl.Float64).to_numpy() * 1e-9
    if not np.isfinite(time).all() or len(time) < 2:
        return None
    steps = np.diff(time)
    return np.concatenate(([0.0], np.cumsum(np.where(steps < 0.0, APART_S, steps))))


def values_of(one: FoundColumn, rows: pl.DataFrame) -> np.ndarray:
    """A column in SI [n], a coordinate in deg; NaN where it holds no number."""
    column = rows[one.column]
    number = clock.number_of(column) if column.dtype == pl.String else column
    if one.channel in cells.HEMISPHERES and column.dtype == pl.String:
        letters, farthest = cells.HEMISPHERES[one.channel], cells.FARTHEST_DEG[one.channel]
        number = number.fill_null(cells.coordinates(column, letters, farthest))
    raw = number.cast(pl.Float64, strict=False).fill_null(math.nan).to_numpy()
    factor = 1.0 if one.channel in ("latitude", "longitude") else units.factor(one.unit or "1")
    return (raw - one.offset) * one.sign * factor


def by_motion(chosen: Chosen, labels: list[FoundColumn], rows: pl.DataFrame) -> Chosen:
    """The sensors, with the units and signs in which they agree with each other."""
    time = seconds_of(labels, rows)
    if time is None:
        return chosen
    sensors = {name: columns for name, _, columns in chosen}
    motion = Motion(time, _place(sensors.get("position", []), rows), np.zeros(0), np.zeros(0))
    found = {}
    if "heading" in sensors:
        found["heading"] = [_angled(sensors["heading"][0], time, rows, motion)]
        motion = replace(motion, heading_time=time, heading=values_of(found["heading"][0], rows))
    if "velocity" in sensors:
        found["velocity"] = _moving(sensors["velocity"], time, rows, motion)
    if "yaw_rate" in sensors:
        found["yaw_rate"] = [_turning(sensors["yaw_rate"][0], time, rows, motion)]
    return [(name, kind, found.get(name, columns)) for name, kind, columns in chosen]


def _place(columns: list[FoundColumn], rows: pl.DataFrame) -> np.ndarray:
    """North and east [n, 2] m; NaN where there is none."""
    if len(columns) != 2:
        return np.zeros((rows.height, 2)) * np.nan
    place = np.stack([values_of(one, rows) for one in columns], axis=1)
    if columns[0].channel == "latitude":
        place[(place == 0.0).all(axis=1)] = np.nan
        middle = np.nanmedian(place, axis=0) if np.isfinite(place).any() else np.zeros(2)
        place = (place - middle) * METRE * np.array([1.0, math.cos(math.radians(middle[0]))])
    return place


def _raw(one: FoundColumn, rows: pl.DataFrame) -> np.ndarray:
    return values_of(replace(one, unit=None, sign=1.0), rows)


def settled(one: FoundColumn, unit: str, sign: float, how: str) -> FoundColumn:
    """A column in the unit that the motion shows: where another is stated, that is to be checked,
    and not changed."""
    if one.unit_stated:
        if one.unit == unit and one.sign * sign > 0:
            return one
        turned = "" if one.sign * sign > 0 else ", turned round"
        return with_doubts(one, f"{how} as if it were in {unit}{turned}")
    doubts = tuple(d for d in one.doubts if d != UNIT_UNSTATED)
    return replace(one, unit=unit, doubts=(*doubts, f"unit not stated; in {unit} it fits {how}"))


def _angled(one: FoundColumn, time: np.ndarray, rows: pl.DataFrame, motion: Motion) -> FoundColumn:
    found = motion.angle(time, _raw(one, rows))
    if found is None:
        return one
    unit, factor = found
    one = settled(one, unit, 1.0, "the way")
    return replace(one, sign=factor) if factor != 1.0 and not one.unit_stated else one


def _moving(
    columns: list[FoundColumn], time: np.ndarray, rows: pl.DataFrame, motion: Motion
) -> list[FoundColumn]:
    """Speed and course, or the components of a velocity."""
    how = "how fast the position changes"
    if columns[0].channel == "sog":
        speed, course = columns
        unit = motion.speed(time, _raw(speed, rows))
        speed = settled(speed, unit, 1.0, how) if unit else speed
        return [speed, _angled(course, time, rows, motion)]
    unit = motion.speed(time, np.hypot(*(_raw(one, rows) for one in columns)))
    return [settled(one, unit, 1.0, how) for one in columns] if unit else columns


def _turning(one: FoundColumn, time: np.ndarray, rows: pl.DataFrame, motion: Motion) -> FoundColumn:
    found = motion.turning(time, _raw(one, rows))
    if found is None:
        return one
    unit, sign = found
    doubts = one.doubts if one.unit_stated else tuple(d for d in one.doubts if "fits" not in d)
    one = settled(replace(one, doubts=doubts), unit, 1.0, "how fast the heading turns")
    if sign > 0.0:
        return one
    return with_doubts(replace(one, sign=-1.0), "it turns against the heading, and is turned round")


def taking_turns(
    chosen: Chosen, labels: list[FoundColumn], rows: pl.DataFrame
) -> list[FoundColumn]:
    """The labels, with a question at the time where two sources take turns in the rows: every
    second position is near the one before the last, and not near the last."""
    position = next((columns for name, _, columns in chosen if name == "position"), [])
    place = _place(position, rows)
    place = place[np.isfinite(place).all(axis=1)]
    if len(place) < ROWS:
        return labels
    next_one, second = (
        float(np.median(np.linalg.norm(place[by:] - place[:-by], axis=1))) for by in (1, 2)
    )
    if next_one <= TURNS * second or next_one == 0.0:
        return labels
    doubt = (
        f"two receivers take turns, {next_one:.3g} m apart: is this one ship's table? Leave the "
        "rows of one"
    )
    return [with_doubts(one, doubt) if one.channel == "time" else one for one in labels]
