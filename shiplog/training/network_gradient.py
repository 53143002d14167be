"""Loss and gradient of a network's rollouts: by the compiled kernel where there is one, by torch
elsewhere.

Training integrates only what the loss needs, (u, v_m, r): position and heading have weight zero and
drive nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from shiplog import channels
from shiplog.models.feedforward import Scaling, Shape, exogenous
from shiplog.training import kernel
from shiplog.windows import Windows

FIRST, SECOND, LEAST = 0.9, 0.999, 1e-8  # β₁, β₂ and ε of Adam, its authors' and torch's


@dataclass(frozen=True)
class Batch:
    """Windows as the gradient wants them: time first, in the arithmetic's own type.

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
    weights = dt.new_zeros(dt.shape[0] + 1, dt.shape[1])
    weights[:-1] += 0.5 * dt
    weights[1:] += 0.5 * dt
    return weights


def loss_and_gradient(
    weights: Sequence[Tensor], data: Batch, scaling: Scaling, shape: Shape, gradient: bool = True
) -> tuple[float, list[Tensor]]:
    """L of Eq. 8 over the batch, mean over windows, and its gradient for each weight.

    weights   W₁ [H, inputs], b₁ [H], ..., W [3, H], b [3], in the type of the batch
    returns   the loss, without the L2 term, and gradients of the same shapes (none if not asked)

    Explicit Euler as in Eq. 9. Loss and gradient are of the velocities only, yaw rate in deg/s.
    """
    level = kernel.level() if data.velocity.device.type == "cpu" else None
    if level is None:
        return by_torch(weights, data, scaling, shape, gradient)
    scale = scaling.to(data.velocity.dtype)
    scales = (
        scale.input_mean[:3], scale.input_std[:3], scale.output_mean, scale.output_std,
        _error_weights(data.velocity),
    )  # fmt: skip
    return kernel.loss_and_gradient(
        weights, data.velocity, data.driven, data.dt, scales, shape.input_tanh, gradient, level
    )


def loss_only(weights: Sequence[Tensor], data: Batch, scaling: Scaling, shape: Shape) -> float:
    """L of Eq. 8, without keeping what only a gradient needs."""
    return loss_and_gradient(weights, data, scaling, shape, gradient=False)[0]


@torch.no_grad()
def by_torch(
    weights: Sequence[Tensor], data: Batch, scaling: Scaling, shape: Shape, gradient: bool = True
) -> tuple[float, list[Tensor]]:
    """As `loss_and_gradient`, in torch, back-propagated by hand through time.

    What the actuators and the wind add to the first layer is known beforehand and is one matrix
    product; the weights' gradients are one product a layer, after the backward sweep. The scales
    are folded into the first and the last layer, so that a step of time is ten operations.
    """
    like = data.velocity
    steps, count = data.dt.shape
    scale = scaling.to(like.dtype)
    mean, std = scale.input_mean[:3], scale.input_std[:3]
    matrices, biases = list(weights[0::2]), list(weights[1::2])
    depth, width = len(matrices) - 1, matrices[0].shape[0]
    from_velocity, from_driven = matrices[0][:, :3], matrices[0][:, 3:]
    entry = from_velocity if shape.input_tanh else from_velocity / std
    first = torch.addmm(biases[0], data.driven[:-1].flatten(0, 1), from_driven.T)
    if not shape.input_tanh:
        first -= entry @ mean
    first = first.view(steps, count, width)
    out = matrices[depth] * scale.output_std[:, None]
    out_bias = biases[depth] * scale.output_std + scale.output_mean

    hidden = like.new_empty(steps if gradient else 1, depth, count, width)
    path = torch.empty_like(like)
    path[0] = like[0]
    z = velocity = like[0]
    entry_t, out_t = entry.T, out.T
    transposed = [m.T for m in matrices]
    for k in range(steps):
        layers = hidden[k if gradient else 0]
        if shape.input_tanh:
            z = torch.tanh((velocity - mean) / std)
        h = torch.addmm(first[k], z, entry_t, out=layers[0]).tanh_()
        for layer in range(1, depth):
            h = torch.addmm(biases[layer], h, transposed[layer], out=layers[layer]).tanh_()
        y = torch.addmm(out_bias, h, out_t)
        z = velocity = torch.addcmul(velocity, data.dt[k, :, None], y, out=path[k + 1])

    error = path - like
    weighted = error * _error_weights(like) * trapezoid(data.dt)[..., None]
    loss = float((weighted * error).sum(dtype=torch.float64)) / count
    if not gradient:
        return loss, []

    slope = weighted * (2.0 / count)  # dL/dν at each step
    bend = torch.addcmul(torch.ones_like(hidden), hidden, hidden, value=-1.0)  # 1 - h²
    entered = (path[:-1] - mean) / std
    if shape.input_tanh:
        entered = torch.tanh(entered)
        through = (1.0 - entered**2) / std
    else:
        through = None
    delta = torch.empty_like(hidden)
    output = like.new_empty(steps, count, 3)
    back = slope[steps]
    for k in range(steps - 1, -1, -1):
        d = torch.mul(back, data.dt[k, :, None], out=output[k])
        for layer in range(depth - 1, -1, -1):
            above = out if layer == depth - 1 else matrices[layer + 1]
            d = torch.mm(d, above, out=delta[k, layer]).mul_(bend[k, layer])
        if through is None:
            back = torch.addmm(back, d, entry).add_(slope[k])
        else:
            back = torch.addcmul(back, d @ entry, through[k]).add_(slope[k])

    flat = [delta[:, layer].flatten(0, 1) for layer in range(depth)]
    flat.append(output.flatten(0, 1) * scale.output_std)
    inputs = torch.cat((entered, data.driven[:-1]), -1).flatten(0, 1)
    below = [inputs] + [hidden[:, layer].flatten(0, 1) for layer in range(depth)]
    gradients: list[Tensor] = []
    for d, h in zip(flat, below, strict=True):
        gradients += [d.T @ h, d.sum(0)]
    return loss, gradients


def _error_weights(like: Tensor) -> Tensor:
    return torch.tensor(channels.VELOCITY_WEIGHTS, dtype=like.dtype, device=like.device) ** 2


def adam(
    weights: Sequence[Tensor],
    moments: Sequence[Tensor],
    gradients: Sequence[Tensor],
    step: int,
    rate: float,
    decay: float = 0.0,
) -> None:
    """One update of Adam (Kingma and Ba, 2015; β = 0.9, 0.999; ε = 1e-8) in place.

    weights    and `gradients` of the same shapes, in one type
    moments    first moments of all weights, then second ones; zero before the first step
    step       counts from 1
    decay      times the weight is added to its gradient: 2λ for the regulariser λ‖θ‖² of Eq. 7
    """
    means, squares = list(moments[: len(weights)]), list(moments[len(weights) :])
    level = kernel.level() if weights[0].device.type == "cpu" else None
    if level is not None:
        kernel.adam(weights, means, squares, gradients, step, rate, decay, level)
        return
    for w, mean, square, g in zip(weights, means, squares, gradients, strict=True):
        g = g.add(w, alpha=decay)
        mean.lerp_(g, 1.0 - FIRST)
        square.mul_(SECOND).addcmul_(g, g, value=1.0 - SECOND)
        root = (square / (1.0 - SECOND**step)).sqrt_().add_(LEAST)
        w.addcdiv_(mean, root, value=-rate / (1.0 - FIRST**step))
