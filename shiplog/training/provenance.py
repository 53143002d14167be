"""Where a run comes from: versions, commit, log hashes, device and times."""

from __future__ import annotations

import datetime
import platform
import subprocess
import sys
import time
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import polars as pl
import torch

from shiplog.voyages.split_settings import Split
from shiplog.voyages.store import Store


@dataclass(frozen=True)
class Answer:
    """What a command says: to a person and to a machine."""

    text: str
    content: dict


def provenance(store: Store, split: Split, began: float) -> dict:
    """Versions, commit, log hashes, device and times."""
    used = [*split.training, *split.validation]
    return {
        "shiplog": version("shiplog"),
        "commit": commit_of_source(),
        "python": platform.python_version(),
        "torch": torch.__version__,
        "polars": pl.__version__,
        "machine": platform.machine(),
        "device": "cpu",
        "logs_sha256": store.hashes(used),
        "began": _utc(began),
        "ended": _utc(time.time()),
        "command": sys.argv,
    }


def _utc(stamp: float) -> str:
    return datetime.datetime.fromtimestamp(stamp, datetime.UTC).isoformat(timespec="seconds")


def commit_of_source() -> str | None:
    """The source's commit, where shiplog runs from its own checkout.

    Installed into an environment inside somebody's repository, git would name their commit.
    """
    checkout = Path(__file__).parents[2]
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
    except OSError:
        return None
    return done.stdout.strip() or None
