"""Paths that a command is given, checked before the work and before anything heavy is loaded."""

from __future__ import annotations

import fnmatch
import json
import os
from collections.abc import Mapping, Sequence, Sized
from pathlib import Path

from shiplog.exceptions import LogUnreadable, RunError, ShiplogError, UsageError, listed
from shiplog.machine import files

BEGUN = ".partial"  # end of a run's name until it is finished


def sample_logs(given: Path | None = None) -> Path:
    """The folder of logs for the demo: the one given, or that of the checkout this runs from.
    Raises ShiplogError."""
    if given is not None:
        if not any(given.glob("*.mcap")):
            raise ShiplogError(f"No log in {given}.", hint="give --logs a folder of MCAP logs.")
        return given
    here = (Path.cwd(), Path(__file__).resolve().parents[2])
    for folder in here:
        if any((folder / "sample_logs").glob("*.mcap")):
            return folder / "sample_logs"
    raise ShiplogError(
        f"There is no folder sample_logs in {here[0]}.",
        hint="run the demo from a clone of shiplog, or make the logs again with "
        "`python -m pipelines.experiments.simulated_ship sample_logs` and give them with --logs.",
    )


def refuse_none_ingested(reports: Sized, folder: Path) -> None:
    """Raises ShiplogError where no log of the folder became a voyage."""
    if not reports:
        raise ShiplogError(f"No log in {folder} could be ingested.", hint="see the messages above.")


def refuse_no_season(names: Sequence[str], season: str, folder: Path) -> None:
    """Raises ShiplogError where none of the voyages is of the season that the demo diagnoses."""
    if not fnmatch.filter(names, season):
        raise ShiplogError(
            f"Of {folder} no log {season} was ingested, and the demo ends with their diagnosis.",
            hint="leave --logs out, or give it a folder like the checkout's sample_logs.",
        )


def refuse_taken(path: Path, option: str = "--out") -> None:
    """Raises RunError where something is there already."""
    if path.exists():
        raise RunError(f"{path} exists already.", hint=f"choose another {option}, or remove it.")


def refuse_run(path: Path, option: str = "--out") -> None:
    """Raises RunError where something is there already, and UsageError for a name that only a
    begun run has: it would never count as finished."""
    if path.name.endswith(BEGUN):
        raise UsageError(
            f"{option} {path} ends as the folder of a run that is not finished does.",
            hint=f"leave {BEGUN} out: shiplog adds it until the run is finished.",
        )
    refuse_taken(path, option)


def refuse_namesake(name: str, begun: set[str], path: Path) -> None:
    """Raises ShiplogError for a second voyage of a table that is to be the same file; `begun`
    holds the names of the others, and then this one."""
    if name in begun:
        raise ShiplogError(
            f"Two voyages of {path.name} would be {name}.mcap: their names differ only in letters "
            "that a file's name cannot have.",
            hint="the first one is converted; give the other one another name in the table.",
        )
    begun.add(name)


def check_there(path: Path, what: str) -> None:
    """Raises LogUnreadable where there is no such path. `what`: what may be given instead."""
    if not path.exists():
        raise LogUnreadable(f"{path} does not exist.", hint=f"give the path of {what}.")


def check_writable(path: Path, option: str) -> None:
    """Raises ShiplogError where there can be no folder of this name to write into."""
    try:
        there = path if path.exists() else _existing_parent(path)
        good = there.is_dir() and os.access(there, os.W_OK)
        why = "is not writable" if there.is_dir() else "is a file, not a folder"
    except OSError as error:  # a name that is too long
        raise ShiplogError(
            f"{option} {path} cannot be used: {error.strerror}.", hint=f"choose another {option}."
        ) from error
    if not good:
        raise ShiplogError(
            f"{option} {path} cannot be written: {there} {why}.", hint=f"choose another {option}."
        )


def check_file(path: Path, option: str, streams: bool = False) -> Path:
    """The file to write: of a symbolic link, the one that it leads to.

    streams   whether it may be a pipe or a device, which is written to and not replaced

    Raises ShiplogError where no file of this name can be written; one that is there can be
    replaced.
    """
    if streams and files.is_stream(path) and os.access(path, os.W_OK):
        return path
    if path.is_dir() or (path.exists() and not path.is_file()):
        what = "it is a folder" if path.is_dir() else "it is no file that can be replaced"
        raise ShiplogError(
            f"{option} {path} cannot be written: {what}.", hint="give a file's path."
        )
    if path.is_symlink():
        path = Path(os.path.realpath(path))
    if not path.parent.exists():
        raise ShiplogError(
            f"{option} {path} cannot be written: there is no folder {path.parent}.",
            hint=f"give {option} a path in a folder that exists.",
        )
    check_writable(path.parent, option)
    return path


NO_PAGE = frozenset({".pdf", ".png", ".svg", ".md", ".json", ".rrd"})  # endings of other files


def check_page(path: Path, option: str) -> Path:
    """As `check_file`, of a page: what ends as another kind of file would not open, and a name
    without an ending gets .html, without which no browser opens it.

    Raises ShiplogError.
    """
    if path.suffix.lower() in NO_PAGE:
        raise ShiplogError(
            f"{option} {path} ends in {path.suffix!r}, and the page is HTML.",
            hint="end its name in .html; a browser prints it as PDF.",
        )
    return check_file(path if path.suffix else path.with_suffix(".html"), option)


def check_run(path: Path) -> None:
    """Raises RunError for what is no finished run."""
    begun = path.name.endswith(BEGUN)
    if (path / "config.toml").is_file() and not begun:
        return
    if (path if begun else path.with_name(f"{path.name}{BEGUN}")).is_dir():
        raise RunError(
            f"The run {path.with_name(path.name.removesuffix(BEGUN))} is not finished.",
            hint="give the same `shiplog train` again: it goes on.",
        )
    if path.exists():
        raise RunError(
            f"{path} is no run: there is no config.toml in it.",
            hint="give the folder that shiplog train --out RUN made.",
        )
    raise RunError(f"There is no run in {path}.", hint="train one: shiplog train --out RUN.")


def check_diagnosis(out: Path, extend: Path | None) -> None:
    """Where a report goes, and the run that --extend makes. Raises ShiplogError where a report
    would replace a run's own provenance, or where the one would be in the other's way."""
    if (out / "config.toml").is_file():
        raise RunError(
            f"--out {out} is a run: the report's provenance.json would replace the run's.",
            hint="choose another --out; a folder in the run will do.",
        )
    check_writable(out, "--out")
    if extend is None:
        return
    refuse_run(extend, "--extend")
    check_writable(extend, "--extend")
    report, run = (Path(os.path.realpath(path)) for path in (out, extend))
    if run == report or run in report.parents:
        raise UsageError(
            f"--extend {extend} is a folder for a run, and --out {out} for a report in it.",
            hint="give --extend a folder of its own, such as runs/extended.",
        )


def refuse_other_answer(out: Path, run: str, logs: Mapping[str, str | None]) -> None:
    """Raises RunError where --out holds the verdict on another run, or on other voyages: the same
    question may be asked again.

    logs   voyage → SHA-256 of its log
    """
    try:
        was = json.loads((out / "verdict.json").read_text(encoding="utf-8"))["base"]["run"]
        before = json.loads((out / "provenance.json").read_text(encoding="utf-8"))["logs_sha256"]
    except (OSError, ValueError, KeyError, TypeError):  # none is there, or none that was finished
        return
    if (was, before) == (run, dict(logs)):
        return
    raise RunError(
        f"--out {out} holds another answer: of {was} on {listed(map(str, before), most=3)}.",
        hint="choose another --out, or remove that folder.",
    )


def refuse_same_names(runs: Sequence[Path]) -> None:
    """Raises RunError for runs of one name: what is said of them goes by their names."""
    for at, run in enumerate(runs):
        other = next((r for r in runs[:at] if r.name == run.name), None)
        if other is not None:
            same = other.absolute() == run.absolute()
            raise RunError(
                f"{run} is given twice." if same else f"{other} and {run} have the same name.",
                hint="name each run once."
                if same
                else "rename one of the two folders: runs are told apart by their folders' names.",
            )


def check_causes(paths: Sequence[Path]) -> None:
    """Raises RunError for a --cause that is no Python file."""
    for path in paths:
        if not path.is_file() or path.suffix != ".py":
            raise RunError(
                f"{path} is no Python file.", hint="give --cause a file such as my_cause.py."
            )


def _existing_parent(path: Path) -> Path:
    """The nearest folder above that exists."""
    return next((p for p in path.absolute().parents if p.exists()), Path.cwd())
