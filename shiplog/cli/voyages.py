"""`shiplog voyages`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli.options import STORE, JsonOption, StoreOption, Voyages
from shiplog.cli.output import LOST, answer
from shiplog.exceptions import ShiplogError


def voyages(
    store: StoreOption = STORE,
    sensors: Annotated[
        bool,
        typer.Option(
            "--sensors", help="Compare the sensors with each other, over all voyages together."
        ),
    ] = False,
    voyages: Voyages = None,
    json_to: JsonOption = None,
) -> None:
    """What is in the store.

    With --sensors, faults of the instruments that several voyages together show.

    Example: shiplog voyages --store store --voyages 'zigzag_*'

    Example: shiplog voyages --sensors --voyages 'zigzag_*'
    """
    from dataclasses import asdict

    if sensors:
        from shiplog.commands.bars import loading

        with loading():
            from shiplog.commands.sensors import compare_sensors
        from shiplog.voyages.store.store import Store

        answer(compare_sensors(Store(store), voyages or []), json_to)
        return

    from shiplog.nomenclature.contract import CONTRACT
    from shiplog.report.evaluation import text_table
    from shiplog.report.result import Answer
    from shiplog.voyages.store import catalogue

    if not store.exists():
        missing = ShiplogError(
            f"There is no store {store}.",
            hint="ingest logs first: shiplog ingest LOG... --store DIR.",
        )
        if not json_to:
            raise missing
        typer.echo(missing, err=True)  # for machines, no store holds no voyage
        answer(Answer((), {"contract": CONTRACT, "voyages": []}), json_to)
        raise typer.Exit(1)
    if catalogue.unfinished(store):
        from shiplog.voyages.store.store import Store

        Store(store).mend(wait=False)
    entries = catalogue.entries(store)
    left_out = _left_out(store, {entry.name for entry in entries})
    if voyages:
        from shiplog.voyages.store import parts
        from shiplog.voyages.store.store import Store

        chosen = parts.overlapping([e.name for e in entries], Store(store).select(voyages))
        entries = [entry for entry in entries if entry.name in chosen]
    text = text_table.catalogue(entries) if entries else f"no voyage in {store}"
    content = {"contract": CONTRACT, "voyages": [asdict(entry) for entry in entries]}
    answer(Answer((text,), content), json_to)
    if left_out and not voyages:  # named while the others were read
        raise typer.Exit(LOST)


def _left_out(store: Path, names: set[str]) -> bool:
    """Whether a voyage of the store is not among these: one that cannot be read."""
    from shiplog.voyages.store import catalogue

    there = (path for path in store.glob("voyage=*") if (path / "voyage.json").is_file())
    return any(catalogue.name_of(path) not in names for path in there)
