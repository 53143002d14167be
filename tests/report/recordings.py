"""A comparison in closed form, and what a recording of it holds."""

import math

import numpy as np
import polars as pl
from rerun.chunk import RrdReader

SECONDS = 201
TURNING = math.radians(6.0)  # rad/s: passes north every minute


def circle(voyage, east=0.0):
    """A steady turn to starboard at 0.5 m/s, of which everything is known in closed form."""
    time = np.arange(SECONDS, dtype=float)
    heading = TURNING * time
    radius = 0.5 / TURNING
    return pl.DataFrame(
        {
            "voyage": [voyage] * SECONDS,
            "time": time,
            "x0": radius * np.sin(heading),
            "surge": np.full(SECONDS, 0.5),
            "y0": east + radius * (1.0 - np.cos(heading)),
            "sway": np.full(SECONDS, -0.05),
            "heading": np.arctan2(np.sin(heading), np.cos(heading)),
            "yaw_rate": np.full(SECONDS, TURNING),
            "rudder_port": np.full(SECONDS, math.radians(-35.0)),
            "propeller": np.full(SECONDS, 10.0),
            "wind_speed": np.full(SECONDS, 3.1),
            "wind_angle": np.full(SECONDS, math.radians(-50.0)),
        }
    )


def rows(path, entity, component):
    """The values of a component at an entity, rows in order of time."""
    chunks = RrdReader(path).stream().filter(content=entity)
    batches = [pl.DataFrame(pl.from_arrow(c.to_record_batch())) for c in chunks]
    tables = [t for t in batches if component in t.columns]
    assert tables, f"{entity} has no {component}"
    table = pl.concat(tables)
    return table.sort("sim_time") if "sim_time" in table.columns else table


def scalars(path, entity):
    table = rows(path, entity, "Scalars:scalars")
    return table["Scalars:scalars"].explode().to_numpy()


def entities(path):
    return RrdReader(path).store().summary()


def views(blueprint):
    """Every view of a blueprint, container by container: its class, name, origin and parents."""

    def within(part, parents):
        if hasattr(part, "contents") and not hasattr(part, "class_identifier"):
            for child in part.contents:
                yield from within(child, (*parents, part.name))
        else:
            yield {"name": part.name, "origin": part.origin, "in": parents, "view": part}

    return list(within(blueprint.root_container, ()))
