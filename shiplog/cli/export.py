"""`shiplog export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.cli.inputs import check_voyages
from shiplog.cli.options import CHOSEN, STORE, Causes, JsonOption, Simulators, StoreOption
from shiplog.cli.output import LOST, answer
from shiplog.export.targets import PREDICTIONS, TARGETS, of_name, refuse_voyages


def export(
    run: Annotated[
        Path,
        typer.Argument(help="A trained run, such as runs/mmg.", autocompletion=completion.runs),
    ],
    to: Annotated[
        str,
        typer.Option(
            metavar="TARGET",
            help=f"One of {', '.join(TARGETS)}.",
            autocompletion=completion.of_words(tuple(TARGETS)),
        ),
    ],
    voyages: Annotated[
        list[str] | None,
        typer.Option(
            "--voyages",
            help=f"Of mcap, parquet and csv. {CHOSEN} the run's test voyages; csv then has "
            "coefficients.",
            autocompletion=completion.voyages,
        ),
    ] = None,
    store: StoreOption = STORE,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The file; the run's name here unless given."),
    ] = None,
    cause: Causes = None,
    simulator: Simulators = None,
    json_to: JsonOption = None,
) -> None:
    """A run in the files of other simulators and tools.

    Each file is loaded again by the program that it is for, where that is installed, and sails
    600 s as `simulate` does: the greatest difference is printed and kept in the file.

    Example: shiplog export runs/mmg --to fmu --out ship.fmu
    """  # fmt: skip
    target = of_name(to)
    if voyages:
        refuse_voyages(to)
    from shiplog.machine.paths import check_causes, check_file, check_run

    check_run(run)
    check_causes(cause or ())
    path = check_file(out or Path(f"{run.name}{target.ending}"), "--out")
    predicts = target.kind == PREDICTIONS or bool(voyages)
    if predicts:
        check_voyages(store, voyages)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.export import export_run
        from shiplog.commands.simulate import load
        from shiplog.voyages.store.store import Store
    opened = load(run, cause or [], simulator or [])
    done = export_run(opened, to, path, Store(store) if predicts else None, voyages or ())
    answer(done, json_to)
    if not done.complete:
        raise typer.Exit(LOST)
