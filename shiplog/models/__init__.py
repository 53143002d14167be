"""The dynamic models by name. To add one: a file here and a line in MODELS."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from shiplog.models.physical import PhysicalModel


@dataclass(frozen=True, slots=True)
class ModelFamily:
    """How models of a kind are trained.

    name       "network": weights, by the gradient of the loss of rollouts; "physics":
               coefficients with a meaning, by output error; "foreign": not at all, its equations
               are somebody else's
    noun       what a sentence calls a model of it
    options    of `train` that the family takes, in addition to those of all; "copies" are noisy
               ones of the windows
    sections   of a run's configuration that it reads
    """

    name: str
    noun: str
    options: tuple[str, ...]
    sections: tuple[str, ...]


# Forces that `--without` leaves out of a physical model; the hull always stays.
FORCES = ("propeller", "rudder", "thruster", "wind")

NETWORK = ModelFamily(
    "network",
    "a network",
    options=("recipe", "width", "wind_input", "epochs", "device", "copies"),
    sections=("network", "paper", "fast"),
)
PHYSICS = ModelFamily(
    "physics",
    "a physical model",
    options=("fit", "parameters", "without", "free", "folds"),
    sections=("physics",),
)
FOREIGN = ModelFamily(
    "foreign",
    "a simulator of your own",
    options=(),
    sections=("foreign",),
)
FAMILIES = (NETWORK, PHYSICS, FOREIGN)


@dataclass(frozen=True, slots=True)
class Kind:
    """What the rest of the program asks of a model before it imports the equations.

    about      in a line
    module     which gives a physical model's equations as MODEL
    residual   whether a residual network is fitted on top of the identified equations; each seed
               then draws its own, and it cannot be left unfitted
    """

    about: str
    family: ModelFamily
    module: str = ""
    residual: bool = False

    def takes(self, option: str) -> bool:
        """Whether an option of `train` says something to this model."""
        return option in self.family.options and not (option == "fit" and self.residual)

    @property
    def equations(self) -> PhysicalModel:
        """Of a physical model."""
        return import_module(self.module).MODEL


MODELS = {
    "feedforward": Kind(
        "the paper's network, from the velocities, actuators and apparent wind",
        NETWORK,
    ),
    "mmg": Kind(
        "hull, propellers, rudders and wind on a rigid body, identified from the logs",
        PHYSICS, "shiplog.models.mmg",
    ),
    "hybrid": Kind(
        "the mmg and a small residual network that fades outside its training data",
        PHYSICS, "shiplog.models.hybrid", residual=True,
    ),
    "foreign": Kind("a simulator of your own, by its file: FILE.py, FILE.fmu", FOREIGN),
}  # fmt: skip


# Those that are trained: a simulator of the user's own is known by its file.
TRAINED = tuple(name for name, kind in MODELS.items() if kind.family is not FOREIGN)


def taking(option: str) -> list[str]:
    """The models that an option of `train` says something to."""
    return [name for name, kind in MODELS.items() if kind.takes(option)]
