"""`shiplog diagnose`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.cli.inputs import check_runs
from shiplog.cli.options import STORE, Causes, JsonOption, StoreOption, TrialVoyages
from shiplog.cli.output import LOST, answer


def diagnose(
    context: typer.Context,
    run: Annotated[
        Path,
        typer.Argument(help="A trained run, such as runs/mmg.", autocompletion=completion.runs),
    ],
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
    json_to: JsonOption = None,
) -> None:
    """What the simulation gets wrong, and why.

    The answer names causes with their sizes, and the gain on held-out voyages.

    Example: shiplog diagnose runs/mmg --voyages 'season2_*' --extend runs/mmg2
    """
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
        switches=context.obj or ALL,
    )  # fmt: skip
    answer(found, json_to)
    if not found.drawn:
        raise typer.Exit(LOST)
