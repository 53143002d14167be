"""The paper's recipe for all seeds of a run at once, in torch; on a GPU an epoch is one CUDA graph.

A network of this size leaves most of a GPU idle, and a kernel's launch takes longer than its work.
So all seeds are one batch of matrix products, whole epochs are replayed without the processor, and
several runs take turns on streams of their own.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence

import torch
from torch import Tensor

from shiplog.exceptions import RunError
from shiplog.models.feedforward import Scaling
from shiplog.training.network import network_gradient
from shiplog.training.network.job import Training
from shiplog.training.network.network_gradient import BETA_1, BETA_2, EPSILON, Batch
from shiplog.training.network.network_training import Progress, note_losses, paper_done
from shiplog.training.settings import random_streams
from shiplog.training.settings.run_config import Paper

POLL_S = 2e-4  # between two looks whether a GPU has finished an epoch, which takes milliseconds

Checkpoint = Callable[[int, Progress], None]


class SeedsTogether:
    """Seeds of one run that advance together, each as `network_training.paper` would alone.

    Every seed has its own weights, moments, windows, random split and end. Seeds that have ended
    leave the batch.

    trainings    seeds of one run: the same settings, and windows of the same number
    resumed      seed → where it stood, for those that do not begin
    checkpoint   is called with seed and progress every `every` epochs

    Raises RunError where windows hold what is not a number, and for a GPU with too little memory.
    """

    def __init__(
        self,
        trainings: Sequence[Training],
        device: torch.device,
        resumed: Mapping[int, Progress] | None = None,
        checkpoint: Checkpoint | None = None,
        every: int = 250,
    ) -> None:
        self._trainings = {one.seed: one for one in trainings}
        self.settings = trainings[0].config.paper
        self._device = device
        self._checkpoint, self._every = checkpoint, every
        self._streams = {s: random_streams.generator(s, "batches") for s in self._trainings}
        self.progress: dict[int, Progress] = {}
        for seed, training in self._trainings.items():
            training.refuse_not_finite()
            known = (resumed or {}).get(seed)
            if known is not None and known.stream is not None:
                self._streams[seed].set_state(known.stream)
            self.progress[seed] = known or _at_start(training)
        self._batch: _EpochBatch | None = None
        try:
            self._enter()
        except torch.OutOfMemoryError as error:
            count = trainings[0].training.dt.shape[1]
            raise RunError(
                f"The GPU has too little memory for {len(trainings)} seeds of {count} windows.",
                hint="train fewer seeds at a time, or leave --device out.",
            ) from error

    @property
    def running(self) -> tuple[int, ...]:
        """The seeds that have not ended."""
        return tuple(s for s, p in self.progress.items() if not paper_done(p, self.settings))

    def launch(self) -> None:
        """Begin one epoch of all running seeds, without waiting for it."""
        assert self._batch is not None
        count = self._batch.order.shape[1]
        self._batch.launch(
            [torch.randperm(count, generator=self._streams[s]) for s in self._batch.seeds]
        )

    def ready(self) -> bool:
        """Whether the epoch that was launched is over."""
        assert self._batch is not None
        return self._batch.ready()

    def collect(self) -> tuple[int, ...]:
        """Note the losses of the epoch that is over. Returns the seeds that ended with it."""
        batch = self._batch
        assert batch is not None
        training, validation = batch.losses()
        for seed, learnt, loss in zip(batch.seeds, training, validation, strict=True):
            progress = self.progress[seed]
            progress.epoch += 1
            progress.steps += batch.updates
            note_losses(progress, learnt, loss, self.settings.smoothing)
        ended = tuple(s for s in batch.seeds if paper_done(self.progress[s], self.settings))
        due = [s for s in batch.seeds if self.progress[s].epoch % self._every == 0]
        if ended:
            self.snapshot()
            self._enter()
        elif due:
            self.snapshot()
        for seed in due:
            if self._checkpoint is not None and seed not in ended:
                self._checkpoint(seed, self.progress[seed])
        return ended

    def snapshot(self) -> None:
        """Bring weights and moments of all running seeds into `progress`."""
        if self._batch is not None:
            self._batch.read(self.progress)
            for seed in self._batch.seeds:
                self.progress[seed].stream = self._streams[seed].get_state()

    def _enter(self) -> None:
        """The running seeds as the batch."""
        self._batch = None  # its memory first
        if self.running:
            chosen = [self._trainings[s] for s in self.running]
            self._batch = _EpochBatch(chosen, self.progress, self.settings, self._device)


def advance(
    runs: Sequence[SeedsTogether],
) -> Iterator[tuple[SeedsTogether, tuple[int, ...]]]:
    """Train all runs to their end, each on its own stream; after each epoch of a run, the run and
    the seeds that ended with it. First those that had ended before, with a checkpoint there."""
    for run in runs:
        if before := tuple(seed for seed in run.progress if seed not in run.running):
            yield run, before
    waiting = [run for run in runs if run.running]
    for run in waiting:
        run.launch()
    while waiting:
        over = [run for run in waiting if run.ready()]
        if not over:
            time.sleep(POLL_S)
        for run in over:
            ended = run.collect()
            if not run.running:
                waiting.remove(run)
            else:
                run.launch()
            yield run, ended


def _at_start(training: Training) -> Progress:
    weights = [p.detach().clone() for p in training.model.weights]
    moments = [torch.zeros_like(w) for w in [*weights, *weights]]
    start = network_gradient.loss_only(
        weights, training.validation, training.scaling, training.shape
    )
    return Progress(
        0, weights, [w.clone() for w in weights], start, start, start, moments,
        history=[(0, math.nan, start, start)],
    )  # fmt: skip


class _EpochBatch:
    """S seeds' tensors at fixed places in memory, and the epoch that works on them.

    order   [S, N]  window numbers as each seed splits them in this epoch
    """

    def __init__(
        self,
        trainings: Sequence[Training],
        progress: Mapping[int, Progress],
        settings: Paper,
        device: torch.device,
    ) -> None:
        self.seeds = [one.seed for one in trainings]
        self._settings, self._shape = settings, trainings[0].shape
        self._scale = _move_scaling(
            trainings[0].scaling, trainings[0].training.velocity.dtype, device
        )
        self._training = _stacked([one.training for one in trainings], device)
        self._validation = _stacked([one.validation for one in trainings], device)
        count = self._training.velocity.shape[2]
        self.order = torch.zeros(len(trainings), count, dtype=torch.int64, device=device)
        self._rows = torch.arange(len(trainings), device=device)[:, None]
        self._found = torch.zeros(2, len(trainings), dtype=torch.float64, device=device)
        standing = [progress[seed] for seed in self.seeds]
        self._weights = _columns([p.weights for p in standing], device)
        self._moments = _columns([p.moments for p in standing], device)
        self._best_weights = _columns([p.best_weights for p in standing], device)
        numbers = [[p.best for p in standing], [float(p.steps) for p in standing]]
        self._best, self._steps = torch.tensor(numbers, dtype=torch.float64, device=device)
        self.updates = min(settings.subsets, count)
        self._on_gpu = device.type == "cuda"
        if self._on_gpu:
            self._capture()

    def launch(self, orders: Sequence[Tensor]) -> None:
        order = torch.stack(list(orders))
        if not self._on_gpu:
            self.order.copy_(order)
            self._epoch()
            return
        with torch.cuda.stream(self._stream):
            self._order_sent.copy_(order)
            self.order.copy_(self._order_sent, non_blocking=True)
            self._graph.replay()
            self._found_here.copy_(self._found, non_blocking=True)
            self._over.record()

    def ready(self) -> bool:
        return not self._on_gpu or self._over.query()

    def losses(self) -> tuple[list[float], list[float]]:
        """Training and validation loss of each seed, of the epoch that is over."""
        training, validation = (self._found_here if self._on_gpu else self._found).tolist()
        return training, validation

    def read(self, progress: Mapping[int, Progress]) -> None:
        for index, seed in enumerate(self.seeds):
            one = progress[seed]
            one.weights, one.moments, one.best_weights = (
                [t[index].cpu().clone() for t in tensors]
                for tensors in (self._weights, self._moments, self._best_weights)
            )

    def _capture(self) -> None:
        """An epoch as a CUDA graph. It is run once before, for libraries to set themselves up,
        and what that changed is put back."""
        changed = [
            *self._weights, *self._moments, *self._best_weights, self._best, self._steps
        ]  # fmt: skip
        before = [t.clone() for t in changed]
        self._stream = torch.cuda.Stream()
        self._stream.wait_stream(torch.cuda.current_stream())
        self._order_sent = torch.zeros_like(self.order, device="cpu").pin_memory()
        self._found_here = torch.zeros_like(self._found, device="cpu").pin_memory()
        self._over = torch.cuda.Event()
        with torch.cuda.stream(self._stream):
            self._epoch()
        torch.cuda.synchronize()
        self._graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(self._graph, stream=self._stream):
            self._epoch()
        for tensor, value in zip(changed, before, strict=True):
            tensor.copy_(value)
        torch.cuda.synchronize()

    @torch.no_grad()
    def _epoch(self) -> None:
        """Adam on each subset, then the validation loss and the best weights; all in place."""
        count = self.order.shape[1]
        self._found.zero_()
        for rows in torch.tensor_split(self.order, self._settings.subsets, dim=1):
            if rows.shape[1] == 0:
                continue
            loss, gradients = network_gradient.joint_gradient(
                self._weights, self._pick(rows), self._scale, self._shape
            )
            self._adam(gradients)
            self._found[0] += loss * (rows.shape[1] / count)
        loss, _ = network_gradient.joint_gradient(
            self._weights, self._validation, self._scale, self._shape, gradient=False
        )
        self._found[1] = loss
        better = loss < self._best
        self._best.copy_(torch.where(better, loss, self._best))
        for best, weight in zip(self._best_weights, self._weights, strict=True):
            best.copy_(torch.where(_per_seed(better, weight), weight, best))

    def _pick(self, rows: Tensor) -> Batch:
        """Each seed's windows of these numbers, [S, n]."""
        data = self._training
        return Batch(*(t[:, self._rows, rows] for t in (data.velocity, data.driven, data.dt)))

    def _adam(self, gradients: Sequence[Tensor]) -> None:
        """As `network_gradient.adam`, each seed at its own step."""
        settings = self._settings
        self._steps += 1.0
        mean_share, square_share = (1.0 - beta**self._steps for beta in (BETA_1, BETA_2))
        means = self._moments[: len(self._weights)]
        squares = self._moments[len(self._weights) :]
        for w, mean, square, g in zip(self._weights, means, squares, gradients, strict=True):
            g = g.add(w, alpha=2.0 * settings.regularisation)
            mean.lerp_(g, 1.0 - BETA_1)
            square.mul_(BETA_2).addcmul_(g, g, value=1.0 - BETA_2)
            root = (square / _per_seed(square_share, w).to(w.dtype)).sqrt_().add_(EPSILON)
            rate = settings.learning_rate / mean_share
            w.addcmul_(mean / root, _per_seed(rate, w).to(w.dtype), value=-1.0)


def _per_seed(values: Tensor, like: Tensor) -> Tensor:
    """[S] as [S, 1, ...], to be broadcast over `like`."""
    return values.view(-1, *[1] * (like.dim() - 1))


def _move_scaling(scaling: Scaling, dtype: torch.dtype, device: torch.device) -> Scaling:
    return Scaling(*(getattr(scaling, n).to(device, dtype) for n in Scaling.__slots__))


def _stacked(batches: Sequence[Batch], device: torch.device) -> Batch:
    """Batches of several seeds as one: [I, S, N, ...]."""
    columns = zip(*((b.velocity, b.driven, b.dt) for b in batches), strict=True)
    return Batch(*(torch.stack(list(column), dim=1).to(device) for column in columns))


def _columns(lists: Sequence[Sequence[Tensor]], device: torch.device) -> list[Tensor]:
    """Weight by weight, the seeds stacked."""
    return [torch.stack(list(column)).to(device) for column in zip(*lists, strict=True)]
