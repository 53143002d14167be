"""Azimuths as a network has learned them."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jax import Array

from shiplog.nomenclature.frames import wrap


def within_a_turn(actuator: Array, turning: Sequence[int]) -> Array:
    """Actuators [..., A] with the azimuths [rad], columns `turning`, in (-π, π].

    The rows that a network was trained on have them so. In a record they count on past ±180 deg,
    and a network knows nothing of 350 deg.
    """
    if not turning:
        return actuator
    actuator, columns = jnp.asarray(actuator), np.array(turning)
    return actuator.at[..., columns].set(wrap(actuator[..., columns]))
