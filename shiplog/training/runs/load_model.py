"""A run with its models: what can be simulated, and what a diagnosis changes in it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import polars as pl

from shiplog.exceptions import RunError, listed
from shiplog.foreign import source
from shiplog.foreign.logged import LoggedSimulator
from shiplog.foreign.source import Source
from shiplog.models import FOREIGN, NETWORK, PHYSICS, compiled_network, mmg
from shiplog.models.causes import Cause
from shiplog.models.coefficients import Parameters
from shiplog.models.extended import Extended
from shiplog.models.mmg import MMG
from shiplog.models.network_shape import Shape
from shiplog.models.starting_values import Start
from shiplog.nomenclature.contract import CONTRACT
from shiplog.simulation import force_breakdown, prediction_interval
from shiplog.simulation.extended_simulator import ExtendedSimulator, Extension, campaign
from shiplog.simulation.foreign_model import Failure, ForeignSimulator
from shiplog.simulation.sailing import STILL, Water
from shiplog.simulation.schedules import Manoeuvre
from shiplog.simulation.sensitivities import Simulator
from shiplog.training.physics.stand_in import StandIn
from shiplog.training.runs import (
    coefficients,
    extension_file,
    foreign_run,
    run_folder,
    sailing_run,
)
from shiplog.training.runs.coefficients import Coefficient
from shiplog.training.runs.run_folder import RunFolder
from shiplog.training.settings import run_files
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.windows.windows import Windows

if TYPE_CHECKING:
    from shiplog.models.feedforward import FeedForward, Scaling

HELD_SPREAD = 1e-9  # spread of numbers that a diagnosis leaves where they are


class Base(NamedTuple):
    """What a diagnosis changes: equations with their coefficients, and an MMG of the ship whose
    coefficients [P'] causes change."""

    model: Any
    start: Start
    stand_in: MMG
    values: np.ndarray


@dataclass(frozen=True, repr=False)
class Run(RunFolder, ABC):
    """A run folder whose models can be built.

    extension  causes that a diagnosis named and put into it, with the base's coefficients; None
               for a plain one
    """

    extension: Extension | None = None

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r}: {self.label}; {self._fitted(most=3)})"

    @property
    def text(self) -> str:
        """What it is, of which ship, fitted to what."""
        return f"{self.label} in {self.path}, of {self.profile.ship.name}; {self._fitted()}."

    def _fitted(self, most: int = 12) -> str:
        fitted = self.fitted_to and not (self.given and self.extension is None)
        return f"fitted to {listed(self.fitted_to, most)}" if fitted else "fitted to no voyage"

    @property
    def json(self) -> dict:
        """Its facts and coefficients."""
        return {
            "contract": CONTRACT,
            "run": str(self.path),
            "label": self.label,
            "ship": self.profile.ship.name,
            "fitted_to": list(self.fitted_to),
            "coefficients": {name: asdict(one) for name, one in self.coefficients.items()},
        }

    def __str__(self) -> str:
        return self.text

    @property
    def coefficients(self) -> dict[str, Coefficient]:
        """Name → value, unit and 90 % interval, of the first seed: `run.coefficients["hull.y_v"]`,
        and of an extended run also `run.coefficients["current.speed"]`. Of a network only what its
        extension has. Raises RunError."""
        known = self.identified(self.config.seeds[0]) if self.kind.family is PHYSICS else None
        return coefficients.of(known, self.extension)

    @property
    def coefficients_frame(self) -> pl.DataFrame:
        """The same, one row each: name, value, unit, low, high, standard_error, start, free, ..."""
        return coefficients.frame(self.coefficients)

    @property
    def label(self) -> str:
        if self.extension is None:
            return self.config.label(self.profile.has_wind)
        return f"{self.config.model} with {listed(c.label for c in self.extension.causes)}"

    @property
    def fitted_to(self) -> tuple[str, ...]:
        """Also the voyages that its extension was fitted to."""
        more = () if self.extension is None else self.extension.shares
        return tuple(dict.fromkeys((*self.trained_on, *more)))

    def models(self) -> dict[int, Any]:
        """Seed → what can be simulated: a network in float64, physics with its numbers, or either
        with causes in it."""
        one = self.simulator if self.extension is None else self.extended
        return {seed: one(seed) for seed in self.config.seeds}

    def simulate(
        self,
        inputs: pl.DataFrame | Manoeuvre,
        start: pl.DataFrame | Mapping[str, float] | None = None,
        *,
        water: Water = STILL,
        spread: bool = False,
        seed: int = 0,
        seconds: float | None = None,
    ) -> pl.DataFrame:
        """The model sailed on inputs: member, time, the state's channels and the actuators, SI.

        inputs    time [s], a column an actuator [SI], and `member` where members differ; or a
                  manoeuvre of `shiplog.simulation.schedules`
        start     a row a member of the state's channels, over ground; what is left out is zero,
                  and the surge the run's nominal speed
        water     wind and current
        spread    members beyond the first are drawn as the model may be as well
        seconds   as long as the inputs unless given

        All members are sailed at once: ten thousand in a call. Raises ModelError.
        """
        sailor = sailing_run.of_run(self)
        return sailor.frame(
            inputs, start, water=water, spread=spread, seed=seed, seconds=seconds
        ).frame

    def extended(self, seed: int, record: Record | None = None) -> ExtendedSimulator:
        """The run's model, with its extension if it has one, ready to absorb causes.

        record   the campaign in which further ones are found
        """
        held = self.extension
        equations, theta, covariance = self._numbers(seed)
        _, _, stand_in, values = self._plain_base()
        model = Extended(equations, (), stand_in, values, {})
        shares, lengths = campaign(record) if record is not None else ({}, {})
        plain = ExtendedSimulator(model, theta, covariance, self.profile, shares, lengths)
        if held is None:
            return plain
        plain = replace(
            plain, shares={**held.shares, **shares}, lengths={**held.lengths, **lengths}
        )
        return plain.with_causes(
            held.causes, held.numbers, held.covariance, held.constants, held.coefficients
        )

    def extension_numbers(self) -> dict[str, np.ndarray]:
        """Label → numbers of the causes it has already."""
        return {} if self.extension is None else dict(self.extension.numbers)

    def base(self) -> Base:
        """What a diagnosis changes, as the run has it: with what its extension did to the
        coefficients."""
        plain = self._plain_base()
        if self.extension is None:
            return plain
        return self._with_coefficients(plain, self.extension.coefficients)

    @property
    @abstractmethod
    def judges_itself(self) -> bool:
        """Whether a diagnosis asks this model's own coefficients, and not the ship's MMG."""

    @abstractmethod
    def judge(self) -> Base:
        """What a diagnosis asks about causes: of a network the ship's MMG as somebody published
        it, or as its particulars suggest, fitted to nothing."""

    @property
    def lacks(self) -> str:
        """Why causes that change forces cannot be tested with it; empty where they can."""
        return ""

    @property
    def fixed(self) -> str:
        """Why causes that change coefficients of the ship cannot be tested with it; empty where
        they can."""
        return ""

    @property
    def notes(self) -> tuple[str, ...]:
        """What a diagnosis has to say of how it is judged, in sentences."""
        return ()

    @property
    def failures(self) -> tuple[Failure, ...]:
        """Where a simulator of the user's own failed so far; of all others, nowhere."""
        return ()

    @abstractmethod
    def simulator(self, seed: int) -> Any:
        """What can be simulated, without an extension."""

    @abstractmethod
    def spread(self, models: Mapping[int, Any], simulated: list[np.ndarray], cut: Windows) -> Any:
        """[N, I, 6] how sure the simulated states are: `simulated` by each of the models."""

    @abstractmethod
    def forces(self, seconds: pl.DataFrame) -> pl.DataFrame | None:
        """Part by part along measured voyages, as `force_breakdown.break_down`; None where there
        are no parts."""

    @abstractmethod
    def _numbers(self, seed: int) -> tuple[Any, np.ndarray, np.ndarray]:
        """Equations, coefficients [P] and their covariance [P, P]."""

    @abstractmethod
    def _plain_base(self) -> Base: ...

    @abstractmethod
    def _with_coefficients(self, plain: Base, coefficients: np.ndarray) -> Base: ...


@dataclass(frozen=True, repr=False)
class NetworkRun(Run):
    """A network has no coefficients. Causes are tested on the ship's MMG in its stead, and
    are added to it. Torch is loaded where the network itself is asked for."""

    @property
    def shape(self) -> Shape:
        net = self.config.network
        return Shape(
            len(self.profile.actuators),
            self.profile.has_wind,
            net.width,
            net.depth,
            net.wind_input,
            net.input_tanh,
        )

    def scaling(self) -> Scaling:
        """Raises UnreadableError."""
        from shiplog.training.network import network_files

        return network_files.scaling(self.path)

    def empty_model(self) -> FeedForward:
        from shiplog.models.feedforward import FeedForward

        return FeedForward(self.shape, self.scaling())

    def simulator(self, seed: int) -> FeedForward:
        from shiplog.training.network import network_files

        return network_files.fill(self.empty_model(), self.seed(seed))

    @property
    def judges_itself(self) -> bool:
        return False

    def judge(self) -> Base:
        ship = mmg.begin(self.profile, self.config.physics)
        nominal = ship.start
        start = Start(nominal.values, nominal.spread, nominal.low, nominal.high)
        return Base(ship.model, start, ship.model, nominal.values)

    def spread(self, models: Mapping[int, Any], simulated: list[np.ndarray], cut: Windows) -> Any:
        return prediction_interval.seeds_spread(simulated)

    def forces(self, seconds: pl.DataFrame) -> None:
        return None

    def _numbers(self, seed: int) -> tuple[Any, np.ndarray, np.ndarray]:
        model = compiled_network.compiled(self.simulator(seed), self.profile.azimuths)
        return model, np.zeros(0), np.zeros((0, 0))

    def _plain_base(self) -> Base:
        none = np.zeros(0)
        network, _, _ = self._numbers(self.config.seeds[0])
        _, _, stand_in, values = self.judge()
        return Base(network, Start(none, none, none, none), stand_in, values)

    def _with_coefficients(self, plain: Base, coefficients: np.ndarray) -> Base:
        return plain._replace(model=plain.model.bend(coefficients))


@dataclass(frozen=True, repr=False)
class PhysicalRun(Run):
    """A model of named coefficients, on which causes are tested directly."""

    @property
    def lacks(self) -> str:
        return self.kind.equations.lacks

    def simulator(self, seed: int) -> Simulator:
        """The run's equations of the profile's geometry, with the numbers of a seed."""
        path = self.seed(seed) / "model.safetensors"
        arrays = run_files.arrays(path)
        try:
            model = self.kind.equations.opened(self.profile, self.config.physics, arrays)
            theta = arrays["theta"]
            self._refuse_others(seed, len(theta), model.names)
            covariance = arrays["covariance"].reshape(len(theta), len(theta))
        except (KeyError, ValueError, TypeError) as error:
            raise run_files.unreadable(path, error) from error
        if not np.isfinite(theta).all():
            raise run_files.unreadable(path, "it holds no finite numbers")
        return Simulator(model, theta, covariance)

    @property
    def judges_itself(self) -> bool:
        return True

    def judge(self) -> Base:
        return self.base()

    def spread(self, models: Mapping[int, Any], simulated: list[np.ndarray], cut: Windows) -> Any:
        return next(iter(models.values())).spread(cut)

    def forces(self, seconds: pl.DataFrame) -> pl.DataFrame | None:
        if self.extension is not None:  # its causes are no part of any force of the equations
            return None
        return force_breakdown.break_down(
            self.simulator(self.config.seeds[0]), seconds, self.profile
        )

    def _refuse_others(self, seed: int, count: int, names: Sequence[str]) -> None:
        """Raises RunError where the run's coefficients, `count` with a network's weights, are not
        `names`."""
        weights = [name for name in names if name.startswith("network.")]
        was = [*self.identified(seed)["name"], *weights]
        if was == list(names) and len(was) == count:
            return
        which = sorted({*was} ^ {*names}) or [f"{count} numbers instead of {len(names)}"]
        raise RunError(
            f"The run was made with other equations than this program's: {listed(which, most=8)}.",
            hint="train the run again.",
        )

    def nominal(self) -> Parameters:
        """Coefficients of its equations as published or estimated."""
        return self.kind.equations.begin(self.profile, self.config.physics, None).start

    def _numbers(self, seed: int) -> tuple[Any, np.ndarray, np.ndarray]:
        own = self.simulator(seed)
        return own.model, own.theta, own.covariance

    def _plain_base(self) -> Base:
        nominal = self.nominal()
        seed = self.config.seeds[0]
        simulator, known = self.simulator(seed), self.identified(seed)
        more = len(simulator.theta) - len(nominal.names)
        # a hybrid's network stays as it was trained
        start = Start(
            simulator.theta,
            np.concatenate((known["spread"].to_numpy(), np.full(more, HELD_SPREAD))),
            np.concatenate((nominal.low, np.full(more, -np.inf))),
            np.concatenate((nominal.high, np.full(more, np.inf))),
        )
        return self._standing_in(simulator.model, start)

    def _standing_in(self, model: Any, start: Start) -> Base:
        """The first coefficients are the MMG's where they have its names; else the ship's MMG is
        as it was published, or as its particulars suggest."""
        found = mmg.begin(self.profile, self.config.physics)
        count = len(found.start.names)
        own = model.names[:count] == found.start.names
        values = start.values[:count] if own else found.start.values
        return Base(model, start, found.model, values)

    def _with_coefficients(self, plain: Base, coefficients: np.ndarray) -> Base:
        return self._standing_in(plain.model, replace(plain.start, values=coefficients))


@dataclass(frozen=True, repr=False)
class ForeignRun(Run):
    """A simulator of one's own, on which causes are tested directly. It has no coefficients: those
    that causes change are of an MMG that was fitted to its accelerations.

    source   its file, where it was given by hand in this call
    """

    source: Source | None = None

    @property
    def label(self) -> str:
        if self.extension is None:
            return super().label
        causes = listed(c.label for c in self.extension.causes)
        return f"{self.config.foreign.name} with {causes}"

    @property
    def failures(self) -> tuple[Failure, ...]:
        """Where it failed so far."""
        return tuple(foreign_run.failures(self.config.foreign))

    @property
    def fixed(self) -> str:
        name, known = self.config.foreign.name, foreign_run.kept(self)
        if not len(known.values):
            return f"{self.profile.ship.name} has no MMG that could stand in for {name}"
        if StandIn(known.values, known.misfit).poor:
            return (
                f"no MMG of the ship describes {name}: it leaves "
                f"{float(np.median(known.misfit)):.0%} of its accelerations"
            )
        return ""

    @property
    def judges_itself(self) -> bool:
        return True

    def judge(self) -> Base:
        return self.base()

    @property
    def logged(self) -> bool:
        """Whether its states were logged: it can be asked nothing else."""
        return self.config.foreign.kind == "logged"

    @property
    def notes(self) -> tuple[str, ...]:
        of, misfit = self.config.foreign, foreign_run.kept(self).misfit
        if self.logged:
            return (
                f"{of.name} was logged, and cannot be asked at other states: an MMG that was "
                f"fitted to its accelerations is judged in its stead, and leaves "
                f"{float(np.median(misfit)):.0%} of them.",
            )
        found = [f"Sensitivities of {of.name}: {of.derivatives}."]
        if not self.fixed:
            found.append(
                "Causes that change the ship change an MMG that was fitted to its accelerations, "
                f"and leaves {float(np.median(misfit)):.0%} of them."
            )
        return tuple(found)

    def simulator(self, seed: int) -> Any:
        if self.logged:
            return LoggedSimulator(self.config.foreign.name, foreign_run.states(self))
        none = np.zeros(0)
        failures = foreign_run.failures(self.config.foreign)
        return ForeignSimulator(self._model(), none, np.zeros((0, 0)), failures)

    def accelerations(self, rows: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
        """At so many of the training voyages' rows: (state, actuators, wind) [n, 6 + A + 2], and
        its ν̇ there [n, 3]."""
        if self.logged:
            every, f = foreign_run.logged_accelerations(
                foreign_run.states(self), self.training(), self.profile
            )
            step = max(1, len(every) // most)
            return every[::step], f[::step]
        some = rows[:: max(1, len(rows) // most)]
        return some[:, :-1], self._model().accelerations(some[:, :6], some[:, 6:-1])

    def spread(self, models: Mapping[int, Any], simulated: list[np.ndarray], cut: Windows) -> Any:
        return next(iter(models.values())).spread(cut)

    def forces(self, seconds: pl.DataFrame) -> None:
        return None

    def _model(self) -> Any:
        of = self.config.foreign
        return foreign_run.model(
            self, self.source, lambda: source.absent(self.name, of.name, of.sha256)
        )

    def _numbers(self, seed: int) -> tuple[Any, np.ndarray, np.ndarray]:
        model, start, _, _ = self._plain_base()
        return model, start.values, np.zeros((len(start.values),) * 2)

    def _plain_base(self) -> Base:
        ship = mmg.begin(self.profile, self.config.physics)
        values = foreign_run.kept(self).values
        values = values if len(values) else ship.start.values
        if self.logged:
            held = np.full(len(values), HELD_SPREAD)
            start = Start(values, held, ship.start.low, ship.start.high)
            return Base(ship.model, start, ship.model, values)
        none = np.zeros(0)
        return Base(self._model(), Start(none, none, none, none), ship.model, values)

    def _with_coefficients(self, plain: Base, coefficients: np.ndarray) -> Base:
        return plain


RUNS = {NETWORK.name: NetworkRun, PHYSICS.name: PhysicalRun, FOREIGN.name: ForeignRun}


def of_folder(
    folder: RunFolder, causes: Sequence[Cause] = (), simulators: Sequence[str] = ()
) -> Run:
    """The models of a run folder: a NetworkRun, PhysicalRun or ForeignRun. Raises RunError.

    causes       of the user's own, for a run that was extended by them; see `causes.user.load`
    simulators   paths of simulators of one's own, for runs of them
    """
    run = RUNS[folder.kind.family.name](folder.path, folder.config, folder.profile)
    if isinstance(run, ForeignRun):
        of = folder.config.foreign
        given = [source.read(one) for one in simulators]
        run = replace(run, source=source.matching(given, folder.name, of.name, of.sha256))
    extension = extension_file.read(folder, causes)
    return run if extension is None else replace(run, extension=extension)


def network(folder: RunFolder) -> NetworkRun:
    """A network's run folder, finished or partial."""
    return NetworkRun(folder.path, folder.config, folder.profile)


def load(path: str | Path, causes: Sequence[Cause] = (), simulators: Sequence[str] = ()) -> Run:
    """A finished run with its models, as `of_folder`. Raises RunError."""
    return of_folder(run_folder.open_finished(Path(path)), causes, simulators)
