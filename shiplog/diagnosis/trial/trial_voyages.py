"""Store and run to a trial: nominal voyages, trial voyages, windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shiplog.diagnosis.trial.trial import Trial
from shiplog.exceptions import StoreError
from shiplog.models import mmg
from shiplog.models.causes import Cause, Orders, Setting, constants_of
from shiplog.models.causes.environment import to_wall
from shiplog.models.extended import Extended
from shiplog.models.mmg import estimate
from shiplog.models.starting_values import Start
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.extended_simulator import ExtendedSimulator, campaign
from shiplog.training.runs.load_model import Run
from shiplog.voyages.rows import recording, timescale
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store import parts
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import plan
from shiplog.voyages.windows.windows import Windows

BOTTOM_MAP_PLACES = 12  # of a map of the bottom


def voyages_of(run: Run, store: Store, wanted: Sequence[str]) -> list[str]:
    """The chosen voyages, or all that the run was not trained on; of a voyage that it was trained
    on in part, the test part. Raises StoreError for none."""
    if wanted:
        return store.select(list(wanted))
    stored = store.select()
    names = [n for n in stored if not parts.overlapping([n], run.trained_on)]
    names += [n for n in store.there(run.config.split.test) if n not in stored]
    if not names:
        raise StoreError(
            f"Every voyage in {store.path} was used to make {run.name}.",
            hint="name some with --voyages, or ingest voyages that it was not trained on.",
        )
    return names


def record_of(store: Store, names: Sequence[str], profile: Profile) -> Record:
    return recording.read([frame.collect() for frame in store.tables(names)], names, profile)


def rescale_time(
    run: Run, nominal: Record | None, recorded: Record
) -> tuple[Record | None, Record]:
    """Both campaigns with the time scale of this ship at the working speed of its nominal
    voyages."""
    reference = recorded if nominal is None else nominal
    if not len(reference) or not len(recorded):  # too little for a verdict, which is reported later
        return nominal, recorded
    _, main, _ = mmg.geometry_of(run.profile, run.config.physics.without)
    shorter = min(one.seconds for one in (reference, recorded))
    speeds = np.linalg.norm(reference.state[:, [1, 3]], axis=1)
    working = float(np.quantile(speeds, timescale.WORKING))
    of = timescale.of_ship(main.length, working, shorter)
    changed = None if nominal is None else replace(nominal, timescale=of)
    return changed, replace(recorded, timescale=of)


def windows_of(run: Run, store: Store, names: Sequence[str], profile: Profile) -> Windows | None:
    """As `evaluate` cuts them; None where no stretch is long enough for one."""
    rows = store.seconds(names, profile)
    planned = plan(rows, "ref", run.config.window)
    if planned.height == 0:
        return None
    return windows.cut(rows, planned, run.config.window, profile.actuator_names, profile.wind_names)


def simulator(run: Run, trial: Trial) -> ExtendedSimulator:
    """The model that is judged in a trial, with the causes that the run has already."""
    if run.judges_itself:
        return run.extended(run.config.seeds[0], trial.record)
    ref = trial.reference
    held = () if run.extension is None else run.extension.causes
    numbers = run.extension_numbers()
    theta = np.concatenate((ref.theta, *(numbers[c.label] for c in held)))
    model = replace(
        ref.model, causes=held, constants=constants_for(run, held, ref.setting)
    )  # fmt: skip
    shares, lengths = campaign(trial.record)
    return ExtendedSimulator(
        model, theta, np.zeros((len(theta),) * 2), run.profile, shares, lengths
    )


def model_of(run: Run, causes: Sequence[Cause], setting: Setting) -> tuple[Extended, Start]:
    """The run's physics extended by these causes, and its coefficients."""
    base, start, stand_in, values = run.judge()
    constants = constants_for(run, causes, setting)
    return Extended(base, tuple(causes), stand_in, values, constants), start


def constants_for(run: Run, causes: Sequence[Cause], setting: Setting) -> dict[str, np.ndarray]:
    """Constants of these causes' forces: the run's, else those of its setting."""
    held = {} if run.extension is None else run.extension.constants
    return constants_of(causes, setting) | dict(held)


def setting_of(run: Run, nominal: Record, recorded: Record) -> Setting:
    """Ship and place of a diagnosis; its speed is that of the `nominal` voyages."""
    speed = float(np.sqrt((nominal.state[:, [1, 3]] ** 2).sum(1).mean()))
    ship, main, _ = mmg.geometry_of(run.profile, run.config.physics.without)
    places, spacing = _places(recorded, BOTTOM_MAP_PLACES)
    scale = {
        "speed": max(speed, 1e-3), "length": main.length, "mass": main.mass,
        "moment": main.mass * main.length,
    }  # fmt: skip
    windless = run.profile.has_wind and not ship.wind
    lacking = {f"wind.{k}": v for k, v in estimate.wind(main).items()} if windless else {}
    state = recorded.state[:: max(1, len(recorded) // 4000)]
    near = to_wall(state, run.profile.site.banks)
    return Setting(
        run.profile, scale, places, spacing, lacking, ship.parts, near, Orders.of(recorded)
    )  # fmt: skip


def _places(record: Record, count: int) -> tuple[np.ndarray, float]:
    """Points [K, 2] that cover where the ship was, and the spacing between them [m]: each the
    farthest from those before it (Gonzalez 1985)."""
    every = record.state[:: max(1, len(record) // 4000)][:, [0, 2]]
    chosen = [every.mean(0)]
    nearest = np.linalg.norm(every - chosen[0], axis=1)
    while len(chosen) < count:
        chosen.append(every[int(nearest.argmax())])
        nearest = np.minimum(nearest, np.linalg.norm(every - chosen[-1], axis=1))
    points = np.array(chosen)
    apart = np.linalg.norm(points[:, None] - points, axis=-1) + np.diag(np.full(count, np.inf))
    return points, max(float(np.median(apart.min(0))), 1e-3)
