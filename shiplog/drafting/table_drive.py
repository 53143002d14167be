"""What a table says of its thrusters: their neutral pulse, and which way they push."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import polars as pl

from shiplog.drafting import words
from shiplog.drafting.column_names import FoundColumn, with_doubts
from shiplog.drafting.driven import NEUTRAL_US
from shiplog.drafting.table_motion import Chosen, seconds_of, values_of

ZERO = re.compile(r"zero|neutral|trim")
NEAR_US = 100.0  # of 1500 µs: a neutral pulse is no further off
RESTS = 0.1  # of the rows: a pulse that stands in so many is where the stick rests
RESPONSE_S = 3.0  # s: within which a small boat gathers way
SHOWN = 0.3  # correlation of a command with what follows it: with less nothing is shown
SURE = 5.0  # standard deviations of a correlation of so many changes that have none
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
    driving = [at for at, (kind, _) in enumerate(actuators) if kind == "thruster"]
    commands = [values_of(actuators[at][1], rows) for at in driving]
    ahead = dict(zip(driving, _follow(seconds, commands, speed), strict=True))
    turns = dict.fromkeys(driving, 0.0)
    if rate is not None and len(driving) > 1:
        turns = dict(zip(driving, _follow(seconds, commands, rate), strict=True))
    found = []
    for at, (kind, one) in enumerate(actuators):
        if abs(ahead.get(at, 0.0)) < SHOWN:
            found.append((kind, _unshown(kind, one)))
            continue
        if ahead[at] < 0.0:
            one = with_doubts(replace(one, sign=-one.sign), "less of it drives ahead")
        if abs(turns[at]) >= SHOWN:
            side = "starboard" if turns[at] * ahead[at] < 0.0 else "port"
            one = replace(one, place=f"it turns the bow as a thruster to {side} does")
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
    counts = near.value_counts(sort=True, name="rows").rows()
    rests = [(pulse, rows) for pulse, rows in counts if rows >= RESTS * len(pulses)]
    if rests:
        pulse, often = min(rests, key=lambda one: abs(one[0] - NEUTRAL_US))
        why = f"the neutral pulse, where it stands in {often / len(pulses):.0%} of the rows"
        return with_doubts(replace(one, offset=float(pulse), why=why), why)
    return with_doubts(one, "the neutral pulse")


def _speed(chosen: Chosen, rows: pl.DataFrame) -> np.ndarray | None:
    """Speed ahead, or over ground where nothing says which way; m/s."""
    for name, kind, columns in chosen:
        if name == "velocity" and kind in ("body", "sog_cog"):
            return values_of(columns[0], rows)
    return None


def _follow(seconds: np.ndarray, commands: list[np.ndarray], motion: np.ndarray) -> list[float]:
    """Partial correlation of each command with the motion's change in the RESPONSE_S from its mean
    on, 0 where chance could make it: the others, and the motion that is there already, are taken
    out of both by least squares."""
    step = float(np.median(np.diff(seconds)))
    after = max(round(RESPONSE_S / step), 1) if step > 0 else 1
    count = len(motion) - after
    if count < FEWEST:
        return [0.0] * len(commands)
    ones = np.ones(after + 1) / (after + 1)
    means = [np.convolve(np.nan_to_num(one), ones, "valid") for one in commands]
    columns = np.stack([*means, motion[:count], np.ones(count)], axis=1)
    change = motion[after:] - motion[:count]
    whole = seconds[after:] - seconds[:count] < 2.0 * RESPONSE_S
    whole &= np.isfinite(change) & np.isfinite(columns).all(axis=1)
    if whole.sum() < FEWEST:
        return [0.0] * len(commands)
    columns, change = columns[whole], change[whole]
    apart = float(np.sum(whole)) * step / RESPONSE_S  # changes that do not overlap
    found = []
    for at in range(len(commands)):
        others = np.delete(columns, at, axis=1)
        both = np.stack((columns[:, at], change), axis=1)
        alone = both - others @ np.linalg.lstsq(others, both, rcond=None)[0]
        size = float(np.prod(np.linalg.norm(alone, axis=0)))
        alike = float(alone[:, 0] @ alone[:, 1]) / size if size > 0.0 else 0.0
        found.append(alike if abs(alike) * apart**0.5 > SURE else 0.0)
    return found
