"""How the columns of a table are called, and what one is taken for."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass, replace

import polars as pl

from shiplog.drafting import facts, words
from shiplog.logs.conversion.delimited import DelimitedTable
from shiplog.ship_profile.units_of_channels import MEASURE

# Channel: how its column is called (without unit), the surest names first, and its unit where
# nothing says one.
CHANNEL_COLUMNS = {
    "latitude": ((r"(.*_)?lat(itude)?",), "deg"),
    "longitude": ((r"(.*_)?(lon|lng|long|longitude)",), "deg"),
    "x0": ((r"x0|x_ned|x_north|north(ing)?|pos_?n(orth)?",
            r"x|x_?pos(ition)?(_mid)?|x_position\w*"), "m"),
    "y0": ((r"y0|y_ned|y_east|east(ing)?|pos_?e(ast)?",
            r"y|y_?pos(ition)?(_mid)?|y_position\w*"), "m"),
    "sog": ((r"sog|(gps|gnss)_speed(_over_ground)?|speed_over_ground|ground_?speed|gspeed",
             r"speed|(gps_|gnss_)?spd"), "m/s"),
    "cog": ((r"cog|(gps|gnss)_course(_over_ground)?|course_over_ground|track_made_good|"
             r"ground_?course|(gps_|gnss_)?gcrs", r"z?course|track"), "deg"),
    "velocity_north": ((r"v_?n(orth)?|(.*_)?vel_?n(orth)?|north_?vel\w*|velocity_?n(orth)?",
                        r"(.*_)?v_?x(_ned)?"), "m/s"),
    "velocity_east": ((r"v_?e(ast)?|(.*_)?vel_?e(ast)?|east_?vel\w*|velocity_?e(ast)?",
                       r"(.*_)?v_?y(_ned)?"), "m/s"),
    "surge": ((r"surge(_velo\w*)?|u|u_velo\w*|u_body|vx_body|body_?u",), "m/s"),
    "sway": ((r"sway(_velo\w*)?|vm?|vm?_velo\w*|v_body|vy_body|body_?v",), "m/s"),
    "heading": ((r"(true_)?(heading|hdg|hdt)(_true|_t)?|gyro(_heading)?",
                 r"psi(_hat)?|(att\w*_)?yaw|compass|(magnetic_|mag_)(heading|hdg)|(heading|hdg)_mag\w*|hdm",
                 r"(.*_)?(hdg|yaw|heading)"),
                "deg"),
    "yaw_rate": ((r"yaw_?rate|rate_?of_?turn|rot|r|r_angvelo\w*|turn_?rate|gyro_?z|psi_?dot",),
                 "deg/s"),
    "wind_speed": ((r"aws|(app\w*_|rel\w*_)?wind_?(speed|spd|velo\w*|rel(ative)?)"
                    r"(_rel\w*|_app\w*|_mid)*",), "m/s"),
    "wind_angle": ((r"awa|(app\w*_|rel\w*_)?wind_?(rel\w*_|app\w*_)?(dir\w*|angle)"
                    r"(_rel\w*|_app\w*|_mid)*",), "deg"),
}  # fmt: skip
SENSOR = {"latitude": "position", "longitude": "position", "sog": "velocity", "cog": "velocity",
          "heading": "heading", "yaw_rate": "yaw_rate"}  # fmt: skip
LOOSE = {  # what a channel's less sure names leave open
    "velocity_north": ("to the north, or ahead?",),
    "velocity_east": ("to the east, or to starboard?",),
    "sog": ("over ground?",), "x0": ("to the north?",), "y0": ("to the east?",),
}  # fmt: skip
FULL_TURN_RAD = 6.3  # a heading that never passes it may be in radians
HARD_OVER_RAD = 1.3  # and so may a rudder angle
NOTHING, IDLE = 2, 1  # no value at all; one that does not change, or in hardly any row
UNIT_UNSTATED = "unit not stated"
WIND = ("wind_speed", "wind_angle")


@dataclass(frozen=True, slots=True)
class FoundColumn:
    """A column and what it is taken for."""

    column: str
    channel: str
    unit: str | None
    doubts: tuple[str, ...] = ()  # what its line says to check
    unit_stated: bool = True
    sign: float = 1.0
    offset: float = 0.0
    only: str = ""  # the vessel whose rows are meant
    missing: tuple[int | str, ...] = ()  # values that stand for none; of a status, for no fix
    rank: tuple[int, ...] = ()  # the least is the most trusted
    why: str = ""  # what the offset is
    place: str = ""  # what the data say of where an actuator stands

    @property
    def empty(self) -> bool:
        """Whether it is known to hold no value."""
        return bool(self.rank and self.rank[0] == NOTHING)


def candidates(
    rows: pl.DataFrame, channel: str, taken: Collection[str], table: DelimitedTable
) -> list[FoundColumn]:
    """Columns called as a channel's and in a unit that it can have, the most trusted first.

    What holds nothing, set-points and derived values come last; of others the surest name first.
    """
    patterns, default = CHANNEL_COLUMNS[channel]
    found = []
    for name in rows.columns:
        values = rows[name]
        if name in taken or values.dtype == pl.Boolean:
            continue
        if channel in WIND and words.is_true_wind(name):
            continue
        sure = next((i for i, p in enumerate(patterns) if re.fullmatch(p, words.bare(name))), None)
        if sure is None:
            continue
        one = measured(values, channel, default, (MEASURE[channel],), table)
        if one is None:
            continue
        doubts, sure = _of_name(channel, name, sure)
        *first, instrument = words.trust(SENSOR.get(channel, ""), name)
        life = NOTHING if not facts.holds(channel, values) else facts.idle(values)
        doubts = (*doubts, "no value in it") if life == NOTHING else doubts
        doubts = (*doubts, "it never changes, or is hardly ever there") if life == IDLE else doubts
        rank = (life, *first, sure, instrument)
        found.append(with_doubts(one, *doubts, rank=rank))
    return sorted(found, key=lambda one: one.rank)


def _of_name(channel: str, name: str, sure: int) -> tuple[tuple[str, ...], int]:
    """What a name leaves open, and how sure it is, 0 being the surest."""
    if channel in WIND and not words.is_apparent(name):
        return ("apparent wind, or true?",), 1
    if channel == "heading" and words.is_magnetic(name):
        return ("magnetic, off by the variation",), 2
    return LOOSE.get(channel, ()) if sure else (), sure


def with_doubts(one: FoundColumn, *doubts: str, rank: tuple[int, ...] = ()) -> FoundColumn:
    """A column with more to check of it."""
    return replace(one, doubts=(*one.doubts, *doubts), rank=rank or one.rank)


def measured(
    values: pl.Series,
    channel: str,
    default: str,
    takes: tuple[str, ...],
    table: DelimitedTable,
) -> FoundColumn | None:
    """A column with its unit: the one it states, else the default where the values allow it.

    None where it states a unit of something else.
    """
    name = values.name
    fits, stated = words.stated(name, table.units.get(name, ""), takes)
    coordinate = channel in ("latitude", "longitude")
    if not fits and not (coordinate and words.unit_of(name) is None):
        return None
    doubts = ("a set-point, not a measurement",) if words.is_set_point(name) else ()
    if example := table.undecided.get(name):
        doubts = (*doubts, f'{example!r}: decimals, or thousands? Say decimal = "," or "."')
    if blank := facts.unavailable(channel, values):
        doubts = (*doubts, blank)
    if stated:
        return FoundColumn(name, channel, stated, doubts)
    unit = default
    if default == "deg" and values.dtype.is_numeric() and not coordinate:
        most = values.cast(pl.Float64).fill_nan(None).abs().max()
        limit = FULL_TURN_RAD if channel else HARD_OVER_RAD
        if isinstance(most, float) and 0 < most < limit:
            unit = "rad"
    unsure = () if coordinate else (UNIT_UNSTATED,)
    return FoundColumn(name, channel, unit, (*doubts, *unsure), unit_stated=coordinate)


def best(candidates_of: list[list[FoundColumn]], wind: bool) -> list[FoundColumn]:
    """One column of each list: of two, the pair that is trusted most and called most alike.

    A speed and a direction of two instruments are no wind, and of two words for it neither is.
    """
    if len(candidates_of) == 1:
        return [candidates_of[0][0]]
    firsts, seconds = candidates_of
    pairs = [
        (_of_pair(a, b, wind), i + j, a, b)
        for i, a in enumerate(firsts)
        for j, b in enumerate(seconds)
    ]
    _, _, a, b = min(pairs, key=lambda pair: pair[:2])
    if wind and a.rank[4] != b.rank[4]:
        a, b = (with_doubts(one, "speed and angle of one wind?") for one in (a, b))
    return [a, b]


def _of_pair(a: FoundColumn, b: FoundColumn, wind: bool) -> tuple[int, ...]:
    *sums, sure, instrument = (x + y for x, y in zip(a.rank, b.rank, strict=True))
    apart = _words(a.column) ^ _words(b.column)
    return (*sums, wind and a.rank[4] != b.rank[4], sure, len(apart), instrument)


def _words(name: str) -> set[str]:
    return set(re.findall(r"[a-z]+|\d+", words.parted(words.without_unit(name))))
