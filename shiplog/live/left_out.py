"""A nominal campaign without some of its voyages: what the others say of those.

Linearisation and noise stay those of the whole campaign, and so do the products G_i of its parts:
they hardly depend on one voyage. What is estimated from a handful of voyages does, and is learned
anew from the others: how far parts and voyages differ, D and a, the sizes s of the discrepancy, and
with them the numbers' prior (`diagnosis.nominal`). A voyage is then as far from its model as a new
one is, and the fewer voyages there are, the further.

The share κ is the same for the watch and for all voyages that are left out (`in_common`). It is
estimated in steps of a factor of two, and log Z grows with it: a threshold from voyages that count
for half would be crossed far too often by a watch in which they count in full.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from shiplog.diagnosis.nominal import campaign_prior, voyage_effects
from shiplog.diagnosis.nominal.campaign_characteristics import groups_of
from shiplog.diagnosis.nominal.campaign_prior import INFORMATION_SHARES
from shiplog.diagnosis.nominal.nominal_campaign import Campaign
from shiplog.diagnosis.nominal.voyage_effects import VoyageEffects, reduced

MOST_FOLDS = 6  # groups of voyages that are left out in turn


def folds(campaign: Campaign, of: np.ndarray) -> Iterator[tuple[np.ndarray, Campaign]]:
    """Voyages [n], and what all others say; each voyage of the segments `of` [S] once. Of a single
    voyage nothing is left out: it is watched with what it says itself. Raises
    np.linalg.LinAlgError."""
    if len(groups := _groups(of)) < 2:
        yield np.unique(of), campaign
        return
    for out in groups:
        yield out, without(campaign, out, (campaign.reference.counts,))


def _groups(of: np.ndarray) -> list[np.ndarray]:
    """Voyages that are left out together."""
    voyages = np.unique(of)
    return np.array_split(voyages, min(len(voyages), MOST_FOLDS))


def in_common(campaign: Campaign, of: np.ndarray) -> Campaign:
    """The campaign with the κ of the watch: the median of those that it says itself and that it
    says without each group of its voyages, the lower one of two. `of` as in `folds`. Raises
    np.linalg.LinAlgError."""
    groups = _groups(of)
    if len(groups) < 2:
        return campaign
    said = [without(campaign, out, INFORMATION_SHARES).reference.counts for out in groups]
    said = sorted([*said, campaign.reference.counts])
    return without(campaign, np.zeros(0, int), (said[(len(said) - 1) // 2],), campaign.effects)


def without(
    campaign: Campaign, out: np.ndarray, shares: Sequence[float],
    effects: VoyageEffects | None = None,
) -> Campaign:  # fmt: skip
    """What all voyages but those say, with one of these shares κ. Raises np.linalg.LinAlgError
    where a matrix is singular.

    effects   learned anew unless given
    """
    ref, families = campaign.reference, campaign.discrepancy.families
    kept = np.flatnonzero(~np.isin(campaign.voyage, out))
    each, voyage = tuple(campaign.each[i] for i in kept), campaign.voyage[kept]
    known, count = campaign.effects.size**-2.0, len(ref.anchor)
    if effects is None:
        groups = groups_of(ref.model, ref.columns, campaign.discrepancy)
        learned = voyage_effects.learn(
            [one[: 1 + count, : 1 + count] for one in each], known, ref.anchor,
            list(groups.values()), [family.columns for family in families],
        )  # fmt: skip
        seen = campaign.effects.deviation > 0.0  # the others have none, of whatever voyages
        effects = VoyageEffects(np.where(seen, learned.deviation, 0.0), learned.size)
    parts = [reduced(one[: 1 + count, : 1 + count], effects.deviation)[0] for one in each]
    apart, share = campaign_prior.learn(parts, voyage, effects, ref.anchor, shares)
    return replace(
        campaign, reference=replace(ref, counts=share), effects=effects, each=each, voyage=voyage,
        apart=apart,
    )  # fmt: skip
