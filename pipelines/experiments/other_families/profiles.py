"""The ship.toml that a user of such a ship would write: what stands on its drawings and plates."""

from __future__ import annotations

import math
from typing import Any

import tomli_w

from pipelines.experiments.other_families.instruments import topic
from pipelines.experiments.other_families.ship import Actuator, Ship


def profile(ship: Ship) -> str:
    """TOML of the ship's profile. Masses and areas are rounded as a user has them."""
    body = ship.body
    particulars: dict[str, Any] = {
        "name": ship.name, "length_m": round(body.length, 2), "breadth_m": round(body.breadth, 2),
        "draught_m": round(body.draught, 3), "mass_kg": _figures(body.mass, 3),
        "x_g_m": round(body.gravity, 3),
    }  # fmt: skip
    if ship.winds:
        particulars["frontal_area_m2"] = _figures(ship.windage.frontal, 2)
        particulars["lateral_area_m2"] = _figures(ship.windage.lateral, 2)
    bank = [[-3.0 * ship.radius, ship.bank_east], [3.0 * ship.radius, ship.bank_east]]
    content: dict[str, Any] = {
        "ship": particulars, "sensors": _sensors(ship),
        "actuators": [_actuator(a) for a in ship.actuators],
        "site": {"banks": [[[round(c, 1) for c in point] for point in bank]]},
    }  # fmt: skip
    return tomli_w.dumps(content)


def _sensors(ship: Ship) -> dict[str, Any]:
    s, degree = ship.sensors, math.radians(1.0)
    lever = list(s.antenna)
    if s.position == "local":
        position: dict[str, Any] = {
            "kind": "local", "topic": "/gnss/local", "fields": ["x_m", "y_m"], "unit": "m"
        }  # fmt: skip
    else:
        position = {
            "kind": "geodetic", "topic": "/gnss/fix", "fields": ["latitude", "longitude"],
            "unit": "deg",
        }  # fmt: skip
    if s.velocity == "ned":
        velocity: dict[str, Any] = {
            "kind": "ned", "topic": "/gnss/earth_velocity", "fields": ["north_mps", "east_mps"],
            "unit": "m/s", "sigma": s.velocity_sigma,
        }  # fmt: skip
    else:
        velocity = {
            "kind": "sog_cog", "topic": "/gnss/velocity", "fields": ["sog_mps", "cog_deg"],
            "units": ["m/s", "deg"], "sigma": [s.velocity_sigma, 1.0],
        }  # fmt: skip
    found = {
        "position": {**position, "sigma": s.position_sigma, "lever_arm_m": lever},
        "velocity": {**velocity, "lever_arm_m": lever},
        "heading": {
            "topic": "/gyro", "field": "heading_deg", "unit": "deg",
            "sigma": round(s.heading_sigma / degree, 3),
        },
        "yaw_rate": {
            "topic": "/gyro", "field": "yaw_rate_degps", "unit": "deg/s",
            "sigma": round(s.rate_sigma / degree, 3),
        },
    }  # fmt: skip
    if ship.winds:
        found["wind"] = {
            "topic": "/wind/apparent", "fields": ["speed_mps", "direction_deg"],
            "units": ["m/s", "deg"], "sigma": [s.wind_sigma[0], round(s.wind_sigma[1] / degree, 1)],
        }  # fmt: skip
    return found


def _actuator(a: Actuator) -> dict[str, Any]:
    where, _, name = topic(a)
    entry: dict[str, Any] = {
        "name": a.name, "kind": a.kind, "topic": where, "field": name,
        "unit": "rps" if name == "speed_rps" else "deg", "position_m": list(a.position),
        **a.particulars,
    }  # fmt: skip
    if a.kind == "rudder":
        entry["limits"] = [round(math.degrees(a.low), 1), round(math.degrees(a.high), 1)]
    elif a.kind != "azimuth":
        entry["limits"] = [round(a.low, 2), round(a.high, 2)]
    if a.direction_deg:
        entry["direction_deg"] = a.direction_deg
    return entry


def _figures(value: float, count: int) -> float:
    return float(f"{value:.{count}g}")
