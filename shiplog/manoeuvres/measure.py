"""The quantities of a manoeuvre, and how sure a measurement of them is.

The interval is that of what was recorded: the noise of each instrument (`sensor_noise`), when the
order was given (to half a sample), and the current that was taken out. Each is drawn, the
quantities are worked out again, and the interval is the value ± 1.645 standard deviations. What a
wind or a sea did to the ship is not in it: that is a condition.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from shiplog.manoeuvres import drift, sensor_noise, steadiness, stopping, turning, zigzags
from shiplog.manoeuvres.drift import Drift
from shiplog.manoeuvres.quantity import Estimate
from shiplog.manoeuvres.recognition import Found
from shiplog.manoeuvres.sensor_noise import Noise
from shiplog.manoeuvres.track import Track
from shiplog.nomenclature.numbers import NINETY_SPREADS
from shiplog.ship_profile.profile import Profile

DRAWS = 40  # their standard deviation is known to a ninth
YAW_SHARE = 0.01  # of a spiral's settled yaw rates: how well the last seconds of a hold show them


@dataclass(frozen=True)
class Measured:
    """quantities  name → estimate
    drift       from positions 360 degrees apart, which was taken out; None where there are none
    """

    quantities: Mapping[str, Estimate]
    drift: Drift | None = None

    @property
    def corrected(self) -> bool:
        return self.drift is not None


def values(found: Found, track: Track) -> dict[str, float]:
    """Quantities of a manoeuvre on this track in still water."""
    straight = found.straight
    match found.kind:
        case "turn":
            all_of = turning.quantities(track, found.begin, found.side)
            if straight:
                return all_of
            return {k: v for k, v in all_of.items() if k in ("steady_diameter", "drift_angle")}
        case "zigzag":
            all_of = zigzags.quantities(track, found.orders, found.side, found.angle)
            if not straight:
                all_of.pop("first_overshoot", None)
                all_of.pop("initial_turning", None)
                all_of.pop("check_time", None)
            return all_of
        case "stop":
            return stopping.quantities(track, found.begin)
        case "pull_out":
            return steadiness.residual(track, [(found.side, found.end)])
        case "spiral":
            return steadiness.loop(found.steps) if not found.part else {}
    return {}


def measured(found: Found, profile: Profile, step: float) -> Measured:
    """Of a recorded manoeuvre. `step`: s between two rows."""
    noise = sensor_noise.of_profile(profile, found.track)
    raw = found
    found = replace(found, track=sensor_noise.smoothed(found.track, found.begin))
    moved = drift.of_turn(found.track, found.begin, found.side) if found.kind == "turn" else None
    track = found.track.without(moved.velocity) if moved else found.track
    best = values(found, track)
    if not best:
        return Measured({}, moved)
    rng = np.random.default_rng(0)
    drawn = [values(*_disturbed(raw, noise, moved, step, rng)) for _ in range(DRAWS)]
    estimates = {}
    for name, value in best.items():
        many = np.array([one[name] for one in drawn if name in one])
        spread = float(many.std(ddof=1)) if len(many) > DRAWS // 2 else 0.0
        half = NINETY_SPREADS * spread
        estimates[name] = Estimate(value, value - half, value + half)
    return Measured(estimates, moved)


def _disturbed(
    found: Found, noise: Noise, moved: Drift | None, step: float, rng: np.random.Generator
) -> tuple[Found, Track]:
    """The manoeuvre as it may have been as well."""
    track = noise.drawn(found.track, rng)
    if moved is not None:
        track = track.without(rng.multivariate_normal(moved.velocity, moved.covariance))
    track = sensor_noise.smoothed(track, found.begin)
    late = step * rng.uniform(-0.5, 0.5, len(found.orders))
    orders = tuple(np.clip(np.add(found.orders, late), track.time[0], track.time[-1]).tolist())
    steps = tuple(
        (angle, rate * (1.0 + YAW_SHARE * rng.standard_normal())) for angle, rate in found.steps
    )
    return replace(found, begin=orders[0], orders=orders, steps=steps), track
