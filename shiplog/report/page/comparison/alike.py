"""Whether results may stand next to each other: where they differ, it is in one thing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from shiplog.exceptions import ShiplogError

# What two results must have alike, and in words.
SHIP, WINDOW, KIND = "ship", "window", "kind"


@dataclass(frozen=True)
class Item:
    """A result: `name` of its folder, `kind` ("verdict" or "evaluation"), what it is about."""

    name: str
    kind: str
    subject: Mapping[str, Any]
    result: Any  # Source of its kind

    @property
    def voyages(self) -> tuple[str, ...]:
        return tuple(sorted(one["name"] for one in self.subject["voyages"]))

    @property
    def run(self) -> str:
        if self.kind == "verdict":
            return str(self.subject["run"])
        return ", ".join(one["name"] for one in self.subject["runs"])


def differences(items: Sequence[Item]) -> list[str]:
    """Why these may not be compared: a sentence each; empty where they may.

    Of evaluations the voyages must be the same. Of verdicts the run or the voyages must be: one run
    in several seasons, or several runs in one.
    """
    first, found = items[0], []
    for other in items[1:]:
        if other.kind != first.kind:
            found.append(f"{first.name} is of kind {first.kind}, and {other.name} {other.kind}.")
            continue
        if other.subject["ship"] != first.subject["ship"]:
            found.append(
                f"{first.name} is of the ship {first.subject['ship']!r}, and {other.name} of "
                f"{other.subject['ship']!r}."
            )
        if other.subject["window_s"] != first.subject["window_s"]:
            found.append(
                f"{first.name} has windows of {first.subject['window_s']} s, and {other.name} of "
                f"{other.subject['window_s']} s: their errors are of different lengths."
            )
        if first.kind == "evaluation" and other.voyages != first.voyages:
            found.append(f"{first.name} and {other.name} are of different voyages.")
        if first.kind == "verdict" and other.voyages != first.voyages and other.run != first.run:
            found.append(
                f"{first.name} and {other.name} are of different runs ({first.run}, {other.run}) "
                "on different voyages: what changed could be either."
            )
    return found


def refuse_unlike(items: Sequence[Item]) -> None:
    """Raises ShiplogError with the first reason."""
    if why := differences(items):
        raise ShiplogError(
            f"These results cannot be compared: {why[0]}",
            hint="give results of one ship and window; or --anyway, which the page then says.",
        )
