"""`shiplog watch`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.cli.inputs import check_runs
from shiplog.cli.options import STORE, StoreOption


def watch(
    source: Annotated[
        str,
        typer.Argument(
            help="A growing MCAP or NMEA file, a folder that a recorder rotates, ws://HOST:PORT of "
            "a Foxglove WebSocket, or udp:// or tcp://HOST:PORT of NMEA 0183 or Signal K."
        ),
    ],
    run: Annotated[
        Path,
        typer.Option(
            "--run",
            help="A trained run of this ship, such as runs/mmg.",
            autocompletion=completion.runs,
        ),
    ],
    store: StoreOption = STORE,
    false_alarms_per_day: Annotated[
        float,
        typer.Option(min=0.001, max=100.0, help="How often an alarm may be wrong."),
    ] = 1.0,
    out: Annotated[
        Path, typer.Option(help="Folder of this watch: its state, and the rows of the last hours.")
    ] = Path("watch"),
    anew: Annotated[
        bool, typer.Option("--anew", help="Do not go on from an earlier watch in --out.")
    ] = False,
    stop_after: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="SECONDS", help="End when no message came for so long."),
    ] = None,
    view: Annotated[bool, typer.Option("--view", help="Show it in the Rerun viewer.")] = False,
    web: Annotated[
        bool, typer.Option("--web", help="Show it in a browser, from 127.0.0.1 alone.")
    ] = False,
    json_to: Annotated[
        str | None,
        typer.Option("--json", metavar="PATH|-", help="Append a line of JSON each; - is stdout."),
    ] = None,
) -> None:
    """The model next to a ship that sails: error, alarm, suspicion.

    The error is shown in metres and degrees with its band. An alarm means that the ship is no
    longer the one that the model was identified from; it names a suspect, and `diagnose` gives the
    verdict. Ctrl-C ends the watch, and the same command goes on with it.

    Example: shiplog watch today.mcap --run runs/mmg --false-alarms-per-day 0.1
    """
    check_runs([run], store, None, None)
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.cli import watch_output
        from shiplog.commands.watch import Reporter, watch_command
    from shiplog.voyages.store.store import Store

    with watch_output.lines(json_to) as lines:
        drawn = watch_output.drawn(run, web) if view or web else None
        reporter = Reporter(watch_output.text(json_to), lines, drawn)
        done = watch_command(
            source, run, Store(store), out, reporter, per_day=false_alarms_per_day,
            stop_after_s=stop_after, anew=anew,
        )  # fmt: skip
        reporter.fact(done.json, done.text)
