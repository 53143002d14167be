"""Where a run comes from: versions, commit, log hashes, device and times."""

from __future__ import annotations

import datetime
import platform
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path, PurePath

import polars as pl


def provenance(logs_sha256: Mapping[str, str | None], began: float, device: str = "cpu") -> dict:
    """Versions, commit, log hashes, device and times; no path of this machine.

    logs_sha256   voyage → hash of its log
    device        which finished the run
    """
    return {
        "shiplog": version("shiplog"),
        "commit": commit_of_source(),
        "python": platform.python_version(),
        "torch": version("torch"),
        "polars": pl.__version__,
        "machine": platform.machine(),
        "device": device,
        "logs_sha256": dict(logs_sha256),
        "began": _utc(began),
        "ended": _utc(time.time()),
        "command": portable(sys.argv),
    }


def portable(arguments: Sequence[str]) -> list[str]:
    """A command line without its folders on this machine: of absolute paths the last part."""
    found = []
    for argument in arguments:
        option, equals, value = argument.rpartition("=")
        place = PurePath(value)
        found.append(f"{option}{equals}{place.name if place.is_absolute() else value}")
    return found


def _utc(stamp: float) -> str:
    return datetime.datetime.fromtimestamp(stamp, datetime.UTC).isoformat(timespec="seconds")


def commit_of_source() -> str | None:
    """The source's commit, where shiplog runs from its own checkout.

    Installed into an environment inside somebody's repository, git would name their commit.
    """
    checkout = Path(__file__).parents[3]
    if not (checkout / ".git").exists():
        return None
    try:
        done = subprocess.run(
            ["git", "-C", str(checkout), "rev-parse", "HEAD"],
            capture_output=True,
            text=True,
            timeout=5,
            check=False,
        )
    except (OSError, subprocess.SubprocessError):  # also of a git that takes too long
        return None
    return done.stdout.strip() or None
