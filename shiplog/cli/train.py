"""`shiplog train`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli.inputs import check_voyages
from shiplog.cli.options import (
    STORE,
    Epochs,
    JsonOption,
    StoreOption,
    Validation,
    Voyages,
    Width,
    Window,
)
from shiplog.cli.output import answer


def train(
    out: Annotated[Path, typer.Option(help="The run folder to make.")],
    model: Annotated[
        str, typer.Option(help="Which dynamic model: feedforward, mmg or hybrid.")
    ] = "feedforward",
    data: Annotated[
        str, typer.Option(help="The paper's window set: ref, sli2, ..., d-ref.")
    ] = "ref",
    voyages: Voyages = None,
    validation: Validation = None,
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds: 0, 1, ...")] = 1,
    recipe: Annotated[str, typer.Option(help="fast, or paper: the published one, hours.")] = "fast",
    window: Window = 100,
    width: Width = 256,
    wind_input: Annotated[
        str | None,
        typer.Option(help="angle (default of the paper's recipe) or components (of the fast one)."),
    ] = None,
    epochs: Epochs = None,
    fit: Annotated[
        bool,
        typer.Option("--fit/--no-fit", help="Physical models: identify, or as published."),
    ] = True,
    parameters: Annotated[
        Path | None, typer.Option(help="Physical models: TOML of coefficients to start from.")
    ] = None,
    without: Annotated[
        list[str] | None, typer.Option(help="Physical models: a force to switch off, such as wind.")
    ] = None,
    free: Annotated[
        list[str] | None, typer.Option(help="Physical models: parameters that may move: 'wind.*'.")
    ] = None,
    folds: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="Physical models: parts that voyages are held out in, 5 unless given; 0 holds "
            "none out, and the gain is not tested.",
        ),
    ] = None,
    store: StoreOption = STORE,
    json_to: JsonOption = None,
) -> None:
    """Train a model; interrupted, give the same command again and it goes on.

    Example: shiplog train --data ref --seeds 3 --out runs/ref
    Example: shiplog train --model mmg --voyages 'trial_*' --out runs/mmg
    """
    from shiplog.cli.arguments import check_training
    from shiplog.paths import check_writable, refuse_taken

    physical = {
        "--no-fit": not fit, "--parameters": parameters is not None, "--without": bool(without),
        "--free": bool(free), "--folds": folds is not None,
    }  # fmt: skip
    check_training(model, data, recipe, wind_input, physical)
    refuse_taken(out)
    check_writable(out, "--out")
    check_voyages(store, voyages, validation)
    if model != "feedforward":
        from pipelines.identify import identify_command

        found = identify_command(
            store,
            out,
            model=model,
            data=data,
            voyages=voyages or [],
            validation=validation or [],
            seeds=seeds,
            window=window,
            fit=fit,
            parameters=parameters,
            without=without or [],
            free=free or [],
            folds=folds,
        )
        answer(found.text, found.content, json_to)
        return
    from pipelines.train import train_command

    found = train_command(
        store,
        out,
        model=model,
        data=data,
        voyages=voyages or [],
        validation=validation or [],
        seeds=seeds,
        recipe=recipe,
        window=window,
        width=width,
        wind_input=wind_input,
        epochs=epochs,
    )
    answer(found.text, found.content, json_to)
