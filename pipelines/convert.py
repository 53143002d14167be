"""Tables of other people's making to contract MCAP, through a profile's [table] section."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import polars as pl

from shiplog import units
from shiplog.channels import WIND
from shiplog.exceptions import ChannelMissing, ProfileError, ShiplogError, listed, nearest
from shiplog.logs.write import Series, write_log
from shiplog.profile import Profile, Source
from shiplog.unexpected import unexpected

log = logging.getLogger(__name__)

SCHEMAS = {  # the contract's topic to its schema
    "/ship/state": "shiplog.ShipState", "/wind/apparent": "shiplog.Wind", "/gyro": "shiplog.Gyro",
    "/gnss/velocity": "shiplog.GnssVelocity", "/gnss/fix": "foxglove.LocationFix",
}  # fmt: skip
FAMILIES = {
    "rudder": "shiplog.Rudder",
    "propeller": "shiplog.Propeller",
    "azimuth": "shiplog.Azimuth",
    "thruster": "shiplog.Thruster",
}


def convert(tables: list[Path], profile: Profile, out: Path) -> tuple[list[Path], dict[str, str]]:
    """Each table, or each voyage in it, to one log. Returns the logs and what was refused."""
    written: list[Path] = []
    refused: dict[str, str] = {}
    for path in tables:
        try:
            if path.is_dir():
                written.append(convert_topics(path, profile, out))
                continue
            for name, table in voyages(read_table(path), profile, path):
                target = _free(out / f"{name}.mcap", out)
                out.mkdir(parents=True, exist_ok=True)
                write_log(
                    target,
                    series(table, profile),
                    ship=profile.ship.name,
                    datum=profile.site.datum,
                    notes={"table": path.name},
                )
                log.info("%s: %d rows", target.name, table.height)
                written.append(target)
        except ShiplogError as error:
            refused[str(path)] = str(error)
        except Exception as error:  # one bad table never ends the others
            refused[str(path)] = str(unexpected(error, path.name))
    return written, refused


def _free(target: Path, out: Path) -> Path:
    """Raises ShiplogError for a log that is there already, which may be the only one of its kind,
    and for the name of a voyage that would lead elsewhere."""
    if set(target.stem) & set("/\\\0") or len(target.relative_to(out).parts) != 1:
        raise ShiplogError(
            f"A voyage is called {target.stem!r}, which no file can be.", hint="rename it."
        )
    if target.exists():
        raise ShiplogError(
            f"{target} exists already.", hint="choose another --out, or remove that log."
        )
    return target


def read_table(path: Path) -> pl.DataFrame:
    """A CSV or Parquet file. Raises ChannelMissing for anything else."""
    readers = {".parquet": pl.read_parquet, ".csv": pl.read_csv}
    if path.suffix.lower() not in readers or not path.is_file():
        raise ChannelMissing(f"{path} is no table.", hint="give .parquet or .csv files.")
    try:
        return readers[path.suffix.lower()](path)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise ChannelMissing(f"{path} cannot be read: {error}.", hint="check the file.") from error


def voyages(
    table: pl.DataFrame, profile: Profile, path: Path
) -> Iterator[tuple[str, pl.DataFrame]]:
    """The table in SI under canonical names, one part a voyage. Raises ChannelMissing.

    Rows without a time are dropped; where the profile names no voyage column, the file is one.
    """
    if not profile.table:
        raise ProfileError(
            f"The profile {profile.source} has no [table] section.",
            hint="say which column is which channel there.",
        )
    # Two sources of one ship may name a column differently; what is not in this table is left out.
    present = {name: c for name, c in profile.table.items() if name in table.columns}
    wanted = {"time", *profile.columns}
    lacking = wanted - {c.channel for c in present.values()}
    if lacking:
        column = next((n for n, c in profile.table.items() if c.channel in lacking), "")
        raise ChannelMissing(
            f"{path.name} has no column for {listed(lacking)}"
            f"{nearest(column, table.columns)}. Columns found: {listed(table.columns)}.",
            hint=f"name the columns in the [table] section of {profile.source}.",
        )
    for name, column in present.items():
        if column.channel != "voyage":
            _refuse_words(table[name], path)
    si = table.select(
        *[
            ((pl.col(name).cast(pl.Float64) - c.offset) * c.sign * units.factor(c.unit)).alias(
                c.channel
            )
            for name, c in present.items()
            if c.channel != "voyage"
        ],
        *[
            pl.col(n).cast(pl.String).alias("voyage")
            for n, c in present.items()
            if c.channel == "voyage"
        ],
    ).filter(pl.col("time").is_not_null() & pl.col("time").is_not_nan())
    if si.is_empty():
        raise ChannelMissing(f"{path.name} has no row with a time.", hint="check the file.")
    dropped = table.height - si.height
    if dropped:
        log.warning("%s: %d rows without a time left out", path.name, dropped)
    if "voyage" not in si.columns:
        yield path.stem, si
        return
    for (name,), part in si.group_by("voyage", maintain_order=True):
        yield str(name), part.drop("voyage")


def _refuse_words(column: pl.Series, path: Path) -> None:
    """Raises ChannelMissing for a column that holds anything but numbers."""
    if column.dtype.is_numeric() or column.dtype == pl.Null:
        return
    hint = "give numbers in the unit that the profile's [table] section says; time in seconds."
    if column.dtype != pl.String:
        raise ChannelMissing(
            f"{path.name}: the column {column.name!r} holds {column.dtype} and no numbers.",
            hint=hint,
        )
    words = column.is_not_null() & column.cast(pl.Float64, strict=False).is_null()
    if words.any():
        row = words.arg_max() or 0
        raise ChannelMissing(
            f"{path.name}: the column {column.name!r} holds {column[row]!r} in row {row + 1} where "
            "a number has to be.",
            hint=hint,
        )


def series(table: pl.DataFrame, profile: Profile) -> list[Series]:
    """SI columns back into each topic's fields and units: what the profile will read again."""
    time = np.round(table["time"].to_numpy() * 1e9).astype(np.int64)
    sources: list[tuple[Source, tuple[str, ...]]] = []
    state = {
        "position": ("x0", "y0"), "velocity": ("surge", "sway"), "heading": ("heading",),
        "yaw_rate": ("yaw_rate",), "wind": tuple(c.name for c in WIND),
    }  # fmt: skip
    reduced = {
        "position": "local",
        "velocity": "body",
        "heading": "angle",
        "yaw_rate": "rate",
        "wind": "from_bow",
    }
    for name, sensor in profile.sensors.items():
        if profile.sensors.kind(name) != reduced[name]:
            raise ProfileError(
                f"The profile {profile.source} reads {name} as {profile.sensors.kind(name)!r}; a "
                f"table holds it as {reduced[name]!r} at midship.",
                hint="convert with a profile whose sensors read /ship/state.",
            )
        sources.append((sensor, state[name]))
    sources += [(actuator, (actuator.name,)) for actuator in profile.actuators]
    topics: dict[str, dict[str, np.ndarray]] = {}
    for source, names in sources:
        columns = topics.setdefault(source.topic, {})
        for name, path, (offset, factor) in zip(names, source.paths, source.scale(), strict=True):
            columns[path] = table[name].fill_null(np.nan).to_numpy() / factor + offset
    rate = 1e9 / float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    return [
        Series(
            topic,
            _schema(topic),
            time,
            columns,
            frame_id="midship",
            metadata={"nominal_hz": f"{rate:.3g}", "clock": "of the table"},
        )
        for topic, columns in topics.items()
    ]


def convert_topics(folder: Path, profile: Profile, out: Path) -> Path:
    """A folder with one table a topic (`a__b.parquet` is /a/b), as dumped from a ROS bag.

    Columns `log_time_ns` and `stamp_ns` are the recorder's and the message's clock; every other
    numeric column becomes a field. Nothing is aligned here: that is what ingest is for.
    """
    parts: list[Series] = []
    for path in sorted(folder.glob("*.parquet")):
        table = pl.read_parquet(path)
        if "log_time_ns" not in table.columns:
            continue
        table = table.filter(pl.col("log_time_ns").is_not_null()).sort("log_time_ns")
        stamp = "stamp_ns" if "stamp_ns" in table.columns else "log_time_ns"
        fields = [n for n, t in table.schema.items() if t.is_numeric() and not n.endswith("_ns")]
        if not fields or table.height == 0:
            continue
        parts.append(
            Series(
                topic="/" + path.stem.replace("__", "/"),
                schema=f"shiplog.table.{path.stem.replace('__', '_')}",
                time=table[stamp].fill_null(strategy="forward").to_numpy(),
                columns={n: table[n].cast(pl.Float64).fill_null(np.nan).to_numpy() for n in fields},
                log_time=table["log_time_ns"].to_numpy(),
            )
        )
    if not parts:
        raise ChannelMissing(
            f"{folder} holds no table with a column log_time_ns.",
            hint="give one .parquet a topic, or a single table.",
        )
    target = _free(out / f"{folder.name}.mcap", out)
    out.mkdir(parents=True, exist_ok=True)
    write_log(target, parts, ship=profile.ship.name, datum=profile.site.datum)
    log.info("%s: %d topics", target.name, len(parts))
    return target


def _schema(topic: str) -> str:
    return SCHEMAS.get(topic) or FAMILIES.get(topic.strip("/").split("/")[0], "shiplog.Values")
