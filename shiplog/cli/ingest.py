"""`shiplog ingest`."""

from __future__ import annotations

from typing import Annotated

import typer

from shiplog.cli.inputs import check_paths
from shiplog.cli.options import (
    STORE,
    JsonOption,
    Logs,
    ProfileOption,
    ReportOption,
    StoreOption,
    page_file,
)
from shiplog.cli.output import leave


def ingest(
    logs: Logs,
    profile: ProfileOption = None,
    store: StoreOption = STORE,
    correct: Annotated[
        bool,
        typer.Option(
            "--correct", help="Correct each fault of a sensor that the other sensors make certain."
        ),
    ] = False,
    report: ReportOption = None,
    json_to: JsonOption = None,
) -> None:
    """Logs into the store: 10 Hz, at midship, faults marked.

    The same log with the same profile again changes nothing; with another profile it replaces the
    voyage.

    Example: shiplog ingest sample_logs --store store
    """
    from shiplog.machine.paths import check_writable

    check_writable(store, "--store")
    check_paths(logs, profile)
    page = page_file(report)
    from shiplog.commands.prepare import expand, ingest_logs
    from shiplog.voyages.store.store import Store

    done = ingest_logs(expand(logs), profile, Store(store), correct)
    if page is not None and done.reports:
        from shiplog.commands.report import health_report

        health_report(Store(store), [one.name for one in done.reports], page)
    leave(done, json_to)
