"""How long XLA takes to compile and to run a ship's derivatives, with and without its emitters
of fused loops (`shiplog.machine.jit_cache.COMPILER` switches them off).

    python -m pipelines.experiments.benchmarks.compiling [--rounds 3]

Pin it to a core with `taskset -c 1`. The ship is the Esso Osaka and its states are drawn.
"""

from __future__ import annotations

import argparse

import jax
import jax.numpy as jnp
import numpy as np

from pipelines.experiments.benchmarks.rollouts import (
    SHIP,
    Job,
    clock,
    interleaved,
    processor,
    report,
)
from shiplog.diagnosis.linear import jax_paths
from shiplog.machine import jit_cache
from shiplog.models.mmg.geometry import geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.models.mmg.parameters import load, published_file
from shiplog.ship_profile import file as profile_file
from shiplog.training.network.queue import cores

SEGMENTS, NODES = 64, 151  # of one call, as a diagnosis makes them
WITH: dict[str, str | bool] = {"xla_cpu_use_fusion_emitters": True}
WITHOUT: dict[str, str | bool] = {**jit_cache.COMPILER}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=3)
    rounds = parser.parse_args().rounds
    model = MMG(geometry_of(profile_file.load(SHIP))[0])
    path = published_file(SHIP)
    assert path is not None, f"{SHIP} has no parameter file"
    theta = jnp.asarray(load(path, model.geometry).values)
    rng = np.random.default_rng(0)
    states = rng.normal(0.0, 0.3, (SEGMENTS, NODES, 6))
    driven = rng.normal(0.0, 0.5, (SEGMENTS, NODES, 4))  # rudder [rad], screw [1/s], wind [m/s]
    lowered = jax.jit(jax_paths._slopes._function).lower(model, theta, states, driven)

    print(f"{processor()}, {cores()} core(s), jax {jax.__version__}; {len(theta)} coefficients")
    ways = {"without emitters (ours)": WITHOUT, "with emitters": WITH}
    compiling: dict[str, Job] = {
        name: lambda options=options: lowered.compile(compiler_options=options)
        for name, options in ways.items()
    }
    report("compiling [ms]", interleaved(compiling, rounds))
    made = {name: lowered.compile(compiler_options=options) for name, options in ways.items()}
    running: dict[str, Job] = {
        name: lambda run=run: jax.block_until_ready(run(model, theta, states, driven))
        for name, run in made.items()
    }
    for job in running.values():
        clock(job)
    report("running [ms]", interleaved(running, 5 * rounds))


if __name__ == "__main__":
    with jit_cache.double():
        main()
