"""How a ship moved: a closed form, and what its helm, shaft and mast had to do with it.

With the yaw rate r(t) = Σ aᵢ sin(ωᵢ t + φᵢ), the heading is
ψ = ψ₀ + Σ aᵢ/ωᵢ (cos φᵢ - cos(ωᵢ t + φᵢ)). Midship moves with u(t) ahead and v(t) to starboard,

    dx₀/dt = u cos ψ - v sin ψ,   dy₀/dt = u sin ψ + v cos ψ

integrated by the trapezoidal rule at 100 Hz. The rudder is Nomoto's (1957), T dr/dt + r = K δ; the
shaft turns with u = 0.7 n D in steady motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

FINE_HZ = 100
SLIP = 0.7  # u/(nD) of a hull in steady motion
EQUATOR_M, ECCENTRICITY2 = 6_378_137.0, 6.69437999014e-3  # WGS 84


@dataclass(frozen=True)
class Kind:
    """A ship and how it is sailed."""

    name: str
    length: float  # m
    speed: float  # m/s, negative sails stern first
    turning: float  # rad/s, amplitude of the yaw rate
    seconds: float = 600.0
    sideways: float = 0.0  # m/s, of an azimuth ship on purpose
    waves: float = 0.0  # rad, amplitude of the heading's motion in a seaway
    rudder: bool = True  # else it is steered by something that is not recorded
    shaft: bool = True  # else it is driven by something that is not recorded


KINDS = {
    kind.name: kind
    for kind in (
        Kind("model ship", 3.0, 0.5, math.radians(3.0)),
        Kind("usv", 5.0, 2.0, math.radians(6.0)),
        Kind("planing usv", 6.0, 10.5, math.radians(7.0)),
        Kind("blueboat", 1.2, 1.1, math.radians(14.0), rudder=False),
        Kind("yacht in waves", 12.0, 3.0, math.radians(3.0), waves=math.radians(1.5)),
        Kind("coaster", 80.0, 5.5, math.radians(0.8), 1200.0),
        Kind("vlcc at dead slow", 320.0, 2.0, math.radians(0.12), 3600.0),
        Kind("ferry stern first", 40.0, -4.0, math.radians(1.0), 900.0, rudder=False),
        Kind(
            "azimuth ship sideways",
            9.0,
            0.25,
            math.radians(2.0),
            sideways=0.6,
            rudder=False,
            shaft=False,
        ),
    )
}
AT_REST = {
    kind.name: kind
    for kind in (
        Kind("alongside", 30.0, 0.0, 0.0, 900.0),
        Kind("at anchor in waves", 12.0, 0.0, math.radians(0.05), waves=math.radians(1.5)),
    )
}


@dataclass(frozen=True)
class Motion:
    """A voyage at FINE_HZ, SI, at midship; [n] each. Angles run on without a wrap."""

    kind: Kind
    datum: tuple[float, float]  # deg
    unix: float  # s, of the first row
    t: np.ndarray
    x0: np.ndarray
    y0: np.ndarray
    heading: np.ndarray
    surge: np.ndarray
    sway: np.ndarray
    yaw_rate: np.ndarray
    rudder: np.ndarray
    shaft: np.ndarray  # rev/s
    wind_speed: np.ndarray  # apparent
    wind_angle: np.ndarray  # from the bow, where it comes from

    def at(self, name: str, seconds: np.ndarray) -> np.ndarray:
        """A column at any times from the voyage's start."""
        return np.interp(seconds, self.t, getattr(self, name))

    @property
    def diameter(self) -> float:
        return max(0.03 * self.kind.length, 0.08)


def sail(kind: Kind, rng: np.random.Generator) -> Motion:
    t = np.arange(round(kind.seconds * FINE_HZ) + 1) / FINE_HZ
    pace = kind.length / max(abs(kind.speed), 0.3)  # s a length
    periods = rng.uniform(12.0, 30.0, 3) * pace
    periods = np.minimum(periods, kind.seconds / rng.uniform(3.0, 5.0, 3))
    omega, phase = 2.0 * np.pi / periods, rng.uniform(0.0, 2.0 * np.pi, 3)
    amplitude = kind.turning * np.array([0.6, 0.3, 0.2])
    angle = omega[:, None] * t + phase[:, None]
    rate = amplitude @ np.sin(angle)
    slope = (amplitude * omega) @ np.cos(angle)  # dr/dt, of the manoeuvre alone
    heading = rng.uniform(0.0, 2.0 * np.pi) + (amplitude / omega) @ (
        np.cos(phase)[:, None] - np.cos(angle)
    )
    swell = 2.0 * np.pi / rng.uniform(4.0, 8.0)
    yaw_rate = rate + kind.waves * swell * np.cos(swell * t)
    heading = heading + kind.waves * np.sin(swell * t)
    slow = 2.0 * np.pi / (kind.seconds / rng.uniform(2.0, 4.0))
    change = np.cos(slow * t + rng.uniform(0.0, 6.0))
    surge = kind.speed * (0.8 + 0.2 * change)
    surge = surge + 0.1 * abs(kind.speed) * (kind.waves > 0) * np.sin(0.7 * swell * t)
    sway = -0.25 * kind.length * rate + kind.sideways * (0.75 + 0.25 * change)
    along, across = np.cos(heading), np.sin(heading)
    x0 = _summed(surge * along - sway * across)
    y0 = _summed(surge * across + sway * along)
    # A ship that goes astern is steered the other way; those that do so here have no rudder.
    gain, lag = 0.35 * max(abs(kind.speed), 0.3) / kind.length, 1.5 * pace
    rudder = (lag * slope + rate) / gain
    rudder = rudder * min(1.0, math.radians(30.0) / max(float(np.abs(rudder).max()), 1e-9))
    diameter = max(0.03 * kind.length, 0.08)
    shaft = surge / (SLIP * diameter) + 0.0 * t
    wind, gusts = rng.uniform(2.0, 9.0), rng.uniform(0.0, 2.0 * np.pi, 2)
    blowing = wind * (1.0 + 0.1 * np.sin(0.31 * t + gusts[0]) + 0.05 * np.sin(1.3 * t + gusts[1]))
    source = rng.uniform(0.0, 2.0 * np.pi)  # where it comes from
    ahead = blowing * np.cos(source - heading) + surge
    aside = blowing * np.sin(source - heading) + sway
    return Motion(
        kind, (float(rng.uniform(-60.0, 60.0)), float(rng.uniform(-170.0, 170.0))),
        float(rng.integers(1_600_000_000, 1_760_000_000)), t, x0, y0, heading, surge, sway,
        yaw_rate, rudder, shaft, np.hypot(ahead, aside), np.arctan2(aside, ahead),
    )  # fmt: skip


def _summed(rate: np.ndarray) -> np.ndarray:
    return np.concatenate(([0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1])))) / FINE_HZ


def degrees(motion: Motion, north: np.ndarray, east: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Latitude and longitude [deg] on the ellipsoid of points so far [m] along the tangent plane.

    By the two radii of curvature, and four corrections by what `_on_plane` says of the result.
    """
    latitude, longitude = np.radians(motion.datum)
    w2 = 1.0 - ECCENTRICITY2 * math.sin(latitude) ** 2
    meridian = EQUATOR_M * (1.0 - ECCENTRICITY2) / w2**1.5
    parallel = EQUATOR_M / math.sqrt(w2) * math.cos(latitude)
    phi, lam = latitude + north / meridian, longitude + east / parallel
    for _ in range(4):
        n, e = _on_plane(latitude, longitude, phi, lam)
        phi, lam = phi + (north - n) / meridian, lam + (east - e) / parallel
    return np.degrees(phi), np.degrees(lam)


def _on_plane(latitude: float, longitude: float, phi, lam) -> tuple[np.ndarray, np.ndarray]:
    """North and east [m], in the plane that touches the ellipsoid at the first point [rad]."""

    def centred(p, q):
        n = EQUATOR_M / np.sqrt(1.0 - ECCENTRICITY2 * np.sin(p) ** 2)
        z = n * (1.0 - ECCENTRICITY2) * np.sin(p)
        return n * np.cos(p) * np.cos(q), n * np.cos(p) * np.sin(q), z

    x, y, z = (a - b for a, b in zip(centred(phi, lam), centred(latitude, longitude), strict=True))
    out = math.cos(longitude) * x + math.sin(longitude) * y
    north = math.cos(latitude) * z - math.sin(latitude) * out
    return north, math.cos(longitude) * y - math.sin(longitude) * x
