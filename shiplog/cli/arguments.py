"""Arguments of a command line, checked before anything heavy is loaded: a wrong word is reported
at once, and not after the work."""

from __future__ import annotations

from pathlib import Path

from shiplog.exceptions import ShiplogError, UsageError, listed, nearest
from shiplog.models import MODELS
from shiplog.training.run_config import RECIPES, WIND_INPUTS
from shiplog.voyages.augmentation import AUGMENTATIONS


def check_training(
    model: str, data: str, recipe: str, wind_input: str | None, physical: dict[str, bool]
) -> None:
    """Raises UsageError for a word that names nothing, and for options that exclude each other.

    physical   options of the physical models only, and whether they were given
    """
    for value, allowed, option in (
        (model, MODELS, "--model"),
        (data, AUGMENTATIONS, "--data"),
        (recipe, RECIPES, "--recipe"),
        (wind_input or WIND_INPUTS[0], WIND_INPUTS, "--wind-input"),
    ):
        if value not in allowed:
            raise UsageError(
                f"{option} {value!r} does not exist{nearest(value, allowed)}.",
                hint=f"{option} can be {listed(allowed)}.",
            )
    given = [option for option, was in physical.items() if was]
    if model == "feedforward" and given:
        raise UsageError(
            f"{given[0]} says nothing to a network.", hint="it goes with --model mmg or hybrid."
        )
    if model == "hybrid" and physical["--no-fit"]:
        raise UsageError(
            "A hybrid's network has to be fitted.", hint="--no-fit goes with --model mmg."
        )
    if model != "feedforward" and AUGMENTATIONS[data].copies:
        raise UsageError(
            f"--data {data} is of noisy copies, which an identification has no use for.",
            hint=f"choose {listed(n for n, a in AUGMENTATIONS.items() if not a.copies)}.",
        )


def sample_logs(given: Path | None = None) -> Path:
    """The folder of logs for the demo: the one given, or that of the checkout this runs from.
    Raises ShiplogError."""
    if given is not None:
        if not any(given.glob("*.mcap")):
            raise ShiplogError(f"No log in {given}.", hint="give --logs a folder of MCAP logs.")
        return given
    here = (Path.cwd(), Path(__file__).resolve().parents[2])
    for folder in here:
        if any((folder / "sample_logs").glob("*.mcap")):
            return folder / "sample_logs"
    raise ShiplogError(
        f"There is no folder sample_logs in {here[0]}.",
        hint="run the demo from a clone of shiplog, or make the logs again with "
        "`python -m pipelines.experiments.simulated_ship sample_logs` and give them with --logs.",
    )
