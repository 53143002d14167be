"""A profile from the columns of a table: [ship], [sensors], [[actuators]] and [table]."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.drafting import accuracy, facts, particulars, table_drive, table_motion, words
from shiplog.drafting.column_names import (
    CHANNEL_COLUMNS,
    UNIT_UNSTATED,
    FoundColumn,
    best,
    candidates,
)
from shiplog.drafting.coordinates import on_earth
from shiplog.drafting.driven import found_actuators
from shiplog.drafting.labels import found_labels
from shiplog.drafting.status_columns import found_status
from shiplog.drafting.toml_text import in_comment, quoted
from shiplog.drafting.topics import NO_ACTUATOR, OPTIONAL
from shiplog.exceptions import ShiplogError, listed
from shiplog.logs.conversion import clock
from shiplog.logs.conversion.columns import text_of
from shiplog.logs.conversion.table_files import read_table
from shiplog.nomenclature import units
from shiplog.ship_profile.table_channels import TABLE_CHANNELS

EVEN = 0.01  # of a step: a column that rises so evenly counts, and measures nothing
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


def draft_table(path: Path, vessel: str | None = None) -> str:
    """TOML text of a profile for a table.

    vessel  which ship, where a column tells several apart

    Raises ChannelMissing for what is no table, and ProfileError where there are several vessels
    and none is chosen.
    """
    table = read_table(path)
    frame = table.frame
    labels = found_labels(table, path, vessel)
    rows = frame
    for label in labels:
        if label.channel == "vessel" and vessel is not None:
            rows = frame.filter(text_of(frame[label.column]) == vessel)
    taken = {f.column for f in labels}
    rows = _of_numbers(rows, taken)
    found = {channel: candidates(rows, channel, taken, table) for channel in CHANNEL_COLUMNS}
    _choose_turning(found, labels, rows)
    chosen, second = _kinds(found, rows)
    chosen = table_motion.by_motion(chosen, labels, rows)
    labels = table_motion.taking_turns(chosen, labels, rows)
    taken |= {f.column for _, _, columns in chosen for f in columns}
    taken |= {f.column for columns in found.values() for f in columns}
    if any(name == "position" for name, _, _ in chosen):
        labels += found_status(rows, taken)
        taken |= {f.column for f in labels}
    actuators, idle = found_actuators(rows, table, taken)
    actuators = table_drive.by_response(actuators, chosen, labels, rows)
    parts = [
        f"# Drafted from {in_comment(path.name)}, {rows.height} rows. "
        "Look over every line that says CHECK.\n\n"
        f"[ship]\nname = {quoted(vessel or path.stem)}\n" + particulars.SHIP.format(what="table")
    ]
    parts += [_sensor(name, kind, columns, labels, rows) for name, kind, columns in chosen]
    there = {name for name, _, _ in chosen}
    for name in ("position", "velocity", "heading", "yaw_rate", "wind"):
        if name not in there:
            does = "; shiplog does without it" if name in OPTIONAL else ", and shiplog needs one"
            parts.append(f"# No {name} was recognised{does}.\n")
    parts += [_actuator(kind, one, rows) for kind, one in actuators] or [NO_ACTUATOR]
    listed_columns = [*labels, *(f for *_, fs in chosen for f in fs), *(f for _, f in actuators)]
    parts.append(_table(listed_columns, rows, second))
    mentioned = {f.column for f in (*listed_columns, *second)}
    nameless = [n for n in frame.columns if n not in mentioned and n in table.nameless]
    parts += [_nameless(rows[name]) for name in nameless]
    mentioned |= {*nameless}
    unused = [n for n in frame.columns if n not in mentioned]
    if alike := [n for n in unused if n in idle or words.drives(n)]:
        parts.append(
            "# CHECK: called like an actuator, and not used: "
            + in_comment(listed(alike, most=60))
            + "\n"
        )
    if unused := [n for n in unused if n not in alike]:
        parts.append("# Columns not used: " + in_comment(listed(unused, most=60)) + "\n")
    return "\n".join(parts)


def _nameless(values: pl.Series) -> str:
    """What to say of a column that no line names: what counts evenly may be the time."""
    step = _even_step(values)
    channel, counts = ("time", f"it counts by {step:g}; ") if step else ("...", "")
    unit = ', unit = "s"' if step else ""
    return (
        f'# {quoted(values.name)} = {{ channel = "{channel}"{unit} }}  # CHECK: no line of the '
        f"table names it; {counts}{facts.of_values(values)}"
    )


def _even_step(values: pl.Series) -> float:
    """By how much a column rises from each row to the next, if always by as much; else 0."""
    if not values.dtype.is_numeric() or values.null_count() or len(values) < facts.FEW:
        return 0.0
    steps = np.diff(values.cast(pl.Float64).to_numpy())
    step = float(np.median(steps))
    even = step > 0.0 and float(np.abs(steps - step).max()) < EVEN * step
    return float(f"{step:.6g}") if even else 0.0


def _of_numbers(rows: pl.DataFrame, labels: set[str]) -> pl.DataFrame:
    """Columns of numbers with a word among them as numbers; `convert` leaves the words out, too."""
    numbers = []
    for values in rows:
        if values.dtype == pl.String and values.name not in labels:
            number = clock.number_of(values)
            if number.null_count() < len(number) / 2:
                numbers.append(number)
    return rows.with_columns(numbers)


def _choose_turning(
    found: dict[str, list[FoundColumn]], labels: list[FoundColumn], rows: pl.DataFrame
) -> None:
    """The unit of a yaw rate that states none: the one that fits how fast the heading turns."""
    time = next((f for f in labels if f.channel == "time"), None)
    rates, headings = found["yaw_rate"], found["heading"]
    if time is None or not rates or not headings or rates[0].unit_stated:
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
        ratio = float(_median(rate[1:]) / _median(turned))
    if not np.isfinite(ratio) or ratio <= 0:
        return
    unit = min(TURNING, key=lambda u: abs(np.log(ratio * units.factor(u))))
    doubts = tuple(d for d in rates[0].doubts if d != UNIT_UNSTATED)
    fits = "the unit fits how fast the heading turns"
    found["yaw_rate"][0] = replace(rates[0], unit=unit, doubts=(*doubts, fits))


def _median(values: np.ndarray) -> np.float64:
    """Of the numbers among them; NaN of none."""
    known = values[np.isfinite(values)]
    return np.float64(np.median(known) if len(known) else np.nan)


def _kinds(
    found: dict[str, list[FoundColumn]], rows: pl.DataFrame
) -> tuple[list[tuple[str, str, list[FoundColumn]]], list[FoundColumn]]:
    """The kind of each sensor whose columns are all there, GNSS first; and the second choices.

    A kind whose columns hold nothing comes after one whose columns do, and a sensor that
    shiplog does without is left out then.
    """
    there: dict[str, list[tuple[str, list[FoundColumn]]]] = {}
    for (name, kind), channels in TABLE_CHANNELS.items():
        if (name, kind) in SINGLE and all(found.get(c) for c in channels):
            columns = best([found[c] for c in channels], wind=name == "wind")
            if kind == "geodetic":
                columns = on_earth(columns, rows)
            there.setdefault(name, []).append((kind, columns))
    chosen: list[tuple[str, str, list[FoundColumn]]] = []
    second: list[FoundColumn] = []
    for name, kinds in there.items():
        kinds.sort(key=lambda one: any(f.empty for f in one[1]))
        kind, columns = kinds[0]
        if name in OPTIONAL and any(f.empty for f in columns):
            second += columns
            continue
        chosen.append((name, kind, columns))
        for channel in TABLE_CHANNELS[name, kind]:
            others = [f for f in found[channel] if f.column not in {c.column for c in columns}]
            second += others[:1]
        second += [f for _, columns in kinds[1:] for f in columns]
    used = {f.column for _, _, columns in chosen for f in columns}
    return chosen, [f for f in second if f.column not in used]


def _sensor(
    name: str, kind: str, columns: list[FoundColumn], labels: list[FoundColumn], rows: pl.DataFrame
) -> str:
    topic, fields, unit_names = SINGLE[name, kind]
    named = ", ".join(map(quoted, fields))
    lines = [f"[sensors.{name}]", f'kind = "{kind}"', f'topic = "{topic}"']
    lines.append(f"fields = [{named}]" if len(fields) > 1 else f"field = {named}")
    if len(unit_names) == 1:
        lines.append(f'unit = "{unit_names[0]}"')
    else:
        lines.append("units = [" + ", ".join(f'"{u}"' for u in unit_names) + "]")
    if name in ("position", "velocity"):
        lines.append("lever_arm_m = [0.0, 0.0]  # CHECK: antenna ahead and to starboard of midship")
    seconds = table_motion.seconds_of(labels, rows)
    if seconds is None:
        lines.append(accuracy.NOT_SHOWN)
    else:
        values = np.stack([table_motion.values_of(one, rows) for one in columns], axis=1)
        time = np.round(seconds * 1e9).astype(np.int64)
        lines += accuracy.lines(name, kind, time, values, list(unit_names))
    return "\n".join(lines) + "\n"


def _actuator(kind: str, one: FoundColumn, rows: pl.DataFrame) -> str:
    field, unit = FIELDS[kind]
    if units.measure(one.unit or "1") in ("ratio", "servo pulse"):
        field, unit = FIELDS["thruster"]  # what commands it stands there, and not its value
    unit = unit or one.unit or "1"
    offset = f"offset = {one.offset}  # CHECK: {one.why}\n" if one.offset else ""
    values = rows[one.column].cast(pl.Float64, strict=False).fill_nan(None).abs()
    most = values.max() if kind == "thruster" else None
    return (
        f'[[actuators]]\nname = "{one.channel}"\nkind = "{kind}"\n'
        f'topic = "/{kind}/{one.channel}"\nfield = "{field}"\nunit = "{unit}"\n{offset}'
        + particulars.of_actuator(kind, unit, most if isinstance(most, float) else None, one.place)
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
    more = f", only = {quoted(one.only)}" if one.only else ""
    more += f", missing = {_listed(one.missing)}" if one.missing else ""
    more += f", sign = {one.sign:g}" if one.sign != 1.0 else ""
    more += f", offset = {one.offset}" if one.offset else ""
    check = f"CHECK: {'; '.join(one.doubts)}; " if one.doubts else ""
    what = facts.of_values(rows[one.column])
    if one.channel == "time":
        what = f"{what}; {_rate(rows[one.column], one.unit)}"
    return f'{quoted(one.column)} = {{ channel = "{one.channel}"{unit}{more} }}  # {check}{what}'


def _listed(values: tuple[int | str, ...]) -> str:
    return "[" + ", ".join(quoted(v) if isinstance(v, str) else str(v) for v in values) + "]"


def _rate(values: pl.Series, unit: str | None) -> str:
    try:
        return facts.of_times(clock.instants(values, unit).drop_nulls()).replace("messages", "rows")
    except ShiplogError:
        return f"{len(values)} rows"
