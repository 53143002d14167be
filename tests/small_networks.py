"""Small networks and random windows, and the loss of the two by autograd."""

import math

import polars as pl
import torch

from shiplog.models.feedforward import FeedForward, driven_by, scaling
from shiplog.voyages.windows.windows import Windows


def windows(count=5, size=20, actuators=3, wind=2, seed=0):
    g = torch.Generator().manual_seed(seed)

    def random(*shape):
        return torch.randn(*shape, generator=g, dtype=torch.float64)

    parts = (
        0.3 * random(count, size, 6), random(count, size, actuators),
        random(count, size, wind).abs() * 2,
        0.5 + torch.rand(count, size - 1, generator=g, dtype=torch.float64),
    )  # fmt: skip
    return Windows(pl.DataFrame({"copy": [0] * count}), *(t.numpy() for t in parts))


def network(shape, data, seed=0):
    model = FeedForward(shape, scaling(data, shape.wind_input)).double()
    return model.initialise(torch.Generator().manual_seed(seed))


def by_autograd(model, data):
    """Eqs. 5, 8 and 9 word by word, with velocities only."""
    driven = driven_by(data, model.shape.wind_input)
    measured, dt = torch.from_numpy(data.velocity), torch.from_numpy(data.dt)
    velocity, errors = measured[:, 0], []
    for i in range(dt.shape[1] + 1):
        errors.append(velocity - measured[:, i])
        if i < dt.shape[1]:
            velocity = velocity + dt[:, i, None] * model.acceleration(velocity, driven[:, i])
    w = torch.tensor([100.0, 100.0, 10.0 * 180.0 / math.pi], dtype=torch.float64)
    d = ((torch.stack(errors, 1) * w) ** 2).sum(-1)
    return ((d[:, 1:] + d[:, :-1]) / 2 * dt).sum(1).mean()
