"""What a user can mend: what was found, what was expected, what to do next."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

MOST_NEAR = 3  # names that are close to a wrong one, in a message


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


class VoyageMissing(StoreError, KeyError):
    """There is no voyage of that name in a store; a KeyError as well, as of a dict."""

    def __init__(self, name: str, available: Iterable[str], store: str) -> None:
        names = list(available)
        near = difflib.get_close_matches(str(name), names, n=MOST_NEAR, cutoff=0.5)
        there = f"Names near it: {listed(near)}" if near else f"There are {listed(names)}"
        super().__init__(
            f"There is no voyage {name!r} in the store {store}. {there}.",
            hint="`for voyage in store` goes through them all; a part of one is 'name[0:1200]'.",
        )


class WindowError(ShiplogError):
    """No window of the asked length can be cut from these voyages."""


class RunError(ShiplogError):
    """A run folder is missing, unfinished, or belongs to other settings."""


class RunNotEvaluated(RunError, KeyError):
    """A run that an evaluation does not have; a KeyError as well, as of a dict."""

    def __init__(self, name: str, available: Iterable[str]) -> None:
        names = list(available)
        super().__init__(
            f"The evaluation has no run {name!r}{nearest(str(name), names)}.",
            hint=f"it has {listed(names)}.",
        )


class SeveralRuns(RunError, AttributeError):
    """A number of one run is asked of an evaluation of several; an AttributeError as well."""

    def __init__(self, what: str, available: Iterable[str]) -> None:
        names = sorted(available)
        super().__init__(
            f"The evaluation is of several runs, {listed(names)}: each has its own {what}.",
            hint=f"name one: evaluation[{names[0]!r}].{what}; all of them are in .summary.",
        )


class UnreadableError(RunError):
    """A file of a run folder is not what was written there, or is missing."""


class FleetError(ShiplogError):
    """A list of ships cannot be read, or says something that cannot be."""


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
