"""Records in memory: the known ship's own voyages, and the project's MMG under her helm."""

from __future__ import annotations

import math
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from pipelines import known_ship
from shiplog import profile as profiles
from shiplog.models import mmg
from shiplog.record import Record
from shiplog.sensitivity import rate

PROFILE = profiles.load("esso-vectwin")
SHIP, PARTICULARS, _ = mmg.geometry_of(PROFILE)
MODEL = mmg.MMG(SHIP)
THETA = mmg.estimated(SHIP, PARTICULARS).values
NOISE = np.array([0.02, 0.01, 0.02, 0.01, math.radians(0.1), math.radians(0.1)])


def voyage(seconds: float = 300.0, seed: int = 5) -> known_ship.Voyage:
    return known_ship.sail(
        seconds, seed=seed, wind=known_ship.Wind(2.0, 0.7), effects=known_ship.Effects()
    )


def record(sailed: known_ship.Voyage, state: np.ndarray | None = None, seed: int = 1) -> Record:
    """A voyage at 10 Hz with instruments' noise; `state` [K, 6] instead of her own path."""
    rng = np.random.default_rng(seed)
    if state is None:
        state = np.stack(
            (sailed.x0, sailed.surge, sailed.y0, sailed.sway, sailed.heading, sailed.yaw_rate), -1
        )
    north = sailed.true_wind_speed * np.cos(sailed.true_wind_direction)
    east = sailed.true_wind_speed * np.sin(sailed.true_wind_direction)
    c, s = np.cos(state[:, 4]), np.sin(state[:, 4])
    wind = np.stack((c * north + s * east + state[:, 1], c * east - s * north + state[:, 3]), -1)
    count = len(state)
    starts = np.zeros(count, dtype=bool)
    starts[0] = True
    return Record(
        profile=PROFILE, names=("one",), voyage=np.zeros(count, dtype=int),
        time=0.1 * np.arange(count), share=(np.arange(count) + 0.5) / count, starts=starts,
        seen=np.ones(count, dtype=bool), state=state + NOISE * rng.standard_normal((count, 6)),
        actuator=controls(sailed), wind=wind,
    )  # fmt: skip


def controls(sailed: known_ship.Voyage) -> np.ndarray:
    return np.stack((sailed.rudder_port, sailed.rudder_starboard, sailed.propeller), -1)


def pushed(sailed: known_ship.Voyage, push: np.ndarray) -> np.ndarray:
    """States [K, 6] of the project's MMG, with her controls and wind, under `push` [K, 3]: forces
    in N and N m that no actuator makes. Explicit Euler at 0.1 s."""
    north = sailed.true_wind_speed * np.cos(sailed.true_wind_direction)
    east = sailed.true_wind_speed * np.sin(sailed.true_wind_direction)
    start = np.array([0.0, 0.1, 0.0, 0.0, 0.3, 0.0])
    return np.asarray(_sail(start, controls(sailed), np.stack((north, east), -1), push))


@partial(jax.jit)
def _sail(start, actuator, wind, push):
    p = dict(zip(MODEL.names, jnp.asarray(THETA), strict=True))

    def step(state, along):
        now, blowing, force = along
        slope = rate(MODEL, jnp.asarray(THETA), state, now, blowing)
        zero = jnp.zeros(())
        more = mmg.model.body.accelerations(p, SHIP, zero, zero, zero, force)
        slope = slope.at[jnp.array([1, 3, 5])].add(more)
        return state + 0.1 * slope, state

    return jax.lax.scan(step, start, (actuator, wind, push))[1]
