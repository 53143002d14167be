"""The commands: one short function each. Only here does the library call `pipelines`.

Results on stdout, progress on stderr. Exit codes: 0 done, 1 the input is at fault, 2 wrong usage,
3 done but something was lost or refused. What is heavy is imported where it is used, after the
arguments were checked: a wrong word is answered at once.
"""

from __future__ import annotations

import errno
import io
import json
import logging
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from shiplog import disk_cache
from shiplog.exceptions import ShiplogError
from shiplog.unexpected import unexpected

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Learn a ship's dynamic model from its logs, and see where it fails.",
)

LOST = 3
STOPPED = 130  # by Ctrl-C, as shells have it
KEPT = "stopped; what was finished is kept"
MENDABLE = (  # what the system says of a path that the user can mend
    errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.ENOENT,
    errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.ENAMETOOLONG, errno.EFBIG,
)  # fmt: skip


def _ask_json(json_to: str | None) -> str | None:
    """Whether --json can be written is known before the work."""
    if json_to and json_to != "-":
        from shiplog.paths import check_file

        check_file(Path(json_to), "--json")
    return json_to


Logs = Annotated[list[Path], typer.Argument(help="MCAP logs, or folders of them.")]
StoreOption = Annotated[Path, typer.Option("--store", help="Folder of ingested voyages.")]
ProfileOption = Annotated[
    str | None, typer.Option("--profile", help="A shipped profile's name, or a TOML's path.")
]
JsonOption = Annotated[
    str | None,
    typer.Option("--json", metavar="PATH|-", help="Write the answer as JSON.", callback=_ask_json),
]
Voyages = Annotated[
    list[str] | None,
    typer.Option("--voyages", help="Names or shell patterns; can be given several times."),
]
Causes = Annotated[
    list[Path] | None,
    typer.Option("--cause", help="A Python file with causes of your own; several times."),
]
Window = Annotated[int, typer.Option(min=2, help="Samples in a window, at 1 Hz.")]
Width = Annotated[int, typer.Option(min=1, help="Units of each hidden layer.")]
Epochs = Annotated[
    int | None, typer.Option(min=1, help="Cap the epochs (paper) or iterations (fast).")
]
Validation = Annotated[
    list[str] | None, typer.Option(help="Voyages to validate on; can be given several times.")
]
STORE = Path("store")


def _version(asked: bool) -> None:
    """What runs: versions, and what computes the gradient of a training."""
    if not asked:
        return
    from importlib.metadata import version

    from shiplog.training import kernel

    level = kernel.level()
    what = f"compiled kernel, {level}" if level else "torch (no compiled kernel)"
    typer.echo(f"shiplog {version('shiplog')}, torch {version('torch')}, training by: {what}")
    raise typer.Exit


@app.callback()
def _every(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Versions, and exit."),
    ] = False,
) -> None:
    """Learn a ship's dynamic model from its logs, and see where it fails."""


def main() -> None:
    """Entry point: settings of this process, then `run`."""
    # What JAX compiled for one ship serves every later command: some ten seconds each.
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(disk_cache.folder() / "jax"))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    logging.basicConfig(format="%(message)s", stream=sys.stderr, level=logging.WARNING)
    logging.getLogger("shiplog").setLevel(logging.INFO)
    logging.getLogger("pipelines").setLevel(logging.INFO)
    for number in (signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        if signal.getsignal(number) is signal.SIG_DFL:  # not under nohup
            signal.signal(number, _stopped)
    sys.exit(run())


def run(arguments: Sequence[str] | None = None) -> int:
    """The exit code of a command line, that of this process unless one is given.

    Whatever goes wrong is a sentence on stderr and never a traceback: a fault of the input says
    what to mend, and a fault of the program where its trace was written.
    """
    for stream in (sys.stdout, sys.stderr):  # a file's name need not be text
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        disk_cache.trim()
        app(arguments)
    except SystemExit as ended:  # as every command ends
        code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        if code == STOPPED:  # as typer has it; SIGTERM has said so itself
            typer.echo(KEPT, err=True)
        return code
    except Exception as error:
        fault = _fault(error)
        typer.echo(str(fault), err=True)
        return fault.exit_code
    return 0


def _fault(error: Exception) -> ShiplogError:
    """What a user is told of it."""
    if isinstance(error, ShiplogError):
        return error
    if isinstance(error, OSError) and error.filename is not None and error.errno in MENDABLE:
        return ShiplogError(
            f"{os.fsdecode(error.filename)}: {error.strerror}.",
            hint="look whether that path is what you meant, may be used, and has room on its disk.",
        )
    return unexpected(error)


def _stopped(number: int, _frame: object) -> NoReturn:
    """Asked to end: everything that was started is ended on the way out."""
    signal.signal(number, signal.SIG_IGN)
    typer.echo(KEPT, err=True)
    sys.exit(128 + number)


def _answer(text: str, content: dict, json_to: str | None) -> None:
    """Text on stdout, JSON where it was asked for; `--json -` moves the text to stderr."""
    from shiplog import files  # it loads polars

    if json_to == "-":
        typer.echo(text, err=True)
        typer.echo(files.json_text(content))
        return
    if text:
        typer.echo(text)
    if json_to:
        try:
            files.write_text(Path(json_to), files.json_text(content))
        except OSError as error:
            raise ShiplogError(
                f"{json_to} cannot be written: {error.strerror}.",
                hint="give --json a path in a folder that exists.",
            ) from error


@app.command("cache")
def cache_command(
    clear: Annotated[bool, typer.Option("--clear", help="Remove all that is kept.")] = False,
    json_to: JsonOption = None,
) -> None:
    """What shiplog keeps to be faster the next time: where, how much, and a way to remove it.

    Example: shiplog cache --clear
    """
    removed = disk_cache.trim(0) if clear else disk_cache.trim()
    kept = disk_cache.size()
    most = disk_cache.LIMIT / 1e6
    text = f"{disk_cache.folder()} holds {kept / 1e6:.1f} MB (at most {most:.0f} MB)."
    if removed:
        text += f" {removed / 1e6:.1f} MB were removed."
    content = {"folder": str(disk_cache.folder()), "bytes": kept, "removed": removed}
    _answer(text, content | {"limit": disk_cache.LIMIT}, json_to)


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Where store, run and recording go.")] = Path("demo"),
    view: Annotated[bool, typer.Option("--view/--no-view", help="Open the viewer.")] = True,
    logs: Annotated[
        Path | None, typer.Option(help="Sample logs; found beside the source otherwise.")
    ] = None,
    json_to: JsonOption = None,
) -> None:
    """The main job on sample_logs: ingest, train, evaluate, compare.

    Example: shiplog demo --out demo --no-view
    """
    from shiplog.cli.arguments import sample_logs
    from shiplog.paths import check_writable

    check_writable(out, "--out")
    folder = sample_logs(logs)
    from pipelines.demo import run_demo

    result = run_demo(out, folder)
    _answer(result.text, result.content, json_to)
    if view:
        try:
            _show(result.recording, web=False)
        except ShiplogError as error:  # the job is done; only the window is missing
            typer.echo(f"not shown: {error.message}", err=True)


@app.command()
def check(logs: Logs, profile: ProfileOption = None, json_to: JsonOption = None) -> None:
    """Health of logs without ingesting them: what is readable, lost, late, out of order, and
    where a profile fits, which sensors disagree.

    Example: shiplog check sample_logs/voyage_1.mcap
    """
    _check_logs(logs, profile)
    from pipelines.prepare import check_logs

    _leave(check_logs(logs, profile), json_to)


@app.command()
def ingest(
    logs: Logs,
    profile: ProfileOption = None,
    store: StoreOption = STORE,
    correct: Annotated[
        bool,
        typer.Option("--correct", help="Put right what the sensors say of each other for certain."),
    ] = False,
    json_to: JsonOption = None,
) -> None:
    """Logs into the store: aligned, reduced to midship, faults marked. Idempotent by content.

    Example: shiplog ingest sample_logs --store store
    """
    from shiplog.paths import check_writable

    check_writable(store, "--store")
    _check_logs(logs, profile)
    from pipelines.prepare import expand, ingest_logs
    from shiplog.voyages.store import Store

    _leave(ingest_logs(expand(logs), profile, Store(store), correct), json_to)


def _leave(done, json_to: str | None) -> None:
    """Answer; exit 1 where nothing could be taken, 3 where something was lost or refused."""
    from shiplog.report import tables

    text = "\n".join(line for one in done.reports for line in tables.voyage_lines(one))
    _answer(text, tables.voyages_json(done.reports, done.refused), json_to)
    for path, error in done.refused.items():
        typer.echo(f"{Path(path).name} refused: {error}", err=True)
    if done.refused and not done.reports:
        raise typer.Exit(1)
    if not done.complete:
        raise typer.Exit(LOST)


@app.command()
def convert(
    tables: Annotated[
        list[Path],
        typer.Argument(
            help="CSV or Parquet tables, folders of one table a topic, NMEA 0183 text, ROS bags."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the logs.")],
    profile: Annotated[
        str | None,
        typer.Option(
            "--profile",
            help="The profile whose [table] section names the columns; NMEA and bags need none.",
        ),
    ] = None,
    json_to: JsonOption = None,
) -> None:
    """Tables, NMEA 0183 text and ROS bags to contract MCAP.

    Example: shiplog convert trials/*.parquet --profile esso-osaka --out logs
    """
    from shiplog.paths import check_writable

    check_writable(out, "--out")
    from shiplog import profile as profiles

    ship = profiles.load(profile) if profile else None
    from pipelines.convert import convert as convert_tables

    done = convert_tables(tables, ship, out)
    content = {"contract": 1, "logs": [str(path) for path in done.logs], "refused": done.refused}
    _answer(f"{len(done.logs)} logs in {out}", content | {"lost": done.lost}, json_to)
    for path, why in done.refused.items():
        typer.echo(f"{Path(path).name} refused: {why}", err=True)
    for path, what in done.lost.items():
        typer.echo(f"{Path(path).name}: not converted: {what}", err=True)
    if done.refused or done.lost:
        raise typer.Exit(LOST if done.logs else 1)


@app.command()
def profile(
    log: Annotated[
        Path, typer.Argument(help="A log, table, folder of tables, NMEA text or bag of some ship.")
    ],
    out: Annotated[Path | None, typer.Option(help="Write the draft here, not to stdout.")] = None,
    vessel: Annotated[
        str | None, typer.Option(help="Which ship, where the log holds many: its MMSI or name.")
    ] = None,
) -> None:
    """Draft a ship profile from a log's topics, or a table's columns.

    Example: shiplog profile unknown.mcap --out my-ship.toml
    """
    from shiplog.paths import check_file, refuse_taken

    if out is not None:
        refuse_taken(out)
        check_file(out, "--out")
    from pipelines.convert import draft

    text = draft(log, vessel)
    if out is None:
        typer.echo(text)
    else:
        out.write_text(text, encoding="utf-8")
        typer.echo(f"draft written to {out}: look over every line that says CHECK")


@app.command()
def voyages(
    store: StoreOption = STORE,
    sensors: Annotated[
        bool, typer.Option("--sensors", help="What the sensors say of each other, all voyages.")
    ] = False,
    voyages: Voyages = None,
    json_to: JsonOption = None,
) -> None:
    """What is in the store; with --sensors, what several voyages together say of the instruments.

    Example: shiplog voyages --store store
    Example: shiplog voyages --sensors --voyages 'zigzag_*'
    """
    from dataclasses import asdict

    if sensors:
        from pipelines.sensors import sensors_command

        found = sensors_command(store, voyages or [])
        _answer(found.text, found.content, json_to)
        return

    from shiplog.report import tables
    from shiplog.voyages.store import Store

    if not store.exists():
        raise ShiplogError(
            f"There is no store {store}.",
            hint="ingest logs first: shiplog ingest LOG... --store DIR.",
        )
    entries = Store(store).entries()
    content = {"contract": 1, "voyages": [asdict(entry) for entry in entries]}
    _answer(tables.catalogue(entries) if entries else f"no voyage in {store}", content, json_to)


@app.command()
def train(
    out: Annotated[Path, typer.Option(help="The run folder to make.")],
    model: Annotated[
        str, typer.Option(help="Which dynamic model: feedforward, mmg or hybrid.")
    ] = "feedforward",
    data: Annotated[
        str, typer.Option(help="The paper's window set: ref, sli2, ..., d-ref.")
    ] = "ref",
    voyages: Voyages = None,
    validation: Validation = None,
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds: 0, 1, ...")] = 1,
    recipe: Annotated[str, typer.Option(help="fast, or paper: the published one, hours.")] = "fast",
    window: Window = 100,
    width: Width = 256,
    wind_input: Annotated[
        str | None,
        typer.Option(help="angle (default of the paper's recipe) or components (of the fast one)."),
    ] = None,
    epochs: Epochs = None,
    fit: Annotated[
        bool,
        typer.Option("--fit/--no-fit", help="Physical models: identify, or as published."),
    ] = True,
    parameters: Annotated[
        Path | None, typer.Option(help="Physical models: TOML of coefficients to start from.")
    ] = None,
    without: Annotated[
        list[str] | None, typer.Option(help="Physical models: a force to switch off, such as wind.")
    ] = None,
    free: Annotated[
        list[str] | None, typer.Option(help="Physical models: parameters that may move: 'wind.*'.")
    ] = None,
    folds: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="Physical models: parts that voyages are held out in, 5 unless given; 0 holds "
            "none out, and the gain is not tested.",
        ),
    ] = None,
    store: StoreOption = STORE,
    json_to: JsonOption = None,
) -> None:
    """Train a model; interrupted, give the same command again and it goes on.

    Example: shiplog train --data ref --seeds 3 --out runs/ref
    Example: shiplog train --model mmg --voyages 'trial_*' --out runs/mmg
    """
    from shiplog.cli.arguments import check_training
    from shiplog.paths import check_writable, refuse_taken

    physical = {
        "--no-fit": not fit, "--parameters": parameters is not None, "--without": bool(without),
        "--free": bool(free), "--folds": folds is not None,
    }  # fmt: skip
    check_training(model, data, recipe, wind_input, physical)
    refuse_taken(out)
    check_writable(out, "--out")
    _check_voyages(store, voyages, validation)
    if model != "feedforward":
        from pipelines.identify import identify_command

        found = identify_command(
            store,
            out,
            model=model,
            data=data,
            voyages=voyages or [],
            validation=validation or [],
            seeds=seeds,
            window=window,
            fit=fit,
            parameters=parameters,
            without=without or [],
            free=free or [],
            folds=folds,
        )
        _answer(found.text, found.content, json_to)
        return
    from pipelines.train import train_command

    answer = train_command(
        store,
        out,
        model=model,
        data=data,
        voyages=voyages or [],
        validation=validation or [],
        seeds=seeds,
        recipe=recipe,
        window=window,
        width=width,
        wind_input=wind_input,
        epochs=epochs,
    )
    _answer(answer.text, answer.content, json_to)


@app.command()
def paper(
    out: Annotated[Path, typer.Option(help="Where runs, tables and figures go.")] = Path("paper"),
    data: Annotated[
        list[str] | None,
        typer.Option("--data", help="Window sets, all eight unless given; several times."),
    ] = None,
    voyages: Voyages = None,
    validation: Validation = None,
    seeds: Annotated[int, typer.Option(min=1, help="How many seeds: 0, 1, ...")] = 10,
    recipe: Annotated[str, typer.Option(help="fast, or paper: the published one, days.")] = "fast",
    window: Window = 100,
    width: Width = 256,
    epochs: Epochs = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Trainings at a time; one a core unless given.")
    ] = None,
    ray: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Train on this Ray cluster instead.")
    ] = None,
    store: StoreOption = STORE,
    json_to: JsonOption = None,
) -> None:
    """The published experiment: eight window sets, ten seeds each, tables and figures.

    Interrupted, give the same command again. Example: shiplog paper --seeds 10 --out paper
    """
    from shiplog.cli.arguments import check_training
    from shiplog.paths import check_writable
    from shiplog.voyages.augmentation import AUGMENTATIONS

    chosen = list(dict.fromkeys(data or AUGMENTATIONS))
    for name in chosen:
        check_training("feedforward", name, recipe, None, {})
    check_writable(out, "--out")
    _check_voyages(store, voyages, validation)
    from pipelines.paper import paper_command

    answer = paper_command(
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
    )
    _answer(answer.text, answer.content, json_to)
    if answer.content["failures"]:
        raise typer.Exit(LOST)


@app.command()
def evaluate(
    run: Annotated[Path, typer.Argument(help="A trained run, such as runs/ref.")],
    voyages: Voyages = None,
    store: StoreOption = STORE,
    cause: Causes = None,
    json_to: JsonOption = None,
) -> None:
    """L, RMSE per channel, end errors, coverage, against two floors.

    Example: shiplog evaluate runs/ref --voyages voyage_6
    """
    _check_runs([run], store, voyages, cause)
    from pipelines.evaluate import evaluate_runs, save
    from shiplog.voyages.store import Store

    found = evaluate_runs([run], Store(store), voyages or [], cause or [])
    save(found)
    _answer(found.text(), found.answer(found.runs[0]), json_to)


@app.command()
def compare(
    runs: Annotated[list[Path], typer.Argument(help="One or more trained runs.")],
    voyages: Voyages = None,
    store: StoreOption = STORE,
    save: Annotated[
        Path | None, typer.Option(help="Write the recording here and open nothing.")
    ] = None,
    web: Annotated[bool, typer.Option("--web", help="Serve it on 127.0.0.1.")] = False,
    cause: Causes = None,
    json_to: JsonOption = None,
) -> None:
    """Measured against simulated in Rerun.

    Example: shiplog compare runs/ref runs/d-ref --save compare.rrd
    """
    from shiplog.paths import check_file

    _check_runs(runs, store, voyages, cause)
    if save is not None:
        check_file(save, "--save")
    from pipelines.evaluate import compare_runs
    from shiplog.voyages.store import Store

    result = compare_runs(runs, Store(store), voyages or [], save, cause or [])
    _answer(result.text, result.content, json_to)
    if save is None:
        try:
            _show(result.recording, web)
        except ShiplogError as error:
            typer.echo(str(error), err=True)
            raise typer.Exit(LOST) from None


@app.command()
def diagnose(
    run: Annotated[Path, typer.Argument(help="A trained run, such as runs/mmg.")],
    voyages: Voyages = None,
    store: StoreOption = STORE,
    out: Annotated[Path, typer.Option(help="Folder for the report and its pictures.")] = Path(
        "diagnosis"
    ),
    extend: Annotated[
        Path | None, typer.Option(help="Write the model with the named causes as this run.")
    ] = None,
    cause: Causes = None,
    json_to: JsonOption = None,
) -> None:
    """What the simulation gets wrong, why, the extended model, and the gain on held-out voyages.

    Example: shiplog diagnose runs/mmg --voyages 'season2_*' --extend runs/mmg2
    """
    from shiplog.paths import check_writable, refuse_taken

    _check_runs([run], store, voyages, cause)
    check_writable(out, "--out")
    if extend is not None:
        refuse_taken(extend, "--extend")
        check_writable(extend, "--extend")
    from pipelines.diagnose import diagnose_command

    found = diagnose_command(
        store, run, voyages=voyages or [], out=out, extend=extend, cause_files=cause or []
    )
    _answer(found.text, found.content, json_to)


def _check_logs(logs: Sequence[Path], profile: str | None) -> None:
    """Raises ShiplogError where there is no such profile, or none of the logs is there; one of
    several that is not there does not stop the others."""
    from shiplog import profile as profiles
    from shiplog.exceptions import LogUnreadable

    if profile is not None:
        profiles.load(profile)
    if not any(log.exists() for log in logs):
        raise LogUnreadable(
            f"{logs[0]} does not exist.", hint="give the path of an MCAP log, or a folder of them."
        )


def _check_voyages(store: Path, *patterns: Sequence[str] | None) -> None:
    """Raises StoreError for a store or voyage that is not there."""
    from shiplog.voyages.store import Store

    for chosen in patterns:
        Store(store).select(list(chosen or ()))


def _check_runs(
    runs: Sequence[Path],
    store: Path,
    voyages: Sequence[str] | None,
    causes: Sequence[Path] | None,
) -> None:
    """Raises ShiplogError for a run, voyage or file that is not there."""
    from shiplog.paths import check_causes, check_run

    for run in runs:
        check_run(run)
    check_causes(causes or ())
    _check_voyages(store, voyages)


def _show(recording: Path, web: bool) -> None:
    from shiplog.report import viewer

    if not web:
        viewer.open_viewer(recording)
        return
    with viewer.serve(recording) as served:
        typer.echo(f"open {served.address} in a browser; Ctrl-C ends it", err=True)
        served.wait()


if __name__ == "__main__":
    main()
