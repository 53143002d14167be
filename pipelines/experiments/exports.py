"""What `shiplog export` writes, by what loads it again: the table of docs/use/export.md.

    python -m pipelines.experiments.exports runs/mmg-extended --network runs/net --single runs/esso

Each target that the run can be written as, with the program that loads it, the greatest difference
from `simulate` over 600 s, the size, and what is not in it. `--network` is a run of a network, for
ONNX; `--single` one of a ship with one screw and one rudder, for shipmmg. libcosim is asked as
well, where libcosimpy is installed. `--speed` adds how long a step of the exported C takes, next to
a step of the rollout of one window and of `simulate`.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from shiplog.exceptions import ShiplogError
from shiplog.export import cpp, exported, fmu_variables, targets
from shiplog.export.exported import Exported
from shiplog.export.filled import replaced
from shiplog.export.job import Job
from shiplog.export.targets import NUMBERS, PREDICTIONS
from shiplog.export.trial import Difference, difference
from shiplog.simulation import sensitivities
from shiplog.simulation.window_series import series
from shiplog.training.runs import load_model
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import plan

OF_NETWORKS, OF_SINGLES = ("onnx",), ("shipmmg",)
STEPS = 2_000_000  # of the exported C, for its time
REPEATS = 5  # of a measurement, of which the shortest counts
PROGRAM = """
#include <stdio.h>
#include <time.h>
#include "ship.h"
int main(void) {
    static @NAME@_ship ship;
    static @NAME@_parameters parameters;
    @NAME@_input input;
    const double start[6] = {0.0, 0.4};
    const clock_t begun = clock();
    long i;
    int j;
    memset(&input, 0, sizeof input);
    memcpy(input.order, @NAME@_APPROACH, sizeof input.order);
    @NAME@_defaults(&parameters);
    @NAME@_begin(&ship, &parameters, start, NULL);
    for (i = 0; i < @STEPS@; ++i) {
        for (j = 0; j < @NAME@_ACTUATORS; ++j)
            input.order[j] = @NAME@_APPROACH[j] != 0.0
                ? @NAME@_APPROACH[j] * (1.0 + 0.1 * ((i / 20) % 2)) : 0.2 - 0.4 * ((i / 20) % 2);
        @NAME@_step(&ship, &parameters, &input);
    }
    printf("%.12g", (double)(clock() - begun) / CLOCKS_PER_SEC / @STEPS@);
    return ship.state[1] > 1e9;
}
"""
HEAD = """\
| `--to` | loaded by | greatest difference | size | not in it |
| --- | --- | --- | --- | --- |"""


def row(done: Exported, job: Job) -> str:
    """Without what no file of a model has, which is said once."""
    known = done.difference
    common = job.ship.losses
    losses = " ".join(one for one in done.losses if one not in common)
    if known is None:
        apart = "not loaded by its consumer"
    elif done.target.kind in (NUMBERS, PREDICTIONS):
        apart = f"{known.greatest:.1g} of its numbers"
    else:
        apart = f"{known.greatest:.1g}"
    by = f"{done.consumer} {done.version}".strip() if known is not None else done.unloaded
    return f"| `{done.to}` | {by} | {apart} | {exported.size(done.size)} | {losses} |"


def export_all(runs: dict[str, Job], folder: Path) -> list[str]:
    rows = []
    for name, target in targets.TARGETS.items():
        job = runs.get(name, runs[""])
        if target.kind == PREDICTIONS and job.store is None:
            continue
        try:
            done = exported.export(job, name, target, folder / f"ship{target.ending}")
            rows.append(row(done, job))
        except ShiplogError as error:
            rows.append(f"| `{name}` | | refused: {error.message} | | |")
        if name == "fmu" and (apart := by_libcosim(job, folder / "ship.fmu")) is not None:
            rows.append(f"| | {apart[0]} | {apart[1].greatest:.1g} | | |")
    return rows


def by_libcosim(job: Job, path: Path) -> tuple[str, Difference] | None:
    """The FMU in the Open Simulation Platform's importer."""
    try:
        from importlib.metadata import version

        from libcosimpy.CosimExecution import CosimExecution
        from libcosimpy.CosimManipulator import CosimManipulator
        from libcosimpy.CosimObserver import CosimObserver
        from libcosimpy.CosimSlave import CosimLocalSlave
    except ImportError:
        return None
    sail = job.trial
    place = {one.name: i for i, one in enumerate(fmu_variables.of_ship(job.ship))}
    execution = CosimExecution.from_step_size(int(job.ship.step * 1e9))
    slave = execution.add_local_slave(CosimLocalSlave(str(path), "ship"))
    for name, value in zip(sail.names, sail.start, strict=True):
        execution.real_initial_value(slave, place[f"start.{name}"], float(value))
    hand, eye = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(hand)
    execution.add_observer(eye)
    water = [place[n] for n in ("wind.x0", "wind.y0", "current.x0", "current.y0")]
    hand.slave_real_values(slave, water, [*sail.water.wind, *sail.water.current])
    orders = [place[f"order.{one.name}"] for one in job.ship.inputs]
    found = np.empty((len(sail.orders), len(sail.names)))
    for k, given in enumerate(sail.orders):
        hand.slave_real_values(slave, orders, given.tolist())
        execution.step()
        found[k] = eye.last_real_values(slave, [place[n] for n in sail.names])
    return f"libcosim (libcosimpy {version('libcosimpy')})", difference(sail, found)


# --- speed -----------------------------------------------------------------------------------


def shortest(work: Callable[[], object], times: int) -> float:
    """s of one call, of processor time: the machine may do other things."""
    work()
    found = []
    for _ in range(REPEATS):
        begun = time.process_time()
        for _ in range(times):
            work()
        found.append((time.process_time() - begun) / times)
    return min(found)


def speed(job: Job, folder: Path) -> list[str]:
    """Nanoseconds a step of the exported C, of a rollout of one window, and of `simulate`."""
    run, rows = job.run, job.run.training()
    size = run.config.window
    names = (run.profile.actuator_names, run.profile.wind_names)
    cut = windows.cut(rows, plan(rows, "ref", size), size, *names).pick(np.array([0]))
    own = run.simulator(run.config.seeds[0])
    data = series(cut)
    steps = (size - 1) * own.model.substeps
    rolled = shortest(lambda: sensitivities.rollout(own.model, own.theta, data), 200) / steps
    trial = job.trial
    sailed = shortest(
        lambda: job.sailor.sail(trial.schedule, members=1, water=trial.water, seconds=600.0), 2
    ) / len(trial.orders)
    step = of_c(job, folder)
    return [
        "| a step of | ns | times as long as the exported C |\n| --- | --- | --- |",
        f"| the exported C | {1e9 * step:.0f} | |",
        f"| the rollout of one window of {size} s | {1e9 * rolled:.0f} | {rolled / step:.0f} |",
        f"| `simulate`, one member | {1e9 * sailed:.0f} | {sailed / step:.0f} |",
    ]


def of_c(job: Job, folder: Path) -> float:
    """s a step, processor time."""
    cpp.write(job, folder / "ship.h", [])
    words = {"NAME": job.ship.identifier, "STEPS": str(STEPS)}
    (folder / "time.c").write_text(replaced(PROGRAM, words), encoding="utf-8")
    subprocess.run(["gcc", "-O2", "-o", "time", "time.c", "-lm"], cwd=folder, check=True)
    return min(
        float(subprocess.run([folder / "time"], capture_output=True, check=True).stdout)
        for _ in range(REPEATS)
    )


def main(given: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--network", type=Path)
    parser.add_argument("--single", type=Path)
    parser.add_argument("--store", type=Path)
    parser.add_argument("--voyage", default="")
    parser.add_argument("--speed", action="store_true")
    asked = parser.parse_args(given)
    store = None if asked.store is None else Store(asked.store)
    voyages = (asked.voyage,) if asked.voyage else ()
    runs = {"": Job(load_model.load(asked.run))}
    for path, names in ((asked.network, OF_NETWORKS), (asked.single, OF_SINGLES)):
        if path is not None:
            runs |= dict.fromkeys(names, Job(load_model.load(path)))
    if store is not None:
        predicting = Job(load_model.load(asked.run), store, voyages)
        runs |= {n: predicting for n, t in targets.TARGETS.items() if t.kind == PREDICTIONS}
    with tempfile.TemporaryDirectory() as folder:
        print(HEAD, *export_all(runs, Path(folder)), sep="\n")
        if asked.speed:
            print("", *speed(runs[""], Path(folder)), sep="\n")


if __name__ == "__main__":
    main()
