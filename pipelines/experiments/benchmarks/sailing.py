"""Ten thousand zigzags of 300 s in closed loop, each with its own coefficients and discrepancy;
the peers are rollouts of as many windows on given orders.

    python -m pipelines.experiments.benchmarks.sailing RUN [--members 10000] [--rounds 3]

Processor time of one process. `rollout` is the compiled kernel of open-loop windows with one set of
coefficients for all; `call a member` is the kernel called once for each, as one whose coefficients
differ has to be. Neither can reverse a rudder at a heading.
"""

from __future__ import annotations

import argparse
import math
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from shiplog.simulation.schedules import Zigzag
from shiplog.simulation.sensitivities import rollout
from shiplog.simulation.window_series import WindowSeries, pick
from shiplog.training.runs import load_model
from shiplog.training.runs.sailing_run import Sailor, of_run

SECONDS = 300
FEW = 200  # members that are called one by one; the others by proportion


def windows(sailor: Sailor, members: int) -> WindowSeries:
    """As many instants, a constant rudder angle each."""
    count = SECONDS + 1
    measured = np.zeros((members, count, 6))
    measured[:, 0, 1] = sailor.speed
    approach = sailor.controls(sailor.speed)
    angle = np.linspace(-0.3, 0.3, members)[:, None]
    held = approach.approach + angle * approach.steering
    actuator = np.repeat(held[:, None], count, axis=1)
    still = np.zeros((members, count, 2))
    return WindowSeries(measured, actuator, still, np.ones((members, count - 1)), np.ones(members))


def spent(job: Callable[[], object]) -> float:
    began = time.process_time()
    job()
    return time.process_time() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path, help="an mmg run")
    parser.add_argument("--members", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    sailor = of_run(load_model.load(given.run))
    own = sailor.run.simulator(sailor.run.config.seeds[0])
    data = windows(sailor, given.members)
    few = min(FEW, given.members)
    zigzag = Zigzag(math.radians(20.0), math.radians(20.0), reversals=10**6)

    def one_by_one() -> None:
        for k in range(few):
            rollout(own.model, own.theta, pick(data, slice(k, k + 1)))

    jobs = {
        "zigzags, closed loop": lambda: sailor.sail(zigzag, members=given.members, seconds=SECONDS),
        "rollout, one θ": lambda: rollout(own.model, own.theta, data),
        f"a call a member (of {few})": one_by_one,
    }
    each: dict[str, list[float]] = {name: [] for name in jobs}
    for job in jobs.values():  # kernels are made
        job()
    for _ in range(given.rounds):
        for name, job in jobs.items():
            scale = given.members / few if "call" in name else 1.0
            each[name].append(scale * spent(job))
    first = statistics.median(next(iter(each.values())))
    print(f"{given.members} members, {SECONDS} s, {len(own.theta)} coefficients each")
    for name, seconds in each.items():
        middle = statistics.median(seconds)
        print(f"  {name:<28} {middle:6.2f} s ({min(seconds):.2f} to {max(seconds):.2f}), "
              f"{middle / first:.2f} of the zigzags")  # fmt: skip


if __name__ == "__main__":
    main()
