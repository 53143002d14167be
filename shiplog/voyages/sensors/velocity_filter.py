"""What the filter of a receiver takes from the turns of a velocity.

Receivers smooth speed and course over ground over some seconds. A filter of the first order,

    τ dv_f/dt = v - v_f,

is late by τ, and of a turn with the rate r it takes 1 - 1/sqrt(1 + (r τ)²) ≈ (r τ)²/2 of the
speed. A mean over 2 τ takes a third of that. Such a speed has the right scale in straight motion.
"""

from __future__ import annotations

import math

import numpy as np

MORE = 1.5  # times what the first order takes: filters of a higher order, and what noise adds


def takes(velocity: np.ndarray, late: float, step: float) -> float:
    """The share of a velocity [n, 2] over ground that a filter of the first order takes from its
    changes, which is late by so many seconds: 1 minus the slope of v_f on v(t - τ), about their
    means, by least squares.

    step  s between rows
    """
    from scipy.signal import lfilter  # 0.7 s to load, and few records ask for it

    delay = round(late / step)
    if delay < 1 or len(velocity) < 4 * delay:
        return 0.0
    keep = math.exp(-step / late)
    start = keep * velocity[:1]  # as if it had stood at its first value before
    filtered = lfilter([1.0 - keep], [1.0, -keep], velocity, axis=0, zi=start)[0]
    before, after = velocity[delay:-delay], filtered[2 * delay :]
    before, after = before - before.mean(0), after - after.mean(0)
    size = float((before**2).sum())
    return 1.0 - float((after * before).sum()) / size if size > 0.0 else 0.0


def explains(value: float, half: float, share: float) -> bool:
    """Whether a velocity of `value` times the true one, known to ± `half`, is what a filter makes
    that takes such a share of its turns."""
    return share > 0.0 and 0.0 < 1.0 - value <= MORE * share + half
