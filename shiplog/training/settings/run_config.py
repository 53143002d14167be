"""What a training is: every value of it, frozen, saved together with its weights as TOML."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import Field, ValidationError, model_validator

from shiplog.exceptions import UnreadableError, listed
from shiplog.models import FAMILIES, FOREIGN, MODELS, NETWORK, ModelFamily
from shiplog.nomenclature.channels import LEAST_WINDOW
from shiplog.ship_profile.toml_section import Section
from shiplog.voyages.windows.split_settings import Split

RECIPES = ("fast", "paper")
WIND_INPUTS = ("angle", "components")
DEVICES = ("cpu", "cuda")


class Paper(Section):
    """Table 5 and Sec. 4.3 of the paper."""

    learning_rate: float = Field(default=1e-4, gt=0)
    regularisation: float = Field(default=1e-2, ge=0)  # λ of Eq. 6, on all parameters
    subsets: int = Field(default=3, gt=0)
    smoothing: float = Field(default=0.1, gt=0, le=1)  # α of Eq. 23
    least_epochs: int = Field(default=10_000, ge=0)
    rise: float = Field(default=0.1, gt=0)  # the stopping rule's share, Eq. 24
    most_epochs: int | None = None  # a cap the paper does not have, for those who cannot wait


class Fast(Section):
    """Short-window warm start with Adam, then L-BFGS on whole rollouts; not the paper's."""

    warm_steps: int = Field(default=5, gt=0)  # Euler steps of a warm-start window
    warm_epochs: int = Field(default=30, ge=0)
    warm_subsets: int = Field(default=12, gt=0)
    warm_learning_rate: float = Field(default=1e-3, gt=0)
    regularisation: float = Field(default=1e-2, ge=0)
    memory: int = Field(default=30, gt=0)
    iterations: int = Field(default=300, gt=0)
    patience: int = Field(default=40, gt=0)  # iterations without a better validation loss
    smoothing: float = Field(default=0.1, gt=0, le=1)
    most_windows: int = Field(default=256, gt=0)  # of a set with more, each seed takes as many


class NetworkSettings(Section):
    width: int = Field(default=256, gt=0)
    depth: int = Field(default=4, gt=0)
    wind_input: Literal["angle", "components"]
    input_tanh: bool = False


class Physics(Section):
    """How a physical model is identified; the hybrid's network too."""

    fit: bool = True  # else the starting values as they are
    parameters: str = ""  # where the starting values are from
    without: tuple[str, ...] = ()  # forces switched off
    sheet: str | None = None  # name of the trial sheet that it is identified from, of no voyage
    free: tuple[str, ...] = ()  # patterns of the parameters that may move; empty is all
    substeps: int = Field(default=1, ge=1, le=1000)  # Euler steps within each measured one
    folds: int = Field(default=5, ge=0)  # that voyages are held out in; below 2, none is
    # on the plausible spreads, for the ridge; to choose from on validation voyages
    ridges: tuple[Annotated[float, Field(gt=0)], ...] = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
    width: int = Field(default=8, gt=0)  # of the hybrid's residual network
    strengths: tuple[float, ...] = (0.1, 0.3, 1.0)  # of it, to choose from on held-out voyages


class Foreign(Section):
    """A simulator of one's own: what it is. Its code stays where it is."""

    name: str = ""  # of its file
    sha256: str = ""
    kind: Literal["callable", "fmu", "logged"] = "callable"
    function: str = ""  # of a callable, where it is not f; of logged states, their topic
    returns: str = ""  # derivative, acceleration or next state
    step: float = 0.0  # s, its own; 0 where it has none
    layout: str = ""  # how it takes many rows
    derivatives: str = ""  # its own, or how differences are taken
    place: bool = False  # whether its accelerations depend on where the ship is
    mapping: dict[str, Any] = Field(default_factory=dict)  # of an FMU, as its TOML has it


class Config(Section):
    """A run: which model learns what from which voyages, and how."""

    model: str = "feedforward"
    data: str = "ref"
    window: int = Field(default=100, ge=LEAST_WINDOW)
    recipe: Literal["paper", "fast"] = "fast"
    seeds: tuple[int, ...] = (0,)
    split: Split
    standard: tuple[str, ...] = ()  # voyages whose means scale the network; all training ones
    network: NetworkSettings = Field(
        default_factory=lambda: NetworkSettings(wind_input="components")
    )
    paper: Paper = Paper()
    fast: Fast = Fast()
    physics: Physics = Physics()
    foreign: Foreign = Foreign()

    @model_validator(mode="before")
    @classmethod
    def _wind_as_the_recipe_has_it(cls, values: dict) -> dict:
        """The paper's recipe takes the wind angle as it is; the fast one, its components."""
        network = dict(values.get("network") or {})
        network.setdefault(
            "wind_input", "angle" if values.get("recipe") == "paper" else "components"
        )
        return {**values, "network": network}

    @property
    def legend(self) -> str:
        """What a legend says of the model in a word: the recipe, or the physics."""
        if self._family is NETWORK:
            return self.recipe
        if self._family is FOREIGN:
            return self.foreign.name
        return "identified" if self.physics.fit else "as given"

    def label(self, wind: bool) -> str:
        """How results are headed: model, data, recipe, and how the wind enters where it does."""
        if self._family is NETWORK:
            how = f", wind {self.network.wind_input}" if wind else ""
            return f"{self.model} {self.data} ({self.recipe} recipe{how})"
        if self._family is FOREIGN:
            return f"{self.foreign.name}, a simulator of its own"
        data = "a trial sheet" if self.physics.sheet else self.data
        how = f"identified on {data}" if self.physics.fit else "as given"
        off = f", without {listed(self.physics.without)}" if self.physics.without else ""
        return f"{self.model} {how}{off}"

    @property
    def _family(self) -> ModelFamily:
        return MODELS[self.model].family

    def to_toml(self) -> str:
        """As it is saved; the sections that its model does not read left out."""
        other = {name for family in FAMILIES for name in family.sections}
        other -= set(self._family.sections)
        return tomli_w.dumps(self.model_dump(mode="json", exclude_none=True, exclude=other))


def load(path: Path) -> Config:
    """A config from TOML. Raises UnreadableError naming what is wrong."""
    try:
        return Config.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, RecursionError) as error:  # of TOML, UTF-8 and pydantic
        first = str(error).splitlines()[0] if isinstance(error, ValidationError) else error
        raise UnreadableError(
            f"{path} is no configuration of a run: {first}.", hint="train the run again."
        ) from error
