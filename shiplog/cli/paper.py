"""`shiplog paper`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli.inputs import check_voyages
from shiplog.cli.options import (
    STORE,
    Device,
    Epochs,
    JsonOption,
    ReportOption,
    Seeds,
    StoreOption,
    TrainingVoyages,
    Validation,
    Width,
    Window,
    page_file,
)
from shiplog.cli.output import LOST, answer
from shiplog.exceptions import UsageError


def paper(
    out: Annotated[Path, typer.Option(help="Where runs, tables and figures go.")] = Path("paper"),
    data: Annotated[
        list[str] | None,
        typer.Option("--data", help="Window sets, all eight unless given; several times."),
    ] = None,
    voyages: TrainingVoyages = None,
    validation: Validation = None,
    seeds: Seeds = 10,
    recipe: Annotated[
        str, typer.Option(help="fast, or paper: the published one, which takes days.")
    ] = "fast",
    window: Window = 100,
    width: Width = 256,
    epochs: Epochs = None,
    device: Device = "cpu",
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Trainings at a time; one a core unless given.")
    ] = None,
    ray: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Train on this Ray cluster instead.")
    ] = None,
    store: StoreOption = STORE,
    report: ReportOption = None,
    json_to: JsonOption = None,
) -> None:
    """The published experiment: eight window sets, ten seeds each.

    It leaves tables, figures and a recording. If it was interrupted, give the same command again:
    it goes on.

    Example: shiplog paper --seeds 10 --out paper
    """
    from shiplog.machine.paths import check_writable
    from shiplog.training.settings.options import TrainOptions
    from shiplog.voyages.windows.augmentation import AUGMENTATIONS

    chosen = list(dict.fromkeys(data or AUGMENTATIONS))
    for name in chosen:
        TrainOptions(data=name, recipe=recipe, device=device).check()
    _refuse_together(device, jobs, ray)
    page = page_file(report)
    check_writable(out, "--out")
    check_voyages(store, voyages, validation)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.paper import paper_command

    found = paper_command(
        store,
        out,
        data=chosen,
        voyages=voyages or [],
        validation=validation or [],
        seeds=seeds,
        recipe=recipe,
        window=window,
        width=width,
        epochs=epochs,
        jobs=jobs,
        ray=ray,
        device=device,
        page=page,
    )
    answer(found, json_to)
    if found.json["failures"]:
        raise typer.Exit(LOST)


def _refuse_together(device: str, jobs: int | None, ray: str | None) -> None:
    """Raises UsageError for two of a GPU, processes and a cluster."""
    if ray is not None and jobs is not None:
        raise UsageError(
            "--jobs says nothing to --ray: the cluster trains as many at a time as it has cores.",
            hint="leave --jobs or --ray out.",
        )
    for value, flag in ((jobs, "--jobs"), (ray, "--ray")):
        if device == "cuda" and value is not None:
            raise UsageError(
                f"{flag} says nothing to --device cuda: one process trains all seeds on the GPU.",
                hint=f"leave {flag} or --device out.",
            )
