"""`shiplog train`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.cli.inputs import check_voyages
from shiplog.cli.options import (
    STORE,
    AutoWindow,
    Device,
    Epochs,
    JsonOption,
    Seeds,
    StoreOption,
    TrainingVoyages,
    Validation,
    Width,
)
from shiplog.cli.output import LOST, answer
from shiplog.exceptions import UsageError, listed
from shiplog.foreign.source import recognised
from shiplog.models import FORCES, MODELS, PHYSICS, TRAINED
from shiplog.nomenclature.channels import AUTO_WINDOW, WINDOW
from shiplog.voyages.windows.augmentation import AUGMENTATIONS

Out = Annotated[Path, typer.Option(help="The run folder to make.")]
Model = Annotated[
    str,
    typer.Option(
        help=f"Which dynamic model: {', '.join(TRAINED)}; begin with mmg. Or the file of a "
        "simulator of your own: FILE.py, FILE.fmu, or 'logs:/TOPIC'.",
        autocompletion=completion.of_words(TRAINED),
    ),
]
Data = Annotated[
    str,
    typer.Option(
        help=f"The paper's window set: {', '.join(AUGMENTATIONS)}.",
        autocompletion=completion.of_words(AUGMENTATIONS),
    ),
]
Recipe = Annotated[
    str,
    typer.Option(
        help="fast, or paper: the published one, which takes hours.",
        autocompletion=completion.of_words(("fast", "paper")),
    ),
]
WindInput = Annotated[
    str | None,
    typer.Option(
        help="angle (default of the paper's recipe) or components (of the fast one).",
        autocompletion=completion.of_words(("angle", "components")),
    ),
]
Fit = Annotated[
    bool,
    typer.Option(
        "--fit/--no-fit",
        help="Physical models: identify the coefficients, or take the published or estimated ones "
        "as they are.",
    ),
]
Parameters = Annotated[
    Path | None, typer.Option(help="Physical models: TOML of coefficients to start from.")
]
Without = Annotated[
    list[str] | None,
    typer.Option(
        help=f"Physical models: a force to switch off: {', '.join(FORCES[:-1])} or {FORCES[-1]}; "
        "several times.",
        autocompletion=completion.of_words(FORCES),
    ),
]
Free = Annotated[
    list[str] | None,
    typer.Option(
        help="Physical models: coefficients that are identified, such as 'wind.*'; all others "
        "keep their values. Several times.",
    ),
]
Folds = Annotated[
    int | None,
    typer.Option(
        min=0,
        help="Physical models: parts in which voyages are held out in turn, 5 unless given; below "
        "2 none is, and the fit is not tested on other voyages.",
    ),
]
Unchecked = Annotated[
    bool,
    typer.Option(
        "--unchecked",
        help="Although the profile still says CHECK, or sensors contradict each other.",
    ),
]
Again = Annotated[
    Path | None,
    typer.Option(
        help="Repeat this run from its folder alone; every setting is that run's.",
        autocompletion=completion.runs,
    ),
]

TrialSheet = Annotated[
    Path | None,
    typer.Option(
        help="Physical models: TOML of a trial sheet's numbers, from which alone it is identified.",
    ),
]
SheetProfile = Annotated[
    str | None,
    typer.Option("--profile", help="With --trial-sheet: the ship's profile, a name or a path."),
]

Mapping = Annotated[
    Path | None,
    typer.Option(
        help="An FMU: TOML that says which of its variables is which channel; drafted where there "
        "is none.",
    ),
]
SimulatedLogs = Annotated[
    list[Path] | None,
    typer.Option(
        "--logs",
        help="With logs:/TOPIC: the logs that were ingested and hold it, or folders of them.",
    ),
]


NO_MODEL = (
    "No --model is given: this trains {model}, the paper's network. To begin with a ship, take "
    "--model mmg: it needs fewer voyages, and its coefficients have a meaning."
)
OF_SHEET = (  # those that go with --trial-sheet
    "out", "trial_sheet", "profile", "model", "parameters", "without", "free", "json_to",
)  # fmt: skip
OF_SIMULATORS = (  # those that go with a simulator's file
    "out", "model", "voyages", "validation", "window", "mapping", "logs", "store", "json_to",
    "unchecked",
)  # fmt: skip
OF_AGAIN = ("out", "again", "store", "json_to")  # parameters that go with --again


def train(
    context: typer.Context,
    out: Out,
    model: Model = "feedforward",
    data: Data = "ref",
    voyages: TrainingVoyages = None,
    validation: Validation = None,
    seeds: Seeds = 1,
    recipe: Recipe = "fast",
    window: AutoWindow = "100",
    width: Width = 256,
    wind_input: WindInput = None,
    epochs: Epochs = None,
    device: Device = "cpu",
    fit: Fit = True,
    parameters: Parameters = None,
    without: Without = None,
    free: Free = None,
    folds: Folds = None,
    unchecked: Unchecked = False,
    again: Again = None,
    mapping: Mapping = None,
    logs: SimulatedLogs = None,
    trial_sheet: TrialSheet = None,
    profile: SheetProfile = None,
    store: StoreOption = STORE,
    json_to: JsonOption = None,
) -> None:
    """Train a network, or identify a physical model.

    If it was interrupted, give the same command again: it goes on.

    Example: shiplog train --data ref --seeds 3 --out runs/ref

    Example: shiplog train --model mmg --voyages 'june_*' --out runs/mmg

    Example: shiplog train --again runs/mmg --out runs/mmg-2

    Example: shiplog train --model mmg --trial-sheet trials.toml --out runs/trials
    """
    from shiplog.machine.paths import check_run, check_writable, refuse_run
    from shiplog.training.settings.options import TrainOptions

    options = TrainOptions(
        model=model, data=data, voyages=tuple(voyages or ()), validation=tuple(validation or ()),
        seeds=seeds, window="auto" if window == AUTO_WINDOW else int(window), recipe=recipe,
        width=width, wind_input=wind_input, epochs=epochs, device=device, fit=fit,
        parameters=parameters, without=tuple(without or ()), free=tuple(free or ()), folds=folds,
        unchecked=unchecked,
    )  # fmt: skip
    if recognised(model):
        _refuse_of_simulators(context)
        options = replace(options, model=next(iter(MODELS)))
    options.check()
    refuse_run(out)
    check_writable(out, "--out")
    if again is not None:
        _refuse_others(context)
        check_run(again)
        from shiplog.commands.train_again import again_command

        found = again_command(store, out, again)
        answer(found, json_to)
        return
    if trial_sheet is not None:
        _refuse_of_voyages(context, model)
        from shiplog.commands.bars import loading

        with loading():
            from shiplog.commands.identify_sheet import sheet_command
        answer(sheet_command(trial_sheet, profile, out, options), json_to)
        return
    if profile is not None:
        raise UsageError(
            "--profile goes with --trial-sheet: voyages have the profile that they were ingested "
            "with.",
            hint="leave it out.",
        )
    check_voyages(store, voyages, validation)
    if recognised(model):
        from shiplog.commands.bars import loading

        with loading():
            from shiplog.commands.train_foreign import Given, foreign_command
        size = WINDOW if options.window == AUTO_WINDOW else options.window
        given = Given(model, mapping, tuple(logs or ()), unchecked)
        found = foreign_command(given, store, out, options.voyages, options.validation, int(size))
        answer(found, json_to)
        if not found.complete:
            raise typer.Exit(LOST)
        return
    if not _typed(context, "model"):
        typer.echo(NO_MODEL.format(model=model), err=True)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.train import train_command
    found = train_command(store, out, options)
    answer(found, json_to)


def _refuse_of_simulators(context: typer.Context) -> None:
    """Raises UsageError for an option that trains: a simulator is taken as it is."""
    given = [
        "no-fit" if (name, value) == ("fit", False) else name.replace("_", "-")
        for name, value in context.params.items()
        if name not in OF_SIMULATORS and _typed(context, name)
    ]
    if given:
        raise UsageError(
            f"A simulator of your own is taken as it is: {listed(f'--{name}' for name in given)} "
            "says nothing to it.",
            hint="leave it out.",
        )


def _refuse_others(context: typer.Context) -> None:
    """Raises UsageError for options that would change a run which is to be repeated as it was.
    One that is given with its default would change a run of another value, too."""
    given = [
        "no-fit" if (name, value) == ("fit", False) else name.replace("_", "-")
        for name, value in context.params.items()
        if name not in OF_AGAIN and _typed(context, name)
    ]
    if given:
        raise UsageError(
            f"--again repeats a run as it was, and {listed(f'--{name}' for name in given)} would "
            "change it.",
            hint="leave the other options out, or train a run of other settings without --again.",
        )


def _refuse_of_voyages(context: typer.Context, model: str) -> None:
    """Raises UsageError for a model, or an option, that a trial sheet is too little for."""
    if MODELS[model].family is not PHYSICS or MODELS[model].residual:
        fitting = [name for name, kind in MODELS.items() if kind.family is PHYSICS
                   and not kind.residual]  # fmt: skip
        raise UsageError(
            f"A trial sheet has too few numbers for a {model}.",
            hint=f"add --model {' or '.join(fitting)}.",
        )
    given = [
        "no-fit" if (name, value) == ("fit", False) else name.replace("_", "-")
        for name, value in context.params.items()
        if name not in OF_SHEET and _typed(context, name)
    ]
    if given:
        raise UsageError(
            f"A trial sheet has no voyages, and {listed(f'--{name}' for name in given)} is about "
            "these.",
            hint="leave it out; the sheet has the conditions of its manoeuvres.",
        )


def _typed(context: typer.Context, name: str) -> bool:
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"
