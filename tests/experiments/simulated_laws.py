"""Laws of a seed, and which coefficient of the catalogue has the role of which of their terms."""

import numpy as np

from pipelines.experiments.simulated_ship import (
    Laws,
    cases,
)

TERMS = {  # of the simulator, and the catalogue's coefficient in the same role
    "resistance": "hull.x_0f", "sway_damping": "hull.y_v", "yaw_damping": "hull.n_r",
    "sway_turning": "hull.y_r", "yaw_drift": "hull.n_v", "cross_flow": "hull.c_d",
    "added_surge": "body.m_x", "added_sway": "body.m_y", "added_inertia": "body.i_j",
}  # fmt: skip


def of(seed: int) -> Laws:
    return cases.draw(seed, cause="none").laws


def state(voyage) -> np.ndarray:
    names = ("x0", "surge", "y0", "sway", "heading", "yaw_rate")
    return np.column_stack([getattr(voyage, name) for name in names])
