"""What sailing a run needs, taken out of the run: equations, numbers, actuators, step."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from importlib.metadata import version

import numpy as np

from shiplog.export import equations, given_simulator, given_unit
from shiplog.export.equations import Equations
from shiplog.export.given_simulator import Function
from shiplog.export.given_unit import Unit
from shiplog.simulation.controls import FASTEST, STEERING_CAUSES
from shiplog.training.runs import foreign_run
from shiplog.training.runs.load_model import ForeignRun, Run
from shiplog.training.runs.sailing_run import Sailor

UNITS = {"rudder": "rad", "azimuth": "rad", "propeller": "rev/s", "thruster": "1"}


@dataclass(frozen=True)
class Input:
    """An actuator, SI.

    approach   position at which the model keeps the approach speed
    rate       the fastest change a second, as `simulate` moves it; `FASTEST` where it is not known
    low, high  limits of the profile; infinite where it has none
    offset     what acts minus what is recorded, of a steering with that cause
    geared     whether what a diagnosis found in the steering is of this one
    """

    name: str
    kind: str
    unit: str
    approach: float
    rate: float
    low: float
    high: float
    offset: float = 0.0
    geared: bool = False


@dataclass(frozen=True)
class Number:
    """A coefficient, in SI: what the equations take."""

    name: str
    value: float
    unit: str
    meaning: str
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Ship:
    """A run as other programs sail it.

    step         s, of Euler's method, or of Heun's where `heun`
    lag, delay   s, of the steering
    limits       [3] |u|, |v|, |r| beyond which the model has diverged
    losses       what of the run is not in it, a sentence each
    unit         a user's own FMU that is asked, around which the equations are
    function     the same of a Python function
    """

    run: str
    ship: str
    label: str
    length: float
    equations: Equations
    numbers: tuple[Number, ...]
    inputs: tuple[Input, ...]
    step: float
    heun: bool
    speed: float
    limits: tuple[float, float, float]
    lag: float = 0.0
    delay: float = 0.0
    losses: tuple[str, ...] = ()
    unit: Unit | None = None
    function: Function | None = None

    @property
    def identifier(self) -> str:
        """Of its run's name, as a word of C, Python and Octave."""
        found = re.sub(r"\W", "_", self.run, flags=re.ASCII).strip("_") or "ship"
        return found if found[0].isalpha() else f"ship_{found}"

    @property
    def author(self) -> str:
        return f"shiplog {version('shiplog')}"

    @property
    def theta(self) -> np.ndarray:
        return np.array([one.value for one in self.numbers])

    @property
    def past(self) -> int:
        """Steps that a delay of the steering looks back."""
        return int(divmod(self.delay / self.step, 1.0)[0]) + 2 if self.delay > 0.0 else 0


def of_run(run: Run, sailor: Sailor) -> Ship:
    """Of the run's first seed. Raises ModelError for equations that no code can be made of."""
    seed = run.config.seeds[0]
    plain = run.extension is None and run.judges_itself
    own = run.simulator(seed) if plain else run.extended(seed)
    actuators = run.profile.actuators
    around = given_simulator.asked(run)
    unit = function = None
    if around is None:
        made = equations.of_model(own.model, len(own.theta), len(actuators), share=not plain)
    else:
        own = run.extended(seed)
        rest, water = given_simulator.parts(around)
        made = equations.of_model(rest, len(own.theta), len(actuators), share=True, water=water)
        if around.config.foreign.kind == "fmu":
            unit = given_unit.of_run(around)
        else:
            function = given_simulator.function_of(around)
    controls = sailor.controls(sailor.speed)
    found = Ship(
        run=run.name,
        ship=run.profile.ship.name,
        label=run.label,
        length=run.profile.ship.length_m,
        equations=made,
        numbers=_numbers(run, own.model.names, own.theta),
        inputs=tuple(
            Input(
                a.name, a.kind, UNITS[a.kind], float(controls.approach[i]),
                min(float(controls.rate[i]), FASTEST), float(controls.low[i]),
                float(controls.high[i]),
            )
            for i, a in enumerate(actuators)
        ),
        step=sailor.row / sailor.substeps,
        heun=sailor.heun,
        speed=sailor.speed,
        limits=(float(sailor.limits[0]), float(sailor.limits[1]), float(sailor.limits[2])),
        losses=_losses(run, sailor),
        unit=unit,
        function=function,
    )  # fmt: skip
    return found if run.extension is None else _steered(found, run)


def _numbers(run: Run, names: tuple[str, ...], theta: np.ndarray) -> tuple[Number, ...]:
    known = run.coefficients
    found = []
    for name, value in zip(names, theta.tolist(), strict=True):
        one = known.get(name)
        if one is None:  # a cause's number, a weight of a hybrid's network, or a stand-in's
            of, _, place = name.rpartition(".")
            what = f"number {place} of {of}, SI" if place.isdigit() else "a weight of the network"
            if not name.startswith("network.") and not place.isdigit():
                what = f"of the MMG that stands in for {run.config.foreign.name}"
            found.append(Number(name, value, "", what))
        else:
            words = ", ".join(filter(None, (one.symbol, one.meaning)))
            found.append(Number(name, value, one.unit, words, one.low, one.high))
    return tuple(found)


def _steered(ship: Ship, run: Run) -> Ship:
    """With what a diagnosis found in the steering, as `simulation.controls.Gear` has it."""
    assert run.extension is not None
    inputs, lag, delay = list(ship.inputs), 0.0, 0.0
    for cause in run.extension.causes:
        if cause.name not in STEERING_CAUSES:
            continue
        kind = "rudder" if getattr(cause, "what", "rudders") == "rudders" else "azimuth"
        p = np.asarray(run.extension.numbers[cause.label])
        for i, actuator in enumerate(run.profile.actuators):
            if actuator.kind != kind:
                continue
            inputs[i] = replace(inputs[i], geared=True)
            if cause.name == "rudder_offset":
                each = float(p[0] if actuator.position_m[1] < 0.0 else p[-1])
                inputs[i] = replace(inputs[i], offset=inputs[i].offset + each)
        lag += float(p[0]) if cause.name == "rudder_lag" else 0.0
        delay += float(p[0]) if cause.name == "rudder_delay" else 0.0
    return replace(ship, inputs=tuple(inputs), lag=lag, delay=delay)


def _losses(run: Run, sailor: Sailor) -> tuple[str, ...]:
    around = given_simulator.asked(run)
    found = [] if around is None else list(given_simulator.losses(around))
    if isinstance(run, ForeignRun) and run.logged:
        left = float(np.median(foreign_run.kept(run).misfit))
        found.append(
            f"{run.config.foreign.name} itself, which was logged: an MMG that was fitted to its "
            f"accelerations stands in, and leaves {left:.0%} of them."
        )
    if sailor.ignored:
        found.append(
            f"Causes of its record, which do not change how it sails: {', '.join(sailor.ignored)}."
        )
    if len(run.config.seeds) > 1:
        found.append(f"Seed {run.config.seeds[0]} of {len(run.config.seeds)}: no ensemble.")
    if sailor.spreads:
        found.append("The band of what the model may be as well: `shiplog simulate` has it.")
    if math.isinf(min(sailor.limits)):
        found.append("Limits beyond which it has diverged.")
    return tuple(found)
