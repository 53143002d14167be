"""Run folders: a model, one dataset, all its seeds. Paths, tables and settings; what is made of
them stands in `load_model`.

    <run>/config.toml  provenance.json      every resolved value; versions, hashes, times, and what
                                            held-out voyages chose
    <run>/profile.json                      the ship the run is of
    <run>/windows.parquet                     which windows it was trained on
    <run>/training.parquet  validation.parquet    the 1 Hz rows they were cut from
    <run>/scaling.safetensors               mean and std of inputs and accelerations (networks)
    <run>/seed<k>/                          see `network_files` and `physics_files`
    <run>/cross_validation.parquet          L of every training window by a fit without its voyage
    <run>/band.safetensors                  how far off a simulation may be
    <run>/trust.json                        what may be believed of each coefficient: `trust_file`
    <run>/extension.*                       causes that a diagnosis put into it: `extension_file`
    <run>/errors.parquet  rollouts.parquet  of the latest evaluation, per window, step and seed

While it is being trained a run is called <run>.partial; it is renamed when every seed is done.
Killed, it goes on from the finished seeds and, in the paper's recipe, from the last checkpoint.
<run>.partial itself appears with all that a training needs, or not at all.
"""

from __future__ import annotations

import logging
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl
from pydantic import ValidationError

from shiplog.exceptions import RunError, UnreadableError
from shiplog.machine import files
from shiplog.machine.paths import check_run, refuse_taken
from shiplog.models import MODELS, Kind
from shiplog.ship_profile.file import advice
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.prediction_interval import Band
from shiplog.training.settings import run_config as configuration
from shiplog.training.settings import run_files
from shiplog.training.settings.run_config import Config

if TYPE_CHECKING:
    from shiplog.models.feedforward import Scaling

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RunFolder:
    """An opened run folder, finished or partial."""

    path: Path
    config: Config
    profile: Profile

    @property
    def name(self) -> str:
        return self.path.name.removesuffix(".partial")

    @property
    def kind(self) -> Kind:
        """What sort of model it is of."""
        return MODELS[self.config.model]

    @property
    def label(self) -> str:
        """How results are headed: model, data, recipe, and how the wind enters if it does."""
        return self.config.label(self.profile.has_wind)

    @property
    def given(self) -> bool:
        """Whether its coefficients are as somebody gave them, fitted to no voyage."""
        return not self.config.physics.fit

    @property
    def trained_on(self) -> tuple[str, ...]:
        """The voyages it was fitted to, or stopped by."""
        return (*self.config.split.training, *self.config.split.validation)

    @property
    def fitted_to(self) -> tuple[str, ...]:
        """The voyages that any of its numbers were fitted to: no test of it."""
        return self.trained_on

    def windows(self) -> pl.DataFrame:
        """The plan of the training windows: voyage, segment, start, copy."""
        return run_files.table(self.path / "windows.parquet")

    def training(self) -> pl.DataFrame:
        """The 1 Hz rows the run was trained on, sorted, as `one_hertz.resample` gave them."""
        return run_files.table(self.path / "training.parquet")

    def validation(self) -> pl.DataFrame:
        """The 1 Hz rows of the validation voyages, likewise."""
        return run_files.table(self.path / "validation.parquet")

    def seed(self, seed: int) -> Path:
        """The folder of one seed; see `network_files` and `physics_files`."""
        return self.path / f"seed{seed}"

    def finished(self, seed: int) -> bool:
        """Whether a network's seed is trained."""
        return (self.seed(seed) / "training.parquet").is_file()

    def history(self, seed: int) -> pl.DataFrame:
        """Of a network: epoch, training, validation, smoothed."""
        return run_files.table(self.seed(seed) / "training.parquet")

    def identified(self, seed: int = 0) -> pl.DataFrame:
        """Of a physical model: name, symbol, meaning, unit, start, spread, value, standard_error,
        free."""
        return run_files.table(self.seed(seed) / "identified.parquet")

    def logs_sha256(self) -> dict[str, str | None]:
        """Voyage → hash of its log, as its provenance has them; none where it has none."""
        found = run_files.json_of(self.path / "provenance.json")
        known = found.get("logs_sha256") if isinstance(found, dict) else None
        return known if isinstance(known, dict) else {}

    def save_cross_validation(self, losses: pl.DataFrame) -> None:
        """groups, voyage, window, start (L of the starting values), loss."""
        files.write_frame(self.path / "cross_validation.parquet", losses)

    def cross_validation(self) -> pl.DataFrame | None:
        """A row a training window, by a fit that did not know its voyage, or its day: held_out
        (voyages or days), group, window, start, loss; None where nothing was held out."""
        path = self.path / "cross_validation.parquet"
        return run_files.table(path) if path.is_file() else None

    def save_band(self, band: Band) -> None:
        arrays = {"growth": band.growth, "factor": band.factor}
        run_files.save_arrays(self.path / "band.safetensors", arrays)

    def band(self) -> Band | None:
        """How far off its simulations may be; None where nothing was held out to learn it from."""
        path = self.path / "band.safetensors"
        return Band(**run_files.arrays(path)) if path.is_file() else None

    def save_evaluation(self, errors: pl.DataFrame, rollouts: pl.DataFrame) -> None:
        """What the latest evaluation found: errors.parquet and rollouts.parquet."""
        for name, frame in (("errors", errors), ("rollouts", rollouts)):
            files.write_frame(self.path / f"{name}.parquet", frame)

    def finish(self, provenance: dict) -> RunFolder:
        """Say where it came from and give it its name."""
        files.write_json(self.path / "provenance.json", provenance)
        final = self.path.with_name(self.name)
        self.path.rename(final)
        return RunFolder(final, self.config, self.profile)


def create(
    path: Path,
    config: Config,
    profile: Profile,
    scaling: Scaling | None,
    windows: pl.DataFrame,
    training: pl.DataFrame,
    validation: pl.DataFrame,
) -> RunFolder:
    """Begin a run, or go on with one of the same settings that was interrupted.

    Raises RunError where the name is taken by a finished run or by other settings.
    """
    partial = path.with_name(f"{path.name}.partial")
    refuse_taken(path)
    if partial.exists():
        try:
            _refuse_other(partial, config, profile, training, validation)
            for folder in (partial, *partial.glob("seed*")):
                files.sweep(folder)
            return RunFolder(partial, config, profile)
        except UnreadableError as error:
            _refuse_foreign(partial)
            log.warning("%s", error.message)
            log.warning("%s is begun anew.", partial)
            shutil.rmtree(partial)
    with files.whole_folder(partial) as new:
        windows.write_parquet(new / "windows.parquet")
        training.write_parquet(new / "training.parquet")
        validation.write_parquet(new / "validation.parquet")
        files.write_json(new / "profile.json", profile.model_dump(mode="json"))
        if scaling is not None:
            from shiplog.training.network import (
                network_files,  # with torch, which others do without
            )

            network_files.save_scaling(new, scaling)
        files.write_text(new / "config.toml", config.to_toml())
    return RunFolder(partial, config, profile)


def _refuse_other(
    partial: Path,
    config: Config,
    profile: Profile,
    training: pl.DataFrame,
    validation: pl.DataFrame,
) -> None:
    """Raises RunError where a begun run has other settings, another profile or other data;
    UnreadableError where these cannot be read."""
    same = (
        configuration.load(partial / "config.toml") == config
        and run_files.json_of(partial / "profile.json") == profile.model_dump(mode="json")
        and all(
            run_files.table(partial / f"{name}.parquet").equals(rows)
            for name, rows in (("training", training), ("validation", validation))
        )
    )
    if not same:
        raise RunError(
            f"{partial} was begun with other settings, another profile or other data and is not "
            "finished.",
            hint=f"finish it with its own settings, choose another --out, or remove {partial}.",
        )


def _refuse_foreign(partial: Path) -> None:
    """Raises RunError for a folder that no training began: it is not to be removed."""
    if (partial.is_dir() and not any(partial.iterdir())) or (partial / "config.toml").is_file():
        return
    raise RunError(
        f"{partial} is there, and is no run that was begun: there is no config.toml in it.",
        hint=f"choose another --out, or move {partial} away.",
    )


def open_finished(path: Path) -> RunFolder:
    """The folder of a finished run. Raises RunError."""
    check_run(path)
    return open_folder(path)


def open_folder(path: Path) -> RunFolder:
    """A run folder as it stands, finished or partial. Raises RunError for one that is spoilt."""
    config = configuration.load(path / "config.toml")
    if config.model not in MODELS:
        raise RunError(
            f"{path / 'config.toml'} is no configuration of a run: there is no model "
            f"{config.model!r}.",
            hint="train the run again, or open it with the shiplog that made it.",
        )
    try:
        profile = Profile.model_validate(run_files.json_of(path / "profile.json"))
    except ValidationError as error:
        raise run_files.unreadable(path / "profile.json", advice(error)) from error
    return RunFolder(path, config, profile)
