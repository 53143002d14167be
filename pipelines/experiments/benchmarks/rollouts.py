"""Rollouts of the MMG, their sensitivities and a refit; the peer is the same model in CasADi.

    python -m pipelines.experiments.benchmarks.rollouts [--windows 119] [--rounds 9]

One process, serial on both sides; pin it to a core with `taskset -c 1`. Without CasADi ours runs
alone. The windows are synthetic: nothing outside this repository is read.
"""

from __future__ import annotations

import argparse
import math
import platform
import shutil
import statistics
import time
from collections.abc import Callable

import jax
import numpy as np

from pipelines.experiments.benchmarks.machine import processor
from shiplog.models.mmg.geometry import geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.models.mmg.parameters import Parameters, load, published_file
from shiplog.nomenclature.channels import VELOCITY_IN_STATE
from shiplog.ship_profile import file as profile_file
from shiplog.simulation.jax_rollouts import padded
from shiplog.simulation.sensitivities import linearised, normal, rollout
from shiplog.simulation.window_series import WindowSeries
from shiplog.training.network.queue import cores
from shiplog.training.physics.output_error import Identified, identify

try:
    from pipelines.experiments.benchmarks.casadi_mmg import Peer
except ImportError:
    Peer = None

SHIP = "esso-osaka"
SAMPLES = 100  # of 1 s
FEW = ("hull.x_0f", "hull.y_v", "hull.n_v", "hull.c_d", "wind.y1")
SIGMA = np.array([0.005, 0.002, 0.005, 0.002, math.radians(0.1), math.radians(0.03)])
HIDDEN = 0.3  # spreads by which the ship behind the synthetic data differs from the starting values
Job = Callable[[], object]


def held(rng: np.random.Generator, low: float, high: float, shortest: int) -> np.ndarray:
    """An order [I] that is given anew every `shortest` to three times as many seconds."""
    out, at = np.empty(SAMPLES), 0
    while at < SAMPLES:
        until = at + int(rng.integers(shortest, 3 * shortest))
        out[at:until] = rng.uniform(low, high)
        at = until
    return out


def inputs(count: int, rng: np.random.Generator) -> WindowSeries:
    """Harbour manoeuvres: slow starts, bold orders, up to 3 m/s of wind from anywhere."""
    measured = np.zeros((count, SAMPLES, 6))
    measured[:, 0, 1] = rng.uniform(0.0, 0.4, count)
    measured[:, 0, 3] = rng.uniform(-0.05, 0.05, count)
    measured[:, 0, 4] = rng.uniform(-math.pi, math.pi, count)
    measured[:, 0, 5] = np.radians(rng.uniform(-2.0, 2.0, count))
    full = math.radians(35.0)
    actuator = [
        np.stack((held(rng, -full, full, 8), held(rng, -10.0, 15.0, 12)), -1) for _ in range(count)
    ]
    gusts = np.clip(1.0 + 0.02 * rng.normal(size=(count, SAMPLES)).cumsum(1), 0.5, 1.2)
    speed = np.minimum(rng.uniform(0.0, 3.0, (count, 1)) * gusts, 3.0)
    angle = rng.uniform(-math.pi, math.pi, (count, 1))
    wind = np.stack((speed * np.cos(angle), speed * np.sin(angle)), -1)
    return WindowSeries(
        measured, np.stack(actuator), wind, np.ones((count, SAMPLES - 1)), np.ones(count)
    )


def measurements(
    model: MMG, known: Parameters, data: WindowSeries, rng: np.random.Generator
) -> tuple[np.ndarray, WindowSeries]:
    """Another ship's parameters, and what its noisy sensors say of these manoeuvres."""
    moved = known.values + HIDDEN * known.spread * rng.normal(size=len(known.values))
    truth = np.clip(moved, known.low, known.high)
    states = rollout(model, truth, data)
    return truth, data._replace(measured=states + SIGMA * rng.normal(size=states.shape))


def clock(job: Job) -> float:
    began = time.perf_counter()
    job()
    return time.perf_counter() - began


def interleaved(jobs: dict[str, Job], rounds: int) -> dict[str, list[float]]:
    """Seconds of each job in each round: what else the machine does falls on all alike."""
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(rounds):
        for name, job in jobs.items():
            seconds[name].append(clock(job))
    return seconds


def report(title: str, seconds: dict[str, list[float]]) -> None:
    """Medians in ms, extremes, and the peers' times over ours, round by round."""
    ours = next(iter(seconds.values()))
    print(f"\n{title:<34} {'median':>9} {'least':>9} {'most':>9}   over ours (least to most)")
    for i, (name, each) in enumerate(seconds.items()):
        low, middle, high = (1e3 * f(each) for f in (min, statistics.median, max))
        line = f"  {name:<32} {middle:>9.2f} {low:>9.2f} {high:>9.2f}"
        if i:
            ratios = [theirs / own for theirs, own in zip(each, ours, strict=True)]
            middle = statistics.median(ratios)
            line += f"   {middle:.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
        print(line, flush=True)


def peers(model: MMG, data: WindowSeries) -> dict[str, tuple[str, Callable]]:
    """name → (rollout or sensitivities, θ → result), the C ones where there is a C compiler."""
    if Peer is None:
        print("\nno peer: pip install casadi")
        return {}
    found: dict[str, tuple[str, Callable]] = {}
    began = time.perf_counter()
    machine = Peer(model.geometry, model.names, data)
    found["CasADi"] = ("rollout", machine.rollout())
    found["CasADi forward mode"] = ("sensitivities", machine.forward())
    found["CasADi variational"] = ("sensitivities", machine.variational())
    print(f"  {'CasADi, building':<32} {time.perf_counter() - began:>9.2f}", flush=True)
    if shutil.which("gcc"):
        began = time.perf_counter()
        compiled = Peer(model.geometry, model.names, data, compiled=True)
        found["CasADi, step in C"] = ("rollout", compiled.rollout())
        found["CasADi variational, step in C"] = ("sensitivities", compiled.variational())
        print(f"  {'CasADi, building with gcc -O3':<32} {time.perf_counter() - began:>9.2f}")
    return found


def agreement(
    model: MMG, theta: np.ndarray, data: WindowSeries, found: dict[str, tuple[str, Callable]]
) -> None:
    """The largest differences of velocities and of their derivatives over all steps."""
    states, slopes = linearised(model, theta, data)
    ours = {"rollout": states[:, 1:], "sensitivities": slopes[:, 1:]}
    velocity = np.array(VELOCITY_IN_STATE)
    print("\nlargest difference to ours        last step   all steps   windows both finite")
    for name, (kind, job) in found.items():
        theirs = job(theta)
        if name == "CasADi forward mode":
            theirs = theirs.transpose(0, 2, 3, 1)
        elif kind == "sensitivities":
            theirs = theirs.transpose(0, 1, 3, 2)
        own = ours[kind]
        axes = tuple(range(1, own.ndim))
        finite = np.isfinite(own).all(axes) & np.isfinite(theirs).all(axes)
        apart = np.abs(theirs - own)[finite][:, :, velocity]
        if kind == "sensitivities":  # each parameter's by the largest that it has anywhere
            apart = apart / np.maximum(np.abs(own[finite][:, :, velocity]).max((0, 1, 2)), 1e-300)
        unit = "m/s, rad/s" if kind == "rollout" else "of the largest"
        print(
            f"  {name:<32} {apart[:, -1].max():>9.1e}   {apart.max():>9.1e}"
            f"   {int(finite.sum())} of {len(finite)}   {unit}"
        )


def refit(
    model: MMG, known: Parameters, data: WindowSeries, free: np.ndarray
) -> tuple[float, Identified]:
    began = time.perf_counter()
    bounds = (known.low, known.high)
    found = identify(model, known.values, known.spread, data, bounds=bounds, free=free)
    return time.perf_counter() - began, found


def refits(
    model: MMG, known: Parameters, data: WindowSeries, rounds: int, rng: np.random.Generator
) -> None:
    """Identification of all parameters and of a few, from noisy data of another ship; printed."""
    truth, noisy = measurements(model, known, data, rng)
    every, few = np.ones(len(known.values), bool), np.isin(model.names, FEW)
    print(f"\n{'refit':<18} {'s':>6} {'least':>6} {'most':>6}  evaluations  loss")
    took: dict[str, list[float]] = {"all": [], "few": []}
    found: dict[str, Identified] = {}
    for _ in range(rounds):
        for name, free in (("all", every), ("few", few)):
            seconds, found[name] = refit(model, known, noisy, free)
            took[name].append(seconds)
    for name, each in took.items():
        fit = found[name]
        print(
            f"  {f'{int(fit.free.sum())} parameters':<16} {statistics.median(each):>6.2f} "
            f"{min(each):>6.2f} {max(each):>6.2f}  {fit.evaluations:>11}  "
            f"{fit.loss[0]:.4g} to {fit.loss[1]:.4g}, {fit.message}"
        )
    away = np.abs(found["all"].values - truth) / np.maximum(found["all"].standard_error, 1e-300)
    print(f"  of all, {np.mean(away < 2.0):.0%} end within two standard errors of the truth")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--windows", type=int, default=119)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--refits", type=int, default=3, help="of each kind, interleaved")
    parser.add_argument("--no-peer", action="store_true")
    options = parser.parse_args()

    model = MMG(geometry_of(profile_file.load(SHIP))[0])
    path = published_file(SHIP)
    assert path is not None, f"{SHIP} has no parameter file"
    known = load(path, model.geometry)
    theta = known.values
    rng = np.random.default_rng(0)
    data = inputs(options.windows, rng)
    print(f"{processor()}, {cores()} core(s), {platform.system()}, jax {jax.__version__}")
    print(
        f"{options.windows} windows of {SAMPLES} s ({len(padded(data).measured)} with padding), "
        f"{SAMPLES - 1} Euler steps, {len(theta)} parameters, {options.rounds} rounds"
    )

    ours: dict[str, tuple[str, Job]] = {
        "shiplog": ("rollout", lambda: rollout(model, theta, data)),
        "shiplog linearised": ("sensitivities", lambda: linearised(model, theta, data)),
        "shiplog normal": ("normal", lambda: normal(model, theta, data)),
    }
    print(f"\n{'first calls, once a process [s]':<34}")
    for name, (_, job) in ours.items():
        print(f"  {name:<32} {clock(job):>9.2f}", flush=True)
    theirs = {} if options.no_peer else peers(model, data)
    if theirs:
        agreement(model, theta, data, theirs)

    for kind, title in (("rollout", "rollout [ms]"), ("sensitivities", "sensitivities by θ [ms]")):
        jobs = {name: job for name, (what, job) in ours.items() if what == kind}
        jobs |= {
            name: lambda job=job: job(theta) for name, (what, job) in theirs.items() if what == kind
        }
        report(title, interleaved(jobs, options.rounds))
    report(
        "loss, gradient, JᵀJ [ms]",
        interleaved({"shiplog normal": ours["shiplog normal"][1]}, options.rounds),
    )
    refits(model, known, data, options.refits, rng)


if __name__ == "__main__":
    main()
