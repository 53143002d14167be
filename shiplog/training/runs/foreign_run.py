"""What a run of a simulator of one's own keeps, and how the simulator is opened again.

<run>/seed0/states.parquet         of one that was logged: its states at the seconds of the voyages
<run>/seed0/stand_in.safetensors   coefficients of the MMG that stands in, its misfit, the steps of
                                   differences, and the rows at which the simulator is tried

One simulator has its child processes once, however many runs and copies of runs ask it.
"""

from __future__ import annotations

import atexit
import json
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import polars as pl

from shiplog.exceptions import RunError
from shiplog.foreign.bridge import Bridge, Ship
from shiplog.foreign.model import Foreign
from shiplog.foreign.source import SimulatorError, Source
from shiplog.machine import files
from shiplog.nomenclature.channels import STATE, VELOCITY_IN_STATE, WIND
from shiplog.nomenclature.numbers import counted
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.foreign_model import Failure
from shiplog.simulation.scoring import window_loss
from shiplog.simulation.window_series import true_wind
from shiplog.training.runs.run_folder import RunFolder
from shiplog.training.settings import run_files
from shiplog.training.settings.run_config import Foreign as Settings
from shiplog.voyages.windows.windows import Windows

FILE, STATES_FILE = "stand_in.safetensors", "states.parquet"
PROBE_ROWS = 41  # at which a simulator is tried: no other number of rows is as many as its columns
RANDOM = 0  # seed of their choice
# Errors of velocity over the ship's own velocities, √(L / L of standing still), from which on it is
# no model of the ship: a wrong sign leaves 2, knots for m/s 1
NO_SHIP = 5.0

_bridges: dict[tuple, Bridge] = {}
_failures: dict[tuple, dict[Failure, None]] = {}


class Kept(NamedTuple):
    """values [P] of the stand-in's coefficients, empty where the ship has no MMG; misfit [3];
    steps [6 + A + 2]; probe [n, 6 + A + 3]"""

    values: np.ndarray
    misfit: np.ndarray
    steps: np.ndarray
    probe: np.ndarray


def rows_of(frame: pl.DataFrame, profile: Profile) -> np.ndarray:
    """Rows as `shiplog.foreign.rows` has them [n, 6 + A + 3], of seconds of voyages."""
    state = frame.select(c.name for c in STATE).to_numpy()
    acts = frame.select(profile.actuator_names).to_numpy()
    wind = np.zeros((len(state), 2))
    if profile.has_wind:
        wind = true_wind(state, frame.select(c.name for c in WIND).to_numpy())
    elapsed = frame["elapsed"].to_numpy()[:, None]
    return np.concatenate((state, acts, wind, elapsed), 1).astype(float)


def probe_of(rows: np.ndarray) -> np.ndarray:
    """Some of them, in disorder, at the beginning of a voyage: what fails later is found later."""
    rng = np.random.default_rng(RANDOM)
    found = rows[rng.choice(len(rows), PROBE_ROWS, replace=len(rows) < PROBE_ROWS)].copy()
    found[:, -1] = 0.0
    return found


def bridge(source: Source, profile: Profile, settings: Settings, probe: np.ndarray) -> Bridge:
    """The children of this simulator for this ship."""
    names = tuple(profile.actuator_names)
    mapped = json.dumps(settings.mapping, sort_keys=True)
    key = (source.sha256, source.function, names, profile.has_wind, mapped)
    if key not in _bridges:
        ship = Ship(names, profile.has_wind)
        _bridges[key] = Bridge(source, ship, settings.mapping, probe)
    return _bridges[key]


@atexit.register
def close() -> None:
    """End all children."""
    for one in _bridges.values():
        one.close()
    _bridges.clear()


def failures(settings: Settings) -> dict[Failure, None]:
    """Of this simulator so far, in this process."""
    return _failures.setdefault((settings.sha256,), {})


def kept(folder: RunFolder) -> Kept:
    """Raises UnreadableError."""
    path = folder.seed(folder.config.seeds[0]) / FILE
    arrays = run_files.arrays(path)
    try:
        return Kept(*(arrays[name] for name in Kept._fields))
    except KeyError as error:
        raise run_files.unreadable(path, error) from error


def save(folder: RunFolder, found: Kept, states: pl.DataFrame | None = None) -> None:
    """`states` of one that was logged."""
    seed = folder.seed(folder.config.seeds[0])
    seed.mkdir(exist_ok=True)
    run_files.save_arrays(seed / FILE, found._asdict())
    if states is not None:
        files.write_frame(seed / STATES_FILE, states)


def refuse_no_ship(folder: RunFolder, losses: np.ndarray, cut: Windows) -> None:
    """Raises SimulatorError for a simulator whose errors are far beyond the ship's own motion; `L`
    of windows [N]. Windows in which it failed are not asked."""
    sound = np.isfinite(losses)
    still = window_loss(cut.state, cut.dt)
    if not sound.any():
        return
    ratio = math.sqrt(np.median(losses[sound]) / max(np.median(still[sound]), 1e-300))
    if ratio > NO_SHIP:
        name, ship = folder.config.foreign.name, folder.profile.ship.name
        raise SimulatorError(
            f"{name} does not move as {ship}: its velocities are wrong by {ratio:.2g} times what "
            f"they are, the median of {counted(int(sound.sum()), 'window')}.",
            hint="is it this ship's simulator? Look at the channels, units and signs of its "
            "mapping, or at what the function returns.",
        )


def states(folder: RunFolder) -> pl.DataFrame:
    """voyage, elapsed and the states of a simulator that was logged."""
    return run_files.table(folder.seed(folder.config.seeds[0]) / STATES_FILE)


def logged_accelerations(
    states: pl.DataFrame, training: pl.DataFrame, profile: Profile
) -> tuple[np.ndarray, np.ndarray]:
    """Rows (state, actuators, wind over ground) [n, 6 + A + 2] and ν̇ [n, 3] of a simulator that was
    logged: ν̇ ≈ (ν(t + 1 s) - ν(t - 1 s)) / 2 s, at the seconds of training voyages."""
    rows = rows_of(training, profile)
    key = training.select("voyage", "segment", "elapsed")
    own = key.join(states, on=["voyage", "elapsed"], how="left", maintain_order="left")
    state = own.select(c.name for c in STATE).to_numpy().astype(float)
    velocity = state[:, list(VELOCITY_IN_STATE)]
    stretch = key.select(pl.struct("voyage", "segment").rank("dense")).to_series().to_numpy()
    time = rows[:, -1]
    apart = (time[2:] - time[:-2])[:, None]
    f = np.full_like(velocity, np.nan)
    with np.errstate(all="ignore"):
        f[1:-1] = (velocity[2:] - velocity[:-2]) / apart
    f[1:-1][(stretch[2:] != stretch[:-2])] = np.nan
    rows[:, :6] = state
    return rows[:, :-1], f


def model(folder: RunFolder, source: Source | None, error: Callable[[], RunError]) -> Foreign:
    """The simulator as a model. It is opened with the first request, which raises `error` where no
    source was given."""
    settings, known = folder.config.foreign, kept(folder)

    def opened() -> Bridge:
        if source is None:
            raise error()
        return bridge(source, folder.profile, settings, known.probe)

    return Foreign(settings.name, opened, known.steps)
