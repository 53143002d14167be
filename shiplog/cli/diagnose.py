"""`shiplog diagnose`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.cli.inputs import check_runs
from shiplog.cli.options import STORE, Causes, JsonOption, Simulators, StoreOption, TrialVoyages
from shiplog.cli.output import LOST, answer
from shiplog.exceptions import UsageError

OF_ONE = {  # parameters that say nothing to a list, and where it says the same
    "run": "RUN", "voyages": "--voyages", "store": "--store", "extend": "--extend",
    "ray": "--ray",
}  # fmt: skip


def diagnose(
    context: typer.Context,
    run: Annotated[
        Path | None,
        typer.Argument(help="A trained run, such as runs/mmg.", autocompletion=completion.runs),
    ] = None,
    voyages: TrialVoyages = None,
    store: StoreOption = STORE,
    out: Annotated[Path, typer.Option(help="Folder for report, verdict and recording.")] = Path(
        "diagnosis"
    ),
    extend: Annotated[
        Path | None,
        typer.Option(
            help="Write the model with the named causes as this run; without a named cause nothing "
            "is written. An unrecorded thruster cannot be part of a model.",
        ),
    ] = None,
    cause: Causes = None,
    simulator: Simulators = None,
    ships: Annotated[
        Path | None,
        typer.Option(
            "--list",
            metavar="FILE.csv",
            help="Instead of RUN: many ships, with the columns run, store, voyages. Each has a "
            "folder in --out, which gets one table of verdicts.",
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(min=1, help="Ships of --list at a time; one a core unless given."),
    ] = None,
    ray: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="For very many voyages: this Ray cluster holds their segments.",
        ),
    ] = None,
    json_to: JsonOption = None,
) -> None:
    """What the simulation gets wrong, and why.

    The answer names causes with their sizes, and the gain on held-out voyages.

    Example: shiplog diagnose runs/mmg --voyages 'season2_*' --extend runs/mmg2

    Many ships: shiplog diagnose --list ships.csv --jobs 4 --out september
    """
    if ships is not None:
        _fleet(context, ships, out, jobs, cause, json_to)
        return
    if run is None:
        raise UsageError(
            "There is neither a RUN nor a --list.",
            hint="give the folder of a trained run, such as runs/mmg; or --list FILE.csv.",
        )
    if jobs is not None:
        raise UsageError(
            "--jobs says nothing to one run: its diagnosis is one process.",
            hint="leave --jobs out, or give many ships with --list FILE.csv.",
        )
    from shiplog.machine.paths import check_diagnosis

    check_diagnosis(out, extend)
    check_runs([run], store, voyages, cause)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.diagnose import diagnose_run
        from shiplog.diagnosis.decision_parts import ALL
    from shiplog.voyages.store.store import Store

    found = diagnose_run(
        run, Store(store), voyages or [], out, extend=extend, cause_files=cause or [],
        switches=context.obj or ALL, ray=ray, simulators=simulator or [],
    )  # fmt: skip
    answer(found, json_to)
    if not found.drawn:
        raise typer.Exit(LOST)


def _fleet(
    context: typer.Context,
    ships: Path,
    out: Path,
    jobs: int | None,
    cause: list[Path] | None,
    json_to: str | None,
) -> None:
    """Many ships. Exit 3 where one of them has no verdict, and 1 where none has."""
    for name, written in OF_ONE.items():
        if _given(context, name):
            raise UsageError(
                f"{written} says nothing to --list: it is one ship's.",
                hint=f"leave {written} out; each line of {ships} has a run, a store and voyages.",
            )
    from shiplog.machine.paths import check_causes, check_diagnosis

    check_diagnosis(out, None)
    check_causes(cause or ())
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.fleet import diagnose_list
        from shiplog.diagnosis.decision_parts import ALL
        from shiplog.report.fleet.fleet import refuse_all_failed

    found = diagnose_list(
        ships, out, jobs=jobs, cause_files=cause or [], switches=context.obj or ALL
    )
    answer(found, json_to)
    refuse_all_failed(found)
    if not found.complete:
        raise typer.Exit(LOST)


def _given(context: typer.Context, name: str) -> bool:
    """Whether a parameter stands on the command line."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"
