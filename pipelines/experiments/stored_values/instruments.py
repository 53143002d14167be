"""What instruments show of a motion: rate, noise, resolution, and each one's own time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipelines.experiments.stored_values.motion import Motion, degrees


@dataclass(frozen=True)
class Instruments:
    """One set. Standard deviations in the unit of each channel as it is recorded."""

    name: str
    rates: tuple[float, ...]  # Hz, one is drawn
    position: float  # m
    speed: float  # m/s
    course: float  # deg, at 3 m/s; more below
    heading: float  # deg
    yaw_rate: float | None  # deg/s; None: there is no gyro
    steps: dict[str, float] = field(default_factory=dict)  # resolution, column by column


SETS = {
    one.name: one
    for one in (
        Instruments("fine", (5.0, 10.0, 20.0, 50.0), 0.015, 0.01, 0.2, 0.05, 0.03),
        Instruments("usual", (1.0, 2.0, 5.0, 10.0), 0.4, 0.04, 0.8, 0.3, 0.15,
                    {"latitude": 1e-7, "longitude": 1e-7, "sog": 0.01, "cog": 0.1, "heading": 0.1}),
        Instruments("coarse", (1.0, 2.0), 0.8, 0.05, 1.0, 0.4, None,
                    {"latitude": 1e-6, "longitude": 1e-6, "sog": 0.0514444, "cog": 1.0,
                     "heading": 1.0, "rudder": 0.5}),
    )
}  # fmt: skip
COLUMNS = ("latitude", "longitude", "sog", "cog", "heading", "yaw_rate", "rudder", "rps",
           "wind_speed", "wind_angle")  # fmt: skip
GROUPS = {  # columns that one instrument sends together
    "position": ("latitude", "longitude"), "velocity": ("sog", "cog"), "heading": ("heading",),
    "yaw_rate": ("yaw_rate",), "rudder": ("rudder",), "rps": ("rps",),
    "wind": ("wind_speed", "wind_angle"),
}  # fmt: skip


@dataclass
class Recorded:
    """What is written down: of each instrument its times [n] s since 1970 and its columns [n], in
    the contract's units (deg, m/s, deg/s, rev/s)."""

    time: dict[str, np.ndarray]
    columns: dict[str, np.ndarray]


def recorded(motion: Motion, kit: Instruments, rng: np.random.Generator) -> tuple[Recorded, float]:
    """The voyage as the instruments show it, all at the same rate [Hz], which is returned."""
    hz = float(rng.choice(kit.rates))
    t = np.arange(int(motion.t[-1] * hz) + 1) / hz
    n = len(t)
    north, east = motion.at("x0", t), motion.at("y0", t)
    walk = _drift(n, hz, 0.5 * kit.position, rng)
    latitude, longitude = degrees(
        motion, north + walk[0] + rng.normal(0.0, 0.3 * kit.position, n),
        east + walk[1] + rng.normal(0.0, 0.3 * kit.position, n),
    )  # fmt: skip
    psi, u, v = (motion.at(name, t) for name in ("heading", "surge", "sway"))
    v_north = u * np.cos(psi) - v * np.sin(psi) + rng.normal(0.0, kit.speed, n)
    v_east = u * np.sin(psi) + v * np.cos(psi) + rng.normal(0.0, kit.speed, n)
    columns = {
        "latitude": latitude,
        "longitude": longitude,
        "sog": np.hypot(v_north, v_east),
        "cog": np.degrees(np.arctan2(v_east, v_north)) % 360.0,
        "heading": (np.degrees(psi) + rng.normal(0.0, kit.heading, n)) % 360.0,
        "wind_speed": np.maximum(motion.at("wind_speed", t) + rng.normal(0.0, 0.2, n), 0.0),
        "wind_angle": (np.degrees(motion.at("wind_angle", t)) + rng.normal(0.0, 2.0, n)) % 360.0,
    }
    if motion.kind.shaft:
        columns["rps"] = motion.at("shaft", t) + rng.normal(0.0, 0.01, n)
    if motion.kind.rudder:
        columns["rudder"] = np.degrees(motion.at("rudder", t)) + rng.normal(0.0, 0.1, n)
    if kit.yaw_rate is not None:
        columns["yaw_rate"] = np.degrees(motion.at("yaw_rate", t)) + rng.normal(0, kit.yaw_rate, n)
    for name, step in kit.steps.items():
        if name in columns:
            columns[name] = np.round(columns[name] / step) * step
    for name in ("cog", "heading", "wind_angle"):
        columns[name] = columns[name] % 360.0
    groups = {g for g, names in GROUPS.items() if names[0] in columns}
    return Recorded({g: motion.unix + t for g in groups}, columns), hz


def _drift(n: int, hz: float, sigma: float, rng: np.random.Generator) -> np.ndarray:
    """[2, n] a receiver's slow error: a first-order process of 60 s."""
    keep = float(np.exp(-1.0 / (60.0 * hz)))
    noise = rng.normal(0.0, sigma * np.sqrt(1.0 - keep**2), (2, n))
    out = np.empty_like(noise)
    out[:, 0] = rng.normal(0.0, sigma, 2)
    for i in range(1, n):
        out[:, i] = keep * out[:, i - 1] + noise[:, i]
    return out
