"""One voyage: weather, operator and physics in, true columns at 10 Hz out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from pipelines.experiments.other_families import motion, roll
from pipelines.experiments.other_families.berthing import Berthing
from pipelines.experiments.other_families.disturbance import Wind, blow, process_noise
from pipelines.experiments.other_families.effects import Effects
from pipelines.experiments.other_families.gear import gear_of
from pipelines.experiments.other_families.lines import external
from pipelines.experiments.other_families.operators import MIDDLE, Helm, Operator
from pipelines.experiments.other_families.ship import Ship

PERIOD = 0.1  # s, of the log
WATCH = 1.0  # s, between two looks of the operator
PULSES = (0.4, 1.0)  # of the strongest
PULSE_LENGTHS, QUIET = (1.0, 4.0), 6.0  # L/U: how long a pulse lasts; mean between two

RUDDER_COEFFICIENTS = (  # of the families with rudders
    "y_d", "y_ddd", "n_d", "n_ddd", "x_dd", "rudder_lift", "rudder_drag", "area",
)  # fmt: skip

Pulse = tuple[float, float, float]  # start [s], length [s], force to starboard [N]


@dataclass(frozen=True, slots=True)
class Voyage:
    """What really happened, [K] at 10 Hz, SI. No instrument has touched it."""

    ship: Ship
    effects: Effects
    duration: float
    time: np.ndarray
    x0: np.ndarray
    y0: np.ndarray
    heading: np.ndarray  # rad, free-running
    surge: np.ndarray  # over ground
    sway: np.ndarray
    yaw_rate: np.ndarray
    actuators: np.ndarray  # [K, A]
    from_ahead: np.ndarray  # m/s, where the apparent wind comes from, at midship
    from_starboard: np.ndarray
    pulses: tuple[Pulse, ...] = ()
    heel: np.ndarray = field(default_factory=lambda: np.zeros(0))  # rad, of a ship that rolls


def sail(
    ship: Ship, duration: float, *, seed: int, wind: Wind, effects: Effects | None = None,
    campaign: tuple[float, float] = (0.0, 1.0), helm: Helm | None = None,
    start: tuple[float, ...] | None = None, quiet: bool = False,
    acts: tuple[float, float] = (0.0, math.inf),
) -> Voyage:  # fmt: skip
    """Sail for `duration` s.

    campaign  which share of a campaign this voyage is, for effects that grow along it
    helm      a random `Operator` of this seed unless given
    start     x₀, y₀, ψ, u, v, r; at rest near the middle unless given
    quiet     no process noise
    acts      from when to when what is hidden acts on the ship [s]; instruments know no such time,
              nor does a ship with equations of motion of its own

    Weather, noise, pulses and operator draw from streams of their own: the same seed meets the
    same gusts whatever is hidden.
    """
    effects = effects or Effects()
    weather, noise, pulse, place, hand = (np.random.default_rng([seed, i]) for i in range(5))
    if start is None:
        off = place.uniform(-0.12, 0.12, 2) * ship.radius
        start = (off[0], off[1] + MIDDLE * ship.radius, place.uniform(-np.pi, np.pi), 0, 0, 0)
    steer = helm or operator_of(ship, effects, hand)
    pulses = draw_pulses(ship, effects.side_thrust, duration, pulse)

    public = ship.own_motion
    step = ship.step
    rows = math.ceil(duration / step - 1e-9)
    times = step * np.arange(rows + 1) if public else 0.5 * step * np.arange(2 * rows + 1)
    push = np.zeros((len(times), 4))
    if not quiet:
        push[:, 1:] = process_noise(noise, ship.noise, times, effects.louder)
    for begin, length, force in pulses:
        push[(times >= begin) & (times < begin + length), 0] = force
    air = np.zeros((len(times), 2))
    if ship.winds:
        air = blow(wind, duration, times, weather)

    if public:
        track = public(
            ship, effects, np.array(start, float), duration, steer, push[:, 1:], push[:, 0],
            campaign,
        )  # fmt: skip
    else:
        track = _integrate(ship, effects, start, rows, steer, air, push, campaign, duration, acts)
    time = PERIOD * np.arange(round(duration / PERIOD) + 1)
    seen = _at(track, step, time)
    blowing = air if public else air[::2]
    north, east = (np.interp(time, step * np.arange(rows + 1), blowing[:, i]) for i in (0, 1))
    x, y, psi, u, v, r = seen[:, :6].T.copy()
    count = len(ship.actuators)
    cos, sin = np.cos(psi), np.sin(psi)
    return Voyage(
        ship, effects, duration, time, x, y, psi, u, v, r, seen[:, 6 : 6 + count].copy(),
        north * cos + east * sin + u, east * cos - north * sin + v, pulses,
        seen[:, -2].copy() if ship.roll else np.zeros(0),
    )  # fmt: skip


def operator_of(ship: Ship, effects: Effects, rng: np.random.Generator) -> Helm:
    """Where there is a wall to lean on, one who calls there."""
    if effects.contact is None:
        return Operator(ship, rng)
    return Berthing(ship, rng, lean=0.25 * effects.contact.reach)


def _at(track: np.ndarray, step: float, time: np.ndarray) -> np.ndarray:
    """The track at the log's times: its own rows, or smoothly between them."""
    every = round(PERIOD / step)
    if every >= 1 and abs(every * step - PERIOD) < 1e-9:
        return track[::every][: len(time)]
    grid = step * np.arange(len(track))
    rate = np.gradient(track, step, axis=0)
    seen = CubicHermiteSpline(grid, track, rate)(time)
    for column in range(6, track.shape[1]):  # actuators have corners
        seen[:, column] = np.interp(time, grid, track[:, column])
    return seen


def _integrate(
    ship: Ship, e: Effects, start, rows, steer, air, push, campaign, duration, acts
):  # fmt: skip
    count, step = len(ship.actuators), ship.step
    track = np.zeros((rows + 1, motion.STATE + 2 * count + (roll.STATES if ship.roll else 0)))
    track[0, :6] = start
    drive = drives_of(ship)
    acting = hidden_of(ship, e, campaign, duration), with_rudders(ship, e.rudder_force)
    nothing = hidden_of(ship, Effects(), campaign, duration), with_rudders(ship, 0.0)
    watch = round(WATCH / step)
    for first in range(0, rows, watch):
        order = np.asarray(steer(first * step, track[first].copy()), float)
        steps = min(watch, rows - first)
        h, c = acting if acts[0] <= first * step < acts[1] else nothing
        if ship.roll:
            roll.advance(
                ship.forces, c, ship.body, ship.roll, ship.windage, drive, h, track, first, steps,
                step, order, air, push,
            )  # fmt: skip
            continue
        motion.advance(
            ship.forces, c, ship.body, ship.windage, drive, h, track, first, steps, step, order,
            air, push,
        )  # fmt: skip
    return track


def with_rudders(ship: Ship, share: float):
    """The ship's coefficients with `share` added to every rudder force."""
    scaled = [name for name in RUDDER_COEFFICIENTS if name in ship.c._fields]
    return ship.c._replace(**{name: getattr(ship.c, name) * (1.0 + share) for name in scaled})


def drives_of(ship: Ship) -> motion.Drive:
    def column(name: str, kind: type) -> np.ndarray:
        return np.array([getattr(a, name) for a in ship.actuators], kind)

    return motion.Drive(
        column("time", float), column("rate", float), column("low", float), column("high", float),
        column("steers", bool), np.array([a.kind == "azimuth" for a in ship.actuators]),
        np.array([-1 if a.drive is None else a.drive for a in ship.actuators]),
    )  # fmt: skip


def hidden_of(
    ship: Ship, e: Effects, campaign: tuple[float, float], duration: float
) -> motion.Hidden:
    """The force side of the effects. `campaign`: this voyage's start and end as shares of it."""
    offset = np.zeros(len(ship.actuators))
    for i in ship.steering:
        offset[i] = e.rudder_offset[0 if ship.actuators[i].position[1] < 0.0 else 1]
    gain = np.full(len(ship.drives), 1.0 - e.thrust_loss)
    if e.unit >= 0:
        gain[e.unit] *= 1.0 - e.unit_loss
    along = (campaign[1] - campaign[0]) / duration
    return motion.Hidden(
        current_north=e.current_north, current_east=e.current_east,
        wind=tuple(1.0 + share for share in e.wind), tether=e.tether, tether_north=e.tether_north,
        tether_east=e.tether_east, tether_slack=0.5 * ship.length, tow_north=e.tow_north,
        tow_east=e.tow_east, tow_start=campaign[0], tow_slope=along, fouling=e.fouling,
        cross_flow=e.cross_flow_drag, payload=e.payload, payload_ahead=e.payload_ahead,
        aside=e.aside, keel=e.keel, slope_half=e.slope_half, slope_north=e.slope_north,
        slope_east=e.slope_east, slope_towards=e.slope_towards, bank=e.bank,
        bank_reach=e.bank_reach, bank_east=ship.bank_east, lag=e.rudder_lag, delay=e.rudder_delay,
        limit=e.rudder_limit, offset=offset, gain=gain, drift_start=e.thrust_drift * campaign[0],
        drift_slope=e.thrust_drift * along, couple=e.couple, couple_from=e.couple_from,
        couple_to=e.couple_to, device_at=e.device_at,
        gear=gear_of(len(ship.actuators), e.gear),
        external=external(e.line, e.slow_tow, e.contact, ship.bank_east),
        share_start=campaign[0], share_slope=along,
    )  # fmt: skip


def draw_pulses(
    ship: Ship, strongest: float, duration: float, rng: np.random.Generator
) -> tuple[Pulse, ...]:
    """Either way, never two at once; the same times whatever their strength."""
    unit = min(ship.time_unit, 40.0)
    found: list[Pulse] = []
    begin = rng.exponential(QUIET * unit)
    while strongest > 0.0 and begin < duration:
        length = rng.uniform(*PULSE_LENGTHS) * unit
        force = strongest * rng.uniform(*PULSES) * rng.choice((-1.0, 1.0))
        found.append((round(begin, 1), round(length, 1), round(float(force), 4)))
        begin = found[-1][0] + length + rng.exponential(QUIET * unit)
    return tuple(found)
