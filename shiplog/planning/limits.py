"""Within what a manoeuvre is to be sailed: water, rudder, speed and time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.exceptions import ShiplogError, listed
from shiplog.ship_profile.profile import Profile
from shiplog.training.runs.sailing_run import Sailor

ORDERS = 14  # of a helmsman in a manoeuvre, each at a whole second
MANOEUVRE_TIMES = 42.0  # L/U that a manoeuvre takes unless given: 300 s of a three-metre ship
HARD = np.radians(35.0)  # a rudder is laid so far, or as far as in the training voyages
LEAST_TIMES = 4.0  # L/U: a shorter manoeuvre says nothing
MOST_TIMES = 400.0  # L/U: a search of longer ones takes too long
AT_REST = 0.05  # of the approach speed: a ship that is slower lies stopped


class NoRoom(ShiplogError):
    """Limits within which no manoeuvre can be sailed."""


@dataclass(frozen=True)
class Limits:
    """seconds    of the whole manoeuvre
    speed      least and greatest |u|, m/s; 0 where the ship may stop
    ahead, aside   m of water ahead of the start and behind it, and to either side; infinite where
                   there is enough
    low, high  [A] of the actuators, SI
    """

    seconds: float
    speed: tuple[float, float]
    ahead: float
    aside: float
    low: np.ndarray
    high: np.ndarray

    def excess(self, state: np.ndarray, length: float) -> np.ndarray:
        """[N] by how much members [N, K, 6] go beyond: lengths of the ship, and shares of the
        greatest speed; zero where they stay within. A path that ends is beyond by far."""
        known = np.asarray(np.isfinite(state).all((1, 2)))
        s = np.where(known[:, None, None], state, 0.0)
        out = np.maximum(np.abs(s[..., 0]).max(1) - self.ahead, 0.0) / length
        out += np.maximum(np.abs(s[..., 2]).max(1) - self.aside, 0.0) / length
        speed, (least, most) = s[..., 1], self.speed
        out += np.maximum(speed.max(1) - most, 0.0) / most
        out += np.maximum(least - speed.min(1), 0.0) / most
        return np.where(known, out, 1e3)


def usual_time(sailor: Sailor) -> float:
    """s of a manoeuvre, unless a time is given."""
    return MANOEUVRE_TIMES * sailor.length / max(sailor.speed, 1e-6)


def limits(
    sailor: Sailor,
    *,
    seconds: float | None = None,
    rudder: float | None = None,
    speed: tuple[float, float] | None = None,
    water: tuple[float, float] | None = None,
) -> Limits:
    """What is given, else what the run's training voyages used.

    rudder   rad; by default as far as in the training voyages, and HARD at least
    speed    m/s; by default from astern to the fastest of the training voyages
    water    m ahead (and behind) and aside; by default as much as it takes

    Raises NoRoom.
    """
    profile, training = sailor.profile, sailor.training
    own = sailor.length / max(sailor.speed, 1e-6)
    time = usual_time(sailor) if seconds is None else seconds
    if not LEAST_TIMES * own <= time <= MOST_TIMES * own:
        raise NoRoom(
            f"A manoeuvre of {time:g} s is {time / own:.2g} times L/U of {profile.ship.name}.",
            hint=f"give --seconds between {LEAST_TIMES * own:.0f} and {MOST_TIMES * own:.0f}.",
        )
    fastest = float(np.abs(training["surge"].to_numpy()).max())
    between = (-fastest, fastest) if speed is None else speed
    if not between[0] < sailor.speed <= between[1] * 1.001:
        raise NoRoom(
            f"The approach speed of {sailor.speed:.3g} m/s is not within {between[0]:g} and "
            f"{between[1]:g} m/s.",
            hint="widen --speed, so that the ship may sail as in its training voyages.",
        )
    ahead, aside = water or (np.inf, np.inf)
    if min(ahead, aside) < sailor.length:
        raise NoRoom(
            f"Water of {ahead:g} m ahead and {aside:g} m aside is less than the ship's length of "
            f"{sailor.length:g} m.",
            hint="give --water more room, or sail a smaller ship.",
        )
    time = ORDERS * max(round(time / ORDERS), 1)
    low, high = _actuators(profile, training.select(profile.actuator_names).to_numpy(), rudder)
    return Limits(float(time), between, ahead, aside, low, high)


def _actuators(
    profile: Profile, used: np.ndarray, rudder: float | None
) -> tuple[np.ndarray, np.ndarray]:
    """All as far as the training voyages went, and rudders at least to HARD; no farther than the
    profile says."""
    low, high = used.min(0), used.max(0)
    for i, actuator in enumerate(profile.actuators):
        given = actuator.si_limits or (-np.inf, np.inf)
        if actuator.kind == "rudder":
            most = (-rudder, rudder) if rudder is not None else (
                min(low[i], -HARD), max(high[i], HARD))  # fmt: skip
            low[i], high[i] = max(given[0], most[0]), min(given[1], most[1])
        elif actuator.kind == "azimuth" and rudder is not None:
            low[i], high[i] = max(low[i], -rudder), min(high[i], rudder)
    still = [a.name for a, b, t in zip(profile.actuators, low, high, strict=True) if t - b <= 0.0]
    if len(still) == len(low):
        raise NoRoom(
            f"No actuator may move: {listed(still)}.",
            hint="widen --rudder, or train on voyages in which they moved.",
        )
    return low, high
