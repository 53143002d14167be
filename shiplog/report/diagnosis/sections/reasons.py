"""Causes that are not named, or cannot be tested, and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from shiplog.report.diagnosis.sections.written import bullets


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a cause is not named.

    reason  of a cause with several channels, it begins with the channel
    """

    name: str
    reason: str


def of(reasons: Mapping[str, str]) -> tuple[Reason, ...]:
    """Label → reason."""
    found = []
    for label, why in reasons.items():
        name, _, channel = label.partition(":")
        found.append(Reason(name, f"{channel}: {why}" if channel else why))
    return tuple(found)


def markdown(title: str, reasons: Sequence[Reason]) -> list[str]:
    return bullets(title, [f"{one.name}: {one.reason}" for one in reasons])
