"""Which program gave an answer: the commit of this source when a step began.

A figure belongs to one program, so every step of a case records the commit, and whether the source
had changes that no commit holds. A commit under way splits a test in two: run a long one from a
checkout of its own.
"""

from __future__ import annotations

import shlex
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]  # `python -m pipelines...` finds this source and no other
SOURCE = ("shiplog", "pipelines", "pyproject.toml")  # changes elsewhere change no answer
ANSWERING = ("diagnose", "rivals")  # steps whose program a figure belongs to
SHORT = 12  # characters of a commit that a page shows
UNRECORDED = "no commit recorded"


def identity(checkout: Path = ROOT) -> dict[str, Any]:
    """`commit` (None outside a checkout) and `dirty`: the source differs from that commit."""
    if not (checkout / ".git").exists():
        return {"commit": None, "dirty": None}
    commit = _git(checkout, "rev-parse", "HEAD")
    changes = _git(checkout, "status", "--porcelain", "--", *SOURCE)
    return {"commit": commit or None, "dirty": None if changes is None else bool(changes)}


def other(command: Sequence[str], called: str = "") -> dict[str, Any]:
    """The identity of a program that is not this source: what it is called, or else its command."""
    return {"commit": None, "dirty": None, "program": called or shlex.join(command)}


def name(step: Mapping[str, Any]) -> str:
    """How a page names the program of a step: short commit, `+changes` where it was not clean."""
    if step.get("program"):
        return str(step["program"])
    if not step.get("commit"):
        return UNRECORDED
    return str(step["commit"])[:SHORT] + ("+changes" if step.get("dirty") else "")


def of_answers(steps: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """The programs that answered a case; of one that failed before, that of its last step."""
    return names(steps, ANSWERING) or tuple(name(step) for step in steps[-1:]) or (UNRECORDED,)


def names(steps: Iterable[Mapping[str, Any]], among: Sequence[str]) -> tuple[str, ...]:
    """The programs of the steps of these names, each once."""
    return tuple(dict.fromkeys(name(step) for step in steps if step["step"] in among))


def _git(checkout: Path, *arguments: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(checkout), *arguments],
            capture_output=True, text=True, timeout=20, check=False,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None
