"""From a helmsman's orders to a ship's actuators: which ones steer and propel, how far and how fast
they go, and what a diagnosis found between an order and what acts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.exceptions import ModelError
from shiplog.models.causes import Cause
from shiplog.ship_profile.profile import Actuator, Profile
from shiplog.simulation.members import Rates

# SOLAS II-1/29: from 35 deg on one side to 30 deg on the other in 28 s, at full speed.
RUDDER_RATE = math.radians(65.0 / 28.0)  # rad/s, of a ship as long as SHIP_LENGTH or longer
SHIP_LENGTH = 100.0  # m; a shorter one's gear is faster by Froude's law, √(100 m / L)
MOVING = 0.2  # of the fastest change: slower ones are trim, or the ends of a movement
USUAL_RATE = 0.9  # quantile of those movements: a single faster one is a fault, or a hand
REVOLUTIONS = 400  # between none and the most, among which the approach's are searched
FASTEST = 1e9  # a second: of what has no known rate
ALONG = math.cos(math.radians(45.0))  # a fixed thruster within 45 deg of the axis propels


@dataclass(frozen=True)
class Controls:
    """Of each actuator [A], SI: what one radian of steering and full propulsion mean.

    steering   1 of a rudder, -1 of an azimuth astern of midship, 0 of what does not steer
    approach   at the approach speed
    astern     at full astern; zero where nothing turns astern
    low, high  limits
    rate       the fastest change a second; infinite where it is not known
    balanced   whether the approach's revolutions keep the approach speed in the model
    """

    names: tuple[str, ...]
    steering: np.ndarray
    approach: np.ndarray
    astern: np.ndarray
    low: np.ndarray
    high: np.ndarray
    rate: np.ndarray
    balanced: bool = True

    @property
    def steers(self) -> bool:
        return bool(self.steering.any())

    def actuators(self, steering: np.ndarray, propulsion: np.ndarray) -> np.ndarray:
        """[N, A] of a rudder angle [N] (positive: bow to starboard) and a propulsion [N]: 1 as in
        the approach, 0 stopped, -1 full astern."""
        ahead, back = np.maximum(propulsion, 0.0), np.maximum(-propulsion, 0.0)
        found = steering[:, None] * self.steering + ahead[:, None] * self.approach
        return np.clip(found + back[:, None] * self.astern, self.low, self.high)

    def moved(
        self, now: np.ndarray, ordered: np.ndarray, after: np.ndarray, step: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Actuators [N, A] at the end of a step, and their mean over it, of an order that is given
        `after` [N] s into it: they stay, then move at their rate, then stay."""
        left = (step - after)[:, None]
        rate = np.minimum(self.rate, FASTEST)[None, :]
        way = ordered - now
        moving = np.minimum(np.abs(way) / rate, left)
        # where it arrives it is there, and not beside it by what is rounded: of a stopped screw's
        # revolutions a model divides
        there = np.abs(way) <= rate * left
        end = np.where(there, ordered, now + np.copysign(rate * moving, way))
        mean = now * after[:, None] + 0.5 * (now + end) * moving + end * (left - moving)
        return end, np.where(way == 0.0, ordered, mean / step)


def untouched(names: tuple[str, ...]) -> Controls:
    """Of actuators whose positions are known: nothing is ordered, and nothing limits them."""
    none, all_of = np.zeros(len(names)), np.full(len(names), math.inf)
    return Controls(names, none, none, none, -all_of, all_of, all_of)


def controls(
    profile: Profile, training: pl.DataFrame, rates: Rates, speed: float, rudder_rate: float = 0.0
) -> Controls:
    """Of a ship whose model is `rates`, at an approach speed [m/s].

    training      1 Hz rows of the run: they show how far and how fast the actuators go
    rudder_rate   rad/s; as the training rows have it, or SOLAS asks for it, unless given

    Raises ModelError where nothing propels the ship.
    """
    each = profile.actuators
    seen = training.select(profile.actuator_names).to_numpy()
    limits = [a.si_limits or (-math.inf, math.inf) for a in each]
    low, high = np.array(limits).reshape(-1, 2).T
    propels = np.array([_propels(a) for a in each], dtype=bool)
    most = np.where(propels, np.minimum(seen.max(0, initial=0.0), high), 0.0)
    if not (most > 0.0).any():
        raise ModelError(
            f"Nothing propels {profile.ship.name} ahead in the run's training data.",
            hint="give --schedule a file with the orders of its actuators.",
        )
    least = np.where(np.isfinite(low), low, np.minimum(seen.min(0, initial=0.0), 0.0))
    approach, balanced = _approach(rates, most, speed)
    return Controls(
        names=profile.actuator_names,
        steering=np.array([_steers(a) for a in each]),
        approach=approach,
        astern=np.where(propels, np.maximum(np.minimum(least, 0.0), -most), 0.0),
        low=low,
        high=high,
        rate=_rates(profile, training, rudder_rate),
        balanced=balanced,
    )


def _propels(actuator: Actuator) -> bool:
    if actuator.kind == "thruster":
        return math.cos(math.radians(actuator.direction_deg)) > ALONG
    return actuator.kind == "propeller"


def _steers(actuator: Actuator) -> float:
    if actuator.kind == "rudder":
        return 1.0
    # thrust to starboard at the stern turns the bow to port
    return -1.0 if actuator.kind == "azimuth" and actuator.position_m[0] < 0.0 else 0.0


def _approach(rates: Rates, most: np.ndarray, speed: float) -> tuple[np.ndarray, bool]:
    """Actuators [A] at which u̇(U, 0, 0) = 0, all propellers at the same share of their most; the
    nearest ones, and False, where none of them balances."""
    share = np.linspace(0.0, 1.0, REVOLUTIONS)
    state = np.zeros((REVOLUTIONS, 6))
    state[:, 1] = speed
    with np.errstate(all="ignore"):
        surge = rates(state, share[:, None] * most, np.zeros((REVOLUTIONS, 2)))[:, 0]
    surge = np.where(np.isfinite(surge), surge, -math.inf)
    rises = np.flatnonzero((surge[:-1] < 0.0) & (surge[1:] >= 0.0))
    if not len(rises):
        return share[int(np.abs(surge).argmin())] * most, False
    at = rises[-1]
    part = surge[at] / (surge[at] - surge[at + 1]) if np.isfinite(surge[at]) else 1.0
    return (share[at] + part * (share[1] - share[0])) * most, True


def _rates(profile: Profile, training: pl.DataFrame, rudder_rate: float) -> np.ndarray:
    """[A] per second."""
    table = training.select("voyage", "segment", "time", *profile.actuator_names)
    near = (table["voyage"] == table["voyage"].shift(1)) & (
        table["segment"] == table["segment"].shift(1)
    )
    keep = near.fill_null(False).to_numpy()
    time = table["time"].to_physical().to_numpy() * 1e-9
    step = np.diff(time, prepend=time[:1])
    found = []
    for actuator in profile.actuators:
        values = table[actuator.name].to_numpy()
        values = np.unwrap(values) if actuator.circular else values
        with np.errstate(all="ignore"):
            change = np.abs(np.diff(values, prepend=values[:1]) / step)[keep]
        change = change[np.isfinite(change)]
        moving = change[change > MOVING * change.max(initial=0.0)]
        known = float(np.quantile(moving, USUAL_RATE)) if len(moving) else math.inf
        if actuator.kind in ("rudder", "azimuth"):
            shorter = max(1.0, math.sqrt(SHIP_LENGTH / profile.ship.length_m))
            known = known if len(moving) else RUDDER_RATE * shorter
            known = rudder_rate or known
        found.append(known)
    return np.array(found)


# --- what a diagnosis found between order and action ------------------------------------------

STEERING_CAUSES = ("rudder_offset", "rudder_lag", "rudder_delay")


class Gear:
    """Actuators [N, A] as they act, of what is recorded of them, step by step: the steering's
    causes of an extended model, as `causes.steering` has them of a whole record."""

    def __init__(
        self, causes: Sequence[Cause], numbers: Mapping[str, np.ndarray], profile: Profile
    ) -> None:
        self._lagged: np.ndarray | None = None
        self._past: list[np.ndarray] = []
        self._time = {"rudder_lag": 0.0, "rudder_delay": 0.0}
        kinds = [a.kind for a in profile.actuators]
        self._offset = np.zeros(len(kinds))
        steering = np.zeros(len(kinds), dtype=bool)
        for cause in causes:
            if cause.name not in STEERING_CAUSES:
                continue
            kind = "rudder" if getattr(cause, "what", "rudders") == "rudders" else "azimuth"
            mine = np.array([k == kind for k in kinds])
            steering |= mine
            p = np.asarray(numbers[cause.label])
            if cause.name == "rudder_offset":
                aside = np.array([a.position_m[1] for a in profile.actuators])
                each = np.where(aside < 0.0, p[0], p[-1])
                self._offset += np.where(mine, each, 0.0)
            else:
                self._time[cause.name] += float(p[0])
        self._steering = steering

    def acting(self, recorded: np.ndarray, step: float) -> np.ndarray:
        """The next step's, of what was recorded in it."""
        if not self._steering.any():
            return recorded
        found = recorded
        if (delay := self._time["rudder_delay"]) > 0.0:
            self._past.append(recorded)
            whole, part = divmod(delay / step, 1.0)
            keep = int(whole) + 2
            self._past = self._past[-keep:]
            later = self._past[max(0, len(self._past) - 1 - int(whole))]
            earlier = self._past[max(0, len(self._past) - 2 - int(whole))]
            found = later + part * (earlier - later)
        if (lag := self._time["rudder_lag"]) > 0.0:
            if self._lagged is None:
                self._lagged = found
            self._lagged = self._lagged + (1.0 - math.exp(-step / lag)) * (found - self._lagged)
            found = self._lagged
        return np.where(self._steering, found + self._offset, recorded)
