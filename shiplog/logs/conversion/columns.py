"""One table to the topics that its profile reads, through the profile's [table] section."""

from __future__ import annotations

import logging
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.exceptions import ChannelMissing, ProfileError, listed, nearest
from shiplog.logs.conversion import cells, clock
from shiplog.logs.conversion.delimited import DelimitedTable
from shiplog.logs.conversion.steps_back import explain_steps
from shiplog.logs.conversion.write import SCHEMAS, Series
from shiplog.logs.health.dates import UNDATED
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.numbers import counted
from shiplog.ship_profile.profile import Column, Profile, Source
from shiplog.ship_profile.table_channels import TABLE_CHANNELS, TABLE_LABELS, channels_of

log = logging.getLogger(__name__)

TOPIC_SCHEMAS = {  # the contract's topic to its schema
    "/ship/state": "shiplog.ShipState", "/wind/apparent": "shiplog.Wind", "/gyro": "shiplog.Gyro",
    "/gnss/velocity": "shiplog.GnssVelocity", "/gnss/fix": "foxglove.LocationFix",
}  # fmt: skip
FAMILY_SCHEMAS = {
    "rudder": "shiplog.Rudder",
    "propeller": "shiplog.Propeller",
    "azimuth": "shiplog.Azimuth",
    "thruster": "shiplog.Thruster",
}
# A topic filled in fewer rows than this is slower than its table; in more, what is empty is lost.
SLOW_SHARE = 0.5
MOST_VESSELS = 8  # vessels that a message names
RECEIVED = (  # channels that a receiver's status speaks of
    "latitude", "longitude", "x0", "y0", "sog", "cog", "velocity_north", "velocity_east",
)  # fmt: skip


def required(profile: Profile | None, path: Path) -> Profile:
    """The profile that a table is read by. Raises ProfileError where none was given."""
    if profile is None:
        raise ProfileError(
            f"{path.name} is a table, and only a profile says what its columns are.",
            hint=f"draft one with `shiplog profile {path} --out my-ship.toml`, look it over, "
            "and give it with --profile.",
        )
    return profile


def voyages(
    table: DelimitedTable, profile: Profile, path: Path
) -> tuple[Iterator[tuple[str, pl.DataFrame, list[Finding]]], list[str]]:
    """The table in SI, a column a channel and `time` in ns, one part a voyage; and which rows are
    in none, since their time or their voyage is blank. Rows that are blank throughout are no rows.

    Without a voyage column the file is one voyage.
    Raises ChannelMissing for columns that are not there, ProfileError for what cannot be read.
    """
    if not profile.table:
        raise ProfileError(
            f"The profile {profile.source} has no [table] section.",
            hint=f"say which column is which channel there; `shiplog profile {path}` drafts it.",
        )
    frame = table.frame
    # Two sources of one ship may name a column differently; what is not in this table is left out.
    present = {name: c for name, c in profile.table.items() if name in frame.columns}
    _require(present, profile, frame, path)
    _refuse_two(present, profile, path)
    refuse_scaled(present, profile)
    refuse_undecided({n: table.undecided[n] for n in present if n in table.undecided}, path)
    frame = frame.with_columns(
        cells.drop_missing(frame[name], column.missing)
        for name, column in present.items() if column.missing and column.channel != "status"
    )  # fmt: skip
    frame = _of_one_vessel(frame, present, profile, path)
    lost = [*table.lost]
    columns = [_time(frame, present).rename("time")]
    for name, column in present.items():
        if column.channel not in TABLE_LABELS:
            read = cells.si(frame[name], column, path)
            columns.append(read.values)
            lost += [read.lost] if read.lost else []
        elif column.channel == "voyage":
            columns.append(text_of(frame[name]).rename("voyage"))
    every = _where_valid(pl.DataFrame(columns), frame, present, profile, path)
    si = every.filter(pl.col("time").is_not_null())
    timeless = every.filter(pl.col("time").is_null() & pl.any_horizontal(
        pl.exclude("time", "voyage").is_finite()
    )).height  # fmt: skip
    lost += [f"{counted(timeless, 'row')} without a time"] if timeless else []
    if si.height == 0:
        raise ProfileError(
            f"{path.name}: no row of {listed(_named(present, 'time'))} holds a time.",
            hint="correct `unit` or `format` of that column in [table].",
        )
    if "voyage" not in si.columns:
        return _in_order([(path.stem, si)], path), lost
    named = si.filter(pl.col("voyage").str.strip_chars() != "")
    if named.height == 0:
        raise ProfileError(
            f"{path.name}: {listed(_named(present, 'voyage'))} is blank in every row.",
            hint="fill that column, or take it out of [table]: the file is then one voyage.",
        )
    parts = [(str(name), part) for (name,), part in named.group_by("voyage", maintain_order=True)]
    if nameless := si.height - named.height:
        lost.append(f"{nameless} rows whose voyage is blank")
    return _in_order(parts, path), lost


def _in_order(
    parts: list[tuple[str, pl.DataFrame]], path: Path
) -> Iterator[tuple[str, pl.DataFrame, list[Finding]]]:
    """Each voyage's rows in the order of time, under a name that a file can have, and what their
    clock shows. A voyage whose recorder was started again is several: NAME_1, NAME_2."""
    for name, part in parts:
        rows = part.drop("voyage", strict=False)
        filled = rows.select(pl.exclude("time").is_not_null())
        course = explain_steps(
            rows["time"].to_numpy(), filled.hash_rows().to_numpy() if filled.width else None
        )
        rows = rows.with_columns(time=pl.Series(course.time))
        several = int(course.part.max(initial=0)) + 1
        for number in range(several):
            one = rows.filter(pl.Series(course.part == number)) if several > 1 else rows
            called = f"{name}_{number + 1}" if several > 1 else name
            findings = [found for of, found in course.findings if of in (None, number)]
            for finding in findings:
                log.warning("%s: %s: %s", path.name, called, finding.sentence)
            back = int((one["time"].diff() < 0).sum())
            if back:
                log.warning("%s: %s goes back in time %d times; sorted", path.name, called, back)
                sentence = f"The rows of the table go back in time {back} times; they were sorted."
                findings.append(Finding("out_of_order", "log", sentence, value=float(back)))
            one = one.sort("time", maintain_order=True)
            yield re.sub(r'[\\/:*?"<>|]', "_", called), one, findings


def dropped(lost: Sequence[str]) -> list[Finding]:
    """What was left out of a table, for whoever reads the log that is made of it."""
    said = "Left out of the table that this log was made of: {}."
    return [Finding("dropped", "log", said.format(what.rstrip("."))) for what in lost]


def series(table: pl.DataFrame, profile: Profile) -> list[Series]:
    """SI columns back into each topic's fields and units: what the profile will read again."""
    time = table["time"].to_numpy()
    topics: dict[str, dict[str, np.ndarray]] = {}
    noted: dict[str, dict[str, str]] = {}
    for source, names in sources(profile):
        columns = topics.setdefault(source.topic, {})
        for name, path, (offset, factor) in zip(names, source.paths, source.scale(), strict=True):
            if name == "yaw_rate" and name not in table.columns:
                si = _turning(table)
                noted[source.topic] = {"yaw_rate": "differentiated from the heading"}
            else:
                si = table[name].fill_null(np.nan).to_numpy()
            columns[path] = si / factor + offset
    return named_apart(
        _topic(topic, time, columns, noted.get(topic, {})) for topic, columns in topics.items()
    )


def sources(profile: Profile) -> list[tuple[Source, tuple[str, ...]]]:
    """What the profile reads, and the channels of a table that fill it."""
    sensors = [
        (sensor, channels_of(name, profile.sensors.kind(name), len(sensor.paths)))
        for name, sensor in profile.sensors.items()
    ]
    return [*sensors, *((actuator, (actuator.name,)) for actuator in profile.actuators)]


def schema_of(topic: str, fields: Iterable[str]) -> str:
    """The contract's schema of a topic that holds no other fields, else one of its own."""
    contract = TOPIC_SCHEMAS.get(topic) or FAMILY_SCHEMAS.get(topic.strip("/").split("/")[0], "")
    if set(fields) <= set(SCHEMAS.get(contract, ())):
        return contract
    return "shiplog.table." + plain(topic.strip("/"))


def named_apart(parts: Iterable[Series]) -> list[Series]:
    """The topics with a schema's name for each layout: `a-b` and `a_b`, and all names of so many
    Japanese letters, are one name in protobuf."""
    layouts: dict[str, tuple[str, ...]] = {}
    named = []
    for one in parts:
        schema, layout = one.schema, tuple(one.columns)
        while schema not in SCHEMAS and layouts.setdefault(schema, layout) != layout:
            schema += "_2"
        named.append(replace(one, schema=schema))
    return named


def plain(name: str) -> str:
    """A protobuf name: letters, digits and underscores, no digit first."""
    name = re.sub(r"\W", "_", name, flags=re.ASCII)
    return f"_{name}" if name[:1].isdigit() else name


def _topic(
    topic: str, time: np.ndarray, columns: dict[str, np.ndarray], noted: dict[str, str]
) -> Series:
    filled = np.any([np.isfinite(values) for values in columns.values()], axis=0)
    if filled.any() and filled.mean() < SLOW_SHARE:
        time, columns = time[filled], {n: values[filled] for n, values in columns.items()}
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    rate = {"nominal_hz": f"{1e9 / step:.3g}"} if step > 0 else {}
    return Series(
        topic, schema_of(topic, columns), time, columns, frame_id="midship",
        metadata={**rate, **dict([UNDATED]), **noted},
    )  # fmt: skip


def _turning(table: pl.DataFrame) -> np.ndarray:
    """Yaw rate [rad/s] of the heading, between the rows that have one; NaN where a row has none.

    Repeated times would divide by zero: a row of the same time takes part only once.
    """
    time = table["time"].to_numpy() * 1e-9
    heading = table["heading"].fill_null(np.nan).to_numpy()
    rate = np.full(len(time), np.nan)
    known = np.isfinite(heading)
    known[1:] &= np.diff(time) > 0
    if known.sum() > 1:
        rate[known] = np.gradient(np.unwrap(heading[known]), time[known])
    return rate


def _require(present: dict[str, Column], profile: Profile, frame: pl.DataFrame, path: Path) -> None:
    """Every channel that the profile reads has its column here, or say which ones have none."""
    given = {column.channel for column in present.values()}
    needed = {"time"} | {name for _, names in sources(profile) for name in names}
    if "yaw_rate" not in given and "heading" in given:
        needed.discard("yaw_rate")
        if profile.sensors.yaw_rate is None:
            log.info("%s: no yaw rate; ingest differentiates the heading", path.name)
        else:
            log.warning(
                "%s: no yaw rate; the log holds the heading's derivative instead. Without "
                "[sensors.yaw_rate] in the profile, nobody takes it for a gyro's",
                path.name,
            )
    lacking = needed - given
    if not lacking:
        return
    free = set(frame.columns) - set(profile.table)
    column = next((n for n, c in profile.table.items() if c.channel in lacking), "")
    hint = f"name the columns in the [table] section of {profile.source}"
    for name, sensor in profile.sensors.items():
        kind = profile.sensors.kind(name)
        other = [
            k for (n, k), names in TABLE_CHANNELS.items()
            if n == name and k != kind and set(names) <= given
        ]  # fmt: skip
        if other and lacking & set(TABLE_CHANNELS[name, kind]):
            hint = (
                f"the columns say {name} as {other[0]!r} and the profile reads {kind!r} from "
                f'{sensor.topic}: put kind = "{other[0]}" and its fields into [sensors.{name}]'
            )
            break
    raise ChannelMissing(
        f"{path.name} has no column for {listed(lacking)}{nearest(column, free)}. "
        f"Columns found: {listed(frame.columns, most=40)}.",
        hint=f"{hint}; or draft a profile with `shiplog profile {path}`.",
    )


def _refuse_two(present: dict[str, Column], profile: Profile, path: Path) -> None:
    """Raises ProfileError where two columns of this table are one channel."""
    for channel, times in Counter(column.channel for column in present.values()).items():
        if times > 1 and channel != "time":  # of clocks, the first that is named counts
            names = _named(present, channel)
            raise ProfileError(
                f"{path.name}: the columns {listed(names)} are all {channel!r} in [table].",
                hint=f"leave one of them in the [table] section of {profile.source}.",
            )


def refuse_scaled(present: dict[str, Column], profile: Profile) -> None:
    """Raises ProfileError for a factor or an offset of a time or a name, which nobody would use."""
    for name, column in present.items():
        if column.channel in TABLE_LABELS and (column.sign != 1.0 or column.offset != 0.0):
            raise ProfileError(
                f"[table] {name!r} has a `sign` or an `offset`, and is a {column.channel}: they "
                "are of channels that were measured.",
                hint=f"leave them out in {profile.source}, and change the column in the table.",
            )


def refuse_undecided(undecided: dict[str, str], path: Path) -> None:
    """Raises ProfileError for numbers that can be read in two ways."""
    for name, example in undecided.items():
        sign = "," if "," in example else "."
        raise ProfileError(
            f"{path.name}: the column {name!r} holds numbers such as {example!r}, and nothing in "
            f"the file says whether the {'comma' if sign == ',' else 'dot'} stands before decimals "
            "or groups thousands.",
            hint=f'say it in [table], as "{name}" = {{ ..., decimal = "{sign}" }} for decimals, or '
            f'decimal = "{"." if sign == "," else ","}" for thousands.',
        )


def _where_valid(
    si: pl.DataFrame, frame: pl.DataFrame, present: dict[str, Column], profile: Profile, path: Path
) -> pl.DataFrame:
    """The channels of a receiver blank where a status next to them says that it has no fix.

    Raises ProfileError for a status of which the profile does not say what means so.
    """
    for name in _named(present, "status"):
        marks = present[name].missing
        if not marks:
            raise ProfileError(
                f"[table] {name!r} is a status, and its `missing` does not say which of its values "
                "mean that there is no fix.",
                hint=f'say them in {profile.source}, as "{name}" = {{ channel = "status", missing '
                f"= [0] }}. Its values: {busiest(text_of(frame[name]))}.",
            )
        without = cells.holds(frame[name], marks)
        if not without.any():
            continue
        log.warning(
            "%s: %d of %d rows have no fix, by %r; their position and velocity are blank",
            path.name, int(without.sum()), len(without), name,
        )  # fmt: skip
        si = si.with_columns(
            pl.when(without).then(None).otherwise(pl.col(c)).alias(c)
            for c in RECEIVED if c in si.columns
        )  # fmt: skip
    return si


def _of_one_vessel(
    frame: pl.DataFrame, present: dict[str, Column], profile: Profile, path: Path
) -> pl.DataFrame:
    for name, column in present.items():
        if column.channel != "vessel":
            continue
        vessels = text_of(frame[name])
        if column.only is None:
            if vessels.n_unique() > 1:
                raise ProfileError(
                    f"{path.name} holds {vessels.n_unique()} vessels in {name!r}: "
                    f"{busiest(vessels)}.",
                    hint=f'say which in {profile.source}: "{name}" = {{ channel = "vessel", '
                    'only = "..." }.',
                )
            continue
        frame = frame.filter(vessels == str(column.only))
        if frame.height == 0:
            raise ProfileError(
                f"{path.name} has no row of vessel {column.only}. Vessels: {busiest(vessels)}.",
                hint=f"correct `only` of {name!r} in {profile.source}.",
            )
    return frame


def busiest(vessels: pl.Series) -> str:
    """The vessels with most rows, for a message."""
    counts = vessels.drop_nulls().value_counts(sort=True, name="rows")
    named = [f"{name} ({rows} rows)" for name, rows in counts.head(MOST_VESSELS).iter_rows()]
    rest = counts.height - len(named)
    return ", ".join(named) + (f", and {rest} more" if rest > 0 else "")


def _time(frame: pl.DataFrame, present: dict[str, Column]) -> pl.Series:
    (name, *_), day = _named(present, "time"), _named(present, "date")
    column = present[name]
    if not day:
        return clock.instants(frame[name], column.unit, column.format)
    time = clock.of_day(frame[name], column.unit, column.format)
    midnight = clock.dates(frame[day[0]], present[day[0]].format)
    return midnight + time % clock.DAY_NS


def _named(present: dict[str, Column], channel: str) -> list[str]:
    return [name for name, column in present.items() if column.channel == channel]


def text_of(values: pl.Series) -> pl.Series:
    """Names of voyages or vessels: where all are whole numbers, none has decimals."""
    if values.dtype.is_float():
        values = values.fill_nan(None)
        whole = bool((values.drop_nulls() % 1 == 0).all())
        values = values.cast(pl.Int64, strict=False) if whole else values
    return values.cast(pl.String)
