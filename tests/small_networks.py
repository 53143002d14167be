"""Small networks and random windows, and the loss of the two by autograd."""

import math

import polars as pl
import torch

from shiplog.models.feedforward import FeedForward, exogenous, scaling
from shiplog.voyages.windows import Windows


def windows(count=5, size=20, actuators=3, wind=2, seed=0):
    g = torch.Generator().manual_seed(seed)

    def random(*shape):
        return torch.randn(*shape, generator=g, dtype=torch.float64)

    return Windows(
        pl.DataFrame({"copy": [0] * count}), 0.3 * random(count, size, 6),
        random(count, size, actuators), random(count, size, wind).abs() * 2,
        0.5 + torch.rand(count, size - 1, generator=g, dtype=torch.float64),
    )  # fmt: skip


def network(shape, data, seed=0):
    model = FeedForward(shape, scaling(data, shape.wind_input)).double()
    return model.initialise(torch.Generator().manual_seed(seed))


def by_autograd(model, data):
    """Eqs. 6, 8 and 9 word by word, with velocities only."""
    driven = exogenous(data.actuator, data.wind, model.shape.wind_input)
    velocity, errors = data.velocity[:, 0], []
    for i in range(data.dt.shape[1] + 1):
        errors.append(velocity - data.velocity[:, i])
        if i < data.dt.shape[1]:
            velocity = velocity + data.dt[:, i, None] * model.acceleration(velocity, driven[:, i])
    w = torch.tensor([100.0, 100.0, 10.0 * 180.0 / math.pi], dtype=torch.float64)
    d = ((torch.stack(errors, 1) * w) ** 2).sum(-1)
    return ((d[:, 1:] + d[:, :-1]) / 2 * data.dt).sum(1).mean()
