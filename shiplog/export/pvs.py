"""`--to pvs`: a vehicle of the Python Vehicle Simulator (Fossen), in a file of numpy.

Its main loop calls `stepInput` or `headingAutopilot`, then `dynamics`, and integrates place and
attitude itself: η ← η + h J(η) ν of the new ν. `driven` does as that loop does.
"""

from __future__ import annotations

import keyword
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shiplog.export import python_file, written_python
from shiplog.export.filled import filled, inert
from shiplog.export.job import Job
from shiplog.export.not_loaded import NotLoaded
from shiplog.export.ship import Ship
from shiplog.export.trial import Difference, Trial, difference
from shiplog.machine import files

CONSUMER = "the Python Vehicle Simulator"
SAMPLE = 0.02  # s, the simulator's own


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    files.write_text(path, text(job.ship, job.sailor.controls(job.sailor.speed).steering, record))


def text(ship: Ship, steering: np.ndarray, record: Sequence[str]) -> str:
    vehicle = filled("vehicle_py.txt", {
        "CLASS": vehicle_name(ship), "SHIP": inert(ship.ship).replace('"', "'"),
        "RUN": inert(ship.run), "LENGTH": repr(ship.length), "SPEED": repr(ship.speed),
        "CONTROLS": ", ".join(f'"{i.name} ({i.unit})"' for i in ship.inputs),
        "STEERS": "".join(f"{float(one)!r}, " for one in steering).rstrip(" "),
    })  # fmt: skip
    return python_file.text(ship, record) + vehicle


def vehicle_name(ship: Ship) -> str:
    """Of its class: the run's name, unless that is a word of Python or of the file."""
    name = ship.identifier
    return f"{name}_vehicle" if keyword.iskeyword(name) or name[0].isupper() else name


def losses(job: Job) -> tuple[str, ...]:
    return (
        "The trapezoidal rule of place and heading: the simulator's own is Euler's.",
        "A tuned autopilot: `headingAutopilot` is a start.",
        *job.ship.losses,
    )


def compare(job: Job, path: Path) -> Difference:
    """Raises NotLoaded, with what a loop as the simulator's own gives."""
    sample = job.ship.step / max(1, round(job.ship.step / SAMPLE))
    apart = difference(job.trial, driven(job.ship, job.trial, path, sample))
    raise NotLoaded(
        f"no package index has it; driven as its main loop does, every {sample:g} s, place differs "
        "by "
        f"{max(apart.by_channel['x0'], apart.by_channel['y0']):.2g} m and heading by "
        f"{np.degrees(apart.by_channel['heading']):.2g} deg after {apart.seconds:.0f} s, as it "
        "integrates them otherwise"
    )


def driven(ship: Ship, trial: Trial, path: Path, sample: float) -> np.ndarray:
    """[n, 6] at the end of each inner step, by the loop of the simulator's `mainLoop.simulate` at
    that sample time."""
    known = written_python.names_of(path, ship.identifier)
    wind, current = trial.water.wind, trial.water.current
    vehicle = known[vehicle_name(ship)](
        V_current=float(np.hypot(*current)),
        beta_current=float(np.degrees(np.arctan2(current[1], current[0]))), wind=wind,
    )  # fmt: skip
    x0, u, y0, v, psi, r = trial.start
    eta, nu = np.array([x0, y0, 0.0, 0.0, 0.0, psi]), np.array([u, v, 0.0, 0.0, 0.0, r])
    actual, every = vehicle.u_actual, round(ship.step / sample)
    found = np.empty((len(trial.orders), 6))
    for k, order in enumerate(trial.orders):
        for _ in range(every):
            nu, actual = vehicle.dynamics(eta, nu, actual, order, sample)
            c, s = np.cos(eta[5]), np.sin(eta[5])
            moved = [c * nu[0] - s * nu[1], s * nu[0] + c * nu[1], 0.0, 0.0, 0.0, nu[5]]
            eta = eta + sample * np.array(moved)
        found[k] = eta[0], nu[0], eta[1], nu[1], eta[5], nu[5]
    return found


def version() -> str:
    return ""
