"""`--to mcap`: predictions of a voyage as the contract's topics, next to what was measured.

/sim/<run>/state   what the run predicts, beginning at the measured state of each window
/ship/state        what was measured
/rudder/<name> …   the actuators; /wind/apparent
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version as version_of
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.exceptions import StoreError, listed
from shiplog.export import predictions
from shiplog.export.job import Job
from shiplog.export.not_loaded import NotLoaded
from shiplog.export.predictions import MEASURED
from shiplog.export.trial import Difference
from shiplog.logs.conversion.write import Series, write_log
from shiplog.nomenclature.channels import STATE
from shiplog.report.simulation import SCHEMAS

CONSUMER = "Rerun"
CHANNEL = {"unit": "in the fields' names", "axes": "x0, y0; heading clockwise from x0; midship"}


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    """Raises StoreError for several voyages: their clocks overlap or are years apart."""
    rows = predictions.frame(job)
    assert job.store is not None
    names = rows["voyage"].unique().to_list()
    if len(names) > 1:
        raise StoreError(
            f"A log is of one voyage, and {len(names)} are given: {listed(names)}.",
            hint="export each with --voyages and an --out of its own; --to parquet takes several.",
        )
    time = rows["time"].to_physical().to_numpy()
    notes = {
        "model": job.run.name,
        "predicted": " ".join(record),
        "window_s": str(job.run.config.window),
    }
    write_log(
        path, [*_states(rows, time, job.run.name), *_inputs(job, rows, time)],
        ship=job.run.profile.ship.name, datum=job.store.origin(names[0])[1], notes=notes,
    )  # fmt: skip


def _states(rows: pl.DataFrame, time: np.ndarray, run: str) -> list[Series]:
    found = []
    for topic, prefix in ((f"/sim/{run}/state", ""), ("/ship/state", MEASURED)):
        one = {c.name: rows[prefix + c.name].to_numpy() for c in STATE}
        columns = {
            "x0_m": one["x0"], "y0_m": one["y0"],
            "heading_deg": np.degrees(one["heading"]) % 360.0, "surge_mps": one["surge"],
            "sway_mps": one["sway"], "yaw_rate_degps": np.degrees(one["yaw_rate"]),
        }  # fmt: skip
        found.append(Series(topic, "shiplog.ShipState", time, columns, metadata=CHANNEL))
    return found


def _inputs(job: Job, rows: pl.DataFrame, time: np.ndarray) -> list[Series]:
    found = []
    for actuator in job.run.profile.actuators:
        schema, column = SCHEMAS[actuator.kind]
        values = rows[actuator.name].to_numpy()
        values = np.degrees(values) if actuator.kind in ("rudder", "azimuth") else values
        found.append(Series(f"/{actuator.kind}/{actuator.name}", schema, time, {column: values}))
    if job.run.profile.has_wind:
        columns = {
            "speed_mps": rows["wind_speed"].to_numpy(),
            "direction_deg": np.degrees(rows["wind_angle"].to_numpy()) % 360.0,
        }
        found.append(Series("/wind/apparent", "shiplog.Wind", time, columns))
    return found


def losses(job: Job) -> tuple[str, ...]:
    return predictions.losses(job)


def compare(job: Job, path: Path) -> Difference:
    """Read again by Rerun's own importer, message by message."""
    import re

    import pyarrow as pa
    from rerun.chunk import McapReader

    topic = f"/sim/{job.run.name}/state"
    only = [f"^{re.escape(topic)}$"]
    found: list[dict] = []
    for chunk in McapReader(str(path), decoders=["protobuf"], include_topic_regex=only).stream():
        batch = chunk.to_record_batch()
        names = [n for n in batch.schema.names if n.endswith(":message")]
        if not chunk.is_static and names:
            found += pa.Table.from_batches([batch]).column(names[0]).combine_chunks() \
                .flatten().to_pylist()  # fmt: skip
    if not found:
        raise NotLoaded(f"Rerun found no message in {topic}")
    own = _states(predictions.frame(job), np.zeros(0), job.run.name)[0]
    apart = {}
    for c, field in zip(STATE, own.columns, strict=True):
        read = np.array([one[field] for one in found], dtype=float)
        if len(read) != len(own.columns[field]):
            return Difference({"messages": float(len(own.columns[field]) - len(read))}, 0.0)
        apart[c.name] = float(np.abs(read - own.columns[field]).max(initial=0.0))
    return Difference(apart, predictions.seconds(job))


def version() -> str:
    return version_of("rerun-sdk")
