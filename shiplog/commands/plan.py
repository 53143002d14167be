"""`shiplog plan`: a run to the manoeuvre to sail next."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from shiplog.commands.bars import reach, staged
from shiplog.planning import causes, limits, noise, plan
from shiplog.planning.causes import Apart
from shiplog.planning.plan import Plan
from shiplog.report.planning import Planned
from shiplog.simulation.sailing import Sailed, Water
from shiplog.simulation.schedules import Turn, Zigzag
from shiplog.training.runs import load_model, sailing_run
from shiplog.training.runs.load_model import Run
from shiplog.voyages.store.store import Store

log = logging.getLogger(__name__)

STANDARD = {  # manoeuvres whose causes are looked at where none is planned
    "zigzag 20/20": Zigzag(math.radians(20.0), math.radians(20.0), plan.MANY),
    "turn +35": Turn(math.radians(35.0)),
}
NO_VOYAGES = (
    "Which causes it tells apart is not asked: the store has none of the run's training voyages, "
    "which show how much the model errs. Name it with --store."
)

# seconds of the sample logs' run
STAGES = {"noise": 3.0, "manoeuvres": 36.0, "causes": 15.0}


@staged("planning", STAGES)
@threadpool_limits.wrap(limits=1, user_api="blas")  # of matrices too small to share out
def plan_run(
    path: Path,
    store: Store,
    out: Path | None = None,
    *,
    seconds: float | None = None,
    rudder: float | None = None,
    speed: tuple[float, float] | None = None,
    room: tuple[float, float] | None = None,
    water: Water | None = None,
    seed: int = 0,
    causes_only: bool = False,
    with_causes: bool = True,
    simulators: Sequence[str] = (),
) -> Planned:
    """The manoeuvre within the limits (`limits.limits`) that says most about the run's
    coefficients, and which causes it tells apart. Raises ShiplogError.

    room    m of water ahead and aside
    water   wind and current that are expected; the training voyages' mean wind unless given
    simulators   files of simulators of the user's own: the run may be one of these
    """
    run = load_model.load(path, simulators=simulators)
    physical = None if causes_only else plan.refuse_unplannable(run)
    sailor = sailing_run.of_run(run)
    water = Water(wind=noise.usual_wind(run)) if water is None else water
    found: Plan | None = None
    sailed: dict[str, Sailed] = {}
    if physical is not None:
        within = limits.limits(sailor, seconds=seconds, rudder=rudder, speed=speed, water=room)
        instrument = plan.instrument_of(physical, sailor)
        reach("manoeuvres")
        found = plan.plan(physical, sailor, within, water=water, seed=seed, instrument=instrument)
        sailed = {"The plan": found.found.sailed, found.zigzag[0]: found.zigzag[1]}
    else:
        time = limits.usual_time(sailor) if seconds is None else seconds
        for name, of in STANDARD.items():
            sailed[name] = sailor.sail(of, members=1, seconds=time, water=water)[0]
    reach("causes")
    apart, notes = _apart(run, store, sailed) if with_causes else ({}, ())
    done = Planned(run.name, run.profile, found, apart, out or run.path / "plan", notes)
    done.save()
    return done


def _apart(
    run: Run, store: Store, sailed: dict[str, Sailed]
) -> tuple[dict[str, Apart], tuple[str, ...]]:
    """Name of a manoeuvre → what it says of causes; and why there is nothing."""
    made = causes.trial_of(run, store, list(sailed.values()))
    if made is None:
        return {}, (NO_VOYAGES,)
    try:
        each = causes.apart(made, run)
    except np.linalg.LinAlgError as error:
        return {}, (f"Which causes it tells apart is not known: {error}.",)
    return dict(zip(sailed, each, strict=True)), ()
