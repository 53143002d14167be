"""Wind over the pond: gusts on a mean that slowly turns and freshens."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np

GRID = 0.1  # s; anemometers and a 3 m ship feel nothing faster


@dataclass(frozen=True, slots=True)
class Wind:
    """True wind. Angles say where it comes from, clockwise from north."""

    speed: float  # m/s, mean at the start
    direction: float  # rad, mean at the start
    speed_end: float | None = None  # m/s, mean at the end; as at the start unless given
    turn: float = 0.0  # rad, from start to end
    gust: float = 0.16  # standard deviation over the mean, intensity of turbulence
    gust_time: float = 9.0  # s
    veer: float = 0.14  # rad, standard deviation of the direction within gusts
    wander: float = 0.17  # rad, of the mean direction, within minutes


CALM = Wind(0.0, 0.0, gust=0.0, veer=0.0, wander=0.0)


def ornstein_uhlenbeck(
    rng: np.random.Generator, count: int, step: float, time: float, sigma: float
) -> np.ndarray:
    """[count] of stationary noise whose memory fades as exp(-t/time), exact at any step."""
    kept = np.exp(-step / time)
    pushes = sigma * np.sqrt(1.0 - kept**2) * rng.standard_normal(count)
    pushes[:1] = sigma * rng.standard_normal()
    return np.array(list(accumulate(pushes, lambda now, push: kept * now + push)))


def blow(wind: Wind, duration: float, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """[K, 2] wind at `times` [s] as the vector to where it comes from, north and east [m/s].

    Drawn on a grid of its own, so that a finer integration meets the same gusts.
    """
    count = int(np.ceil(duration / GRID)) + 2
    grid = GRID * np.arange(count)
    share = np.minimum(grid / duration, 1.0)
    end = wind.speed if wind.speed_end is None else wind.speed_end
    mean = wind.speed + (end - wind.speed) * share
    gusts = ornstein_uhlenbeck(rng, count, GRID, wind.gust_time, wind.gust)
    speed = mean * np.maximum(1.0 + gusts, 0.05)  # a lull, and no wind out of the other side
    direction = (
        wind.direction
        + wind.turn * share
        + ornstein_uhlenbeck(rng, count, GRID, wind.gust_time, wind.veer)
        + ornstein_uhlenbeck(rng, count, GRID, 150.0, wind.wander)
    )
    vector = (speed * np.cos(direction), speed * np.sin(direction))
    return np.column_stack([np.interp(times, grid, part) for part in vector])
