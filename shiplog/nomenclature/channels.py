"""The nomenclature: name, symbol, unit and order of every canonical channel (SI, radians).

North-east-down earth axes x₀, y₀; body axes x ahead, y to starboard. The state order is the
paper's x = (x₀, u, y₀, v_m, ψ, r); the error weights are its w, with yaw rate in deg/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntFlag

DEGREE = math.pi / 180.0


@dataclass(frozen=True, slots=True)
class Channel:
    """One canonical column: what it is called in tables, in formulas and on axes."""

    name: str
    symbol: str
    unit: str
    circular: bool = False

    @property
    def label(self) -> str:
        """Axis title: degrees where a person reads angles."""
        return f"{self.name.replace('_', ' ')} {self.symbol} [{self.display_unit}]"

    @property
    def display_unit(self) -> str:
        """The unit on the axis."""
        return {"rad": "deg", "rad/s": "deg/s"}.get(self.unit, self.unit)

    @property
    def to_display(self) -> float:
        """Factor from SI to the unit on the axis."""
        return 180.0 / math.pi if self.unit in ("rad", "rad/s") else 1.0


X0 = Channel("x0", "x₀", "m")
Y0 = Channel("y0", "y₀", "m")
HEADING = Channel("heading", "ψ", "rad", circular=True)
SURGE = Channel("surge", "u", "m/s")
SWAY = Channel("sway", "v_m", "m/s")
YAW_RATE = Channel("yaw_rate", "r", "rad/s")
WIND_SPEED = Channel("wind_speed", "U_A", "m/s")
WIND_ANGLE = Channel("wind_angle", "γ_A", "rad", circular=True)

STATE = (X0, SURGE, Y0, SWAY, HEADING, YAW_RATE)  # the paper's x ∈ R⁶, and every [..., 6]
VELOCITY = (SURGE, SWAY, YAW_RATE)  # the paper's ν ∈ R³, and every [..., 3]
VELOCITY_IN_STATE = (1, 3, 5)
WIND = (WIND_SPEED, WIND_ANGLE)  # the paper's ω ∈ R²

WINDOW = 100  # s, the paper's I at 1 Hz, unless a run has another
LEAST_WINDOW = 6  # s: a hybrid differences velocities over 5 s, and the baseline over two
AUTO_WINDOW = "auto"  # instead of a length: as long as the ship needs
WEIGHTS = (0.0, 100.0, 0.0, 100.0, 0.0, 10.0)  # w of Eq. 5, yaw rate in deg/s
JITTER = (0.0, 0.01, 0.0, 0.01, 0.0, math.radians(0.1))  # √diag Σ_x of Table 5, SI
VELOCITY_WEIGHTS = (100.0, 100.0, 10.0 * 180.0 / math.pi)  # the same w, for ν in SI


class Quality(IntFlag):
    """Marks of one 10 Hz row. Nothing is repaired: what is UNUSABLE stays out of 1 Hz averages."""

    GOOD = 0
    GAP = 1  # no sample within the tolerance: the value is null
    BLANK = 2  # a message came, but its value is null, NaN, infinite or beyond 1e12
    LIMITS = 4  # an actuator beyond the limits in the profile
    SPIKE = 8  # one sample far off both neighbours, which agree with each other
    HELD = 16  # the instrument repeats itself although the ship moves
    FROZEN = 32  # held for longer than 3 s: a stale value, not data
    JUMP = 64  # the first row after a step in time or state without the other


UNUSABLE = Quality.GAP | Quality.BLANK | Quality.LIMITS | Quality.SPIKE | Quality.FROZEN
