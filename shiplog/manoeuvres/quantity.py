"""What is measured of a manoeuvre: the contract's names, their units, and how they scale."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Kind:
    """unit    of the value: L (lengths of the ship), deg, deg/s, s, or 1
    words   as a sheet has it
    froude  the power of the scale by which it grows from a model to a ship: times 1/2, rates -1/2
    """

    unit: str
    words: str
    froude: float = 0.0


QUANTITIES: dict[str, Kind] = {
    "advance": Kind("L", "advance"),
    "transfer": Kind("L", "transfer"),
    "tactical_diameter": Kind("L", "tactical diameter"),
    "steady_diameter": Kind("L", "steady turning diameter"),
    "drift_angle": Kind("deg", "drift angle in the steady turn"),
    "speed_loss": Kind("1", "loss of speed in the turn"),
    "initial_turning": Kind("L", "initial turning"),
    "first_overshoot": Kind("deg", "first overshoot"),
    "second_overshoot": Kind("deg", "second overshoot"),
    "third_overshoot": Kind("deg", "third overshoot"),
    "check_time": Kind("s", "time to check yaw", 0.5),
    "period": Kind("s", "period", 0.5),
    "track_reach": Kind("L", "track reach"),
    "head_reach": Kind("L", "head reach"),
    "lateral_deviation": Kind("L", "lateral deviation"),
    "residual_yaw_rate": Kind("deg/s", "residual yaw rate", -0.5),
    "loop_width": Kind("deg", "width of the spiral's loop"),
}


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value with its 90 % interval; `note` says what limits it, in words."""

    value: float
    low: float
    high: float
    note: str = ""

    def times(self, factor: float) -> Estimate:
        low, high = sorted((self.low * factor, self.high * factor))
        return Estimate(self.value * factor, low, high, self.note)

    @property
    def json(self) -> dict:
        found: dict = {"value": self.value, "low": self.low, "high": self.high}
        return found | ({"note": self.note} if self.note else {})
