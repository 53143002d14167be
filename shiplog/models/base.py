"""What every dynamic model is: accelerations from the state, the actuators and the wind."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

# A model, called: (state [N, 6], actuator [N, A], wind [N, 0|2]) -> ẋ = f(x, u, ω) of Eq. 2 [N, 6]
Dynamics = Callable[[Tensor, Tensor, Tensor], Tensor]


def kinematics(state: Tensor, acceleration: Tensor) -> Tensor:
    """ẋ of Eq. 19 from the state [..., 6] and ν̇ [..., 3]: earth-fixed velocities and heading rate.

    Order as channels.STATE: (ẋ₀, u̇, ẏ₀, v̇_m, ψ̇, ṙ).
    """
    surge, sway, heading, yaw_rate = (state[..., i] for i in (1, 3, 4, 5))
    c, s = torch.cos(heading), torch.sin(heading)
    return torch.stack(
        (
            c * surge - s * sway,
            acceleration[..., 0],
            s * surge + c * sway,
            acceleration[..., 1],
            yaw_rate,
            acceleration[..., 2],
        ),
        dim=-1,
    )
