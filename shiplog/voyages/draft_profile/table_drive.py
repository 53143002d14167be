"""What a table says of its thrusters: their neutral pulse, and which way they push."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import polars as pl

from shiplog.voyages.draft_profile import words
from shiplog.voyages.draft_profile.column_names import FoundColumn, with_doubts
from shiplog.voyages.draft_profile.driven import NEUTRAL_US
from shiplog.voyages.draft_profile.table_motion import Chosen, seconds_of, values_of

ZERO = re.compile(r"zero|neutral|trim")
NEAR_US = 100.0  # of 1500 µs: a neutral pulse is no further off
RESTS = 0.1  # of the rows: a pulse that stands in so many is where the stick rests
RESPONSE_S = 4.0  # s: how long a small boat takes to gather way
SHOWN = 0.3  # correlation of a command with what follows it: with less nothing is shown
FEWEST = 200  # rows that are compared
Driven = list[tuple[str, FoundColumn]]


def by_response(
    actuators: Driven, chosen: Chosen, labels: list[FoundColumn], rows: pl.DataFrame
) -> Driven:
    """The actuators with the neutral pulses that the table states or shows, and with the signs of
    thrusters that push astern where their numbers grow."""
    actuators = [(kind, _neutral(one, rows)) for kind, one in actuators]
    seconds = seconds_of(labels, rows)
    speed = _speed(chosen, rows)
    if seconds is None or speed is None or rows.height < FEWEST:
        return [(kind, _unshown(kind, one)) for kind, one in actuators]
    rate = next((values_of(fs[0], rows) for name, _, fs in chosen if name == "yaw_rate"), None)
    found = []
    pushes = [
        (kind, one, _follows(seconds, values_of(one, rows), speed)) for kind, one in actuators
    ]
    several = sum(kind == "thruster" for kind, _, _ in pushes) > 1
    for kind, one, ahead in pushes:
        if kind not in ("thruster", "propeller"):
            found.append((kind, one))
            continue
        if abs(ahead) < SHOWN:
            found.append((kind, _unshown(kind, one)))
            continue
        if ahead < 0.0:
            one = with_doubts(replace(one, sign=-one.sign), "less of it drives ahead")
        if several and kind == "thruster" and rate is not None:
            turns = _follows(seconds, values_of(one, rows), rate)
            side = "starboard" if turns < 0.0 else "port"
            where = f"it turns the bow as one to {side} does" if abs(turns) > SHOWN / 2.0 else ""
            one = replace(one, place=where)
        found.append((kind, one))
    return found


def _unshown(kind: str, one: FoundColumn) -> FoundColumn:
    if kind != "thruster" or one.unit != "pwm":
        return one
    return with_doubts(one, "does more of it drive ahead? else sign = -1.0")


def _neutral(one: FoundColumn, rows: pl.DataFrame) -> FoundColumn:
    """A servo's neutral pulse: of a column that says it, else where the pulse rests."""
    if one.unit != "pwm" or one.offset != NEUTRAL_US:
        return one
    own = set(re.findall(r"[a-z]+|\d+", words.parted(one.column)))
    for name in rows.columns:
        other = set(re.findall(r"[a-z]+|\d+", words.parted(name)))
        if not ZERO.search(name.lower()) or not own <= other or not rows[name].dtype.is_numeric():
            continue
        stated = rows[name].cast(pl.Float64).fill_nan(None).drop_nulls()
        if len(stated) and stated.n_unique() == 1 and abs(stated[0] - NEUTRAL_US) <= NEAR_US:
            why = f"the neutral pulse, of the column {name}"
            return with_doubts(replace(one, offset=float(stated[0]), why=why), why)
    pulses = rows[one.column].cast(pl.Float64).fill_nan(None).drop_nulls().round()
    near = pulses.filter((pulses - NEUTRAL_US).abs() <= NEAR_US)
    if len(near):
        often = near.value_counts(sort=True, name="rows").row(0)
        if often[1] >= RESTS * len(pulses):
            why = f"the neutral pulse, where it stands in {often[1] / len(pulses):.0%} of the rows"
            return with_doubts(replace(one, offset=float(often[0]), why=why), why)
    return with_doubts(one, "the neutral pulse")


def _speed(chosen: Chosen, rows: pl.DataFrame) -> np.ndarray | None:
    """Speed ahead, or over ground where nothing says which way; m/s."""
    for name, kind, columns in chosen:
        if name == "velocity" and kind in ("body", "sog_cog"):
            return values_of(columns[0], rows)
    return None


def _follows(seconds: np.ndarray, command: np.ndarray, motion: np.ndarray) -> float:
    """Correlation of a command with the motion's change in the RESPONSE_S after it."""
    step = float(np.median(np.diff(seconds)))
    after = max(round(RESPONSE_S / step), 1) if step > 0 else 1
    if len(command) <= 2 * after:
        return 0.0
    mean = np.convolve(np.nan_to_num(command), np.ones(after) / after, "valid")[:-1]
    change = motion[after:] - motion[:-after]
    count = min(len(mean), len(change))
    mean, change = mean[:count], change[:count]
    whole = np.isfinite(change) & (
        seconds[after : after + count] - seconds[:count] < 2 * RESPONSE_S
    )
    if whole.sum() < FEWEST:
        return 0.0
    a, b = mean[whole] - mean[whole].mean(), change[whole] - change[whole].mean()
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size > 0.0 else 0.0
