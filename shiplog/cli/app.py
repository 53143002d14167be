"""All commands, in the order in which `shiplog --help` lists them: a line each."""

from __future__ import annotations

from typing import Annotated

import typer

from shiplog.cli import (
    cache,
    check,
    compare,
    convert,
    demo,
    diagnose,
    evaluate,
    export,
    gate,
    ingest,
    manoeuvres,
    paper,
    plan,
    profile,
    report,
    simulate,
    train,
    trend,
    voyages,
    watch,
)

COMMANDS = (
    demo.demo,
    check.check,
    ingest.ingest,
    convert.convert,
    profile.profile,
    voyages.voyages,
    train.train,
    paper.paper,
    evaluate.evaluate,
    compare.compare,
    diagnose.diagnose,
    trend.trend,
    watch.watch,
    simulate.simulate,
    manoeuvres.manoeuvres,
    export.export,
    plan.plan,
    report.report,
    gate.gate,
    cache.cache,
)

app = typer.Typer(
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Learn a ship's dynamic model from its logs, and see where it fails.",
    epilog="Exit codes: 0 done; 1 the input is at fault; 2 wrong usage; 3 done, but something was "
    "lost or refused; 4 a limit of `gate` is broken.",
)


def _version(asked: bool) -> None:
    """Versions of the program, of Rerun and of torch, and the engine that trains networks."""
    if not asked:
        return
    from importlib.metadata import version

    from shiplog.training.network import kernel

    level = kernel.level()
    engine = f"compiled kernel, {level}" if level else "torch (no compiled kernel)"
    typer.echo(
        f"shiplog {version('shiplog')}, engine: {engine}, Rerun {version('rerun-sdk')}, "
        f"torch {version('torch')}"
    )
    raise typer.Exit


@app.callback()
def _every(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_version,
            is_eager=True,
            help="Versions, and what trains networks.",
        ),
    ] = False,
) -> None:
    """Learn a ship's dynamic model from its logs, and see where it fails."""


for _command in COMMANDS:  # the list has each first sentence in full, however narrow the terminal
    app.command(short_help=(_command.__doc__ or "").split("\n", 1)[0])(_command)
