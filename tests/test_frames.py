"""Lever arms, frames and geodesy against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from shiplog.nomenclature import frames


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


def test_a_ship_at_rest_has_a_velocity_though_no_course():
    speed, course = np.array([0.0, 0.0, 0.5, np.nan]), np.array([np.nan, 1.0, np.nan, 1.0])
    earth = frames.earth_velocity(speed, course)
    assert (earth[:2] == 0.0).all() and np.isnan(earth[2:]).all()


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
    level = np.array([[0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)]])
    ahead = frames.turned(level, np.array([1.0, 0.0, 0.0]))
    assert ahead[0] == pytest.approx([0.0, 1.0, 0.0])
    assert frames.quaternion_heading(ahead, east_north_up=True)[0] == pytest.approx(0.0)
    assert frames.quaternion_heading(ahead, east_north_up=False)[0] == pytest.approx(np.pi / 2)


def test_a_turned_axis_is_that_of_the_rotation_matrix():
    turn = Rotation.from_rotvec([[0.3, -1.2, 0.7], [2.0, 0.1, -0.4]])
    axis = np.array([0.2, -0.5, 0.8])
    assert frames.turned(turn.as_quat(), axis) == pytest.approx(turn.apply(axis), abs=1e-12)


def test_a_mounting_is_turned_about_ahead_then_starboard_then_down():
    turns = (0.3, -0.2, 1.1)
    known = Rotation.from_euler("ZYX", turns[::-1]).as_matrix()
    assert frames.mounted(turns) == pytest.approx(known, abs=1e-12)


@pytest.mark.parametrize(
    ("angle", "wrapped"), [(np.pi, np.pi), (-np.pi, np.pi), (7.0, 7.0 - 2 * np.pi)]
)
def test_wrap_is_half_open(angle, wrapped):
    assert frames.wrap(np.array([angle]))[0] == pytest.approx(wrapped)


ANGLE = st.floats(-50.0, 50.0)
METRES = st.floats(-100.0, 100.0)
MANY = settings(max_examples=100, deadline=None)


@given(degrees=st.integers(-(10**6), 10**6))
@MANY
def test_wrapped_degrees_are_what_is_left_of_whole_turns(degrees):
    """Against whole numbers, where 540 deg is 180 deg to the last digit."""
    left = (degrees + 179) % 360 - 179  # -179 ... 180
    found = float(frames.wrap(np.radians([float(degrees)]))[0])
    assert -np.pi <= found <= np.pi
    assert abs(found) == pytest.approx(np.radians(abs(left)), abs=1e-9)
    assert abs(left) == 180 or found == pytest.approx(np.radians(left), abs=1e-9)


@given(north=METRES, east=METRES, heading=ANGLE)
@MANY
def test_body_axes_are_those_of_a_complex_number_turned_back(north, east, heading):
    body = frames.to_body(np.array([[north, east]]), np.array([heading]))[0]
    turned = complex(north, east) * np.exp(-1j * heading)  # x ahead is real, starboard imaginary
    assert body == pytest.approx([turned.real, turned.imag], abs=1e-9)
    back = frames.in_earth_axes(*body, np.cos(heading), np.sin(heading))
    assert back == pytest.approx((north, east), abs=1e-9)


@given(ahead=METRES, starboard=METRES, heading=ANGLE, rate=st.floats(-1.0, 1.0))
@MANY
def test_an_antenna_is_moved_to_midship_as_its_path_says(ahead, starboard, heading, rate):
    """Midship stays at the origin; the antenna circles it, and its velocity is its derivative."""
    arm = (ahead, starboard)

    def antenna(time):
        return complex(ahead, starboard) * np.exp(1j * (heading + rate * time))

    place, velocity = antenna(0.0), 1j * rate * antenna(0.0)
    position = np.array([[place.real, place.imag]])
    assert frames.position_at_midship(position, np.array([heading]), arm) == pytest.approx(
        np.zeros((1, 2)), abs=1e-9
    )
    body = frames.to_body(np.array([[velocity.real, velocity.imag]]), np.array([heading]))
    assert frames.velocity_at_midship(body, np.array([rate]), arm) == pytest.approx(
        np.zeros((1, 2)), abs=1e-9
    )
