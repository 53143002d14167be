"""Which values of an actuator lie beyond the limits that its profile states."""

from __future__ import annotations

import numpy as np

from shiplog.ship_profile.profile import Actuator

SLACK = 1e-3  # of the range: rounding of a recorder, and no excess


def exceeds(actuator: Actuator, values: np.ndarray) -> np.ndarray:
    """[n] bool of values [n] in SI (rad, rev/s, or 1); none where no limits are stated.

    An azimuth is compared modulo a full turn: 0 to 360 deg are all there is, wherever the angle is
    cut.
    """
    limits = actuator.si_limits
    if limits is None:
        return np.zeros(len(values), bool)
    low, high = limits
    slack = SLACK * (high - low)
    if actuator.circular:
        return np.mod(values - low + slack, 2.0 * np.pi) > high - low + 2.0 * slack
    return (values < low - slack) | (values > high + slack)
