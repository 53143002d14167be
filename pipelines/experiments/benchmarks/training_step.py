"""The time of one update: loss and gradient of rollouts, and Adam; peers in the same run.

    python -m pipelines.experiments.benchmarks.training_step [--windows 8 15 77 767] [--rounds 9]

CPU time of one thread, implementations in turn, round by round. All must agree on loss and gradient
before they are timed. Also printed: the share of this core's best matrix product, memory above
rest, and what two trainings on two cores do against one. Peers: pip install '.[bench]'.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

ONE_THREAD = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {ONE_THREAD}".strip()

import numpy as np  # noqa: E402 (after the environment is set, as all below)
import torch  # noqa: E402

from pipelines.experiments.benchmarks.machine import processor  # noqa: E402
from shiplog.models.feedforward import Scaling  # noqa: E402
from shiplog.models.network_shape import Shape  # noqa: E402
from shiplog.training.network import kernel, network_gradient  # noqa: E402
from shiplog.training.network.network_gradient import Batch  # noqa: E402
from shiplog.training.network.queue import cores  # noqa: E402

SAMPLES = 100  # of a window
SHAPE = Shape(3)
WORK = 118.2e6  # floating point operations of a window: 99 steps forward, backward, weights
PRODUCT = 1024  # rows of the square matrices of the core's best product
CLOSE = 3e-5  # of loss and gradient in float32
SECONDS = 4.0  # for which two trainings run on two cores
UNIT = Scaling(torch.zeros(8), torch.ones(8), torch.zeros(3), torch.ones(3))


def problem(count: int) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Weights, velocities [I, N, 3] and standardised inputs [I, N, 5], all float32."""
    rng = np.random.default_rng(count)
    widths = [SHAPE.inputs, *[SHAPE.width] * SHAPE.depth, 3]
    weights: list[np.ndarray] = []
    for into, out in pairwise(widths):
        bound = into**-0.5
        weights += [rng.uniform(-bound, bound, (out, into)), rng.uniform(-bound, bound, out)]
    weights[-2] *= 0.02  # accelerations of a ship, not of a ball
    weights[-1] *= 0.02
    velocity = 0.3 * rng.normal(size=(SAMPLES, count, 3)).cumsum(0) / SAMPLES**0.5
    driven = rng.normal(size=(SAMPLES, count, SHAPE.inputs - 3))
    return [w.astype("f4") for w in weights], velocity.astype("f4"), driven.astype("f4")


def ours(weights, velocity, driven, body: str):
    """Loss and gradient by one of our bodies, and one update of Adam."""
    given = [torch.from_numpy(w.copy()) for w in weights]
    dt = torch.ones(velocity.shape[0] - 1, velocity.shape[1])
    data = Batch(torch.from_numpy(velocity), torch.from_numpy(driven), dt)

    def job() -> tuple[float, list[np.ndarray]]:
        os.environ[kernel.SWITCH] = body
        loss, slopes = network_gradient.loss_and_gradient(given, data, UNIT, SHAPE)
        return loss, [s.numpy() for s in slopes]

    return job


def with_adam(job, weights) -> Callable[[], object]:
    """The job and an update, by the kernel's Adam for ours and by torch's for the peers."""
    given = [torch.from_numpy(w.copy()) for w in weights]
    moments = [torch.zeros_like(w) for w in [*given, *given]]
    parameters = [torch.nn.Parameter(w.clone()) for w in given]
    adam = torch.optim.Adam(parameters, lr=1e-4, weight_decay=0.02, foreach=True)

    def update() -> None:
        _, slopes = job()
        if job.__qualname__.startswith("ours"):
            tensors = [torch.from_numpy(s) for s in slopes]
            network_gradient.adam(given, moments, tensors, 1, 1e-4, 0.02)
        else:
            for parameter, slope in zip(parameters, slopes, strict=True):
                parameter.grad = torch.tensor(slope)
            adam.step()

    return update


def cpu_seconds(job: Callable[[], object]) -> float:
    began = time.process_time()
    job()
    return time.process_time() - began


def best_product() -> float:
    """Floating point operations a second of this core's best square product, torch's or numpy's."""
    left = np.random.default_rng(0).normal(size=(PRODUCT, PRODUCT)).astype("f4")
    a = torch.from_numpy(left)
    both = (lambda: left @ left, lambda: a @ a)
    return 2.0 * PRODUCT**3 / min(cpu_seconds(job) for job in both for _ in range(3))


def same(jobs: dict[str, Callable]) -> None:
    """Raises AssertionError where two implementations differ in loss or gradient."""
    loss, slopes = next(iter(jobs.values()))()
    reference = np.concatenate([s.ravel() for s in slopes]).astype("f8")
    for name, job in jobs.items():
        value, found = job()
        flat = np.concatenate([s.ravel() for s in found]).astype("f8")
        off = float(np.linalg.norm(flat - reference) / np.linalg.norm(reference))
        assert abs(value / loss - 1.0) < CLOSE, f"{name}: loss {value}, not {loss}"
        assert off < CLOSE, f"{name}: gradient off by {off:.1e}"


def timed(count: int, rounds: int, peers: bool) -> None:
    """One table: each implementation's time, and over the first one's."""
    data = problem(count)
    os.environ.pop(kernel.SWITCH, None)
    level = kernel.level()
    jobs = {} if level is None else {f"kernel, {level}": ours(*data, level)}
    jobs["torch body"] = ours(*data, "off")
    if peers:
        from pipelines.experiments.benchmarks.gradient_peers import peers as all_peers

        jobs |= all_peers(*data)
    same(jobs)
    updates = {name: with_adam(job, data[0]) for name, job in jobs.items()}
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    products = []
    for _ in range(rounds):
        products.append(best_product())
        for name, update in updates.items():
            seconds[name].append(cpu_seconds(update))
    first = next(iter(seconds.values()))
    print(f"\n{count} windows{'':<22} {'median':>9} {'least':>9} ms   over the first one")
    for name, each in seconds.items():
        ratios = sorted(other / own for other, own in zip(each, first, strict=True))
        print(
            f"  {name:<30} {1e3 * statistics.median(each):>9.2f} {1e3 * min(each):>9.2f}"
            f"      {statistics.median(ratios):.2f} ({ratios[0]:.2f} to {ratios[-1]:.2f})"
        )
    rate = count * WORK / statistics.median(first)
    peak = statistics.median(products)
    shares = [count * WORK / own / best for own, best in zip(first, products, strict=True)]
    print(
        f"  {rate / 1e9:.0f} GFLOP/s of {peak / 1e9:.0f}: {statistics.median(shares):.0%} of the "
        f"core's best product ({min(shares):.0%} to {max(shares):.0%})",
        flush=True,
    )


def trained(count: int, seconds: float) -> tuple[int, float]:
    """Updates in so many seconds of wall time, and the memory of one above rest [MiB]."""
    data = problem(count)
    update = with_adam(ours(*data, ""), data[0])
    cpu_seconds(lambda: torch.ones(64, 64) @ torch.ones(64, 64))
    at_rest = resident("VmRSS")
    if at_rest:
        Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")  # the peak begins anew
    update()
    above = resident("VmHWM") - at_rest
    began, done = time.monotonic(), 0
    while time.monotonic() - began < seconds:
        update()
        done += 1
    return done, above


def resident(which: str) -> float:
    """Memory of this process [MiB], now or at its peak; 0 where the system does not say."""
    status = Path("/proc/self/status")
    if not status.exists():
        return 0.0
    lines = status.read_text(encoding="utf-8").splitlines()
    return next(float(line.split()[1]) for line in lines if line.startswith(which)) / 1024.0


def child(count: int) -> subprocess.Popen:
    command = [
        sys.executable,
        "-m",
        "pipelines.experiments.benchmarks.training_step",
        "--child",
        str(count),
    ]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def together(count: int, rounds: int) -> None:
    """Two trainings on two cores against one, and the memory of one."""
    ratios, memory = [], 0.0
    for _ in range(rounds):
        alone = child(count).communicate()[0].split()
        both = [process.communicate()[0].split() for process in (child(count), child(count))]
        ratios.append(sum(int(one[0]) for one in both) / int(alone[0]))
        memory = max(memory, float(alone[1]))
    middle = statistics.median(ratios)
    print(
        f"{count} windows: two trainings are {middle:.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
        f" times one; {memory:.0f} MiB above rest",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--windows", type=int, nargs="+", default=[8, 15, 77, 767])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument("--child", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    torch.set_num_threads(1)
    if options.child:
        print(*trained(options.child, SECONDS))
        return
    print(f"{processor()}, {cores()} core(s), kernel: {kernel.level() or 'not built'}")
    for count in options.windows:
        timed(count, options.rounds, not options.no_peers)
    print()
    if cores() > 1:
        for count in options.windows:
            together(count, 3)


if __name__ == "__main__":
    main()
