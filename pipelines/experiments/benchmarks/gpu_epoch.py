"""The time of an epoch of the paper's recipe on a GPU, all seeds at once.

    python -m pipelines.experiments.benchmarks.gpu_epoch [--windows 23 2120] [--seeds 10]

23 and 2120 windows are the sets `ref` and `sli10xjit10` of the sample logs. Loss and gradient must
agree with float64 on the processor before anything is timed. Also printed: the share of this GPU's
best matrix product in float32, and the memory. Wall time between CUDA events; needs a GPU.
"""

from __future__ import annotations

import argparse
import statistics
from itertools import pairwise

import numpy as np
import torch

from pipelines.experiments.benchmarks.training_step import CLOSE, SHAPE, UNIT, WORK, problem
from shiplog.models.feedforward import FeedForward
from shiplog.training.network import network_gradient
from shiplog.training.network.gpu import find
from shiplog.training.network.job import Training
from shiplog.training.network.network_gradient import Batch
from shiplog.training.network.seeds_together import SeedsTogether, advance
from shiplog.training.settings.run_config import Config, Paper
from shiplog.voyages.windows.split_settings import Split

VALIDATION = 12  # windows of the voyage of the sample logs that validates
FORWARD = 1.0 / 3.0  # of the work of a window, where no gradient is needed
PRODUCT = 8192  # rows of the square matrices of the GPU's best product


def seeds(count: int, how_many: int, epochs: int) -> list[Training]:
    """Trainings on synthetic windows: the time does not depend on what they hold."""
    config = Config(
        recipe="paper", paper=Paper(most_epochs=epochs), split=Split(training=(), validation=())
    )
    found = []
    for seed in range(how_many):
        weights, *learnt = problem(count)
        _, *held = problem(VALIDATION)
        model = FeedForward(SHAPE, UNIT)
        with torch.no_grad():
            for parameter, value in zip(model.weights, weights, strict=True):
                parameter.copy_(torch.from_numpy(value) * (1.0 + 0.01 * seed))
        found.append(Training(config, seed, model, _batch(*learnt), _batch(*held)))
    return found


def _batch(velocity: np.ndarray, driven: np.ndarray) -> Batch:
    dt = torch.ones(velocity.shape[0] - 1, velocity.shape[1])
    return Batch(torch.from_numpy(velocity), torch.from_numpy(driven), dt)


def check(gpu: torch.device) -> None:
    """Raises AssertionError where loss or gradient differ from float64 on the processor."""
    one = seeds(8, 1, 1)[0]
    weights, data = [w.detach() for w in one.model.weights], one.training
    exact = Batch(data.velocity.double(), data.driven.double(), data.dt.double())
    loss, slopes = network_gradient.by_torch([w.double() for w in weights], exact, UNIT, SHAPE)
    there = Batch(data.velocity.to(gpu), data.driven.to(gpu), data.dt.to(gpu))
    scale = type(UNIT)(*(getattr(UNIT, name).to(gpu) for name in UNIT.__slots__))
    value, found = network_gradient.by_torch([w.to(gpu) for w in weights], there, scale, SHAPE)
    flat, reference = (torch.cat([s.double().cpu().ravel() for s in g]) for g in (found, slopes))
    off = float((flat - reference).norm() / reference.norm())
    assert abs(value / loss - 1.0) < CLOSE, f"loss {value}, not {loss}"
    assert off < CLOSE, f"gradient off by {off:.1e}"
    print(f"loss and gradient against float64: {abs(value / loss - 1.0):.1e}, {off:.1e}")


def best_product(gpu: torch.device) -> float:
    """Floating point operations a second of the GPU's best square product in float32."""
    left = torch.randn(PRODUCT, PRODUCT, device=gpu)
    times = []
    for _ in range(5):
        began, over = (torch.cuda.Event(enable_timing=True) for _ in range(2))
        began.record()
        torch.mm(left, left)
        over.record()
        torch.cuda.synchronize()
        times.append(1e-3 * began.elapsed_time(over))
    return 2.0 * PRODUCT**3 / min(times)


def timed(count: int, how_many: int, epochs: int, gpu: torch.device, best: float) -> None:
    torch.cuda.reset_peak_memory_stats()
    run = SeedsTogether(seeds(count, how_many, epochs + 1), gpu)
    marks = [torch.cuda.Event(enable_timing=True)]
    torch.cuda.synchronize()
    marks[0].record()
    for _ in advance([run]):
        marks.append(torch.cuda.Event(enable_timing=True))
        marks[-1].record()
    torch.cuda.synchronize()
    times = [a.elapsed_time(b) for a, b in pairwise(marks[1:])]
    middle = statistics.median(times)
    work = how_many * WORK * (count + FORWARD * VALIDATION)
    rate = work / (1e-3 * middle)
    print(
        f"{how_many} seeds of {count} windows: {middle:.2f} ms an epoch ({min(times):.2f} to "
        f"{max(times):.2f}), {rate / 1e12:.2f} TFLOP/s, {rate / best:.0%} of the best product, "
        f"{torch.cuda.max_memory_allocated() / 2**30:.1f} GiB; 10,000 epochs in "
        f"{1e4 * 1e-3 * middle / 60.0:.1f} min",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--windows", type=int, nargs="+", default=[23, 2120])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--epochs", type=int, default=60)
    options = parser.parse_args()
    gpu = find()
    check(gpu)
    best = best_product(gpu)
    print(f"{torch.cuda.get_device_name()}, best product {best / 1e12:.1f} TFLOP/s in float32")
    for count in options.windows:
        timed(count, options.seeds, options.epochs, gpu, best)


if __name__ == "__main__":
    main()
