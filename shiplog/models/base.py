"""What every dynamic model is: accelerations from the state, the actuators and the wind."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shiplog.nomenclature.frames import in_earth_axes

# A model, called: (state [N, 6], actuator [N, A], wind [N, 0|2]) -> ẋ = f(x, u, ω) of Eq. 2 [N, 6]
Dynamics = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def kinematics(state: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """ẋ of Eq. 19 from the state [..., 6] and ν̇ [..., 3]: earth-fixed velocities and heading rate.

    Order as channels.STATE: (ẋ₀, u̇, ẏ₀, v̇_m, ψ̇, ṙ).
    """
    surge, sway, heading, yaw_rate = (state[..., i] for i in (1, 3, 4, 5))
    north, east = in_earth_axes(surge, sway, np.cos(heading), np.sin(heading))
    return np.stack(
        (
            north,
            acceleration[..., 0],
            east,
            acceleration[..., 1],
            yaw_rate,
            acceleration[..., 2],
        ),
        axis=-1,
    )
