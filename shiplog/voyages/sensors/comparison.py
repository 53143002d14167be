"""One voyage's sensors against each other: what contradicts grossly first, small errors after.

Two channels that contradict each other are not fitted to each other: the fit would explain a sign
by a delay, and a unit by a scale.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import polars as pl

from shiplog.logs.health.health_report import Finding, NotCompared
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.contradictions import gross as contradictions
from shiplog.voyages.contradictions import wind_contradictions
from shiplog.voyages.contradictions.gross import Contradictions
from shiplog.voyages.sensors import sensor_consistency
from shiplog.voyages.sensors.sensor_findings import Estimate

MOVING = frozenset({"position", "velocity", "heading"})  # in doubt, they say nothing of the wind
# Of a channel: the one that its "held" and its "jump" are measured by, and are wrong with it.
MEASURED_BY = {"heading": "yaw_rate", "position": "velocity"}
AFTER = "the same comparison once the profile is corrected"


@dataclass(frozen=True)
class Comparison:
    """findings: contradictions, then what is notable of the small errors."""

    contradictions: Contradictions
    estimates: tuple[Estimate, ...]
    findings: tuple[Finding, ...]
    not_compared: tuple[NotCompared, ...]


def compare(table: pl.DataFrame, profile: Profile) -> Comparison:
    """Of one voyage at 10 Hz, as ingest makes it."""
    gross = contradictions.find(table, profile)
    fine = sensor_consistency.compared(table, profile, gross.of_yaw_rate, gross.of_velocity)
    small = sensor_consistency.findings(fine.estimates, table.height, profile)
    left = [*gross.not_compared, *fine.not_compared]
    for holds, names in (
        (gross.of_yaw_rate, "yaw rate and heading"), (gross.of_velocity, "position and velocity"),
    ):  # fmt: skip
        if not holds:
            left.append(
                NotCompared(f"small errors of {names}", "they contradict each other", AFTER)
            )
    wind = wind_contradictions.WindComparison()
    if not {one.channel for one in gross.findings} & MOVING:
        wind = wind_contradictions.compare(table, profile)
    left += wind.not_compared
    found = (*gross.findings, *wind.findings, *small)
    return Comparison(gross, fine.estimates, found, tuple(left))


def without_consequences(of_rows: Iterable[Finding], found: Iterable[Finding]) -> list[Finding]:
    """What was found row by row, but for what a contradicted channel makes of another one: a yaw
    rate that is 60 times too large holds the heading, and steps beside it."""
    wrong = {one.channel for one in found if one.kind == "contradiction"}
    return [
        one
        for one in of_rows
        if one.kind not in ("held", "jump") or MEASURED_BY.get(one.channel) not in wrong
    ]
