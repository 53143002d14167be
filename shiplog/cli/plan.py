"""`shiplog plan`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.cli.options import STORE, JsonOption, Simulators, StoreOption
from shiplog.cli.output import answer
from shiplog.exceptions import UsageError


def _pair(words: str | None, option: str, example: str) -> tuple[float, float] | None:
    """Two numbers of "400,200"."""
    if words is None:
        return None
    try:
        first, second = (float(part) for part in words.split(","))
    except ValueError:
        first = second = math.nan
    if not (math.isfinite(first) and math.isfinite(second)):
        raise UsageError(f"{option} {words} is not two numbers.", hint=f"write {option} {example}.")
    return first, second


def plan(
    run: Annotated[
        Path,
        typer.Argument(help="An identified run, such as runs/mmg.", autocompletion=completion.runs),
    ],
    seconds: Annotated[
        float | None, typer.Option(min=1.0, help="How long it may take; 42 L/U unless given.")
    ] = None,
    rudder: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", min=1.0, max=180.0, help="Hardest rudder, 35 deg unless given."
        ),
    ] = None,
    speed: Annotated[
        str | None,
        typer.Option(metavar="LOW,HIGH", help="m/s between which the ship keeps; may stop at 0."),
    ] = None,
    water: Annotated[
        str | None,
        typer.Option(metavar="AHEAD,ASIDE", help="m of water before and behind, and to each side."),
    ] = None,
    wind: Annotated[
        str | None,
        typer.Option(
            metavar="M/S,DEG",
            help="Wind that is expected, and where it comes from; the mean of the training voyages "
            "unless given.",
        ),
    ] = None,
    causes_only: Annotated[
        bool,
        typer.Option(
            "--causes-only",
            help="Plan nothing: which causes the standard manoeuvres tell apart. Any model.",
        ),
    ] = False,
    no_causes: Annotated[
        bool, typer.Option("--no-causes", help="Coefficients only; the store is not asked.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Of the search.")] = 0,
    store: StoreOption = STORE,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the plan; RUN/plan unless given.")
    ] = None,
    simulator: Simulators = None,
    json_to: JsonOption = None,
) -> None:
    """The manoeuvre to sail next, and what it would show.

    It says most about a run's coefficients, within limits of water, rudder, speed and time, and is
    compared with the standard zigzag. With the run's training voyages in the store, also which
    causes it would tell apart.

    Example: shiplog plan runs/mmg --water 600,300 --rudder 25
    """
    if causes_only and no_causes:
        raise UsageError(
            "--causes-only and --no-causes leave nothing to plan.", hint="leave one of them out."
        )
    within = _pair(speed, "--speed", "0,8")
    room = _pair(water, "--water", "600,300")
    blowing = _pair(wind, "--wind", "5,90")
    from shiplog.machine.paths import check_run, check_writable

    check_run(run)
    if out is not None:
        check_writable(out, "--out")
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.plan import plan_run
        from shiplog.simulation.sailing import Water, from_direction
        from shiplog.voyages.store.store import Store
    expected = None if blowing is None else Water(wind=from_direction(*blowing))
    answer(
        plan_run(
            run, Store(store), out, seconds=seconds,
            rudder=None if rudder is None else math.radians(rudder), speed=within, room=room,
            water=expected, seed=seed, causes_only=causes_only, with_causes=not no_causes,
            simulators=simulator or [],
        ),
        json_to,
    )  # fmt: skip
