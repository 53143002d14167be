"""From where and how an instrument measures to the ship's state at midship.

Vectors [n, 2] are made as `np.stack(...).T`, each component in one piece of memory: a diagnosis
turns them thousands of times, component by component.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pymap3d


class Axes(NamedTuple):
    """Cosine and sine [n] of the heading: they cost more than all that is done with them."""

    cos: np.ndarray
    sin: np.ndarray

    def turned(self, angle: float) -> Axes:
        """Clockwise by so much [rad]."""
        c, s = np.cos(angle), np.sin(angle)
        return Axes(c * self.cos - s * self.sin, c * self.sin + s * self.cos)

    @property
    def back(self) -> Axes:
        """Of the opposite heading: from body axes to the earth's."""
        return Axes(self.cos, -self.sin)


def axes(heading: np.ndarray | Axes) -> Axes:
    """Of a heading [n], or as they are known."""
    return heading if isinstance(heading, Axes) else Axes(np.cos(heading), np.sin(heading))


def local_plane(
    latitude: np.ndarray, longitude: np.ndarray, datum: tuple[float, float]
) -> np.ndarray:
    """Geodetic positions [deg] to north and east [n, 2] of the datum [deg], m, WGS 84.

    The plane touches the ellipsoid at the datum (height 0): 1 km away it is 0.1 mm off.
    """
    north, east, _ = pymap3d.geodetic2ned(latitude, longitude, 0.0, datum[0], datum[1], 0.0)
    return np.stack((north, east), axis=-1)


def geodetic(north: float, east: float, datum: tuple[float, float]) -> tuple[float, float]:
    """Latitude and longitude [deg] of a place in the plane of `local_plane`: its inverse."""
    latitude, longitude, _ = pymap3d.ned2geodetic(north, east, 0.0, datum[0], datum[1], 0.0)
    return float(latitude), float(longitude)


def earth_velocity(speed: np.ndarray, course: np.ndarray) -> np.ndarray:
    """Speed [m/s] and course over ground [rad, clockwise from north] to (north, east) [n, 2].

    At no speed a receiver has no course, and sends none: the velocity is zero all the same.
    """
    course = np.where(speed == 0.0, 0.0, course)
    return np.stack((speed * np.cos(course), speed * np.sin(course))).T


def in_body_axes(north: Any, east: Any, cos: Any, sin: Any) -> tuple[Any, Any]:
    """(ahead, starboard) of earth-fixed components and the heading's cosine and sine.

    Numbers or arrays of one shape, of numpy, JAX or numba: the one place of this rotation.
    """
    return cos * north + sin * east, cos * east - sin * north


def in_earth_axes(ahead: Any, starboard: Any, cos: Any, sin: Any) -> tuple[Any, Any]:
    """(north, east) of body components: the inverse of `in_body_axes`."""
    return cos * ahead - sin * starboard, sin * ahead + cos * starboard


def to_body(earth: np.ndarray, heading: np.ndarray | Axes) -> np.ndarray:
    """Earth-fixed (north, east) [n, 2] to body axes (ahead, starboard) [n, 2]."""
    return np.stack(in_body_axes(earth[:, 0], earth[:, 1], *axes(heading))).T


def position_at_midship(
    position: np.ndarray, heading: np.ndarray | Axes, arm: tuple[float, float]
) -> np.ndarray:
    """Antenna position [n, 2] minus the lever arm (ahead, starboard) turned by the heading."""
    return position - np.stack(in_earth_axes(*arm, *axes(heading))).T


def velocity_at_midship(
    velocity: np.ndarray, yaw_rate: np.ndarray, arm: tuple[float, float]
) -> np.ndarray:
    """Body velocity [n, 2] of the point at `arm`, less r × arm: (u + r·y, v - r·x)."""
    ahead, starboard = arm
    return velocity + np.stack((yaw_rate * starboard, -yaw_rate * ahead)).T


def turned(quaternion: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """An axis [3] turned by unit quaternions (x, y, z, w) [n, 4]: [n, 3] (Rodrigues, 1840).

    a' = a + 2 w (u × a) + 2 u × (u × a),   u = (x, y, z)
    """
    u, w = quaternion[:, :3], quaternion[:, 3:]
    across = 2.0 * np.cross(u, axis)
    return axis + w * across + np.cross(u, across)


def quaternion_heading(ahead: np.ndarray, east_north_up: bool) -> np.ndarray:
    """Heading [rad, clockwise from north] of an axis of the ship [n, 3] in the earth's.

    With the sensor's x axis ahead it is that of a quaternion, ship heeled or not:

        yaw = atan2(2 (w z + x y), 1 - 2 (y² + z²))

    In east-north-up axes (ROS, REP 103) yaw is counter-clockwise from east: ψ = π/2 - yaw.
    """
    if east_north_up:
        return np.arctan2(ahead[:, 0], ahead[:, 1])
    return np.arctan2(ahead[:, 1], ahead[:, 0])


def mounted(turns: tuple[float, ...]) -> np.ndarray:
    """From a sensor's axes to the ship's [3, 3], both x ahead, y to starboard, z down: turned by
    (roll, pitch, yaw) [rad] about these axes, M = R_z(yaw) R_y(pitch) R_x(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(turns), np.sin(turns)
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])  # fmt: skip


def wrap(angle: Any) -> Any:
    """Angles [rad] in (-π, π], of numpy or JAX."""
    return np.pi - (np.pi - angle) % (2.0 * np.pi)
