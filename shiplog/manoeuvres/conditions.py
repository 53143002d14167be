"""In which conditions a manoeuvre was sailed, and why it is or is not of the standard.

IMO MSC.137(76), 4 and MSC/Circ.1053, 1.2 and 2.2: deep unrestricted water (depth above 4 T), wind
up to 5 Bft, sea state up to 4, full load and even keel, from a steady approach at 90 % or more of
the speed at 85 % of the engine's maximum output.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shiplog.manoeuvres.criteria import NEAR
from shiplog.manoeuvres.recognition import Found
from shiplog.nomenclature.numbers import figure
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.recording import Record

MOST_BEAUFORT = 5
DEEP = 4.0  # T
TEST_SPEED = 0.9  # of the speed at 85 % of the engine's output
STEADY_SPEED = 0.05  # share by which the speed may change in the approach
# Manoeuvres that the standards name: rudder and reversal in degrees.
ZIGZAGS = ((10.0, 10.0), (20.0, 20.0))
FULL_TURN = 35.0
CIRCLE = math.radians(360.0)
BEAUFORT = 0.836  # m/s: V = 0.836 B^1.5 (WMO)
NEVER_RECORDED = ("sea state", "loading and trim", "engine output")


def beaufort(wind: float) -> int:
    """Of a wind at 10 m, m/s: the number whose range it is in, B = (V/0.836)^(2/3) rounded."""
    return round((max(wind, 0.0) / BEAUFORT) ** (2.0 / 3.0))


@dataclass(frozen=True)
class Conditions:
    """SI, in the scale in which it was sailed.

    speed          of the approach, m/s
    wind           mean true wind, m/s, and where it comes from, rad from x₀; None without a sensor
    depth          m; None where the profile has none
    coverage       share of its seconds inside a run's training data; None without a run
    unknown        what a log cannot show
    """

    speed: float
    wind: float | None
    wind_from: float | None
    depth: float | None
    coverage: float | None
    unknown: tuple[str, ...]

    @property
    def json(self) -> dict:
        direction = None if self.wind_from is None else math.degrees(self.wind_from) % 360.0
        return {
            "speed": self.speed, "wind": self.wind, "wind_direction_deg": direction,
            "depth": self.depth, "coverage": self.coverage, "not_recorded": list(self.unknown),
        }  # fmt: skip


def of(found: Found, record: Record, profile: Profile, coverage: float | None = None) -> Conditions:
    speed = found.approach.speed if found.approach else found.track.at(
        found.track.speed, found.begin
    )  # fmt: skip
    wind = wind_from = None
    if profile.has_wind:
        rows = (record.time >= found.begin) & (record.time <= found.end)
        blowing = record.true_wind[rows]
        if len(blowing):
            north, east = blowing.mean(0)
            wind, wind_from = float(np.hypot(north, east)), math.atan2(east, north)
    depth = profile.site.depth_m
    unknown = [*NEVER_RECORDED]
    unknown += ["depth"] if depth is None or profile.ship.draught_m is None else []
    unknown += ["wind"] if wind is None else []
    return Conditions(speed, wind, wind_from, depth, coverage, tuple(unknown))


def why_not(
    found: Found, conditions: Conditions, profile: Profile, nominal: float, scale: float = 1.0
) -> tuple[str, ...]:
    """Everything known that keeps it from being the standard's; nothing where it is.

    nominal   speed that stands for that of 85 % of the output: the fastest approach of the voyages
    scale   λ of a model: its wind is the ship's divided by √λ
    """
    reasons = [found.part] if found.part else []
    degrees, heading = math.degrees(found.angle), math.degrees(found.heading)
    off = math.degrees(NEAR)
    if found.kind == "turn" and abs(degrees - FULL_TURN) > off:
        reasons.append(f"the rudder is at {degrees:.0f} deg; the standard's is at 35, or full")
    if found.kind == "zigzag" and not any(
        abs(degrees - a) <= off and abs(heading - b) <= 2.0 * off for a, b in ZIGZAGS
    ):
        reasons.append(f"it is a {degrees:.0f}/{heading:.0f}; the standard's are 10/10 and 20/20")
    reasons += _approach(found, nominal)
    if conditions.wind is not None:
        wind = conditions.wind * math.sqrt(scale)
        if (number := beaufort(wind)) > MOST_BEAUFORT:
            reasons.append(f"the wind is {figure(wind)} m/s, {number} Bft; up to 5 are allowed")
    draught = profile.ship.draught_m
    if conditions.depth is not None and draught and conditions.depth <= DEEP * draught:
        reasons.append(
            f"the water is {conditions.depth / draught:.1f} T deep; deep water is above 4 T"
        )
    return tuple(reasons)


def _approach(found: Found, nominal: float) -> list[str]:
    before = found.approach
    if before is None:
        return ["the record does not show its approach"]
    reasons = []
    if not before.steady and found.kind not in ("pull_out", "spiral"):
        turning = abs(before.yaw) * 180.0 / math.pi
        reasons.append(
            f"the approach is not steady: the heading changes by {turning:.0f} deg in a length, "
            f"with {math.degrees(before.rudder):.0f} deg of rudder"
        )
    if abs(before.gained) > STEADY_SPEED and found.kind not in ("pull_out", "spiral"):
        reasons.append(f"the speed changes by {before.gained:+.0%} in the approach")
    if before.speed < TEST_SPEED * nominal and found.kind not in ("pull_out", "spiral"):
        reasons.append(
            f"the approach is at {figure(before.speed)} m/s, less than 90 % of "
            f"{figure(nominal)} m/s"
        )
    return reasons
