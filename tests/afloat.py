"""Records in memory: the known ship's own voyages, and the project's MMG under its helm."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np

from pipelines.experiments import simulated_ship
from shiplog.diagnosis.linear import linearisation, segments
from shiplog.diagnosis.linear.linear_segments import Linear, Wide
from shiplog.diagnosis.noise import residual_acceleration
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.models import mmg
from shiplog.models.extended import Extended
from shiplog.models.mmg import body
from shiplog.ship_profile import file as profiles
from shiplog.simulation.jax_rollouts import rate
from shiplog.voyages.rows.recording import Record

PROFILE = profiles.load("esso-vectwin")
SHIP, PARTICULARS, _ = mmg.geometry_of(PROFILE)
MODEL = mmg.MMG(SHIP)
THETA = mmg.estimated(SHIP, PARTICULARS).values
COEFFICIENTS = dict(zip(MODEL.names, THETA, strict=True))
NOISE = np.array([0.02, 0.01, 0.02, 0.01, math.radians(0.1), math.radians(0.1)])
WIDE = Wide(
    np.array([0.02, 0.01, 0.02, 0.01, 0.003, 0.002]),
    np.array([1.0, 0.3, 1.0, 0.3, 0.2, 0.1]),
    np.array([0.02, 0.02, 0.02]),
)
PROCESS_NOISE = (
    ProcessNoise(  # as learnt on an ordinary campaign: noise of 2 s averages, and its acceleration
        np.array([0.007, 0.0076, 0.0066, 0.0073, 0.0006, 0.0013]),
        np.array([7e-4, 7e-4, 5e-4]),
        4.0,
        WIDE.start,
    )
)


def voyage(seconds: float, seed: int = 5) -> simulated_ship.Voyage:
    return simulated_ship.sail(
        seconds, seed=seed, wind=simulated_ship.Wind(2.0, 0.7), effects=simulated_ship.Effects()
    )


def true_wind(sailed: simulated_ship.Voyage) -> np.ndarray:
    north = sailed.true_wind_speed * np.cos(sailed.true_wind_direction)
    east = sailed.true_wind_speed * np.sin(sailed.true_wind_direction)
    return np.stack((north, east), -1)


def controls(sailed: simulated_ship.Voyage) -> np.ndarray:
    return np.stack((sailed.rudder_port, sailed.rudder_starboard, sailed.propeller), -1)


def record(
    sailed: simulated_ship.Voyage, state: np.ndarray | None = None, noise: float = 1.0
) -> Record:
    """A voyage at 10 Hz with instruments' noise; `state` [K, 6] instead of its own path."""
    rng = np.random.default_rng(1)
    if state is None:
        state = np.stack(
            (sailed.x0, sailed.surge, sailed.y0, sailed.sway, sailed.heading, sailed.yaw_rate), -1
        )
    (north, east), c, s = true_wind(sailed).T, np.cos(state[:, 4]), np.sin(state[:, 4])
    wind = np.stack((c * north + s * east + state[:, 1], c * east - s * north + state[:, 3]), -1)
    count = len(state)
    starts = np.zeros(count, dtype=bool)
    starts[0] = True
    return Record(
        profile=PROFILE, names=("one",), voyage=np.zeros(count, dtype=int),
        time=0.1 * np.arange(count), share=(np.arange(count) + 0.5) / count, starts=starts,
        measured=np.ones(count, dtype=bool),
        state=state + noise * NOISE * rng.standard_normal((count, 6)),
        actuator=controls(sailed), wind=wind,
    )  # fmt: skip


def sailed_with(sailed: simulated_ship.Voyage, force: np.ndarray) -> np.ndarray:
    """States [K, 6] of the project's MMG, with its controls and wind, under `force` [K, 3]:
    N and N m that no actuator makes. Explicit Euler at 0.1 s."""
    start = jnp.array([0.0, 0.1, 0.0, 0.0, 0.3, 0.0])
    return np.asarray(_sail(start, controls(sailed), true_wind(sailed), force))


@jax.jit
def _sail(start, actuator, wind, acceleration):
    def step(state, along):
        now, blowing, force = along
        slope = rate(MODEL, jnp.asarray(THETA), state, now, blowing)
        still = jnp.zeros(())
        added = body.accelerations(COEFFICIENTS, SHIP, still, still, still, force)
        return state + 0.1 * slope.at[jnp.array([1, 3, 5])].add(added), state

    return jax.lax.scan(step, start, (actuator, wind, acceleration))[1]


def linear(observed: Record) -> Linear:
    """The record under the project's MMG as it is, covered to the end.

    `linearise.linear` without its columns by θ, which take twice as long to compile.
    """
    model = Extended(MODEL, (), MODEL, np.zeros(0), {})
    g = segments.grid(observed)
    cut = segments.cut(observed, residual_acceleration.covering(observed))
    path = linearisation.fit_path(model, THETA, cut, g, WIDE)
    y, z, _ = linearisation.simulated(model, THETA, cut, path, g)
    at = np.concatenate((np.zeros_like(path.start), path.acceleration.reshape(len(y), -1)), 1)
    e = cut.y - y + np.einsum("sbcz,sz->sbc", z, at)
    return Linear(cut, path, e, z, np.zeros((*e.shape, 0)))
