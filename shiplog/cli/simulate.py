"""`shiplog simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shiplog.cli import completion
from shiplog.cli.inputs import check_voyages
from shiplog.cli.options import STORE, Causes, JsonOption, Simulators, StoreOption
from shiplog.cli.output import answer
from shiplog.exceptions import UsageError


def _pair(words: str | None, option: str) -> tuple[float, float] | None:
    """Speed and direction of "2.5,90"."""
    if words is None:
        return None
    try:
        speed, direction = (float(part) for part in words.split(","))
    except ValueError:
        speed = direction = -1.0
    if not (0.0 <= speed < float("inf") and -360.0 <= direction <= 360.0):
        raise UsageError(
            f"{option} {words} is no speed with a direction.",
            hint=f"give m/s and degrees clockwise from x0, such as {option} 5,90.",
        )
    return speed, direction


def simulate(
    run: Annotated[
        Path,
        typer.Argument(help="A trained run, such as runs/mmg.", autocompletion=completion.runs),
    ],
    zigzag: Annotated[
        str | None, typer.Option(metavar="A/B", help="Rudder and heading in degrees; -A to port.")
    ] = None,
    turn: Annotated[
        float | None, typer.Option(metavar="DEG", help="Two circles; negative to port.")
    ] = None,
    stop: Annotated[bool, typer.Option("--stop", help="Full astern until stopped.")] = False,
    pullout: Annotated[
        bool, typer.Option("--pullout", help="Amidships after a turn to each side.")
    ] = False,
    spiral: Annotated[
        bool, typer.Option("--spiral", help="Dieudonné's, 15 deg to 15 deg and back.")
    ] = False,
    schedule: Annotated[
        Path | None,
        typer.Option(metavar="FILE.csv", help="Orders: time_s, and a column for each actuator."),
    ] = None,
    voyage: Annotated[
        str | None,
        typer.Option(help="A voyage's own inputs.", autocompletion=completion.voyages),
    ] = None,
    store: StoreOption = STORE,
    speed: Annotated[
        float | None,
        typer.Option(
            metavar="M/S", help="Of the approach, through the water; the nominal one unless given."
        ),
    ] = None,
    wind: Annotated[
        str | None, typer.Option(metavar="M/S,DEG", help="True wind, and where it comes from.")
    ] = None,
    current: Annotated[
        str | None, typer.Option(metavar="M/S,DEG", help="Current, and where it sets.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(min=1.0, help="Sail it so long, and not to its end.")
    ] = None,
    members: Annotated[int, typer.Option(min=1, help="Members of its ensemble; 1 for none.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Of the ensemble's draws.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="FILE.parquet, .csv, .mcap or .rrd (a recording)."),
    ] = None,
    cause: Causes = None,
    simulator: Simulators = None,
    json_to: JsonOption = None,
) -> None:
    """A model sailed on a schedule, with its band.

    Standard manoeuvres begin on a straight course; their quantities are printed with 90 %
    intervals.

    Example: shiplog simulate runs/mmg --zigzag 10/10 --out zigzag.csv
    """
    given = [zigzag is not None, turn is not None, stop, pullout, spiral, schedule is not None,
             voyage is not None]  # fmt: skip
    if sum(given) != 1:
        raise UsageError(
            f"{sum(given)} things to sail are given, and one is wanted.",
            hint="give one of --zigzag, --turn, --stop, --pullout, --spiral, --schedule, --voyage.",
        )
    blowing, setting = _pair(wind, "--wind"), _pair(current, "--current")
    if voyage is not None and (speed or blowing or setting or seconds):
        raise UsageError(
            "--voyage has its own start, wind and length.",
            hint="leave --speed, --wind, --current and --seconds out; 'name[0:600]' is a part.",
        )
    from shiplog.machine.paths import check_causes, check_file, check_run

    check_run(run)
    check_causes(cause or ())
    if voyage is not None:
        check_voyages(store, [voyage])
    from shiplog.simulation import schedules

    made = (
        schedules.zigzag(zigzag) if zigzag is not None
        else schedules.turn(turn) if turn is not None
        else schedules.Stop() if stop
        else schedules.PullOut() if pullout
        else schedules.Spiral() if spiral
        else None
    )  # fmt: skip
    from shiplog.commands.bars import loading

    with loading():
        from shiplog.commands.simulate import load, simulate_run, simulate_voyage
        from shiplog.report import simulation
    if out is not None:
        out = check_file(out, "--out")
        simulation.check(out)
    opened = load(run, cause or [], simulator or [])
    if voyage is not None:
        from shiplog.voyages.store.store import Store

        answer(
            simulate_voyage(opened, Store(store), voyage, members=members, seed=seed, out=out),
            json_to,
        )
        return
    from shiplog.simulation.sailing import Water, from_direction

    if schedule is not None:
        made = schedules.read(schedule, opened.profile)
    assert made is not None
    water = Water(
        (0.0, 0.0) if blowing is None else from_direction(*blowing),
        (0.0, 0.0) if setting is None else from_direction(*setting),
    )
    answer(
        simulate_run(
            opened, made, speed=speed, water=water, members=members, seed=seed, seconds=seconds,
            out=out,
        ),
        json_to,
    )  # fmt: skip
