"""What an ArduPilot output drives, by the parameters SERVOn_* that the autopilot itself records.

Function numbers: ArduPilot, libraries/SRV_Channel/SRV_Channel.h. Outputs of other functions, as a
gripper's or a camera's, move no ship.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from shiplog.exceptions import listed
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding

log = logging.getLogger(__name__)

HALF_TRAVEL_US = 400.0  # what the unit `pwm` takes as full command
FUNCTIONS = {  # number: kind, name of the topic, ArduPilot's name
    21: ("rudder", "/rudder/rudder", "Rudder"),
    26: ("rudder", "/rudder/steering", "GroundSteering"),
    70: ("propeller", "/propeller/throttle", "Throttle"),
    73: ("thruster", "/thruster/left", "ThrottleLeft"),
    74: ("thruster", "/thruster/right", "ThrottleRight"),
    **{32 + n: ("thruster", f"/thruster/motor_{n}", f"Motor{n}") for n in range(1, 9)},
    **{73 + n: ("thruster", f"/thruster/motor_{n}", f"Motor{n}") for n in range(9, 13)},
}
AHEAD = (70, 73, 74)  # functions that push along the ship
DEFAULTS = {"MIN": 1100.0, "MAX": 1900.0, "TRIM": 1500.0, "REVERSED": 0.0}
SCHEMA, FIELD = "shiplog.ServoPulse", "pulse_us"
MOVES_US = 1.0  # an output that never varies by more is of nothing that moved


@dataclass(frozen=True, slots=True)
class Output:
    """An output of the autopilot: its number from 1 on, and pulses [n] µs, 0 where it is off."""

    number: int
    pulses: np.ndarray


def topics(
    outputs: list[Output], time: np.ndarray, logged: np.ndarray, parameters: Mapping[str, float]
) -> tuple[list[Series], list[str]]:
    """The actuators among the outputs, and the functions of the others.

    time, logged  [n] ns of every output's pulses
    """
    series: list[Series] = []
    others: list[str] = []
    taken: Counter[str] = Counter()
    stated = any(name.startswith("SERVO") and name.endswith("_FUNCTION") for name in parameters)
    for one in outputs:
        pulses = np.where(one.pulses > 0, one.pulses, np.nan).astype(float)
        known = np.isfinite(pulses)
        if not known.any():
            continue
        number = int(parameters.get(f"SERVO{one.number}_FUNCTION", 0))
        if stated and number not in FUNCTIONS:
            if number:
                others.append(f"SERVO{one.number}_FUNCTION {number}")
            continue
        if not stated and np.ptp(pulses[known]) < MOVES_US:
            continue
        topic, metadata = _described(one.number, number, parameters, stated)
        taken[topic] += 1
        topic = topic if taken[topic] == 1 else f"{topic}_{taken[topic]}"
        series.append(Series(topic, SCHEMA, time, {FIELD: pulses}, logged, metadata=metadata))
    return series, others


def unused(others: list[str], name: str, driven: bool) -> list[Finding]:
    """What there is to say of outputs that have other functions: a finding where none drives."""
    if not others:
        return []
    if driven:
        log.info("%s: outputs that move no ship are not used: %s", name, listed(others))
        return []
    sentence = (
        f"No output has a function that moves a ship: {listed(others)}. Outputs that pass the "
        "pilot's sticks through have none; give them the function of what they drive."
    )
    return [Finding("not_available", "actuators", sentence)]


def _described(
    channel: int, number: int, parameters: Mapping[str, float], stated: bool
) -> tuple[str, dict[str, str]]:
    """Topic and metadata of an output: sign makes full travel from the neutral pulse 1."""
    if not stated:
        why = f"output {channel}: the log has no SERVO{channel}_FUNCTION"
        doubt = f"CHECK: what output {channel} drives, and its kind; no SERVO{channel}_FUNCTION"
        return f"/servo/output_{channel}", {
            "actuator": "thruster", "unit": "pwm", "offset": "1500", "why": why, "doubt": doubt,
        }  # fmt: skip
    kind, topic, name = FUNCTIONS[number]
    low, high, trim, turned = (
        float(parameters.get(f"SERVO{channel}_{key}", value)) for key, value in DEFAULTS.items()
    )
    if not low < high or not low <= trim <= high:
        low, high, trim = DEFAULTS["MIN"], DEFAULTS["MAX"], DEFAULTS["TRIM"]
    sign = HALF_TRAVEL_US / max(high - trim, trim - low) * (-1.0 if turned else 1.0)
    metadata = {
        "actuator": kind, "unit": "pwm", "offset": f"{trim:g}", "limits": f"{low:g},{high:g}",
        "sign": f"{sign:.6g}", "why": f"SERVO{channel}_FUNCTION is {number}, {name}",
    }  # fmt: skip
    if kind == "thruster" and number in AHEAD:
        metadata["direction_deg"] = "0"
    return topic, metadata
