"""Which causes and numbers of theirs a limit can name, and what their size is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shiplog.exceptions import ShiplogError, listed, nearest
from shiplog.models.causes import CATALOGUE, Cause

SIDE_THRUST = "side_thrust"  # an unrecorded thruster: an answer that is not in the catalogue
# Numbers that say where or which way, and not how much.
NO_SIZE = {
    ("current", "direction"), ("payload", "position"),
    ("line", "x0"), ("line", "y0"), ("line", "direction"), ("line", "position"),
    ("tow", "direction"), ("tow", "turn"), ("tow", "position"),
}  # fmt: skip
# Of a number that a diagnosis reports, those whose smallest detectable sizes it lists: it searches
# for a current's two components, and knows of no speed.
SEARCHED = {
    ("current", "speed"): ("north", "east"),
    ("line", "pull"): ("pull_north", "pull_east"),
    ("tow", "pull"): (
        "begin_north", "begin_east", "middle_north", "middle_east", "end_north", "end_east",
    ),
}  # fmt: skip


def parted(name: str) -> tuple[str, str]:
    """`clock_offset:gnss` is the cause and its channel; without a colon it is of any."""
    cause, _, part = name.partition(":")
    return cause, part


def check_cause(name: str, own: Sequence[Cause], actuators: Sequence[str]) -> None:
    """Raises ShiplogError for a cause that there is not."""
    cause, part = parted(name)
    known = [*dict.fromkeys(c.name for c in (*CATALOGUE, *own)), SIDE_THRUST]
    if cause not in known:
        raise ShiplogError(
            f"there is no cause {cause!r}{nearest(cause, known)}.",
            hint=f"causes are {', '.join(known)}; give the file of one of your own with --cause.",
        )
    parts = [c.label.partition(":")[2] for c in CATALOGUE if c.name == cause]
    parts = [one for one in parts if one] or list(actuators)
    if part and part not in parts:
        raise ShiplogError(
            f"{name!r}: {cause} has no {part!r}{nearest(part, parts)}.",
            hint=f"it can be of {listed(parts)}; {cause!r} alone is of each.",
        )


def check_size(name: str, parameter: str, own: Sequence[Cause], actuators: Sequence[str]) -> None:
    """Raises ShiplogError for a cause, or a number of one, that has no size."""
    check_cause(name, own, actuators)
    cause, _ = parted(name)
    if cause == SIDE_THRUST:
        raise ShiplogError(
            f"{cause} has no size that a limit can be set on.",
            hint="forbid it: causes_not_allowed = ['side_thrust'] in [diagnosis].",
        )
    one = next(c for c in (*own, *CATALOGUE) if c.name == cause)
    numbers = [key for key in _displayed(one) if (cause, key) not in NO_SIZE]
    if (cause, parameter) in NO_SIZE:
        raise ShiplogError(
            f"{cause}.{parameter} says where or which way, and not how much.",
            hint=f"limit {listed(numbers)} of it.",
        )
    # what has a number for each rudder shows only on its ship how many
    if one.parameters and parameter not in numbers:
        raise ShiplogError(
            f"{cause} has no number {parameter!r}{nearest(parameter, numbers)}.",
            hint=f"it has {listed(numbers)}.",
        )


def sized(name: str, reported: Sequence[str], own: Sequence[Cause] = ()) -> list[str]:
    """The numbers of a cause that a limit can be set on.

    reported   those that a diagnosis has of it: of a cause with one for each rudder, these
    """
    one = next((c for c in (*own, *CATALOGUE) if c.name == name), None)
    if one is None:
        return []
    numbers = list(_displayed(one)) if one.parameters else list(reported)
    return [key for key in numbers if (name, key) not in NO_SIZE]


def unit_of(name: str, parameter: str, own: Sequence[Cause] = ()) -> str:
    """Unit of a number of a cause, as the contract has it; empty for a factor."""
    cause, _ = parted(name)
    one = next((c for c in (*own, *CATALOGUE) if c.name == cause), None)
    displayed = {} if one is None else _displayed(one)
    unit = displayed.get(parameter, (0.0, next((u for _, u in displayed.values()), "")))[1]
    return "" if unit == "1" else unit


def neutral(name: str, parameter: str, own: Sequence[Cause] = (), windless: bool = False) -> float:
    """The number where the cause is absent: 1 of a factor, 0 of all others.

    windless   whether the model has no wind force: the factors are then of a usual ship's force,
               and 0 where there is none
    """
    cause, _ = parted(name)
    if cause == "wind_force" and windless:
        return 0.0
    one = next((c for c in (*own, *CATALOGUE) if c.name == cause), None)
    return 0.0 if one is None else _displayed(one).get(parameter, (0.0, ""))[0]


def _displayed(cause: Cause) -> dict[str, tuple[float, str]]:
    numbers = cause.displayed(np.zeros(cause.count))
    return {key: (float(value), unit) for key, (value, unit) in numbers.items()}
