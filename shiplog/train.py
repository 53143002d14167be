"""Training: the paper's recipe to the letter, and a fast one that reaches it in seconds.

Knows no disk: what must last is handed to `checkpoint`, and comes back as `resume`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import torch
from scipy.optimize import minimize
from torch import Tensor

from shiplog import seeds
from shiplog.config import Fast, Paper
from shiplog.models.feedforward import FeedForward
from shiplog.training import network_gradient
from shiplog.training.network_gradient import Batch

HISTORY = ("epoch", "training", "validation", "smoothed")


@dataclass
class Progress:
    """Where a training stands: everything needed to go on as if nothing had happened."""

    epoch: int
    weights: list[Tensor]
    best_weights: list[Tensor]
    best: float
    first: float  # validation loss of the initial weights
    smoothed: float
    moments: list[Tensor] = field(default_factory=list)  # Adam's, first then second
    steps: int = 0  # Adam's, for its bias correction
    stream: Tensor | None = None  # state of the random stream that splits the subsets
    history: list[tuple[int, float, float, float]] = field(default_factory=list)


Checkpoint = Callable[[Progress], None]


def paper(
    model: FeedForward,
    training: Batch,
    validation: Batch,
    settings: Paper,
    seed: int,
    checkpoint: Checkpoint | None = None,
    every: int = 250,
    resume: Progress | None = None,
) -> Progress:
    """Adam on three random subsets an epoch until the validation loss has risen, Sec. 4.3.

    Stops once more than `least_epochs` are done and L > rise · (L_init - L_min) + L_min on the
    validation windows (Eq. 24). The weights to keep are `best_weights` (smallest L, not smoothed).
    The regulariser λ‖θ‖² of Eq. 7 has the gradient 2λθ, which is Adam's `weight_decay`.
    """
    weights = [p.detach().clone() for p in model.weights]
    moments = [torch.zeros_like(w) for w in [*weights, *weights]]
    scale = (model.scaling, model.shape)
    rate, decay = settings.learning_rate, 2.0 * settings.regularisation
    stream = seeds.generator(seed, "batches")
    if resume is None:
        start = network_gradient.loss_only(weights, validation, *scale)
        progress = Progress(0, weights, [w.clone() for w in weights], start, start, start)
        progress.history.append((0, math.nan, start, start))
    else:
        progress = resume
        weights = [w.clone() for w in progress.weights]
        moments = [m.clone() for m in progress.moments] or moments
        if progress.stream is not None:
            stream.set_state(progress.stream)

    def snapshot() -> None:
        progress.weights = [w.clone() for w in weights]
        progress.moments = [m.clone() for m in moments]
        progress.stream = stream.get_state()

    count = training.velocity.shape[1]
    while not _paper_done(progress, settings):
        progress.epoch += 1
        total = 0.0
        for rows in torch.tensor_split(torch.randperm(count, generator=stream), settings.subsets):
            if len(rows) == 0:
                continue
            picked = training.pick(rows)
            loss, gradients = network_gradient.loss_and_gradient(weights, picked, *scale)
            progress.steps += 1
            network_gradient.adam(weights, moments, gradients, progress.steps, rate, decay)
            total += loss * len(rows) / count
        loss = network_gradient.loss_only(weights, validation, *scale)
        _note(progress, weights, total, loss, settings.smoothing)
        if checkpoint is not None and progress.epoch % every == 0:
            snapshot()
            checkpoint(progress)
        if not math.isfinite(loss) and not math.isfinite(total):
            break  # diverged for good: the best weights stand
    snapshot()
    return progress


def _paper_done(progress: Progress, settings: Paper) -> bool:
    if settings.most_epochs is not None and progress.epoch >= settings.most_epochs:
        return True
    latest = progress.history[-1][2]
    limit = settings.rise * (progress.first - progress.best) + progress.best
    return progress.epoch > settings.least_epochs and latest > limit


def _note(
    progress: Progress, values: list[Tensor], training: float, loss: float, alpha: float
) -> None:
    """One more epoch in the history; the best weights so far (smoothing as in Eq. 23)."""
    progress.smoothed = alpha * loss + (1.0 - alpha) * progress.smoothed
    progress.history.append((progress.epoch, training, loss, progress.smoothed))
    if loss < progress.best:
        progress.best = loss
        progress.best_weights = [v.clone() for v in values]


def fast(
    model: FeedForward, training: Batch, validation: Batch, settings: Fast, seed: int
) -> Progress:
    """Short windows with Adam, then L-BFGS (Liu and Nocedal, 1989) on the whole rollouts.

    Warm start: every window cut into pieces of `warm_steps` Euler steps, which bend the network
    into shape cheaply and without the long rollouts' chaos. Then full-batch L-BFGS on the paper's
    loss with its regulariser, keeping the weights with the smallest validation loss.
    """
    scale = (model.scaling, model.shape)
    weights = [p.detach().clone() for p in model.weights]
    start = network_gradient.loss_only(weights, validation, *scale)
    progress = Progress(0, weights, [w.clone() for w in weights], start, start, start)
    progress.history.append((0, math.nan, start, start))
    _warm_start(weights, training, scale, settings, seed)

    shapes = [w.shape for w in weights]
    sizes = [w.numel() for w in weights]
    dtype = weights[0].dtype

    def unpack(flat: np.ndarray) -> list[Tensor]:
        parts = torch.from_numpy(flat).to(dtype).split(sizes)
        return [part.view(shape) for part, shape in zip(parts, shapes, strict=True)]

    latest = {"training": math.nan}

    def objective(flat: np.ndarray) -> tuple[float, np.ndarray]:
        loss, gradients = network_gradient.loss_and_gradient(unpack(flat), training, *scale)
        latest["training"] = loss
        slope = torch.cat([g.flatten() for g in gradients]).double().numpy()
        if not (math.isfinite(loss) and np.isfinite(slope).all()):
            return 1e30, np.zeros_like(flat)  # the line search shortens its step
        penalty = settings.regularisation
        return loss + penalty * float(flat @ flat), slope + 2.0 * penalty * flat

    def after(flat: np.ndarray) -> None:
        progress.epoch += 1
        values = unpack(flat)
        loss = network_gradient.loss_only(values, validation, *scale)
        _note(progress, values, latest["training"], loss, settings.smoothing)
        best_at = min(progress.history[1:], key=lambda row: row[2])[0]
        if progress.epoch - best_at >= settings.patience:
            raise StopIteration

    minimize(
        objective,
        torch.cat([w.flatten() for w in weights]).double().numpy(),
        jac=True,
        method="L-BFGS-B",
        callback=after,
        options={
            "maxcor": settings.memory,
            "maxiter": settings.iterations,
            "maxfun": 3 * settings.iterations,
            "ftol": 1e-9,
            "gtol": 1e-8,
        },
    )
    progress.weights = progress.best_weights
    return progress


def _warm_start(
    weights: list[Tensor], training: Batch, scale: tuple, settings: Fast, seed: int
) -> None:
    """Adam on windows of a few steps, in place; learning rate falling to zero on a cosine."""
    pieces = shortened(training, settings.warm_steps)
    count = pieces.velocity.shape[1]
    moments = [torch.zeros_like(w) for w in [*weights, *weights]]
    stream = seeds.generator(seed, "warm start")
    total = settings.warm_epochs * settings.warm_subsets
    step = 0
    for _ in range(settings.warm_epochs):
        order = torch.randperm(count, generator=stream)
        for rows in torch.tensor_split(order, settings.warm_subsets):
            if len(rows) == 0:
                continue
            fall = 0.5 * (1.0 + math.cos(math.pi * step / total))
            _, gradients = network_gradient.loss_and_gradient(weights, pieces.pick(rows), *scale)
            step += 1
            rate = settings.warm_learning_rate * fall
            network_gradient.adam(weights, moments, gradients, step, rate)


def shortened(data: Batch, steps: int) -> Batch:
    """Windows cut into consecutive pieces of `steps` Euler steps, each its own window."""
    whole = (data.velocity.shape[0] - 1) // steps
    if whole == 0:
        return data
    starts = [k * steps for k in range(whole)]

    def pieces(values: Tensor, length: int) -> Tensor:
        return torch.cat([values[s : s + length] for s in starts], dim=1)

    return Batch(
        pieces(data.velocity, steps + 1), pieces(data.driven, steps + 1), pieces(data.dt, steps)
    )
