"""A profile from the columns of a table: [ship], [sensors], [[actuators]] and [table]."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from shiplog import units
from shiplog.exceptions import ProfileError, ShiplogError, listed
from shiplog.logs.conversion import clock
from shiplog.logs.conversion.columns import busiest, text_of
from shiplog.logs.conversion.delimited import DelimitedTable, read_table
from shiplog.profile import TABLE_CHANNELS
from shiplog.voyages.draft_profile import facts, words
from shiplog.voyages.draft_profile.topics import NO_ACTUATOR

# Channel: how its column is called (without unit), its unit, and what its unit may be.
CHANNEL_COLUMNS = {
    "latitude": (r"(.*_)?lat(itude)?", "deg"),
    "longitude": (r"(.*_)?(lon|lng|long|longitude)", "deg"),
    "x0": (r"x0?|x_?pos(ition)?(_mid)?|x_position\w*|x_ned|x_north|north(ing)?|pos_?n(orth)?", "m"),
    "y0": (r"y0?|y_?pos(ition)?(_mid)?|y_position\w*|y_ned|y_east|east(ing)?|pos_?e(ast)?", "m"),
    "sog": (r"sog|(gps_|gnss_)?speed(_over_ground)?|ground_?speed|spd|gspeed", "m/s"),
    "cog": (r"cog|(gps_|gnss_)?course(_over_ground)?|track(_made_good)?|ground_?course|z?course",
            "deg"),
    "velocity_north": (r"v_?n(orth)?|vel_?n(orth)?|north_?vel\w*|velocity_?n(orth)?|vel_n_m_s",
                       "m/s"),
    "velocity_east": (r"v_?e(ast)?|vel_?e(ast)?|east_?vel\w*|velocity_?e(ast)?|vel_e_m_s", "m/s"),
    "surge": (r"surge(_velo\w*)?|u|u_velo\w*|u_body|vx_body|body_?u", "m/s"),
    "sway": (r"sway(_velo\w*)?|vm?|vm?_velo\w*|v_body|vy_body|body_?v", "m/s"),
    "heading": (r"(true_)?(heading|hdg|hdt)(_true|_t)?|psi(_hat)?|yaw|gyro(_heading)?|compass",
                "deg"),
    "yaw_rate": (r"yaw_?rate|rate_?of_?turn|rot|r|r_angvelo\w*|turn_?rate|gyro_?z|psi_?dot",
                 "deg/s"),
    "wind_speed": (r"aws|(app\w*_|rel\w*_)?wind_?(speed|velo\w*|rel(ative)?)(_rel\w*|_app\w*"
                   r"|_mid)*", "m/s"),
    "wind_angle": (r"awa|(app\w*_|rel\w*_)?wind_?(rel\w*_|app\w*_)?(dir\w*|angle)(_rel\w*|_app\w*"
                   r"|_mid)*", "deg"),
}  # fmt: skip
ACTUATOR_COLUMNS = (  # kind, how its column is called, the unit where nothing says one
    ("azimuth", r"(.*_)?(azimuth|azi|pod)(_?angle)?(_?\w+)?", "deg"),
    ("rudder", r"(.*_)?(rudder|delta|steering)(_?angle)?(_?\w+)?", "deg"),
    ("propeller", r"(.*_)?(rpm|rps|n_prop|prop\w*|shaft\w*|revs?)(_\w+|\d)?|n_?\d?", "rps"),
    ("thruster", r"(thr\w*|throttle\w*|pwm\w*|motor\w*|esc\w*|servo\w*)", "1"),
)
LABEL_COLUMNS = {  # how a label's column is called
    "time": r"t(_(s|sec|ms|us|ns|utc))?|time\w*|stamp\w*|utc\w*|(base_?)?date_?time|epoch\w*|"
            r"unix\w*|.*_timestamp|(gps|gnss|log|rec)_?time\w*",
    "date": r"date(_utc)?|day|(gps|gnss|utc)_?date",
    "voyage": r"run(_?(id|no|number|name))?|voyage(_\w+)?|trial(_\w+)?|test(_?(id|no|number))|"
              r"trip(_\w+)?|sequence",
    "vessel": r"mmsi|imo(_number)?|vessel(_?\w+)?|ship(_?(id|name))?|call_?sign",
}  # fmt: skip
SINGLE = {  # where the contract puts a sensor of a table: topic, fields, units
    ("position", "geodetic"): ("/gnss/fix", ("latitude", "longitude"), ("deg",)),
    ("position", "local"): ("/ship/state", ("x0_m", "y0_m"), ("m",)),
    ("velocity", "sog_cog"): ("/gnss/velocity", ("sog_mps", "cog_deg"), ("m/s", "deg")),
    ("velocity", "ned"): ("/gnss/velocity_ned", ("north_mps", "east_mps"), ("m/s",)),
    ("velocity", "body"): ("/ship/state", ("surge_mps", "sway_mps"), ("m/s",)),
    ("heading", "angle"): ("/gyro", ("heading_deg",), ("deg",)),
    ("yaw_rate", "rate"): ("/gyro", ("yaw_rate_degps",), ("deg/s",)),
    ("wind", "from_bow"): ("/wind/apparent", ("speed_mps", "direction_deg"), ("m/s", "deg")),
}
FIELDS = {"rudder": ("angle_deg", "deg"), "azimuth": ("angle_deg", "deg"),
          "propeller": ("speed_rps", "rps"), "thruster": ("command", None)}  # fmt: skip
TURNING = ("deg/s", "rad/s", "deg/min")
FULL_TURN_RAD = 6.3  # a heading that never passes it may be in radians
HARD_OVER_RAD = 1.3  # and so may a rudder angle
PULSES_US = (800.0, 2200.0)  # a servo's pulses, neutral in the middle
NO_ACTUATION = re.compile(r"thrust_n|torque|force|power|current|voltage|temp|zero|neutral|_kw|load")
TWINS = 0.99999  # correlation of two columns that hold one value twice
RATES_HZ = (0.02, 100.0)  # how often a ship's motion is recorded


@dataclass(frozen=True, slots=True)
class FoundColumn:
    """A column and what it is taken for."""

    column: str
    channel: str
    unit: str | None
    check: str = ""
    more: str = ""  # further keys of its line in [table]


def draft_table(path: Path, vessel: str | None = None) -> str:
    """TOML text of a profile for a table.

    vessel  which ship, where a column tells several apart

    Raises ChannelMissing for what is no table, and ProfileError where there are several vessels
    and none is chosen.
    """
    table = read_table(path)
    frame = table.frame
    labels = _labels(table, path, vessel)
    rows = frame
    for label in labels:
        if label.channel == "vessel" and vessel is not None:
            rows = frame.filter(text_of(frame[label.column]) == vessel)
    taken = {f.column for f in labels}
    rows = _of_numbers(rows, taken)
    found: dict[str, list[FoundColumn]] = {}
    for channel, (pattern, unit) in CHANNEL_COLUMNS.items():
        names = _matching(frame, pattern, channel, taken)
        found[channel] = [_found(rows[n], channel, unit, table) for n in names]
    _choose_turning(found, labels, rows)
    chosen, second = _kinds(found)
    taken |= {f.column for _, _, columns in chosen for f in columns}
    taken |= {f.column for columns in found.values() for f in columns}
    actuators = _actuators(rows, table, taken)
    parts = [
        f"# Drafted from {path.name}, {rows.height} rows. Look over every line that says CHECK.\n\n"
        f'[ship]\nname = "{vessel or path.stem}"\nlength_m = 1.0  # CHECK: the table does not say\n'
    ]
    parts += [_sensor(name, kind) for name, kind, _ in chosen]
    there = {name for name, _, _ in chosen}
    for name in ("position", "velocity", "heading", "yaw_rate", "wind"):
        if name not in there:
            optional = name in ("yaw_rate", "wind")
            does = "; shiplog does without it" if optional else ", and shiplog needs one"
            parts.append(f"# No {name} was recognised{does}.\n")
    parts += [_actuator(kind, one) for kind, one in actuators] or [NO_ACTUATOR]
    listed_columns = [*labels, *(f for *_, fs in chosen for f in fs), *(f for _, f in actuators)]
    parts.append(_table(listed_columns, rows, second))
    mentioned = {f.column for f in (*listed_columns, *second)}
    if unused := [n for n in frame.columns if n not in mentioned]:
        parts.append("# Columns not used: " + listed(unused, most=60) + "\n")
    return "\n".join(parts)


def _of_numbers(rows: pl.DataFrame, labels: set[str]) -> pl.DataFrame:
    """Columns of numbers with a word among them as numbers; `convert` leaves the words out, too."""
    numbers = []
    for values in rows:
        if values.dtype == pl.String and values.name not in labels:
            number = clock.number_of(values)
            if number.null_count() < len(number) / 2:
                numbers.append(number)
    return rows.with_columns(numbers)


def _matching(frame: pl.DataFrame, pattern: str, channel: str, taken: Iterable[str]) -> list[str]:
    """Columns called so, set-points and derived values last, then in the table's order."""
    names = [
        n for n in frame.columns
        if n not in taken and re.fullmatch(pattern, words.bare(n)) and frame[n].dtype != pl.Boolean
    ]  # fmt: skip
    return sorted(names, key=lambda n: words.trust(channel, n)[:3])


def _labels(table: DelimitedTable, path: Path, vessel: str | None) -> list[FoundColumn]:
    frame = table.frame
    labels: list[FoundColumn] = []
    for channel, pattern in LABEL_COLUMNS.items():
        names = [n for n in frame.columns if re.fullmatch(pattern, words.bare(n))]
        if channel == "time":
            names = [n for n in frame.columns if isinstance(frame[n].dtype, pl.Datetime)] + names
        if channel in ("voyage", "vessel"):
            names = [n for n in names if 1 < frame[n].n_unique() < frame.height / 2]
        if not names:
            continue
        values = frame[names[0]]
        if channel == "time":
            labels.append(_time(values, table))
        elif channel == "vessel":
            ships = text_of(values)
            if vessel is None or vessel not in ships:
                raise ProfileError(
                    f"{path.name} holds {ships.n_unique()} vessels in {names[0]!r}"
                    f"{'' if vessel is None else f', and none is {vessel}'}: {busiest(ships)}.",
                    hint="say which with --vessel.",
                )
            labels.append(FoundColumn(names[0], channel, None, more=f'only = "{vessel}"'))
        else:
            labels.append(FoundColumn(names[0], channel, None))
    return labels


def _time(values: pl.Series, table: DelimitedTable) -> FoundColumn:
    """The column of times; a unit only where its size does not say it."""
    try:
        times = clock.instants(values)
        check = "" if times.null_count() < len(times) else "CHECK: no time was understood"
        naive = not isinstance(values.dtype, pl.Datetime) or values.dtype.time_zone is None
        if check == "" and values.dtype in (pl.String, pl.Datetime) and naive:
            text = str(values.drop_nulls().head(1).to_list())
            check = "" if "Z" in text or "+" in text else "CHECK: taken as UTC"
        return FoundColumn(values.name, "time", None, check)
    except ShiplogError as error:
        if values.dtype.is_numeric():
            step = clock.typical(values.cast(pl.Float64).diff())
            for unit, per in clock.UNIX:
                if step and RATES_HZ[0] <= per / step <= RATES_HZ[1]:
                    return FoundColumn(values.name, "time", unit, "CHECK: of the step between rows")
        return FoundColumn(values.name, "time", None, f"CHECK: {error.message}")


def _found(values: pl.Series, channel: str, default: str, table: DelimitedTable) -> FoundColumn:
    """A column with its unit: the one it states, else the default where the values allow it."""
    stated = words.unit_of(values.name) or words.spelled(table.units.get(values.name, ""))
    check = "CHECK: a set-point, not a measurement" if words.is_set_point(values.name) else ""
    if stated:
        return FoundColumn(values.name, channel, stated, check)
    unit = default
    if default in ("deg", "deg/s") and values.dtype.is_numeric() and channel not in (
        "latitude", "longitude",
    ):  # fmt: skip
        most = values.cast(pl.Float64).fill_nan(None).abs().max()
        limit = FULL_TURN_RAD if channel else HARD_OVER_RAD
        if isinstance(most, float) and 0 < most < limit and default == "deg":
            unit = "rad"
    sure = channel in ("latitude", "longitude")
    return FoundColumn(
        values.name, channel, unit, check or ("" if sure else "CHECK: unit not stated")
    )


def _choose_turning(
    found: dict[str, list[FoundColumn]], labels: list[FoundColumn], rows: pl.DataFrame
) -> None:
    """The unit of a yaw rate that states none: the one that fits how fast the heading turns."""
    time = next((f for f in labels if f.channel == "time"), None)
    rates, headings = found["yaw_rate"], found["heading"]
    if time is None or not rates or not headings or "unit" not in rates[0].check:
        return
    if not all(rows[f.column].dtype.is_numeric() for f in (rates[0], headings[0])):
        return
    try:
        seconds = clock.instants(rows[time.column], time.unit).cast(pl.Float64).to_numpy() * 1e-9
    except ShiplogError:
        return
    to_rad = units.factor(headings[0].unit or "deg")
    heading = rows[headings[0].column].cast(pl.Float64).to_numpy() * to_rad
    rate = np.abs(rows[rates[0].column].cast(pl.Float64).to_numpy())
    with np.errstate(all="ignore"):
        turned = np.abs(np.angle(np.exp(1j * np.diff(heading)))) / np.diff(seconds)
        # Medians: a table of several runs jumps between them.
        ratio = float(np.nanmedian(rate[1:]) / np.nanmedian(turned))
    if not np.isfinite(ratio) or ratio <= 0:
        return
    unit = min(TURNING, key=lambda u: abs(np.log(ratio * units.factor(u))))
    check = "CHECK: the unit fits how fast the heading turns"
    found["yaw_rate"][0] = replace(rates[0], unit=unit, check=check)


def _kinds(
    found: dict[str, list[FoundColumn]],
) -> tuple[list[tuple[str, str, list[FoundColumn]]], list[FoundColumn]]:
    """The kind of each sensor whose columns are all there, GNSS first; and the second choices."""
    chosen: list[tuple[str, str, list[FoundColumn]]] = []
    second: list[FoundColumn] = []
    for (name, kind), channels in TABLE_CHANNELS.items():
        if (name, kind) not in SINGLE or not all(found.get(c) for c in channels):
            continue
        columns = [found[c][0] for c in channels]
        if name in {n for n, _, _ in chosen}:
            second += columns
        else:
            chosen.append((name, kind, columns))
            second += [f for c in channels for f in found[c][1:2]]
    used = {f.column for _, _, columns in chosen for f in columns}
    return chosen, [f for f in second if f.column not in used]


def _sensor(name: str, kind: str) -> str:
    topic, fields, unit_names = SINGLE[name, kind]
    quoted = ", ".join(f'"{f}"' for f in fields)
    lines = [f"[sensors.{name}]", f'kind = "{kind}"', f'topic = "{topic}"']
    lines.append(f"fields = [{quoted}]" if len(fields) > 1 else f"field = {quoted}")
    if len(unit_names) == 1:
        lines.append(f'unit = "{unit_names[0]}"')
    else:
        lines.append("units = [" + ", ".join(f'"{u}"' for u in unit_names) + "]")
    if name in ("position", "velocity"):
        lines.append("lever_arm_m = [0.0, 0.0]  # CHECK: antenna ahead and to starboard of midship")
    return "\n".join(lines) + "\n"


def _actuators(
    rows: pl.DataFrame, table: DelimitedTable, taken: set[str]
) -> list[tuple[str, FoundColumn]]:
    """Measured ones; orders only of a kind that nothing measured."""
    actuators: list[tuple[str, FoundColumn]] = []
    taken, names = set(taken), set()
    for ordered in (False, True):
        kinds = {kind for kind, _ in actuators}
        for kind, pattern, unit in ACTUATOR_COLUMNS:
            for column in rows.columns:
                if column in taken or (ordered and kind in kinds):
                    continue
                if not rows[column].dtype.is_numeric() or words.is_derived(column):
                    continue
                if words.is_set_point(column) != ordered or NO_ACTUATION.search(column.lower()):
                    continue
                if not re.fullmatch(pattern, words.bare(column)):
                    continue
                taken.add(column)
                if any(_twins(rows, column, one.column) for k, one in actuators if k == kind):
                    continue
                one = _found(rows[column], "", unit, table)
                name = re.sub(r"\W+", "_", words.bare(column)) or kind
                name = f"{kind}_{name}" if name[:1].isdigit() or len(name) < 2 else name
                while name in names:
                    name += "_2"
                names.add(name)
                actuators.append(
                    (kind, _pulsed(FoundColumn(column, name, one.unit, one.check), rows))
                )
    return actuators


def _twins(rows: pl.DataFrame, one: str, other: str) -> bool:
    """Whether two columns are the same value in two units or signs."""
    alike = rows.select(pl.corr(pl.col(one).cast(pl.Float64), pl.col(other).cast(pl.Float64)))
    return abs(alike.item() or 0.0) > TWINS


def _pulsed(one: FoundColumn, rows: pl.DataFrame) -> FoundColumn:
    """A thruster that is given in servo pulses."""
    low, high = rows[one.column].min(), rows[one.column].max()
    if one.unit != "1" or not isinstance(low, (int, float)) or not isinstance(high, (int, float)):
        return one
    if not PULSES_US[0] <= low <= high <= PULSES_US[1]:
        return one
    return replace(one, unit="pwm", check="CHECK: the neutral pulse", more="offset = 1500.0")


DIMENSIONS = {  # of an actuator, which only physical models ask for
    "rudder": "# area_m2 = 0.0  # CHECK: estimated by train --model mmg where left out\n"
    "# span_m = 0.0  # CHECK: likewise\n",
    "propeller": "# diameter_m = 0.0  # CHECK: train --model mmg needs it\n",
}


def _actuator(kind: str, one: FoundColumn) -> str:
    field, unit = FIELDS[kind]
    offset = "offset = 1500.0  # CHECK: the neutral pulse\n" if one.unit == "pwm" else ""
    return (
        f'[[actuators]]\nname = "{one.channel}"\nkind = "{kind}"\n'
        f'topic = "/{kind}/{one.channel}"\nfield = "{field}"\nunit = "{unit or one.unit}"\n{offset}'
        "position_m = [0.0, 0.0]  # CHECK: ahead and to starboard of midship\n"
        f"{DIMENSIONS.get(kind, '')}"
    )


def _table(columns: list[FoundColumn], rows: pl.DataFrame, second: list[FoundColumn]) -> str:
    lines = ["[table]"]
    if not any(f.channel == "time" for f in columns):
        lines.append(
            '# No time was recognised. "COLUMN" = { channel = "time", unit = "s" }  # CHECK'
        )
    lines += [_line(one, rows) for one in columns]
    lines += ["# Second choice: " + _line(one, rows) for one in second]
    return "\n".join(lines) + "\n"


def _line(one: FoundColumn, rows: pl.DataFrame) -> str:
    unit = f', unit = "{one.unit}"' if one.unit else ""
    more = f", {one.more}" if one.more else ""
    check = f"{one.check}; " if one.check else ""
    key = one.column.replace("\\", "\\\\").replace('"', '\\"')
    what = facts.of_values(rows[one.column])
    if one.channel == "time":
        what = f"{what}; {_rate(rows[one.column], one.unit)}"
    return f'"{key}" = {{ channel = "{one.channel}"{unit}{more} }}  # {check}{what}'


def _rate(values: pl.Series, unit: str | None) -> str:
    try:
        return facts.of_times(clock.instants(values, unit).drop_nulls()).replace("messages", "rows")
    except ShiplogError:
        return f"{len(values)} rows"
