"""A ship whose velocity is measured in body axes, and what bent instruments show of its voyage."""

import numpy as np
import polars as pl
import sailing

from pipelines.experiments.simulated_ship import Wind, sail

DEGREE = np.pi / 180.0
BODY = sailing.profile(
    sailing.PROFILE.replace('kind = "sog_cog"', 'kind = "body"')
    .replace('units = ["kn", "deg"]', 'unit = "m/s"')
    .replace("lever_arm_m = [0.7, -0.2]", "lever_arm_m = [0.0, 0.0]")
)


def in_body_axes(seed, late=None, heading_offset=0.0, antenna=(0.0, 0.0), speed_scale=0.0,
                 seconds=900.0):  # fmt: skip
    """A table as ingest makes it of a ship whose velocity is measured in body axes."""
    voyage = sail(seconds, seed=seed, wind=Wind(2.0, 1.0))
    rng, t, late = np.random.default_rng([seed, 7]), voyage.time, late or {}

    def measured(name, channel, sigma):
        delay = late.get(channel, 0.0) + late.get("gnss", 0.0) * (
            channel in ("position", "velocity")
        )
        true = np.interp(t - delay, t, getattr(voyage, name))
        return true + sigma * rng.standard_normal(len(t))

    turned = measured("heading", "position", 0.0)
    c, s = np.cos(turned), np.sin(turned)
    return pl.DataFrame({
        "time": t,
        "x0": measured("x0", "position", 0.015) + c * antenna[0] - s * antenna[1],
        "y0": measured("y0", "position", 0.015) + s * antenna[0] + c * antenna[1],
        "heading": measured("heading", "heading", 0.1 * DEGREE) + heading_offset * DEGREE,
        "surge": (1.0 + speed_scale) * measured("surge", "velocity", 0.01),
        "sway": (1.0 + speed_scale) * measured("sway", "velocity", 0.01),
        "yaw_rate": measured("yaw_rate", "yaw_rate", 0.1 * DEGREE),
        "quality": np.zeros(len(t), np.int32),
    })  # fmt: skip
