"""How much of the paper's recipe the fast one costs, in window-steps to the best validation loss.

    python -m pipelines.experiments.benchmarks.recipes PAPER FAST [PAPER FAST ...]

PAPER and FAST are finished runs of networks on the same windows, one of each recipe, such as
`shiplog train --data ref --seeds 5 --recipe paper --out PAPER` makes. A window-step is one Euler
step of one window, forward and backward. The paper's are counted from its history; the fast
training is done once more, its line searches and its warm start counted with it. Where --epochs
ended the paper's run before its stopping rule, a longer run can only have its best loss later: the
ratio is then the most that it can be.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import numpy as np
import torch

from pipelines.experiments.benchmarks.machine import processor
from shiplog.training.network import network_gradient
from shiplog.training.network.queue import cores
from shiplog.training.runs import load_model
from shiplog.training.runs.load_model import NetworkRun
from shiplog.training.runs.network_seeds import training_of
from shiplog.training.runs.run_folder import open_finished


@dataclass(frozen=True)
class Cost:
    """Window-steps to the best validation loss L, that loss, and s of processor time of all."""

    steps: float
    best: float
    seconds: float = float("nan")


def of_paper(run: NetworkRun, seed: int) -> Cost:
    history = run.history(seed)
    losses = history["validation"].to_numpy()
    best = int(np.nanargmin(losses))
    steps = int(history["epoch"][best]) * run.windows().height * (run.config.window - 1)
    return Cost(steps, float(losses[best]))


def of_fast(run: NetworkRun, seed: int) -> tuple[Cost, Callable[[float], float]]:
    """Its cost; and loss → window-steps to a validation loss as small, inf where none was."""
    steps = 0
    losses: list[tuple[float, int]] = []
    gradient, plain = network_gradient.loss_and_gradient, network_gradient.loss_only

    def counted(weights, batch, *scale, **wanted):
        nonlocal steps
        if wanted.get("gradient", True):  # a validation needs none, and the paper's is not counted
            steps += batch.dt.numel()
        return gradient(weights, batch, *scale, **wanted)

    def noted(weights, batch, *scale):
        losses.append((plain(weights, batch, *scale), steps))
        return losses[-1][0]

    training = training_of(run, seed)
    began = time.process_time()
    with (
        mock.patch.object(network_gradient, "loss_and_gradient", counted),
        mock.patch.object(network_gradient, "loss_only", noted),
    ):
        training.run()
    took = time.process_time() - began
    best, at = min(losses)

    def until(wanted: float) -> float:
        return min((at for loss, at in losses if loss <= wanted), default=float("inf"))

    return Cost(at, best, took), until


def row(paper: NetworkRun, fast: NetworkRun, seed: int) -> tuple[str, float, float]:
    """A line of the table, and the shares of the paper's window-steps: to its own best loss, and to
    the paper's (inf where it never comes to that)."""
    slow = of_paper(paper, seed)
    quick, until = of_fast(fast, seed)
    reached = until(slow.best) / slow.steps
    as_good = f"{reached:.4f}" if np.isfinite(reached) else "never"
    line = (
        f"{paper.profile.ship.name} {paper.config.data:10} {seed:4d} {slow.best:9.0f} "
        f"{quick.best:9.0f} {slow.steps:10.3g} {quick.steps:10.3g} "
        f"{quick.steps / slow.steps:8.4f} {as_good:>8} {quick.seconds:6.1f}"
    )
    return line, quick.steps / slow.steps, reached


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("runs", type=Path, nargs="+", metavar="PAPER FAST")
    paths = parser.parse_args().runs
    torch.set_num_threads(1)
    print(f"{processor()}, {cores()} core(s)")
    print("ship, set, seed; best validation L of paper and fast; window-steps to it of both; their")
    print("ratio; that of the window-steps to the paper's best L; s of processor time of fast")
    ratios, as_good = [], []
    for slow, quick in zip(paths[::2], paths[1::2], strict=True):
        paper, fast = (load_model.network(open_finished(path)) for path in (slow, quick))
        if not paper.windows().equals(fast.windows()):
            parser.error(f"{slow} and {quick} were not trained on the same windows.")
        for seed in sorted({*paper.config.seeds} & {*fast.config.seeds}):
            line, ratio, reached = row(paper, fast, seed)
            ratios.append(ratio)
            as_good.append(reached)
            print(line, flush=True)
    never = sum(np.isinf(as_good))
    print(f"median of {len(ratios)}: {statistics.median(ratios):.4f}")
    print(f"to the paper's best L: {statistics.median(as_good):.4f}, {never} of them never")


if __name__ == "__main__":
    main()
