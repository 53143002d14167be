"""An intermittent side force at one place, and its nominal part.

Random forces on a ship often act at one place, and in bursts. In rougher weather the same forces
are larger, and no device is at work.
"""

from __future__ import annotations

import numpy as np

from shiplog.diagnosis import unrecorded_thruster
from shiplog.diagnosis.nominal_campaign import Campaign
from shiplog.diagnosis.segments import SegmentGrid


def usual_push(campaign: Campaign, g: SegmentGrid) -> np.ndarray | None:
    """Acceleration [3], root mean square, of nominal process noise that acts at one place; None
    where independent noise in each channel is more probable.

    Each part's numbers are predicted by the other voyages and itself, as a trial's are.
    """
    reference = campaign.reference
    linear = reference.nominal
    if linear is None or not campaign.weight.sum():
        return None
    pushed = campaign.discrepancy.pushed(linear.cut, g)
    unit, share = reference.columns.unit, reference.counts
    own = np.empty((len(linear.e), len(unit)))
    names = np.unique(campaign.voyage)
    for rows, part, voyage in zip(campaign.rows, campaign.parts, campaign.voyage, strict=True):
        left_out = int(np.searchsorted(names, voyage))
        information, pull = campaign.prior_without(left_out, campaign.apart)
        gram = share * part[: 1 + len(pull), : 1 + len(pull)]
        own[rows] = np.linalg.solve(gram[1:, 1:] + information, gram[1:, 0] + pull) * unit
    left, none = linear.less_numbers(own, pushed), np.zeros(linear.j.shape[-1])
    found = unrecorded_thruster.pulses_of(
        left, none, reference, reference.process_noise, campaign.weight
    )
    return found.unit * found.force if found.gain > 0.0 else None
