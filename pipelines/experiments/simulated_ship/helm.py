"""Random manoeuvres as an operator on the bank makes them: telegraph, joystick, eye on the edge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pipelines.experiments.simulated_ship.ship import LIMITS

# time [s], state [12] -> port, starboard [rad], propeller [rev/s]; asked once a second
Helm = Callable[[float, np.ndarray], tuple[float, float, float]]
Settings = tuple[float, float, float]  # port [deg], starboard [deg], propeller [rev/s]

TELEGRAPH = (5.0, 6.5, 8.0, 10.0, 11.5, 12.5)  # rev/s, dead slow to full
TELEGRAPH_WEIGHTS = (0.16, 0.20, 0.22, 0.22, 0.10, 0.10)


def _telegraph(rng: np.random.Generator) -> float:
    return float(rng.choice(TELEGRAPH, p=TELEGRAPH_WEIGHTS))


def _cruise(rng: np.random.Generator) -> Settings:
    angle = rng.uniform(-8.0, 8.0)
    return angle, angle, _telegraph(rng)


def _turn(rng: np.random.Generator) -> Settings:
    angle = rng.choice((-1.0, 1.0)) * rng.uniform(12.0, 35.0)
    return angle, angle, _telegraph(rng)


def _hover(rng: np.random.Generator) -> Settings:
    return -75.0 + rng.uniform(-3.0, 3.0), 75.0 + rng.uniform(-3.0, 3.0), _telegraph(rng)


def _astern(rng: np.random.Generator) -> Settings:
    return -rng.uniform(92.0, 105.0), rng.uniform(92.0, 105.0), _telegraph(rng)


def _crab(rng: np.random.Generator) -> Settings:
    """One rudder brakes and the other pushes aside: the stern goes over with little headway."""
    steep, slight = rng.uniform(65.0, 105.0), rng.uniform(0.0, 35.0)
    if rng.random() < 0.5:
        return -steep, -slight, _telegraph(rng)
    return slight, steep, _telegraph(rng)


def _joystick(rng: np.random.Generator) -> Settings:
    return rng.uniform(-105.0, 35.0), rng.uniform(-35.0, 105.0), _telegraph(rng)


def _stop(rng: np.random.Generator) -> Settings:
    return rng.uniform(-5.0, 5.0), rng.uniform(-5.0, 5.0), 0.0


def _full(rng: np.random.Generator) -> Settings:
    return 0.0, 0.0, float(rng.choice((10.0, 12.5)))


MANOEUVRES = (  # what, how often, shortest and longest [s]
    (_cruise, 0.17, 8.0, 30.0),
    (_turn, 0.24, 6.0, 28.0),
    (_hover, 0.08, 8.0, 30.0),
    (_astern, 0.14, 12.0, 40.0),
    (_crab, 0.10, 6.0, 20.0),
    (_joystick, 0.11, 5.0, 15.0),
    (_stop, 0.08, 6.0, 20.0),
    (_full, 0.08, 15.0, 40.0),
)


@dataclass(slots=True)
class Operator:
    """Draws a manoeuvre, holds it for a while, and turns back when the bank comes near.

    He sees the pond and the ship, never its instruments: what is hidden in a sensor does not
    change its path.
    """

    rng: np.random.Generator
    settings: Settings = (0.0, 0.0, 0.0)
    until: float = 5.0  # s; casts off, drifts a moment
    returning: bool = field(default=False)

    def __call__(self, time: float, state: np.ndarray) -> Settings:
        north, surge, east, sway, heading, yaw_rate = state[:6]
        velocity = complex(surge, sway) * np.exp(1j * heading)
        soon = abs(complex(north, east) + 18.0 * velocity)
        here = abs(complex(north, east))
        if self.returning and here < 16.0:
            self.returning, self.until = False, time
        elif not self.returning and here > 20.0 and max(soon, here) > 31.0:
            self.returning = True
            self.settings = (0.0, 0.0, float(self.rng.choice((8.0, 10.0, 12.5))))
        if self.returning:
            return self._home(north, east, heading, yaw_rate, here)
        if time >= self.until:
            which = self.rng.choice(len(MANOEUVRES), p=[m[1] for m in MANOEUVRES])
            draw, _, shortest, longest = MANOEUVRES[which]
            self.settings = draw(self.rng)
            self.until = time + self.rng.uniform(shortest, longest)
        return limited(self.settings)

    def _home(
        self, north: float, east: float, heading: float, yaw_rate: float, here: float
    ) -> Settings:
        """Bow to the middle; more power the nearer the bank."""
        bearing = np.arctan2(-east, -north)
        error = np.rad2deg(np.angle(np.exp(1j * (bearing - heading))))
        rudder = 5.0 * round(
            (0.9 * error - 5.0 * np.rad2deg(yaw_rate)) / 5.0
        )  # a hand, no autopilot
        rudder = float(np.clip(rudder, -35.0, 35.0))
        power = 12.5 if here > 36.0 else self.settings[2]
        return limited((rudder, rudder, power))


def limited(settings: Settings) -> Settings:
    port, starboard, propeller = LIMITS.values()
    return (
        float(np.clip(np.deg2rad(settings[0]), *port)),
        float(np.clip(np.deg2rad(settings[1]), *starboard)),
        float(np.clip(settings[2], *propeller)),
    )
