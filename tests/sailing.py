"""Logs of ships whose path is known in closed form, for tests of ingest and all after it."""

from __future__ import annotations

import numpy as np

from shiplog.logs.conversion.write import Series, write_log
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store.store import Store

START = 1_700_000_000_000_000_000
RADIUS, SPEED = 20.0, 0.8  # m, m/s: a steady starboard turn
DATUM = (34.82, 135.52)

PROFILE = """
[ship]
name = "circle"
length_m = 3.0
[sensors.position]
kind = "local"
topic = "/position"
fields = ["x_m", "y_m"]
unit = "m"
lever_arm_m = [0.7, -0.2]
sigma = 0.01
[sensors.velocity]
kind = "sog_cog"
topic = "/velocity"
fields = ["sog_kn", "cog_deg"]
units = ["kn", "deg"]
lever_arm_m = [0.7, -0.2]
sigma = 0.01
[sensors.heading]
topic = "/gyro"
field = "heading_deg"
unit = "deg"
sigma = 0.05
[sensors.yaw_rate]
topic = "/gyro"
field = "rate_degpmin"
unit = "deg/min"
[sensors.wind]
topic = "/wind"
fields = ["speed_mps", "direction_deg"]
units = ["m/s", "deg"]
[[actuators]]
name = "rudder"
kind = "rudder"
topic = "/rudder"
field = "angle_deg"
unit = "deg"
sign = -1.0
limits = [-35.0, 35.0]
[[actuators]]
name = "propeller"
kind = "propeller"
topic = "/propeller"
field = "speed_rpm"
unit = "rpm"
"""


def profile(text: str = PROFILE) -> Profile:
    return profiles.parse(text, "circle.toml")


def circle(seconds: float, phase: float, rate: float = 10.0) -> dict[str, np.ndarray]:
    """Truth at midship: a circle to starboard, sampled at `rate` with a phase."""
    t = np.arange(phase, seconds, 1.0 / rate)
    r = SPEED / RADIUS
    heading = 3.0 + r * t  # passes ±π soon, so that every wrap is met
    return {
        "t": t, "heading": heading, "yaw_rate": np.full_like(t, r),
        "x0": RADIUS * np.sin(heading), "y0": -RADIUS * np.cos(heading),
        "rudder": np.radians(10.0) * np.sin(0.2 * t), "propeller": 5.0 + 0.1 * t,
    }  # fmt: skip


def stamps(t: np.ndarray) -> np.ndarray:
    return START + np.round(t * 1e9).astype(np.int64)


def series(seconds: float = 60.0) -> dict[str, Series]:
    """The circle through instruments of different phases, an antenna ahead and to port."""
    ahead, starboard = 0.7, -0.2
    p, v, g, w, d, n = (circle(seconds, phase) for phase in (0.0, 0.03, 0.0, 0.051, 0.02, 0.07))
    c, s = np.cos(p["heading"]), np.sin(p["heading"])
    position = {
        "x_m": p["x0"] + c * ahead - s * starboard, "y_m": p["y0"] + s * ahead + c * starboard,
    }  # fmt: skip
    u, sway = SPEED - v["yaw_rate"] * starboard, v["yaw_rate"] * ahead  # at the antenna
    course = v["heading"] + np.arctan2(sway, u)
    velocity = {
        "sog_kn": np.hypot(u, sway) * 3600 / 1852, "cog_deg": np.degrees(course) % 360.0,
    }  # fmt: skip
    gyro = {
        "heading_deg": np.degrees(g["heading"]) % 360.0,
        "rate_degpmin": np.degrees(g["yaw_rate"]) * 60.0,
    }
    wind = {"speed_mps": np.full_like(w["t"], 4.0), "direction_deg": (350.0 + 0.5 * w["t"]) % 360}
    return {
        "/position": Series("/position", "test.Position", stamps(p["t"]), position),
        "/velocity": Series("/velocity", "test.Velocity", stamps(v["t"]), velocity),
        "/gyro": Series("/gyro", "test.Gyro", stamps(g["t"]), gyro),
        "/wind": Series("/wind", "shiplog.Wind", stamps(w["t"]), wind),
        "/rudder": Series("/rudder", "test.Rudder", stamps(d["t"]),
                          {"angle_deg": -np.degrees(d["rudder"])}),
        "/propeller": Series("/propeller", "test.Propeller", stamps(n["t"]),
                             {"speed_rpm": n["propeller"] * 60.0}),
    }  # fmt: skip


def write(path, parts: dict[str, Series] | None = None):
    write_log(path, list((parts or series()).values()), ship="circle")
    return path


def store_of(tmp_path, names, seconds=130.0, same=()):
    """Voyages with noise of their own; those in `same` hold the very data of the first."""
    store = Store(tmp_path / "store")
    for number, name in enumerate(names):
        rng = np.random.default_rng(0 if name in same else number)
        parts = series(seconds)
        for one in parts.values():
            for column, values in one.columns.items():
                one.columns[column] = values + rng.normal(0, 1e-3, len(values))
        path = write(tmp_path / f"{name}.mcap", parts)
        store.add(ingest(path, profile()))
    return store
