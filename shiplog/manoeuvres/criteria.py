"""IMO's standards for ship manoeuvrability, MSC.137(76) of 2002, as functions of L and V.

They apply to ships with rudders and conventional screws of 100 m in length and over, and to
chemical tankers and gas carriers of any length, at full load, even keel, in deep unrestricted
water and calm, from a steady approach at the test speed: at least 90 % of the speed at 85 % of the
engine's maximum output. L is between perpendiculars in m, V in m/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

LEAST_LENGTH = 100.0  # m; chemical tankers and gas carriers of any length
ADVANCE, TACTICAL_DIAMETER = 4.5, 5.0  # L; 5.3.1
INITIAL_TURNING = 2.5  # L, by which 10 deg of rudder have turned the heading by 10 deg; 5.3.2
TWENTY = 25.0  # deg, first overshoot of 20/20; 5.3.3.3
TRACK_REACH, TRACK_REACH_MOST = 15.0, 20.0  # L; the Administration may go to 20; 5.3.4
SHORT, LONG = 10.0, 30.0  # s of L/V
FULL_RUDDER = math.radians(35.0)  # or the maximum that is permissible at the test speed
NEAR = math.radians(1.0)  # how far off the standard's angles an order may be
SHIPS = (
    f"ships of {LEAST_LENGTH:.0f} m and over, and chemical tankers and gas carriers of any length"
)


def first_overshoot(length_time: float) -> float:
    """Of a 10/10 zigzag, deg; L/V in s."""
    if length_time < SHORT:
        return 10.0
    return 20.0 if length_time >= LONG else 5.0 + 0.5 * length_time


def second_overshoot(length_time: float) -> float:
    """Of a 10/10 zigzag, deg; L/V in s."""
    if length_time < SHORT:
        return 25.0
    return 40.0 if length_time >= LONG else 17.5 + 0.75 * length_time


@dataclass(frozen=True)
class Limit:
    """value    in the quantity's unit
    clause   of MSC.137(76)
    applies  whether it is meant for this ship and this manoeuvre
    why_not  in words; empty where it applies
    """

    value: float
    clause: str
    applies: bool
    why_not: str = ""

    @property
    def json(self) -> dict:
        return {"value": self.value, "clause": self.clause}


def limit(
    quantity: str,
    kind: str,
    angle: float,
    heading: float,
    length: float,
    speed: float,
    astern: bool = True,
) -> Limit | None:
    """Of a quantity of a manoeuvre; None where the standards have none.

    angle, heading   of the rudder and, in a zigzag, of the reversal [rad]; positive
    length, speed    L and V of the ship in full scale
    astern           whether a stop was with the propeller astern
    """
    ten = abs(angle - math.radians(10.0)) <= NEAR and abs(heading - math.radians(10.0)) <= 2 * NEAR
    twenty = (
        abs(angle - math.radians(20.0)) <= NEAR and abs(heading - math.radians(20.0)) <= 2 * NEAR
    )
    full = abs(angle - FULL_RUDDER) <= NEAR
    length_time = length / speed if speed > 0.0 else math.inf
    found: tuple[float, str, bool, str] | None = None
    if kind == "turn" and quantity in ("advance", "tactical_diameter"):
        value = ADVANCE if quantity == "advance" else TACTICAL_DIAMETER
        why = f"the limit is for 35 deg of rudder, not {math.degrees(angle):.0f}"
        found = (value, "5.3.1", full, why)
    elif kind == "zigzag" and quantity == "initial_turning":
        found = (INITIAL_TURNING, "5.3.2", True, "")
    elif kind == "zigzag" and quantity in ("first_overshoot", "second_overshoot"):
        if ten and quantity == "first_overshoot":
            found = (first_overshoot(length_time), "5.3.3.1", True, "")
        elif ten:
            found = (second_overshoot(length_time), "5.3.3.2", True, "")
        elif twenty and quantity == "first_overshoot":
            found = (TWENTY, "5.3.3.3", True, "")
    elif kind == "stop" and quantity == "track_reach":
        found = (TRACK_REACH, "5.3.4", astern, "the limit is for full astern")
    if found is None:
        return None
    value, clause, meant, why = found
    if length < LEAST_LENGTH:
        return Limit(value, clause, False, f"the standards are for {SHIPS}; L is {length:.4g} m")
    return Limit(value, clause, meant, "" if meant else why)
