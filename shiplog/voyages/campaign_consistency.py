"""Sensors against each other over a whole campaign: what one short voyage cannot tell, several can.

All voyages of a campaign share one set of parameters, those of `sensor_consistency`, fitted to
all at once. A voyage whose own estimate is far from the campaign's is named: it deviates.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
import polars as pl

from shiplog.logs.health_report import Finding
from shiplog.profile import Profile
from shiplog.voyages import sensor_consistency
from shiplog.voyages.sensor_consistency import SURE_HALF_INTERVALS, Estimate, Motion

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
    """Estimates over several voyages, each with the voyages that deviate from it."""

    voyages: tuple[str, ...]
    estimates: tuple[Estimate, ...]
    deviating: Mapping[tuple[str, str], tuple[Deviating, ...]]

    def findings(self, profile: Profile) -> list[Finding]:
        """What is notable of all voyages together, in words."""
        return sensor_consistency.findings(self.estimates, 1, profile)


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


def together(motions: Sequence[Motion]) -> Motion:
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
    found = tuple(sensor_consistency.of_motion(together(list(motions.values())), profile))
    of = {(e.kind, e.channel): e for e in found}
    deviating: dict[tuple[str, str], list[Deviating]] = {}
    for name, motion in motions.items() if len(motions) > 1 else ():
        for one in sensor_consistency.of_motion(motion, profile):
            key = one.kind, one.channel
            if key in of and deviates(one, of[key]):
                deviating.setdefault(key, []).append(Deviating(name, one))
    return SensorCampaign(tuple(tables), found, {k: tuple(v) for k, v in deviating.items()})


def deviates(one: Estimate, other: Estimate) -> bool:
    """Whether two estimates are significantly apart, and by enough to matter."""
    half = 0.5 * math.hypot(one.high - one.low, other.high - other.low)
    apart = abs(one.value - other.value)
    return apart > SURE_HALF_INTERVALS * half and apart > one.least
