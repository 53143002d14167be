"""Run folders: a model, one dataset, all its seeds. The only module that writes them.

    <run>/config.toml  provenance.json      every resolved value; versions, hashes, times, and what
                                            held-out voyages chose
    <run>/profile.json                      the ship the run is of
    <run>/windows.parquet                     which windows it was trained on
    <run>/training.parquet  validation.parquet    the 1 Hz rows they were cut from
    <run>/scaling.safetensors               mean and std of inputs and accelerations (networks)
    <run>/seed<k>/model.safetensors  training.parquet   weights; epoch, losses; never redone
    <run>/seed<k>/model.safetensors  parameters.toml  identified.parquet    of physical models
    <run>/cross_validation.parquet          L of every training window by a fit without its voyage
    <run>/band.safetensors                  how far off a simulation may be
    <run>/extension.json  extension.safetensors   causes that a diagnosis put into it
    <run>/extension-<k>.py                  where some are a user's own: their code, to be read. It
                                            is never run from here: a run may be anybody's
    <run>/errors.parquet  rollouts.parquet  of the latest evaluation, per window, step and seed

While it is being trained a run is called <run>.partial; it is renamed when every seed is done.
Killed, it goes on from the finished seeds and, in the paper's recipe, from the last checkpoint.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import torch
from pydantic import ValidationError
from safetensors import SafetensorError
from safetensors.numpy import load_file as load_arrays
from safetensors.numpy import save_file as save_arrays
from safetensors.torch import load_file, save_file

from shiplog import files
from shiplog.exceptions import RunError, listed
from shiplog.models import MODELS, compiled_network, mmg
from shiplog.models.causes import CATALOGUE, Cause
from shiplog.models.extended import Extended
from shiplog.models.feedforward import FeedForward, Scaling, Shape
from shiplog.models.mmg import MMG
from shiplog.models.starting_values import Start
from shiplog.paths import check_run, refuse_taken
from shiplog.profile import Profile, advice
from shiplog.simulation.extended_simulator import ExtendedSimulator, Extension, campaign
from shiplog.simulation.prediction_interval import Band
from shiplog.simulation.sensitivities import Simulator
from shiplog.training import earlier_runs
from shiplog.training import run_config as configuration
from shiplog.training.network_training import HISTORY, Progress
from shiplog.training.run_config import Config
from shiplog.voyages.recording import Record

HELD_SPREAD = 1e-9  # spread of numbers that a diagnosis leaves where they are


@dataclass(frozen=True)
class Run:
    """An opened run folder, finished or partial.

    causes  of the user's own, without which a run that was extended by them cannot be simulated
    """

    path: Path
    config: Config
    profile: Profile
    causes: tuple[Cause, ...] = ()

    @property
    def name(self) -> str:
        return self.path.name.removesuffix(".partial")

    @property
    def label(self) -> str:
        """How results are headed: model, data, recipe, and how the wind enters if it does."""
        if (held := self.extension) is not None:
            return f"{self.config.model} with {listed(c.label for c in held.causes)}"
        if self.config.physical:
            off = f", without {listed(off)}" if (off := self.config.physics.without) else ""
            how = f"identified on {self.config.data}" if self.config.physics.fit else "as given"
            return f"{self.config.model} {how}{off}"
        wind = f", wind {self.config.network.wind_input}" if self.profile.has_wind else ""
        return f"{self.config.model} {self.config.data} ({self.config.recipe} recipe{wind})"

    @property
    def given(self) -> bool:
        """Whether its coefficients are as somebody gave them, fitted to no voyage."""
        return self.config.physical and not self.config.physics.fit

    @property
    def made_on(self) -> tuple[str, ...]:
        """The voyages it was fitted to, or stopped by."""
        return (*self.config.split.training, *self.config.split.validation)

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
        path = self.path / "scaling.safetensors"
        tensors = _tensors(path)
        try:
            return Scaling(*(tensors[name] for name in Scaling.__slots__))
        except KeyError as error:
            raise _unreadable(path, f"it lacks {error}") from error

    def windows(self) -> pl.DataFrame:
        """The plan of the training windows: voyage, segment, start, copy."""
        return _table(self.path / "windows.parquet")

    def training(self) -> pl.DataFrame:
        """The 1 Hz rows the run was trained on, sorted, as `table.resample` gave them."""
        return _table(self.path / "training.parquet")

    def validation(self) -> pl.DataFrame:
        """The 1 Hz rows of the validation voyages, likewise."""
        return _table(self.path / "validation.parquet")

    def empty_model(self) -> FeedForward:
        return FeedForward(self.shape, self.scaling())

    def models(self) -> dict[int, FeedForward | Simulator | ExtendedSimulator]:
        """Seed → what can be simulated: a network in float64, physics with its numbers, or
        either with causes in it."""
        one = self.simulator if self.config.physical else self.model
        if self.extension is not None:
            one = self.extended
        return {seed: one(seed) for seed in self.config.seeds}

    @property
    def extension(self) -> Extension | None:
        """The causes that a diagnosis named and put into this run; None for a plain one. Raises
        RunError for one of an earlier program, and for a user's cause that was not given."""
        path = self.path / "extension.json"
        if not path.is_file():
            return None
        told = _json(path)
        known = {cause.label for cause in (*CATALOGUE, *self.causes)}
        try:
            entries = [(str(entry["label"]), str(entry["name"])) for entry in told["causes"]]
        except (KeyError, TypeError) as error:
            raise _unreadable(path, error) from error
        lacking = [label for label, name in entries if not {label, name} & known]
        if lacking:
            code = listed(str(p) for p in sorted(self.path.glob("extension-*.py")))
            raise RunError(
                f"The run {self.name} was extended by {listed(lacking)}, which is no cause of "
                "shiplog's.",
                hint="give the file that defines it with --cause FILE"
                + ("." if code == "none" else f"; a copy to look over first: {code}."),
            )
        arrays = _arrays(self.path / "extension.safetensors")
        try:
            found = Extension.of(told, arrays, self.causes)
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise _unreadable(path, error) from error
        if self.config.physical:
            seed = self.config.seeds[0]
            names = self.simulator(seed).model.names
            place = self._kept(seed, len(found.coefficients), names)
            found = replace(found, coefficients=place.vector(found.coefficients))
        if not self.config.physical and found.coefficients.any() and found.coefficients.ndim != 2:
            raise RunError(
                f"{self.name} was extended by an earlier shiplog, which bent networks otherwise.",
                hint="extend its base again with `shiplog diagnose --extend`.",
            )
        return found

    def base(self) -> tuple[Any, Start, MMG, np.ndarray]:
        """What a diagnosis bends: the plain model, its coefficients, and an MMG of the ship whose
        coefficients causes change, with their values."""
        base, start, stand_in, values = self._plain()
        held = self.extension
        if held is None:
            return base, start, stand_in, values
        if not self.config.physical:
            return base.bend(held.coefficients), start, stand_in, values
        own = held.coefficients[: len(values)]
        return base, replace(start, values=held.coefficients), stand_in, own

    def _plain(self) -> tuple[Any, Start, MMG, np.ndarray]:
        """The same, without what an extension did to the coefficients."""
        ship, usual = self._published()
        seed = self.config.seeds[0]
        if not self.config.physical:
            none = np.zeros(0)
            start = Start(none, none, none, none)
            return compiled_network.compiled(self.model(seed)), start, mmg.MMG(ship), usual.values
        simulator = self.simulator(seed)
        known = self.identified(seed)
        count, more = len(usual.names), len(simulator.theta) - len(usual.names)
        place = self._kept(seed, known.height, usual.names)
        # a hybrid's network stays as it was trained, and so do terms that the run did not have
        start = Start(
            simulator.theta,
            np.concatenate(
                (place.vector(known["spread"].to_numpy(), HELD_SPREAD), np.full(more, HELD_SPREAD))
            ),
            np.concatenate((usual.low, np.full(more, -np.inf))),
            np.concatenate((usual.high, np.full(more, np.inf))),
        )
        stand_in = mmg.MMG(ship, self.config.physics.substeps)
        return simulator.model, start, stand_in, simulator.theta[:count]

    def ship(self) -> tuple[MMG, Start]:
        """Its MMG as somebody published it, or as its particulars suggest: fitted to nothing."""
        geometry, usual = self._published()
        return mmg.MMG(geometry), Start(usual.values, usual.spread, usual.low, usual.high)

    def _published(self) -> tuple[mmg.Geometry, mmg.Parameters]:
        ship, main, _ = mmg.geometry_of(self.profile, self.config.physics.without)
        path = mmg.beside(self.profile.source)
        usual = mmg.load(path, ship, self.config.physics.without) if path else None
        return ship, usual or mmg.estimated(ship, main)

    def extended(
        self,
        seed: int,
        record: Record | None = None,
    ) -> ExtendedSimulator:
        """The run's model, with its extension if it has one, ready to absorb causes.

        record   the campaign in which further ones are found
        """
        held = self.extension
        own = self.simulator(seed) if self.config.physical else None
        base, start, stand_in, values = self._plain()
        if own is None:
            base = compiled_network.compiled(self.model(seed))
        theta = start.values if own is None else own.theta
        covariance = np.zeros((len(theta),) * 2) if own is None else own.covariance
        model = Extended(base if own is None else own.model, (), stand_in, values, {})
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

    def simulator(self, seed: int) -> Simulator:
        """A physical model: equations of the profile's geometry, numbers of this seed."""
        from shiplog.models import hybrid

        arrays = _arrays(self._seed(seed) / "model.safetensors")
        ship, _, _ = mmg.geometry_of(self.profile, self.config.physics.without)
        physics = mmg.MMG(ship, self.config.physics.substeps)
        if self.config.model == "mmg":
            return self._simulator(physics, seed, arrays)
        fixed = {
            name.removeprefix("residual."): value
            for name, value in arrays.items()
            if name.startswith("residual.")
        }
        try:
            residual = hybrid.Residual(width=self.config.physics.width, **fixed)
        except TypeError as error:
            raise _unreadable(self._seed(seed) / "model.safetensors", error) from error
        return self._simulator(hybrid.Hybrid(physics, residual), seed, arrays)

    def _simulator(self, model: Any, seed: int, arrays: dict[str, np.ndarray]) -> Simulator:
        try:
            place = self._kept(seed, len(arrays["theta"]), model.names)
            theta, covariance = place.vector(arrays["theta"]), place.matrix(arrays["covariance"])
        except (KeyError, ValueError, TypeError) as error:
            raise _unreadable(self._seed(seed) / "model.safetensors", error) from error
        if not np.isfinite(theta).all():
            raise _unreadable(self._seed(seed) / "model.safetensors", "it holds no finite numbers")
        return Simulator(model, theta, covariance)

    def _kept(self, seed: int, count: int, names: Sequence[str]) -> earlier_runs.Kept:
        return earlier_runs.kept(self.identified(seed)["name"].to_list(), count, names)

    def save_simulator(
        self,
        seed: int,
        simulator: Simulator,
        fixed: dict[str, np.ndarray],
        parameters: str,
        identified: pl.DataFrame,
    ) -> None:
        """One seed of a physical model.

        fixed       arrays that are no parameters (the hybrid's scaling and anchors)
        parameters  TOML that --parameters takes
        identified  a row a parameter: name, value, standard error, start, spread
        """
        folder = self._seed(seed)
        folder.mkdir(exist_ok=True)
        arrays = {"theta": simulator.theta, "covariance": simulator.covariance}
        arrays |= {f"residual.{name}": np.asarray(value) for name, value in fixed.items()}
        _save_arrays(folder / "model.safetensors", arrays)
        (folder / "parameters.toml").write_text(parameters, encoding="utf-8")
        identified.write_parquet(folder / "identified.parquet")

    def identified(self, seed: int = 0) -> pl.DataFrame:
        """name, symbol, meaning, unit, start, spread, value, standard_error, free."""
        return _table(self._seed(seed) / "identified.parquet")

    def save_cross_validation(self, losses: pl.DataFrame) -> None:
        """groups, voyage, window, start (L of the starting values), loss."""
        losses.write_parquet(self.path / "cross_validation.parquet")

    def save_band(self, band: Band) -> None:
        _save_arrays(self.path / "band.safetensors", {"growth": band.growth, "factor": band.factor})

    def band(self) -> Band | None:
        """How far off its simulations may be; None where nothing was held out to learn it from."""
        path = self.path / "band.safetensors"
        return Band(**_arrays(path)) if path.is_file() else None

    def model(self, seed: int) -> FeedForward:
        model = self.empty_model()
        path = self._seed(seed) / "model.safetensors"
        try:
            _fill(model, _tensors(path))
        except (KeyError, RuntimeError) as error:  # of another size than the settings say
            raise _unreadable(path, error) from error
        return model.double()

    def history(self, seed: int) -> pl.DataFrame:
        """epoch, training, validation, smoothed."""
        return _table(self._seed(seed) / "training.parquet")

    def finished(self, seed: int) -> bool:
        return (self._seed(seed) / "training.parquet").is_file()

    def save_seed(self, seed: int, progress: Progress) -> None:
        """The best weights and the history; the checkpoint has served its purpose."""
        folder = self._seed(seed)
        folder.mkdir(exist_ok=True)
        _save(folder / "model.safetensors", _named(progress.best_weights))
        history = pl.DataFrame(progress.history, schema=list(HISTORY), orient="row")
        files.write_frame(folder / "training.parquet", history)  # last: `finished` looks for it
        (folder / "checkpoint.safetensors").unlink(missing_ok=True)

    def save_checkpoint(self, seed: int, progress: Progress) -> None:
        """Everything a killed training needs to go on as if nothing had happened."""
        folder = self._seed(seed)
        folder.mkdir(exist_ok=True)
        tensors = {
            **_named(progress.weights),
            **{f"best.{name}": w for name, w in _named(progress.best_weights).items()},
            **{f"moment.{i:02d}": m.contiguous() for i, m in enumerate(progress.moments)},
            "history": torch.tensor(progress.history, dtype=torch.float64),
            "numbers": torch.tensor(
                [progress.best, progress.first, progress.smoothed, progress.steps],
                dtype=torch.float64,
            ),
        }
        if progress.stream is not None:
            tensors["stream"] = progress.stream
        _save(folder / "checkpoint.safetensors", tensors)

    def load_checkpoint(self, seed: int) -> Progress | None:
        """Where an unfinished seed stands, or None."""
        path = self._seed(seed) / "checkpoint.safetensors"
        if not path.is_file():
            return None
        tensors = _tensors(path)
        rows = [(int(row[0]), *row[1:]) for row in tensors["history"].tolist()]
        best, first, smoothed, steps = tensors["numbers"].tolist()
        order = list(_named([torch.empty(0)] * sum(n.startswith("layer") for n in tensors)))
        return Progress(
            epoch=rows[-1][0],
            weights=[tensors[name] for name in order],
            best_weights=[tensors[f"best.{name}"] for name in order],
            best=best,
            first=first,
            smoothed=smoothed,
            moments=[tensors[n] for n in sorted(tensors) if n.startswith("moment.")],
            steps=int(steps),
            stream=tensors.get("stream"),
            history=rows,
        )

    def save_evaluation(self, errors: pl.DataFrame, rollouts: pl.DataFrame) -> None:
        """What the latest evaluation found: errors.parquet and rollouts.parquet."""
        for name, frame in (("errors", errors), ("rollouts", rollouts)):
            files.write_frame(self.path / f"{name}.parquet", frame)

    def finish(self, provenance: dict) -> Run:
        """Say where it came from and give it its name."""
        files.write_json(self.path / "provenance.json", provenance)
        final = self.path.with_name(self.name)
        self.path.rename(final)
        return Run(final, self.config, self.profile)

    def _seed(self, seed: int) -> Path:
        return self.path / f"seed{seed}"


def create(
    path: Path,
    config: Config,
    profile: Profile,
    scaling: Scaling | None,
    windows: pl.DataFrame,
    training: pl.DataFrame,
    validation: pl.DataFrame,
) -> Run:
    """Begin a run, or go on with one of the same settings that was interrupted.

    Raises RunError where the name is taken by a finished run or by other settings.
    """
    partial = path.with_name(f"{path.name}.partial")
    refuse_taken(path)
    if partial.is_dir() and (partial / "config.toml").is_file():
        begun = configuration.load(partial / "config.toml")
        same = begun == config and _same_rows(partial, training)
        if not same:
            raise RunError(
                f"{partial} was begun with other settings or data and is not finished.",
                hint=f"finish it with its own settings, choose another --out, or remove {partial}.",
            )
        return Run(partial, config, profile)
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    windows.write_parquet(partial / "windows.parquet")
    training.write_parquet(partial / "training.parquet")
    validation.write_parquet(partial / "validation.parquet")
    files.write_json(partial / "profile.json", profile.model_dump(mode="json"))
    if scaling is not None:
        _save(
            partial / "scaling.safetensors",
            {name: getattr(scaling, name).contiguous() for name in Scaling.__slots__},
        )
    # Last, and whole: a folder with a config is one that can be gone on with.
    files.write_text(partial / "config.toml", config.to_toml())
    return Run(partial, config, profile)


def load(path: str | Path, causes: Sequence[Cause] = ()) -> Run:
    """A finished run. Raises RunError.

    causes   of the user's own, for a run that was extended by them; see `user_causes.load`
    """
    path = Path(path)
    check_run(path)
    return replace(open_folder(path), causes=tuple(causes))


def open_folder(path: Path) -> Run:
    """A run folder as it stands, finished or partial. Raises RunError for one that is spoilt."""
    config = configuration.load(path / "config.toml")
    if config.model not in MODELS:
        raise RunError(
            f"{path / 'config.toml'} is no configuration of a run: there is no model "
            f"{config.model!r}.",
            hint="train the run again, or open it with the shiplog that made it.",
        )
    try:
        profile = Profile.model_validate(_json(path / "profile.json"))
    except ValidationError as error:
        raise _unreadable(path / "profile.json", advice(error)) from error
    return Run(path, config, profile)


def extend(
    run: Run, out: Path, simulator: ExtendedSimulator, own_files: Sequence[Path] = ()
) -> Run:
    """A new run: everything of the old one, and the causes; `own_files` define those that are
    not in the catalogue. Raises RunError for a taken name."""
    refuse_taken(out, "--extend")
    partial = out.with_name(f"{out.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    shutil.copytree(
        run.path, partial,
        ignore=shutil.ignore_patterns(
            "errors.parquet", "rollouts.parquet", "*.rrd", "band.safetensors", "extension.*",
            "extension-*.py",
        ),
    )  # fmt: skip
    told, arrays = Extension.kept(simulator, len(simulator.model.base.names))
    own = tuple(cause for cause in simulator.model.causes if cause.user)
    for i, path in enumerate(own_files if own else ()):
        shutil.copy(path, partial / f"extension-{i}.py")
    files.write_json(partial / "extension.json", told | {"base": run.name})
    _save_arrays(partial / "extension.safetensors", arrays)
    partial.rename(out)
    return Run(out, run.config, run.profile, own)


def _same_rows(partial: Path, training: pl.DataFrame) -> bool:
    """Same seconds and values; to rounding, since a parallel mean may add in another order."""
    begun = pl.read_parquet(partial / "training.parquet")
    if begun.columns != training.columns or begun.height != training.height:
        return False
    exact = [name for name, dtype in training.schema.items() if not dtype.is_float()]
    if not begun.select(exact).equals(training.select(exact)):
        return False
    values = [name for name in training.columns if name not in exact]
    return bool(
        np.allclose(begun.select(values).to_numpy(), training.select(values).to_numpy(), atol=1e-9)
    )


def _named(weights: list[torch.Tensor]) -> dict[str, torch.Tensor]:
    return {
        f"layer{i // 2:02d}.{('weight', 'bias')[i % 2]}": w.contiguous()
        for i, w in enumerate(weights)
    }


def _fill(model: FeedForward, tensors: dict[str, torch.Tensor]) -> None:
    with torch.no_grad():
        for name, parameter in zip(_named(model.weights), model.weights, strict=True):
            parameter.copy_(tensors[name])


def _tensors(path: Path) -> dict[str, torch.Tensor]:
    try:
        return load_file(path)
    except (OSError, SafetensorError) as error:
        raise _unreadable(path, error) from error


def _json(path: Path) -> Any:
    try:
        return json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise _unreadable(path, error) from error


def _table(path: Path) -> pl.DataFrame:
    try:
        return pl.read_parquet(path)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, why: object) -> RunError:
    return RunError(f"{path} cannot be read: {why}.", hint="train the run again.")


def _arrays(path: Path) -> dict[str, np.ndarray]:
    try:
        return load_arrays(path)
    except (OSError, SafetensorError) as error:
        raise _unreadable(path, error) from error


def _save_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    with files.whole(path) as partial:
        plain = {name: np.array(a, dtype=float, order="C") for name, a in arrays.items()}
        save_arrays(plain, partial)


def _save(path: Path, tensors: dict[str, torch.Tensor]) -> None:
    with files.whole(path) as partial:
        save_file(tensors, partial)
