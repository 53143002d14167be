"""What a user can mend: what was found, what was expected, what to do next."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class ShiplogError(Exception):
    """The input is at fault. The command line prints it without a traceback and exits with 1."""

    exit_code = 1

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}\n  {self.hint}" if self.hint else self.message


class UsageError(ShiplogError):
    """A command line that cannot be meant so: a word that names nothing, options at odds."""

    exit_code = 2


class LogUnreadable(ShiplogError):
    """The file is no MCAP log, or nothing in it can be recovered."""


class ProfileError(ShiplogError):
    """A ship profile is missing, malformed, or says something that cannot be."""


class ChannelMissing(ShiplogError):
    """A ship profile asks for a topic or field that the log does not carry."""


class StoreError(ShiplogError):
    """The store cannot be read or written as requested."""


class WindowError(ShiplogError):
    """No window of the asked length can be cut from these voyages."""


class RunError(ShiplogError):
    """A run folder is missing, unfinished, or belongs to other settings."""


class UnreadableError(RunError):
    """A file of a run folder is not what was written there, or is missing."""


class ModelError(ShiplogError):
    """A dynamic model cannot be built, rolled out or identified from what is given."""


def nearest(name: str, available: Iterable[str]) -> str:
    """The closest spelling, to follow a name: `` (did you mean '/gyro'?)``; or nothing."""
    close = difflib.get_close_matches(name, list(available), n=1, cutoff=0.5)
    return f" (did you mean {close[0]!r}?)" if close else ""


def listed(names: Iterable[str], most: int = 12) -> str:
    """Names for a message, cut where a reader would stop reading."""
    names = sorted(names)
    if not names:
        return "none"
    text = ", ".join(names[:most])
    return text if len(names) <= most else f"{text}, and {len(names) - most} more"
