"""Loss and gradient of a network's rollouts: by the compiled kernel where there is one, by torch
elsewhere.

Training integrates only what the loss needs, (u, v_m, r): position and heading have weight zero and
drive nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import torch
from torch import Tensor

from shiplog.models.feedforward import Scaling, driven_by
from shiplog.models.network_shape import Shape
from shiplog.nomenclature import channels
from shiplog.training.network import kernel
from shiplog.voyages.windows.windows import Windows

BETA_1, BETA_2, EPSILON = 0.9, 0.999, 1e-8  # β₁, β₂ and ε of Adam, its authors' and torch's


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
    driven = driven_by(windows, shape.wind_input)
    driven = (driven - scaling.input_mean[3:]) / scaling.input_std[3:]
    if shape.input_tanh:
        driven = torch.tanh(driven)
    parts = (torch.from_numpy(windows.velocity), driven, torch.from_numpy(windows.dt))
    return Batch(*(t.transpose(0, 1).to(dtype).contiguous() for t in parts))


def trapezoid(dt: Tensor) -> Tensor:
    """Weights [I, N] of d_i in the trapezoidal time integral of Eq. 8, from dt [I - 1, N]."""
    weights = dt.new_zeros(dt.shape[0] + 1, *dt.shape[1:])
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
    if level is None or data.velocity.dtype not in (torch.float32, torch.float64):
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
    """As `loss_and_gradient`, in torch, back-propagated by hand through time."""
    loss, gradients = joint_gradient(weights, data, scaling, shape, gradient)
    return float(loss), gradients


@torch.no_grad()
def joint_gradient(
    weights: Sequence[Tensor], data: Batch, scaling: Scaling, shape: Shape, gradient: bool = True
) -> tuple[Tensor, list[Tensor]]:
    """Loss and gradient in torch, of one network or of S networks at once.

    weights   as in `loss_and_gradient`, or each with a first dimension S; the batch then has
              windows of each network: velocity [I, S, N, 3] and so on
    returns   the loss, [] or [S], float64, and gradients of the weights' shapes

    What the actuators and the wind add to the first layer is known beforehand and is one matrix
    product; the weights' gradients are one product a layer, after the backward sweep.
    """
    like, count = data.velocity, data.dt.shape[-1]
    net = _folded(weights, data, scaling.to(like.dtype), shape)
    path, hidden = _forward(net, data, gradient)
    error = path - like
    weighted = error * _error_weights(like) * trapezoid(data.dt)[..., None]
    loss = (weighted * error).sum((0, -2, -1), dtype=torch.float64) / count
    if not gradient:
        return loss, []
    return loss, _backward(net, data, path, hidden, weighted * (2.0 / count))


@dataclass(frozen=True)
class _Folded:
    """A network whose scales are folded into its first and last layer, so that a step of time is
    ten operations.

    matrices, biases  of all layers, as they are
    first             [I - 1, ..., H] what the first layer adds up of all but the velocity
    entry             [H, 3] of the velocity to the first layer
    out, out_bias     the last layer, in m/s² and rad/s²
    mean, std         [3] of the velocity
    output_std        [3] of the acceleration
    entry_tanh        whether the inputs pass a tanh before the first layer
    """

    matrices: list[Tensor]
    biases: list[Tensor]
    first: Tensor
    entry: Tensor
    out: Tensor
    out_bias: Tensor
    mean: Tensor
    std: Tensor
    output_std: Tensor
    entry_tanh: bool

    @property
    def depth(self) -> int:
        return len(self.matrices) - 1

    @property
    def several(self) -> bool:
        return self.matrices[0].dim() == 3


def _folded(weights: Sequence[Tensor], data: Batch, scale: Scaling, shape: Shape) -> _Folded:
    mean, std = scale.input_mean[:3], scale.input_std[:3]
    matrices, biases = list(weights[0::2]), list(weights[1::2])
    if matrices[0].dim() == 3:
        biases = [b.unsqueeze(1) for b in biases]
    from_velocity, from_driven = matrices[0][..., :3], matrices[0][..., 3:]
    entry = from_velocity if shape.input_tanh else from_velocity / std
    first = data.driven[:-1] @ from_driven.mT + biases[0]
    if not shape.input_tanh:
        first -= (entry @ mean).unsqueeze(-2)
    out = matrices[-1] * scale.output_std[:, None]
    out_bias = biases[-1] * scale.output_std + scale.output_mean
    return _Folded(
        matrices, biases, first, entry, out, out_bias, mean, std, scale.output_std,
        shape.input_tanh,
    )  # fmt: skip


def _forward(net: _Folded, data: Batch, keep: bool) -> tuple[Tensor, Tensor]:
    """Velocities [I, ..., 3] of the rollout, and the hidden layers' values [I - 1, depth, ..., H];
    of the last step alone where they need not be kept."""
    like, steps, depth = data.velocity, data.dt.shape[0], net.depth
    add = torch.baddbmm if net.several else torch.addmm
    width = net.matrices[0].shape[-2]
    hidden = like.new_empty(steps if keep else 1, depth, *like.shape[1:-1], width)
    path = torch.empty_like(like)
    path[0] = like[0]
    z = velocity = like[0]
    entry, out = net.entry.mT, net.out.mT
    transposed = [m.mT for m in net.matrices]
    for k in range(steps):
        layers = hidden[k if keep else 0]
        if net.entry_tanh:
            z = torch.tanh((velocity - net.mean) / net.std)
        h = add(net.first[k], z, entry, out=layers[0]).tanh_()
        for layer in range(1, depth):
            h = add(net.biases[layer], h, transposed[layer], out=layers[layer]).tanh_()
        y = add(net.out_bias, h, out)
        z = velocity = torch.addcmul(velocity, data.dt[k].unsqueeze(-1), y, out=path[k + 1])
    return path, hidden


def _backward(
    net: _Folded, data: Batch, path: Tensor, hidden: Tensor, slope: Tensor
) -> list[Tensor]:
    """Gradients of the weights, of dL/dν at each step (`slope`, [I, ..., 3])."""
    steps, depth = data.dt.shape[0], net.depth
    add, multiply = (torch.baddbmm, torch.bmm) if net.several else (torch.addmm, torch.mm)
    bend = torch.addcmul(torch.ones_like(hidden), hidden, hidden, value=-1.0)  # 1 - h²
    entered = (path[:-1] - net.mean) / net.std
    through = None
    if net.entry_tanh:
        entered = torch.tanh(entered)
        through = (1.0 - entered**2) / net.std
    delta = torch.empty_like(hidden)
    output = torch.empty_like(path[1:])
    back = slope[steps]
    for k in range(steps - 1, -1, -1):
        d = torch.mul(back, data.dt[k].unsqueeze(-1), out=output[k])
        for layer in range(depth - 1, -1, -1):
            above = net.out if layer == depth - 1 else net.matrices[layer + 1]
            d = multiply(d, above, out=delta[k, layer]).mul_(bend[k, layer])
        if through is None:
            back = add(back, d, net.entry).add_(slope[k])
        else:
            back = torch.addcmul(back, d @ net.entry, through[k]).add_(slope[k])

    deltas = [*(delta[:, layer] for layer in range(depth)), output * net.output_std]
    below = [torch.cat((entered, data.driven[:-1]), -1), *(hidden[:, i] for i in range(depth))]
    gradients: list[Tensor] = []
    for d, h in zip(map(_rows, deltas), map(_rows, below), strict=True):
        gradients += [d.mT @ h, d.sum(-2)]
    return gradients


def _rows(values: Tensor) -> Tensor:
    """[..., steps · N, H] from [steps, ..., N, H]."""
    return values.movedim(0, -3).flatten(-3, -2)


def _error_weights(like: Tensor) -> Tensor:
    return _weights_of(like.dtype, like.device)


@cache  # a CUDA graph must not copy from the processor's memory while it is captured
def _weights_of(dtype: torch.dtype, device: torch.device) -> Tensor:
    return torch.tensor(channels.VELOCITY_WEIGHTS, dtype=dtype, device=device) ** 2


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
    decay      times the weight is added to its gradient: 2λ for the regulariser λ‖θ‖² of Eq. 6
    """
    means, squares = list(moments[: len(weights)]), list(moments[len(weights) :])
    level = kernel.level() if weights[0].device.type == "cpu" else None
    if level is not None:
        kernel.adam(weights, means, squares, gradients, step, rate, decay, level)
        return
    for w, mean, square, g in zip(weights, means, squares, gradients, strict=True):
        g = g.add(w, alpha=decay)
        mean.lerp_(g, 1.0 - BETA_1)
        square.mul_(BETA_2).addcmul_(g, g, value=1.0 - BETA_2)
        root = (square / (1.0 - BETA_2**step)).sqrt_().add_(EPSILON)
        w.addcdiv_(mean, root, value=-rate / (1.0 - BETA_1**step))
