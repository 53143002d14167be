"""How instruments disturb a recorded track, and what of it is taken out before a peak is sought.

Of a stated accuracy σ a share ½ of the variance is white and a share ½ stays for a minute, a
Gauss-Markov process (Gelb 1974): multipath of a receiver, the swing of a compass, a warm gyro.

    e_k = σ (√½ w_k + √½ g_k),   g_k = e^(-h/τ) g_{k-1} + √(1 - e^(-2h/τ)) w'_k,   τ = 60 s

A constant error of a compass changes no quantity: all are differences of headings. One that moves
between an order and a peak does.

White noise makes the highest of many samples too high, and crosses zero before the yaw rate does.
Cubics by least squares over 0.3 L/V (Savitzky & Golay 1964) take it out: in that time a ship turns
by 6 degrees in the tightest turn, and they are exact to the fourth derivative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from shiplog.manoeuvres.track import Track
from shiplog.ship_profile.profile import Profile

SLOW_SHARE = 0.5  # of the variance: what a data sheet's one number leaves open
SLOW_TIME = 60.0  # s
# Accuracy where the profile states none: a satellite receiver's, a compass's
PLACE_SIGMA, HEADING_SIGMA = 1.0, math.radians(0.5)
SMALLEST_SHARE = 0.02  # of L: a receiver's noise is not more than that on a ship it is meant for
SMOOTHED = 0.3  # L/V of each cubic
ORDER = 3
SECOND_DIFFERENCE = math.sqrt(6.0)  # its standard deviation over that of white noise


@dataclass(frozen=True)
class Noise:
    """Standard deviations [6] of channels.STATE: m, m/s, m, m/s, rad, rad/s."""

    sigma: np.ndarray

    def drawn(self, track: Track, rng: np.random.Generator) -> Track:
        """The track, disturbed once more by the same instruments."""
        from scipy.signal import lfilter

        white, new = rng.standard_normal((2, len(track), 6))
        keep = math.exp(-_step(track) / SLOW_TIME)
        first = keep * rng.standard_normal((1, 6))  # g_{-1}, drawn from where it settles
        slow, _ = lfilter([math.sqrt(1.0 - keep**2)], [1.0, -keep], new, axis=0, zi=first)
        error = math.sqrt(1.0 - SLOW_SHARE) * white + math.sqrt(SLOW_SHARE) * slow
        return replace(track, state=track.state + self.sigma * error)


def of_profile(profile: Profile, track: Track) -> Noise:
    """As the profile states it; of velocities that it says nothing of, the white part by the second
    differences of the record (von Neumann 1941), and as much that is slow."""
    sensors = profile.sensors
    place = sensors.noise("position") or min(PLACE_SIGMA, SMALLEST_SHARE * track.length)
    heading = sensors.noise("heading") or HEADING_SIGMA
    ahead, aside, turning = (_white(track.state[:, i]) for i in (1, 3, 5))
    velocity = sensors.noise("velocity")
    rate = sensors.noise("yaw_rate")
    return Noise(
        np.array([
            place, velocity or ahead, place, velocity or aside, heading, rate or turning,
        ])
    )  # fmt: skip


def _step(track: Track) -> float:
    return float(np.median(np.diff(track.time)))


def _white(values: np.ndarray) -> float:
    """σ of a record whose white part is that of its second differences."""
    if len(values) < 3:
        return 0.0
    second = float(np.sqrt(np.mean(np.diff(values, 2) ** 2)))
    return second / SECOND_DIFFERENCE / math.sqrt(1.0 - SLOW_SHARE)


def smoothed(track: Track, begin: float) -> Track:
    """Its state by local cubics; as it is where 0.3 L/V are too few samples for one."""
    from scipy.signal import savgol_filter

    step = _step(track)
    speed = max(float(track.speed[track.row(begin)]), 1e-6)
    samples = 2 * int(0.5 * SMOOTHED * track.length / speed / step) + 1
    samples = min(samples, len(track) - 1 + len(track) % 2)
    if samples <= ORDER + 1:
        return track
    return replace(track, state=savgol_filter(track.state, samples, ORDER, axis=0))
