"""Training: the paper's recipe, and a short one that takes seconds.

Knows no disk: what must last is handed to `checkpoint`, and comes back as `resume`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor

from shiplog.models.feedforward import FeedForward
from shiplog.training.network import network_gradient
from shiplog.training.network.network_gradient import Batch
from shiplog.training.settings import random_streams
from shiplog.training.settings.run_config import Fast, Paper

HISTORY = ("epoch", "training", "validation", "smoothed")
OUT_OF_REACH = 1e30  # the value of a rollout that diverges: the line search shortens its step
KEPT_POINTS = 6  # of a line search; it seldom asks more


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
    pause: int | None = None,
    report: Callable[[float], None] | None = None,
) -> Progress:
    """Adam on three random subsets an epoch until the validation loss has risen, Sec. 4.3.

    Stops once more than `least_epochs` are done and L > rise · (L_init - L_min) + L_min on the
    validation windows (Eq. 24). The weights to keep are `best_weights` (smallest L, not smoothed).
    The regulariser λ‖θ‖² of Eq. 6 has the gradient 2λθ, which is Adam's `weight_decay`.

    checkpoint  is called every so many epochs with where it stands, `resume` of a later call
    pause       return after so many epochs, finished or not
    report      is called with the share that is done
    """
    weights = [p.detach().clone() for p in model.weights]
    moments = [torch.zeros_like(w) for w in [*weights, *weights]]
    scale = (model.scaling, model.shape)
    stream = random_streams.generator(seed, "batches")
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
    until = math.inf if pause is None else progress.epoch + pause
    while not paper_done(progress, settings) and progress.epoch < until:
        progress.epoch += 1
        order = torch.randperm(count, generator=stream)
        subsets = torch.tensor_split(order, settings.subsets)
        total = _epoch(weights, moments, training, scale, subsets, settings, progress)
        loss = network_gradient.loss_only(weights, validation, *scale)
        _note(progress, weights, total, loss, settings.smoothing)
        if checkpoint is not None and progress.epoch % every == 0:
            snapshot()
            checkpoint(progress)
        if report is not None:
            report(share_done(progress.epoch, settings))
    snapshot()
    return progress


def _epoch(
    weights: list[Tensor],
    moments: list[Tensor],
    training: Batch,
    scale: tuple,
    subsets: Sequence[Tensor],
    settings: Paper,
    progress: Progress,
) -> float:
    """Adam on each subset of window numbers, in place; the mean loss over all of them."""
    rate, decay = settings.learning_rate, 2.0 * settings.regularisation
    total = 0.0
    for rows in subsets:
        if len(rows) == 0:
            continue
        loss, gradients = network_gradient.loss_and_gradient(weights, training.pick(rows), *scale)
        progress.steps += 1
        network_gradient.adam(weights, moments, gradients, progress.steps, rate, decay)
        total += loss * len(rows) / training.velocity.shape[1]
    return total


def share_done(epoch: int, settings: Paper) -> float:
    """Of a training, 0 to 0.99: how long it takes beyond the least epochs nobody knows."""
    return min(0.99, epoch / max(settings.most_epochs or settings.least_epochs, 1))


def ended(best: float, epochs: int) -> str:
    """What a finished training came to."""
    return f"best validation L {best:.0f} after {epochs} epochs"


def paper_done(progress: Progress, settings: Paper) -> bool:
    """Whether the stopping rule holds, Eq. 24, or no loss is a number any more."""
    _, training, validation, _ = progress.history[-1]
    if progress.epoch and not (math.isfinite(training) or math.isfinite(validation)):
        return True  # diverged for good: the best weights stand
    if settings.most_epochs is not None and progress.epoch >= settings.most_epochs:
        return True
    limit = settings.rise * (progress.first - progress.best) + progress.best
    return progress.epoch > settings.least_epochs and validation > limit


def _note(
    progress: Progress, values: list[Tensor], training: float, loss: float, alpha: float
) -> None:
    """One more epoch in the history; the best weights so far."""
    if loss < progress.best:
        progress.best_weights = [v.clone() for v in values]
    note_losses(progress, training, loss, alpha)


def note_losses(progress: Progress, training: float, loss: float, alpha: float) -> None:
    """One more epoch in the history (smoothing as in Eq. 23), without its weights."""
    progress.smoothed = alpha * loss + (1.0 - alpha) * progress.smoothed
    progress.history.append((progress.epoch, training, loss, progress.smoothed))
    if loss < progress.best:
        progress.best = loss


def fast(
    model: FeedForward,
    training: Batch,
    validation: Batch,
    settings: Fast,
    seed: int,
    report: Callable[[float], None] | None = None,
) -> Progress:
    """Short windows with Adam, then L-BFGS (Liu and Nocedal, 1989) on the whole rollouts.

    Warm start: every window cut into pieces of `warm_steps` Euler steps, which bend the network
    into shape cheaply and without the long rollouts' chaos. Then L-BFGS on the paper's loss with
    its regulariser, keeping the weights with the smallest validation loss. Of a set with more than
    `most_windows` each seed takes as many at random.
    """
    scale = (model.scaling, model.shape)
    weights = [p.detach().clone() for p in model.weights]
    start = network_gradient.loss_only(weights, validation, *scale)
    progress = Progress(0, weights, [w.clone() for w in weights], start, start, start)
    progress.history.append((0, math.nan, start, start))
    count = training.velocity.shape[1]
    if count > settings.most_windows:
        order = torch.randperm(count, generator=random_streams.generator(seed, "windows"))
        training = training.pick(order[: settings.most_windows].sort().values)
    _warm_start(weights, training, scale, settings, seed)
    penalty = settings.regularisation

    def objective(values: list[Tensor]) -> tuple[float, list[Tensor]]:
        loss, gradients = network_gradient.loss_and_gradient(values, training, *scale)
        squares = sum(float(v.square().sum()) for v in values)
        return loss + penalty * squares, [
            g.add_(v, alpha=2.0 * penalty) for g, v in zip(gradients, values, strict=True)
        ]

    since = 0  # iterations without a better validation loss
    for value in lbfgs(objective, weights, settings.memory, settings.iterations):
        progress.epoch += 1
        best = progress.best
        loss = network_gradient.loss_only(weights, validation, *scale)
        squares = sum(float(w.square().sum()) for w in weights)
        _note(progress, weights, value - penalty * squares, loss, settings.smoothing)
        since = 0 if progress.best < best else since + 1
        if report is not None:
            report(progress.epoch / settings.iterations)
        if since >= settings.patience:
            break
    progress.weights = progress.best_weights
    return progress


def lbfgs(
    objective: Callable[[list[Tensor]], tuple[float, list[Tensor]]],
    weights: list[Tensor],
    memory: int,
    most: int,
) -> Iterator[float]:
    """Iterations of L-BFGS with a strong Wolfe line search, in place; the value after each.

    objective   weights → value and gradient, of the weights' shapes
    memory      how many steps its approximation of the Hessian keeps
    most        iterations

    Ends by itself where the gradient or the step is nothing.
    """
    parameters = [torch.nn.Parameter(w) for w in weights]  # they share memory with the weights
    optimiser = torch.optim.LBFGS(
        parameters, max_iter=1, max_eval=25, history_size=memory, line_search_fn="strong_wolfe",
        tolerance_grad=0.0, tolerance_change=0.0,
    )  # fmt: skip
    # The optimiser asks again for the point at which it arrived: what it has asked lately is kept.
    known: list[tuple[list[Tensor], float, list[Tensor]]] = []

    def closure() -> float:
        found = next((one for one in known if _same(one[0], weights)), None)
        if found is None:
            value, slopes = objective(weights)
            if not math.isfinite(value) or not all(bool(g.isfinite().all()) for g in slopes):
                value, slopes = OUT_OF_REACH, [torch.zeros_like(w) for w in weights]
            found = ([w.clone() for w in weights], value, slopes)
            known.append(found)
            del known[:-KEPT_POINTS]
        _, value, slopes = found
        for parameter, slope in zip(parameters, slopes, strict=True):
            parameter.grad = slope.clone()
        return value

    value = closure()
    for _ in range(most):
        before = [w.clone() for w in weights]
        optimiser.step(closure)
        if _same(before, weights):
            return
        value = closure()
        yield value


def _same(left: list[Tensor], right: list[Tensor]) -> bool:
    return all(torch.equal(a, b) for a, b in zip(left, right, strict=True))


def _warm_start(
    weights: list[Tensor], training: Batch, scale: tuple, settings: Fast, seed: int
) -> None:
    """Adam on windows of a few steps, in place; learning rate falling to zero on a cosine."""
    pieces = shortened(training, settings.warm_steps)
    count = pieces.velocity.shape[1]
    moments = [torch.zeros_like(w) for w in [*weights, *weights]]
    stream = random_streams.generator(seed, "warm start")
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
