"""Sensors against each other over a whole campaign: what one short voyage cannot tell, several can.

All voyages of a campaign share one set of parameters, those of `sensor_consistency`, fitted to
all at once. A voyage whose own estimate is far from the campaign's is named: it deviates. A voyage
in which two channels contradict each other has no part in the fit of these two.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise

import numpy as np
import polars as pl

from shiplog.logs.health.health_report import Finding, NotCompared
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.contradictions import gross as contradictions
from shiplog.voyages.contradictions.gross import Contradictions
from shiplog.voyages.sensors import sensor_consistency
from shiplog.voyages.sensors.sensor_consistency import Compared, Motion
from shiplog.voyages.sensors.sensor_findings import SURE_HALF_INTERVALS, Estimate

log = logging.getLogger(__name__)

SEASON_DAYS = 90.0  # days without a voyage, after which instruments may have been set anew
CAMPAIGN_ROWS = 72_000  # of a campaign at 10 Hz: every voyage gives its share of two hours


@dataclass(frozen=True)
class Deviating:
    """A voyage whose own estimate differs significantly, and by a practical size."""

    voyage: str
    estimate: Estimate


@dataclass(frozen=True)
class SensorCampaign:
    """Estimates over several voyages, each with the voyages that deviate from it.

    contradictions   of each voyage by itself: what excludes each other, and what cannot be compared
    not_compared     what the fit of all voyages did not find
    """

    voyages: tuple[str, ...]
    estimates: tuple[Estimate, ...]
    deviating: Mapping[tuple[str, str], tuple[Deviating, ...]]
    contradictions: Mapping[str, Contradictions] = field(default_factory=dict)
    not_compared: tuple[NotCompared, ...] = ()

    def findings(self, profile: Profile) -> list[Finding]:
        """What is notable of all voyages together, in words."""
        return sensor_consistency.findings(self.estimates, 1, profile)

    @property
    def contradicting(self) -> dict[str, tuple[Finding, ...]]:
        """Voyage → what excludes each other in it; only voyages in which something does."""
        return {name: one.findings for name, one in self.contradictions.items() if one.findings}

    @property
    def incomparable(self) -> dict[NotCompared, tuple[str, ...]]:
        """What could not be compared → the voyages in which it could not."""
        found: dict[NotCompared, list[str]] = {one: [*self.voyages] for one in self.not_compared}
        for name, one in self.contradictions.items():
            for left in one.not_compared:
                found.setdefault(left, []).append(name)
        return {left: tuple(names) for left, names in found.items()}


def seasons(begins: Mapping[str, float]) -> list[list[str]]:
    """Voyages in order of time, apart where none was sailed for SEASON_DAYS.

    begins   voyage → when it began [s]
    """
    order = sorted(begins, key=lambda name: (begins[name], name))
    found: list[list[str]] = [order[:1]] if order else []
    for before, name in pairwise(order):
        if begins[name] - begins[before] > SEASON_DAYS * 86_400.0:
            found.append([])
        found[-1].append(name)
    return found


def join(motions: Sequence[Motion]) -> Motion:
    """Voyages one after another, each beginning a stretch of its own. Long ones give their first
    rows, so that all together have CAMPAIGN_ROWS at most."""
    most = max(CAMPAIGN_ROWS // max(len(motions), 1), 1)
    parts = [motion.beginning(most) for motion in motions]
    arrays = {f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Motion)}
    at = np.cumsum([0, *(len(p.starts) for p in parts[:-1])])
    arrays["starts"] = arrays["starts"].copy()
    arrays["starts"][at[at < len(arrays["starts"])]] = True
    return Motion(**arrays)


def campaign(tables: Mapping[str, pl.DataFrame], profile: Profile) -> SensorCampaign:
    """Of voyages at 10 Hz that were read through one profile: voyage → its table."""
    log.info("comparing the sensors of %d voyages with each other", len(tables))
    motions = {name: sensor_consistency.measured(table, profile) for name, table in tables.items()}
    gross = {name: contradictions.find(table, profile) for name, table in tables.items()}
    fine = _fitted(motions, gross, profile)
    of = {(e.kind, e.channel): e for e in fine.estimates}
    deviating: dict[tuple[str, str], list[Deviating]] = {}
    for name, motion in motions.items() if len(motions) > 1 else ():
        alone = sensor_consistency.of_motion(
            motion, profile, gross[name].of_yaw_rate, gross[name].of_velocity
        )
        for one in alone.estimates:
            key = one.kind, one.channel
            if key in of and deviates(one, of[key]):
                deviating.setdefault(key, []).append(Deviating(name, one))
    return SensorCampaign(
        tuple(tables), fine.estimates, {k: tuple(v) for k, v in deviating.items()}, gross,
        fine.not_compared,
    )  # fmt: skip


def _fitted(
    motions: Mapping[str, Motion], gross: Mapping[str, Contradictions], profile: Profile
) -> Compared:
    """One set of parameters over the voyages in which the two agree enough to be fitted."""
    estimates: list[Estimate] = []
    left: list[NotCompared] = []
    for of_yaw_rate, names in (
        (True, [name for name in motions if gross[name].of_yaw_rate]),
        (False, [name for name in motions if gross[name].of_velocity]),
    ):
        if not names:
            continue
        whole = join([motions[name] for name in names])
        found = sensor_consistency.of_motion(whole, profile, of_yaw_rate, not of_yaw_rate)
        estimates += found.estimates
        left += found.not_compared
    return Compared(tuple(estimates), tuple(left))


def deviates(one: Estimate, other: Estimate) -> bool:
    """Whether two estimates are significantly apart, and by enough to matter."""
    half = 0.5 * math.hypot(one.high - one.low, other.high - other.low)
    apart = abs(one.value - other.value)
    return apart > SURE_HALF_INTERVALS * half and apart > one.least
