"""The options of `train`: one list for the command line, for Python and for what does it."""

from __future__ import annotations

import logging
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal

from shiplog.exceptions import UsageError, listed, nearest
from shiplog.models import FORCES, MODELS, PHYSICS, TRAINED, taking
from shiplog.nomenclature.channels import AUTO_WINDOW, LEAST_WINDOW
from shiplog.training.settings.run_config import DEVICES, RECIPES, WIND_INPUTS, Config
from shiplog.voyages.windows.augmentation import AUGMENTATIONS
from shiplog.voyages.windows.split_settings import Split

log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True, slots=True)
class TrainOptions:
    """The settings of a training. An option that keeps its default is not reported as given.

    model        which dynamic model, a name in MODELS
    data         the paper's window set: ref, sli2, ..., d-ref
    voyages      names or shell patterns of the voyages to learn from; all where there are none
    validation   those to validate on
    seeds        how many; they are numbered from 0
    window       length of a window [s]: samples at 1 Hz; or auto, which follows the ship (L/U)
    unchecked    although the profile still says CHECK, or sensors contradict each other

    Of networks:
    recipe       fast, or paper: the published one, which takes hours
    width        units of each hidden layer
    wind_input   angle (default of the paper's recipe) or components (of the fast one)
    epochs       cap on the epochs (paper) or iterations (fast)
    device       cpu, or cuda: the paper's recipe on an NVIDIA GPU, all seeds at once

    Of physical models:
    fit          identify; else the coefficients as they are published or estimated
    parameters   TOML of coefficients to start from
    without      forces to switch off: propeller, rudder, thruster or wind
    free         patterns of the coefficients to identify, such as wind.*; all where there are none
    folds        parts in which voyages are held out in turn, 5 unless given; below 2 none is
    """

    model: str = "feedforward"
    data: str = "ref"
    voyages: tuple[str, ...] = ()
    validation: tuple[str, ...] = ()
    seeds: int = 1
    window: int | Literal["auto"] = 100
    unchecked: bool = False
    recipe: str = "fast"
    width: int = 256
    wind_input: str | None = None
    epochs: int | None = None
    device: str = "cpu"
    fit: bool = True
    parameters: Path | None = None
    without: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    folds: int | None = None

    def check(self) -> None:
        """Raises UsageError for a word that names nothing, and for an option that says nothing to
        the model."""
        for value, allowed, option in (
            (self.model, TRAINED, "--model"),
            (self.data, AUGMENTATIONS, "--data"),
            (self.recipe, RECIPES, "--recipe"),
            (self.device, DEVICES, "--device"),
            (self.wind_input or WIND_INPUTS[0], WIND_INPUTS, "--wind-input"),
        ):
            if value not in allowed:
                raise UsageError(
                    f"{option} {value!r} does not exist{nearest(value, allowed)}.",
                    hint=f"{option} can be {listed(allowed)}.",
                )
        if self.device == "cuda" and self.recipe != "paper":
            raise UsageError(
                f"--device cuda does not go with the {self.recipe} recipe, which takes seconds on "
                "a core.",
                hint="add --recipe paper, or leave --device out.",
            )
        self._check_numbers()
        kind = MODELS[self.model]
        for name in filter(taking, self.given()):
            flag = "--no-fit" if name == "fit" else f"--{name.replace('_', '-')}"
            hint = f"it goes with --model {' or '.join(taking(name))}."
            if name in kind.family.options and not kind.takes(name):
                raise UsageError(
                    f"A {self.model}'s network has to be fitted.", hint=f"{flag}: {hint}"
                )
            if not kind.takes(name):
                raise UsageError(f"{flag} says nothing to {kind.family.noun}.", hint=hint)
        for name in self.without:
            if name not in FORCES:
                raise UsageError(
                    f"There is no force {name!r} to leave out{nearest(name, FORCES)}.",
                    hint=f"--without can be {listed(FORCES)}.",
                )
        if kind.family is PHYSICS and AUGMENTATIONS[self.data].step < AUGMENTATIONS["ref"].step:
            raise UsageError(
                f"--data {self.data} is of windows that overlap: an identification would count the "
                "same seconds several times, and its standard errors would be too small.",
                hint="choose ref or d-ref.",
            )
        if AUGMENTATIONS[self.data].copies and not kind.takes("copies"):
            raise UsageError(
                f"--data {self.data} is of noisy copies, which an identification has no use for.",
                hint="choose ref or d-ref.",
            )

    def _check_numbers(self) -> None:
        """Raises UsageError for a number that is too small; a command refuses all but the window
        before it comes here."""
        for name, least in (("seeds", 1), ("width", 1), ("epochs", 1), ("folds", 0)):
            value = getattr(self, name)
            if value is not None and value < least:
                raise UsageError(f"--{name} {value} is too small.", hint=f"give {least} or more.")
        if self.window != AUTO_WINDOW and self.window < LEAST_WINDOW:
            raise UsageError(
                f"A window of {self.window} s is too short to compare velocities in.",
                hint=f"choose --window {LEAST_WINDOW} or longer.",
            )

    def without_idle_seeds(self) -> TrainOptions:
        """The same with one seed where the model draws nothing, so that all would be alike."""
        kind = MODELS[self.model]
        if self.seeds == 1 or kind.family is not PHYSICS or kind.residual:
            return self
        log.info("An identification draws nothing at random: one seed stands for all.")
        return replace(self, seeds=1)

    def config(self, split: Split) -> Config:
        """The configuration of the run, with its voyages."""
        return Config.model_validate({**self.settings(), "split": split})

    def settings(self) -> dict[str, Any]:
        """The same without its voyages: the sections that the model reads."""
        shared = {
            "model": self.model, "data": self.data, "window": self.window,
            "seeds": tuple(range(self.seeds)),
        }  # fmt: skip
        if MODELS[self.model].family is PHYSICS:
            physics = {"fit": self.fit, "without": self.without, "free": self.free}
            return shared | {"physics": physics | _given(folds=self.folds)}
        return shared | {
            "recipe": self.recipe,
            "network": {"width": self.width} | _given(wind_input=self.wind_input),
            "paper": _given(most_epochs=self.epochs),
            "fast": _given(iterations=self.epochs),
        }

    def given(self) -> list[str]:
        """Options that are not as they are left."""
        return [one.name for one in fields(self) if getattr(self, one.name) != one.default]


def _given(**values: Any) -> dict[str, Any]:
    """Those that somebody gave."""
    return {name: value for name, value in values.items() if value is not None}
