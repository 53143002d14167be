"""Azimuths as a network has learned them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shiplog.machine.arrays import Array, put
from shiplog.nomenclature.frames import wrap


def within_a_turn(actuator: Array, turning: Sequence[int]) -> Array:
    """Actuators [..., A] with the azimuths [rad], columns `turning`, in (-π, π].

    The rows that a network was trained on have them so. In a record they count on past ±180 deg,
    and a network knows nothing of 350 deg.
    """
    if not turning:
        return actuator
    columns = np.array(turning)
    return put(actuator, columns, wrap(actuator[..., columns]))
