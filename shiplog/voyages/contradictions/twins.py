"""Two actuators of one kind on either side of the centreline: which of them is which.

Two rudders side by side turn the ship alike, whichever is called the port one; two propellers
differ by the sense of y in their moment, N = -y X, and only while their thrusts differ. Limits that
are not the same tell them apart, where both are moved far enough.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
import polars as pl

from shiplog.logs.health.health_report import Finding, NotCompared
from shiplog.ship_profile.profile import Actuator, Profile
from shiplog.voyages.contradictions.actuators import Driven
from shiplog.voyages.rows.resampling import RATE_HZ
from shiplog.voyages.samples.actuator_limits import exceeds

MIRRORED = 0.02  # of the ship's length: by how much their places may differ from a mirror's
ALIKE = 0.01  # of the range in which they move: the two always stand alike
BEYOND_ROWS = 30  # 3 s of 10 Hz rows, and more, beyond limits
WITHIN = 0.99  # of the rows within the other's limits


def pairs(profile: Profile) -> Iterator[tuple[Actuator, Actuator]]:
    """Actuators of one kind that mirror each other at the centreline."""
    near = MIRRORED * profile.ship.length_m
    for one, other in combinations(profile.actuators, 2):
        if one.kind != other.kind or one.si_unit != other.si_unit:
            continue
        (x, y), (x_other, y_other) = one.position_m, other.position_m
        if y * y_other < 0.0 and abs(x - x_other) < near and abs(y + y_other) < near:
            yield one, other


def not_compared(
    profile: Profile, driven: Mapping[str, np.ndarray], counted: Iterable[Driven]
) -> Iterator[NotCompared]:
    """Pairs of which nothing tells the two apart.

    driven    actuator → its values [n]
    counted   what each does to the ship: a yaw that is known tells two thrusts apart
    """
    turns = {
        one.name for one in counted if one.direction == "yaw rate" and (one.along or one.against)
    }
    for one, other in pairs(profile):
        of_both = driven[one.name], driven[other.name]
        if _stand_alike(*of_both) or _exchanged_s((one, other), of_both):
            continue
        what = f"which of {one.name} and {other.name} is which"
        if one.kind == "rudder":
            yield NotCompared(
                what, "side by side they turn the ship alike", "one of them moved by itself, and "
                "looked at",
            )  # fmt: skip
        elif not {one.name, other.name} <= turns:
            yield NotCompared(
                what, "too little of the turning follows their difference", "a run on one of them, "
                "or more thrust on one side, for some ship's lengths",
            )  # fmt: skip


def find_exchanged(table: pl.DataFrame, profile: Profile) -> list[Finding]:
    """Pairs that stand beyond their own limits and within each other's: they are exchanged, or
    their limits are."""
    found = []
    for one, other in pairs(profile):
        values = (table[a.name].cast(pl.Float64).fill_null(np.nan).to_numpy() for a in (one, other))
        seconds = _exchanged_s((one, other), tuple(values))
        if not seconds:
            continue
        sentence = (
            f"{one.name} and {other.name} each stand beyond their own limits, for {seconds:.0f} s, "
            "and within those of the other, as if the two were exchanged. Change: `topic` and "
            "`field` of the two [[actuators]], or their `limits`."
        )
        found.append(Finding(
            "contradiction", one.name, sentence, value=seconds, unit="s", reason="swapped"
        ))  # fmt: skip
    return found


def _exchanged_s(pair: Sequence[Actuator], values: Sequence[np.ndarray]) -> float:
    """For how long [s] the two stand beyond their own limits where each fits the other's; else
    0."""
    own, theirs = pair
    if own.si_limits is None or theirs.si_limits is None or own.si_limits == theirs.si_limits:
        return 0.0
    first, second = (one[np.isfinite(one)] for one in values)
    excess = int(exceeds(own, first).sum()), int(exceeds(theirs, second).sum())
    if min(excess) < BEYOND_ROWS:
        return 0.0
    exchanged = exceeds(theirs, first), exceeds(own, second)
    if any(rows.mean() > 1.0 - WITHIN for rows in exchanged):
        return 0.0
    return max(excess) / RATE_HZ


def _stand_alike(one: np.ndarray, other: np.ndarray) -> bool:
    both = np.isfinite(one) & np.isfinite(other)
    if not both.any():
        return True
    reach = max(float(np.ptp(one[both])), float(np.ptp(other[both])))
    return float(np.quantile(np.abs(one - other)[both], 0.95)) <= ALIKE * reach
