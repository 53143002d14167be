"""Lever arms, frames and geodesy against closed forms."""

import numpy as np
import pytest

from shiplog import frames


def test_a_ship_spinning_about_midship_does_not_move_there():
    r, arm = np.full(5, 0.3), (1.2, -0.4)  # an antenna ahead and to port
    antenna = np.stack((-r * arm[1], r * arm[0]), axis=-1)  # r × arm, body axes
    assert frames.velocity_at_midship(antenna, r, arm) == pytest.approx(np.zeros((5, 2)))


def test_an_antenna_ahead_of_midship_on_an_eastward_ship():
    heading = np.array([np.pi / 2])
    position = frames.position_at_midship(np.array([[10.0, 7.0]]), heading, (2.0, 0.5))
    assert position[0] == pytest.approx([10.5, 5.0])  # 2 m back west, 0.5 m back north


def test_over_ground_to_body_and_leeway_sign():
    earth = frames.earth_velocity(np.array([2.0]), np.array([np.pi / 2]))  # due east
    body = frames.to_body(earth, np.array([np.pi / 3]))  # heading 60°: drifting to starboard
    assert body[0] == pytest.approx([2 * np.cos(np.pi / 6), 2 * np.sin(np.pi / 6)])


def test_the_local_plane_has_the_ellipsoids_radii():
    a, e2, latitude = 6378137.0, 6.69437999014e-3, np.radians(34.82)
    root = np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    meridian, prime = a * (1 - e2) / root**3, a / root
    step = 1e-5  # degrees, about a metre
    plane = frames.local_plane(
        np.array([34.82 + step, 34.82]), np.array([135.52, 135.52 + step]), (34.82, 135.52)
    )
    assert plane[0] == pytest.approx([np.radians(step) * meridian, 0.0], abs=1e-6)
    assert plane[1] == pytest.approx([0.0, np.radians(step) * prime * np.cos(latitude)], abs=1e-6)


def test_a_quaternion_pointing_north_in_both_conventions():
    yaw = np.pi / 2  # counter-clockwise from east: north
    z, w = np.array([np.sin(yaw / 2)]), np.array([np.cos(yaw / 2)])
    assert frames.quaternion_heading(z, w, east_north_up=True)[0] == pytest.approx(0.0)
    assert frames.quaternion_heading(z, w, east_north_up=False)[0] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize(
    ("angle", "wrapped"), [(np.pi, np.pi), (-np.pi, np.pi), (7.0, 7.0 - 2 * np.pi)]
)
def test_wrap_is_half_open(angle, wrapped):
    assert frames.wrap(np.array([angle]))[0] == pytest.approx(wrapped)
