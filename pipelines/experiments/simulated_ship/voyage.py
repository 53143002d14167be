"""One voyage of the known ship: weather, operator and physics in, true columns at 10 Hz out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pipelines.experiments.simulated_ship import physics
from pipelines.experiments.simulated_ship.berthing import Berthing
from pipelines.experiments.simulated_ship.helm import Helm, Operator
from pipelines.experiments.simulated_ship.laws import Laws
from pipelines.experiments.simulated_ship.noise import process_noise
from pipelines.experiments.simulated_ship.ship import Effects, Ship
from pipelines.experiments.simulated_ship.weather import Wind, blow

PERIOD = 0.1  # s
WATCH = 1.0  # s, between two looks of the operator
PULSES = (0.375, 1.0)  # of the strongest, 1.5 to 4 N
PULSE_TIMES = (10.0, 40.0)  # s
QUIET = 60.0  # s, mean between two pulses

# start [s], length [s], force to starboard [N]
Pulse = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Voyage:
    """What really happened, [K] at 10 Hz, SI. No instrument has touched it."""

    ship: Ship
    effects: Effects
    duration: float  # s
    time: np.ndarray  # s, from 0
    x0: np.ndarray  # m, north of the datum
    surge: np.ndarray  # m/s over ground, at midship
    y0: np.ndarray  # m, east
    sway: np.ndarray
    heading: np.ndarray  # rad, free-running
    yaw_rate: np.ndarray  # rad/s
    rudder_port: np.ndarray  # rad, at the stock, what an encoder there reads
    rudder_starboard: np.ndarray
    propeller: np.ndarray  # rev/s
    true_wind_speed: np.ndarray  # m/s
    true_wind_direction: np.ndarray  # rad, from, clockwise from north
    wind_speed: np.ndarray  # m/s, apparent, at midship
    wind_angle: np.ndarray  # rad, apparent, from, clockwise from the bow, (-π, π]
    pulses: tuple[Pulse, ...] = ()  # of the thruster that nobody records


def sail(
    duration_s: float,
    *,
    seed: int,
    wind: Wind,
    ship: Ship | None = None,
    effects: Effects | None = None,
    laws: Laws | None = None,
    helm: Helm | None = None,
    start: tuple[float, ...] | None = None,
    campaign: tuple[float, float] = (0.0, 1.0),
    step: float = physics.STEP,
    acts: tuple[float, float] = (0.0, math.inf),
) -> Voyage:
    """Sail for `duration_s`, integrated at `step` and kept at 10 Hz.

    laws      which exponents and shares forces have; those of the sample logs unless given
    helm      who steers; a random `Operator` of this seed unless given, asked once a second
    start     x₀, u, y₀, v, ψ, r; near the middle and at rest unless given
    campaign  which share of a campaign this voyage is, for effects that grow along it
    acts      from when to when what is hidden acts on the ship [s]; instruments know no such time

    Weather and operator each draw from a stream of their own: the same seed meets the same gusts
    whatever is hidden.
    """
    ship, effects, laws = ship or Ship(), effects or Effects(), laws or Laws()
    weather_rng, helm_rng, start_rng, noise_rng, pulse_rng = (
        np.random.default_rng([seed, i]) for i in range(5)
    )
    if start is None:
        x0, y0, heading = start_rng.uniform((-8.0, -8.0, -np.pi), (8.0, 8.0, np.pi))
        start = (x0, 0.0, y0, 0.0, heading, 0.0)
    steer = helm or operator_of(effects, helm_rng)

    kept = round(PERIOD / step)
    rows = round(duration_s / PERIOD) * kept
    track = np.zeros((rows + 1, physics.STATES))
    track[0, :6] = start
    halves = 0.5 * step * np.arange(2 * rows + 1)
    air = blow(wind, duration_s, halves, weather_rng)
    pulses = draw_pulses(effects.side_thrust, duration_s, pulse_rng)
    push = unexplained(pulses, effects.turbulence, laws, duration_s, halves, noise_rng)
    numbers = physics.coefficients(ship, laws)
    hidden = physics.hidden(effects, campaign, duration_s)
    nothing = physics.hidden(Effects(), campaign, duration_s)
    watch = round(WATCH / step)
    for first in range(0, rows, watch):
        order = np.array(steer(first * step, track[first].copy()), float)
        steps = min(watch, rows - first)
        now = hidden if acts[0] <= first * step < acts[1] else nothing
        physics.advance(numbers, now, track, first, steps, step, order, air, push)

    seen, (from_north, from_east) = track[::kept], air[:: 2 * kept].T
    return _observed(ship, effects, duration_s, seen, from_north, from_east, pulses)


def operator_of(effects: Effects, rng: np.random.Generator) -> Helm:
    """Where the wall has fenders, one who calls there."""
    if "fender" not in effects.external:
        return Operator(rng)
    return Berthing(rng, lean=0.3 * effects.external["reach"])


def unexplained(
    pulses: tuple[Pulse, ...], turbulence: float, laws: Laws, duration: float, at: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:  # fmt: skip
    """Side thrust [N] and random accelerations [m/s², m/s², rad/s²] at the times `at`: [len, 4]."""
    push = np.zeros((len(at), 4))
    for begin, length, force in pulses:
        push[(at >= begin) & (at < begin + length), 0] = force
    if turbulence > 0.0:
        push[:, 1:] = turbulence * process_noise(laws.noise, duration, at, rng)
    return push


def _observed(
    ship: Ship, effects: Effects, duration: float, track: np.ndarray, from_north: np.ndarray,
    from_east: np.ndarray, pulses: tuple[Pulse, ...],
) -> Voyage:  # fmt: skip
    """The columns of a voyage: its states at 10 Hz, and the wind that the moving ship feels."""
    x0, surge, y0, sway, heading, yaw_rate, port, starboard, speed = track[:, :9].T.copy()
    cos, sin = np.cos(heading), np.sin(heading)
    ahead = from_north * cos + from_east * sin + surge
    aside = -from_north * sin + from_east * cos + sway
    return Voyage(
        ship=ship, effects=effects, duration=duration, time=PERIOD * np.arange(len(track)),
        x0=x0, surge=surge, y0=y0, sway=sway, heading=heading, yaw_rate=yaw_rate,
        rudder_port=port, rudder_starboard=starboard, propeller=speed,
        true_wind_speed=np.hypot(from_north, from_east),
        true_wind_direction=np.arctan2(from_east, from_north),
        wind_speed=np.hypot(ahead, aside), wind_angle=np.arctan2(aside, ahead), pulses=pulses,
    )  # fmt: skip


def draw_pulses(strongest: float, duration: float, rng: np.random.Generator) -> tuple[Pulse, ...]:
    """Either way, at any time, never two at once. The same times whatever their strength."""
    found: list[Pulse] = []
    begin = rng.exponential(QUIET)
    while strongest > 0.0 and begin < duration:
        length = rng.uniform(*PULSE_TIMES)
        force = strongest * rng.uniform(*PULSES) * rng.choice((-1.0, 1.0))
        found.append((round(begin, 1), round(length, 1), round(float(force), 4)))
        begin = found[-1][0] + length + 1.0 + rng.exponential(QUIET)
    return tuple(found)
