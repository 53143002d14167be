"""The training engine: windows and weights in, loss and gradient out.

One function is the seam: a compiled engine replaces it without anyone noticing. Training
integrates only what the loss needs, (u, v_m, r): position and heading have weight zero and drive
nothing. What the actuators and the wind add to the first layer is known beforehand and is one
matrix product; the weight gradients are one product a layer, after the backward sweep.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from shiplog import channels
from shiplog.models.feedforward import Scaling, Shape, exogenous
from shiplog.windows import Windows


@dataclass(frozen=True)
class Batch:
    """Windows as the engine wants them: time first, in the arithmetic's own type.

    velocity  [I, N, 3]     measured ν
    driven    [I, N, E]     standardised actuators and wind
    dt        [I - 1, N]    s
    """

    velocity: Tensor
    driven: Tensor
    dt: Tensor

    def pick(self, rows: Tensor) -> Batch:
        """The windows at these row numbers."""
        return Batch(self.velocity[:, rows], self.driven[:, rows], self.dt[:, rows])


def batch(windows: Windows, scaling: Scaling, shape: Shape, dtype: torch.dtype) -> Batch:
    """Standardise once what does not change during training."""
    driven = exogenous(windows.actuator, windows.wind, shape.wind_input)
    driven = (driven - scaling.input_mean[3:]) / scaling.input_std[3:]
    if shape.input_tanh:
        driven = torch.tanh(driven)
    first = [t.transpose(0, 1).to(dtype).contiguous() for t in (windows.velocity, driven)]
    return Batch(first[0], first[1], windows.dt.T.to(dtype).contiguous())


def trapezoid(dt: Tensor) -> Tensor:
    """Weights [I, N] of d_i in the trapezoidal time integral of Eq. 8, from dt [I - 1, N]."""
    weights = torch.zeros(dt.shape[0] + 1, dt.shape[1], dtype=dt.dtype)
    weights[:-1] += 0.5 * dt
    weights[1:] += 0.5 * dt
    return weights


@torch.no_grad()
def loss_and_gradient(
    weights: list[Tensor], data: Batch, scaling: Scaling, shape: Shape, gradient: bool = True
) -> tuple[float, list[Tensor]]:
    """L of Eq. 8 over the batch, mean over windows, and its gradient for each weight.

    weights   W₁ [H, inputs], b₁ [H], ..., W [3, H], b [3], in the type of the batch
    returns   the loss, without the L2 term, and gradients of the same shapes (none if not asked)

    Explicit Euler as in Eq. 9. Loss and gradient are of the velocities only, yaw rate in deg/s.
    """
    dtype = data.velocity.dtype
    steps, count = data.dt.shape
    mean, std = scaling.input_mean[:3].to(dtype), scaling.input_std[:3].to(dtype)
    out_mean, out_std = scaling.output_mean.to(dtype), scaling.output_std.to(dtype)
    matrices, biases = weights[0::2], weights[1::2]
    from_velocity, from_driven = matrices[0][:, :3], matrices[0][:, 3:]
    depth = len(matrices) - 1
    width = matrices[0].shape[0]

    first = torch.addmm(biases[0], data.driven[:-1].flatten(0, 1), from_driven.T)
    first = first.view(steps, count, width)
    hidden = torch.empty(depth, steps, count, width, dtype=dtype)
    entered = torch.empty(steps, count, 3, dtype=dtype)
    error = torch.zeros_like(data.velocity)
    velocity = data.velocity[0]
    transposed = [m.T for m in matrices]
    for k in range(steps):
        z = (velocity - mean) / std
        if shape.input_tanh:
            z = torch.tanh(z)
        entered[k] = z
        h = torch.addmm(first[k], z, from_velocity.T, out=hidden[0, k]).tanh_()
        for layer in range(1, depth):
            h = torch.addmm(biases[layer], h, transposed[layer], out=hidden[layer, k]).tanh_()
        y = torch.addmm(biases[depth], h, transposed[depth])
        velocity = velocity + data.dt[k, :, None] * (y * out_std + out_mean)
        error[k + 1] = velocity - data.velocity[k + 1]

    w2 = torch.tensor(channels.VELOCITY_WEIGHTS, dtype=dtype) ** 2
    weighted = error * w2 * trapezoid(data.dt)[..., None]
    loss = float((weighted * error).sum(dtype=torch.float64)) / count
    if not gradient:
        return loss, []

    slope = weighted * (2.0 / count)  # dL/dν at each step
    delta = torch.empty_like(hidden)
    output = torch.empty(steps, count, 3, dtype=dtype)
    back = slope[steps]
    for k in range(steps - 1, -1, -1):
        output[k] = back * data.dt[k, :, None] * out_std
        d = output[k]
        for layer in range(depth - 1, -1, -1):
            h = hidden[layer, k]
            d = torch.mm(d, matrices[layer + 1], out=delta[layer, k])
            d.addcmul_(d * h, h, value=-1.0)  # · (1 - h²)
        into = d @ from_velocity
        if shape.input_tanh:
            into = into * (1.0 - entered[k] ** 2)
        back = back + into / std + slope[k]

    flat = [delta[layer].flatten(0, 1) for layer in range(depth)] + [output.flatten(0, 1)]
    inputs = torch.cat((entered, data.driven[:-1]), -1).flatten(0, 1)
    below = [inputs] + [hidden[layer].flatten(0, 1) for layer in range(depth)]
    gradients: list[Tensor] = []
    for d, h in zip(flat, below, strict=True):
        gradients += [d.T @ h, d.sum(0)]
    return loss, gradients


def loss_only(weights: list[Tensor], data: Batch, scaling: Scaling, shape: Shape) -> float:
    """L of Eq. 8, without keeping what only a gradient needs."""
    return loss_and_gradient(weights, data, scaling, shape, gradient=False)[0]
