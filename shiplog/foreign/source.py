"""A simulator's file: its kind, its name and its SHA-256. A run keeps these, and not the code."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from shiplog.exceptions import RunError, UsageError

LOGGED = "logs:"  # in front of a topic
KINDS = {".py": "callable", ".fmu": "fmu"}


class SimulatorError(RunError):
    """A simulator that cannot be used, or failed: what was found, and what it needs."""


@dataclass(frozen=True)
class Source:
    """A simulator that was given by hand in this call.

    path      its file; of logged states, none
    kind      "callable", "fmu" or "logged"
    function  of a callable, where it is not `f`; of logged states, the topic
    sha256    of the file
    """

    path: Path
    kind: str
    function: str
    sha256: str

    @property
    def name(self) -> str:
        return self.function if self.kind == "logged" else self.path.name


def recognised(model: str) -> bool:
    """Whether `--model` names a simulator's file or topic, and no model of shiplog's."""
    if model.startswith(LOGGED):
        return True
    return _split(model)[0].suffix.lower() in KINDS


def read(given: str) -> Source:
    """Of `FILE.py`, `FILE.py:NAME`, `FILE.fmu` or `logs:/TOPIC`. Raises SimulatorError."""
    if given.startswith(LOGGED):
        topic = given.removeprefix(LOGGED)
        return Source(Path(), "logged", topic, hashlib.sha256(topic.encode()).hexdigest())
    path, function = _split(given)
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise UsageError(
            f"{given} is no simulator's file.",
            hint="give FILE.py, FILE.py:NAME, FILE.fmu, or 'logs:/TOPIC'.",
        )
    try:
        content = path.read_bytes()
    except OSError as error:
        raise SimulatorError(
            f"{path} cannot be read: {error.strerror}.", hint="give the path of the simulator."
        ) from error
    return Source(path.resolve(), kind, function, hashlib.sha256(content).hexdigest())


def matching(sources: Sequence[Source], run: str, name: str, sha256: str) -> Source | None:
    """The one that a run was made of; None where it is not given. Raises SimulatorError for one of
    its name with another hash."""
    for one in sources:
        if one.sha256 == sha256:
            return one
    other = next((one for one in sources if one.name == name), None)
    if other is not None:
        raise SimulatorError(
            f"{other.path} is not the simulator that {run} was made of: its SHA-256 begins with "
            f"{other.sha256[:12]}, that of the run's with {sha256[:12]}.",
            hint="give the very file, or train a run of this one.",
        )
    return None


def absent(run: str, name: str, sha256: str) -> SimulatorError:
    return SimulatorError(
        f"{run} is a run of the simulator {name} (SHA-256 {sha256[:12]}), and keeps no code of it.",
        hint=f"add --simulator PATH of {name}.",
    )


def refuse_again(run: str, name: str) -> NoReturn:
    """Raises SimulatorError."""
    raise SimulatorError(
        f"{run} is a run of the simulator {name}, which is taken as it is: there is nothing to "
        "train again.",
        hint="give shiplog train --model and the path of the simulator.",
    )


def _split(given: str) -> tuple[Path, str]:
    """Path and function of FILE.py:NAME."""
    whole, _, name = given.rpartition(":")
    if whole.lower().endswith(".py") and name.isidentifier():
        return Path(whole), name
    return Path(given), ""
