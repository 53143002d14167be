"""What a ship is to the rest of the package, whatever its family. SI units.

Axes: x₀ north, y₀ east, heading ψ clockwise; body x ahead, y to starboard, origin at midship. A
rudder angle is positive where it turns the bow to starboard, an azimuth angle counts from ahead
towards starboard, a thrust is positive ahead (a tunnel thruster's to starboard).
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

WATER = 1025.0  # kg/m³

# Rigid body and added mass about midship. `m_yr` couples sway and yaw (-Y_ṙ), `added` is the share
# of the added mass's Coriolis terms that the family's equations have, `munk` that of the Munk
# moment; a family whose hull polynomial already contains them has zero.
Body = namedtuple("Body", "mass gravity inertia m_x m_y m_yr j_z added munk length breadth draught")

# Blendermann (1994): areas [m²], drag ahead and athwart, cross-force parameter δ, lever [m]
Windage = namedtuple("Windage", "frontal lateral drag_ahead drag_athwart delta lever length")
NO_WINDAGE = Windage(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class Actuator:
    """One recorded actuator value.

    kind       rudder, azimuth, propeller or thruster, as in a profile
    low, high  limits [rad or rev/s]
    time       s, first order between order and record
    rate       largest rate [rad/s or rev/s²]
    drive      number of the unit whose thrust it sets; None for what only steers
    """

    name: str
    kind: str
    low: float
    high: float
    position: tuple[float, float]  # m ahead and to starboard of midship
    time: float
    rate: float
    drive: int | None = None
    direction_deg: float = 0.0
    particulars: Mapping[str, float] = field(default_factory=dict)  # further keys of the profile

    @property
    def steers(self) -> bool:
        return self.kind in ("rudder", "azimuth")


@dataclass(frozen=True, slots=True)
class Noise:
    """Process noise of one ship: never an Ornstein-Uhlenbeck process.

    kind    "sea": sines with a Pierson-Moskowitz spectrum; "bursts": a second-order process whose
            intensity comes and goes
    sigma   standard deviations of the accelerations [m/s², m/s², rad/s²]
    period  s, of the spectrum's peak
    """

    kind: str
    sigma: tuple[float, float, float]
    period: float
    damping: float  # of the second-order process
    burst: float  # standard deviation of the logarithm of its intensity


@dataclass(frozen=True, slots=True)
class Sensors:
    """How this ship measures; what a user writes into the profile."""

    position: str  # geodetic or local
    velocity: str  # sog_cog or ned
    antenna: tuple[float, float]  # m, as the profile has it
    position_sigma: float  # m
    velocity_sigma: float  # m/s
    heading_sigma: float  # rad
    rate_sigma: float  # rad/s
    wind_sigma: tuple[float, float]  # m/s, rad
    slow: float  # share of the noise's variance that lasts for minutes


# surge, turn, side in [-1, 1] → orders [A], SI
Mixer = Callable[[float, float, float], np.ndarray]


@dataclass(frozen=True, slots=True)
class Ship:
    """One ship of a family.

    speed     m/s, typical of its harbour manoeuvres; with the length it sets all sizes
    radius    m, of the basin
    forces    compiled: forces(c, u, v, r, acting, gain, grow, side_force, cross, out); see `motion`
    c         its coefficients, a named tuple
    """

    family: str
    name: str
    body: Body
    speed: float
    radius: float
    step: float  # s, of the integration
    actuators: tuple[Actuator, ...]
    mixer: Mixer
    noise: Noise
    sensors: Sensors
    forces: Any = None
    c: Any = None
    windage: Windage = NO_WINDAGE
    reverses: bool = True
    crabs: bool = False
    spins: bool = False
    cross_flow: bool = False  # has a drag that grows with the cross flow
    own_motion: Callable[..., Any] | None = None  # a family that integrates by itself
    roll: Any = None  # `roll.Roll` of a ship that heels; its forces have φ, p and K

    @property
    def length(self) -> float:
        return self.body.length

    @property
    def time_unit(self) -> float:
        """s, in which the ship goes its own length."""
        return self.length / self.speed

    @property
    def force_unit(self) -> float:
        """N: m U²/L."""
        return self.body.mass * self.speed**2 / self.length

    @property
    def winds(self) -> bool:
        return self.windage.lateral > 0.0

    @property
    def drives(self) -> tuple[str, ...]:
        """Names of what sets each unit's thrust, in the order of the units."""
        found = {a.drive: a.name for a in self.actuators if a.drive is not None}
        return tuple(found[i] for i in sorted(found))

    @property
    def steering(self) -> tuple[int, ...]:
        return tuple(i for i, a in enumerate(self.actuators) if a.steers)

    @property
    def rudders(self) -> tuple[int, ...]:
        return tuple(i for i, a in enumerate(self.actuators) if a.kind == "rudder")

    @property
    def bank_east(self) -> float:
        """m; a charted vertical bank stands along this line, well within the basin's circle."""
        return 0.6 * self.radius


def stream(seed: int, purpose: str) -> np.random.Generator:
    """One stream a purpose: another draw here must not change the draws there."""
    return np.random.default_rng([seed, *b"other families ", *purpose.encode()])


def about(rng: np.random.Generator, value: float, spread: float = 0.15) -> float:
    """A coefficient within ± `spread` of the published one."""
    return float(value * rng.uniform(1.0 - spread, 1.0 + spread))


def draw_noise(rng: np.random.Generator, length: float, speed: float) -> Noise:
    """Of 0.1 to 0.5 % of U²/L: what swell, gusts and eddies leave unexplained on a calm day."""
    share = rng.uniform(0.001, 0.005)
    unit = speed**2 / length
    yaw = rng.uniform(0.4, 1.2) * share * unit / (0.5 * length)
    return Noise(
        kind=str(rng.choice(("sea", "bursts"))),
        sigma=(share * unit, rng.uniform(0.6, 1.4) * share * unit, yaw),
        period=length / speed * math.exp(rng.uniform(math.log(0.5), math.log(5.0))),
        damping=rng.uniform(0.15, 0.5),
        burst=rng.uniform(0.4, 0.9),
    )


def draw_sensors(rng: np.random.Generator, length: float) -> Sensors:
    """Survey-grade on a boat, a bridge's usual equipment on a ship."""
    large = min(max(math.log10(length / 2.0) / 2.0, 0.0), 1.0)  # 0 for 2 m, 1 for 200 m
    degree = math.radians(1.0)
    return Sensors(
        position=str(rng.choice(("geodetic", "local"))),
        velocity=str(rng.choice(("sog_cog", "ned"))),
        antenna=(round(rng.uniform(-0.2, 0.3) * length, 2), 0.0),
        position_sigma=round(rng.uniform(0.015, 0.03) * (1.0 + 2.0 * large), 3),
        velocity_sigma=round(rng.uniform(0.01, 0.025), 3),
        heading_sigma=round(rng.uniform(0.06, 0.25) * (1.0 - 0.65 * large), 3) * degree,
        rate_sigma=round(rng.uniform(0.05, 0.15) * (1.0 - 0.8 * large), 3) * degree,
        wind_sigma=(round(rng.uniform(0.1, 0.3), 2), round(rng.uniform(1.5, 3.0), 1) * degree),
        slow=rng.uniform(0.1, 0.5),
    )
