"""`shiplog gate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.cli.inputs import check_runs
from shiplog.cli.options import STORE, Causes, JsonOption, Simulators, StoreOption
from shiplog.cli.output import answer

BROKEN = 4  # exit code: a limit is broken


def gate(
    run: Annotated[
        Path,
        typer.Argument(help="A trained run, such as runs/mmg.", autocompletion=completion.runs),
    ],
    limits: Annotated[Path, typer.Option(help="TOML file of limits; --write makes one.")],
    voyages: Annotated[
        list[str] | None,
        typer.Option(
            help="Names or shell patterns, several times; unless given, those of the diagnosis, "
            "else the run's test voyages, else all that it was not fitted to.",
            autocompletion=completion.voyages,
        ),
    ] = None,
    store: StoreOption = STORE,
    diagnosis: Annotated[
        Path | None,
        typer.Option(
            help="Folder of a diagnosis of these voyages, for limits on a verdict. Where there is "
            "none yet, it is made there; without this option it is made and not kept."
        ),
    ] = None,
    junit: Annotated[
        Path | None, typer.Option(help="Write the result as JUnit XML into this file.")
    ] = None,
    write: Annotated[
        bool,
        typer.Option("--write", help="Write a new limits file from today's results, and end."),
    ] = False,
    cause: Causes = None,
    simulator: Simulators = None,
    json_to: JsonOption = None,
) -> None:
    """Whether a run keeps the limits that you set, for CI.

    One line a limit. Exits with 0 where all hold, and with 4 where one is broken or was not
    assessed.

    Example: shiplog gate runs/mmg --limits limits.toml --voyages 'june_*' --junit gate.xml
    """
    from shiplog.machine.paths import check_file

    if junit is not None:
        junit = check_file(junit, "--junit", streams=True)
    check_runs([run], store, voyages, cause)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.gate import gate_command, write_limits
        from shiplog.report.gate.limits_file import refuse_replaced
    from shiplog.voyages.store.store import Store

    refuse_replaced(limits, junit=junit, json=None if json_to in (None, "-") else Path(json_to))
    if write:
        answer(
            write_limits(
                run, Store(store), limits, voyages or [], diagnosis=diagnosis,
                cause_files=cause or [], simulators=simulator or [],
            ),
            json_to,
        )  # fmt: skip
        return
    done = gate_command(
        run, Store(store), limits, voyages or [], diagnosis=diagnosis, cause_files=cause or [],
        junit_to=junit, simulators=simulator or [],
    )  # fmt: skip
    answer(done, json_to)
    if not done.holds:
        raise typer.Exit(BROKEN)
