"""Headings of quaternions, against rotations composed axis by axis by another library."""

from __future__ import annotations

import numpy as np
import pytest
import sailing
from scipy.spatial.transform import Rotation

from shiplog.exceptions import LogUnreadable, ProfileError
from shiplog.logs.conversion.write import Series
from shiplog.nomenclature import frames
from shiplog.nomenclature.channels import Quality
from shiplog.voyages.ingest.ingest import ingest

GYRO = '[sensors.heading]\ntopic = "/gyro"\nfield = "heading_deg"\nunit = "deg"\nsigma = 0.05'
ENU, NED = "quaternion_enu", "quaternion_ned"
FOUR = '["q_x", "q_y", "q_z", "q_w"]'
TWO = '["q_z", "q_w"]'
T = np.arange(0.0, 60.0, 0.1)
HEADING = 3.0 + sailing.SPEED / sailing.RADIUS * T
WAVE = np.sin(2 * np.pi * T / 5.0)


def attitude(kind: str, roll, pitch, mounted=(0.0, 0.0, 0.0)) -> dict[str, np.ndarray]:
    """Quaternions of a ship that turns, heels [deg, to starboard] and pitches [deg, bow up]: from
    the sensor's axes to the earth's. `mounted` turns the sensor about x ahead, y to starboard and
    z down, in the ship [deg]."""
    angles = np.stack([np.degrees(HEADING), np.broadcast_to(pitch, T.shape),
                       np.broadcast_to(roll, T.shape)], 1)  # fmt: skip
    ship = Rotation.from_euler("ZYX", angles, degrees=True)  # to north, east, down
    sensor = ship * Rotation.from_euler("ZYX", mounted[::-1], degrees=True)
    if kind == "quaternion_enu":  # x ahead, y to port, z up; of east, north, up
        to_enu = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
        from_flu = Rotation.from_matrix([[1, 0, 0], [0, -1, 0], [0, 0, -1]])
        sensor = to_enu * sensor * from_flu
    return dict(zip(("q_x", "q_y", "q_z", "q_w"), sensor.as_quat().T, strict=True))


@pytest.fixture
def voyage(tmp_path):
    def build(columns, kind="quaternion_enu", fields=FOUR, more=""):
        parts = {**sailing.series(), "/imu": Series("/imu", "test.Imu", sailing.stamps(T), columns)}
        heading = f'[sensors.heading]\nkind = "{kind}"\ntopic = "/imu"\nfields = {fields}\n{more}'
        text = sailing.PROFILE.replace(GYRO, heading)
        return ingest(sailing.write(tmp_path / "turn.mcap", parts), sailing.profile(text))

    return build


def off(done) -> np.ndarray:
    """Errors of the usable headings [deg]."""
    t = (done.table["time"].to_physical().to_numpy() - sailing.START) * 1e-9
    true = 3.0 + sailing.SPEED / sailing.RADIUS * t
    heading = done.table["heading"].to_numpy()
    return np.degrees(np.abs(frames.wrap(heading - true)))[np.isfinite(heading)]


def mounting(done) -> list:
    return [f for f in done.report.findings if f.kind == "contradiction"]


@pytest.mark.parametrize(
    ("kind", "fields", "roll", "pitch"),  # z and w alone: the message has x and y as well
    [(ENU, FOUR, 0.0, 0.0), (NED, TWO, 0.0, 0.0), (ENU, FOUR, 25.0, 8.0 * WAVE),
     (ENU, TWO, 25.0, 8.0 * WAVE), (NED, FOUR, -35.0 + 5 * WAVE, 6.0),
     (NED, TWO, -35.0 + 5 * WAVE, 6.0), (ENU, TWO, 12.0, -15.0), (NED, FOUR, 12.0, -15.0)],
)  # fmt: skip
def test_a_heeled_ship_has_the_heading_of_its_bow(voyage, kind, fields, roll, pitch):
    done = voyage(attitude(kind, roll, pitch), kind, fields)
    assert off(done).max() < 0.02  # interpolated between samples that pitch
    assert not mounting(done)
    assert (done.table["quality"] == 0).all()


@pytest.mark.parametrize(
    ("kind", "mounted"),
    [(ENU, (180.0, 0.0, 0.0)), (NED, (180.0, 0.0, 0.0)), (ENU, (90.0, 0.0, 0.0)),
     (NED, (-120.0, 0.0, 0.0))],
)  # fmt: skip
def test_a_sensor_that_is_turned_over_is_said(voyage, kind, mounted):
    done = voyage(attitude(kind, 2.0 * WAVE, 1.5, mounted), kind)
    (finding,) = mounting(done)
    assert finding.channel == "heading" and finding.reason == "mounting"
    assert finding.value == pytest.approx(abs(mounted[0]), abs=3.0) and finding.unit == "deg"
    assert "/imu" in finding.sentence and "mounting_deg" in finding.sentence
    assert done.report.serious
    assert off(done).max() < 0.05  # x points ahead all the same


@pytest.mark.parametrize(
    ("kind", "mounted"),
    [(ENU, (180.0, 0.0, 0.0)), (NED, (0.0, 90.0, 0.0)), (ENU, (10.0, -20.0, 130.0)),
     (NED, (10.0, -20.0, 130.0)), (NED, (0.0, 180.0, 0.0))],
)  # fmt: skip
def test_a_mounting_that_the_profile_states_is_taken_out(voyage, kind, mounted):
    stated = f"mounting_deg = {list(mounted)}"
    done = voyage(attitude(kind, 20.0 + 2.0 * WAVE, 1.5 * WAVE, mounted), kind, more=stated)
    assert off(done).max() < 0.05
    assert not mounting(done) and not done.report.serious


def test_a_sensor_whose_x_axis_points_up_has_no_heading(voyage):
    with pytest.raises(LogUnreadable, match="heading"):
        voyage(attitude("quaternion_ned", 0.0, 0.0, (0.0, 90.0, 0.0)), "quaternion_ned")


@pytest.mark.parametrize(
    ("fields", "length"), [(FOUR, 0.0), (FOUR, 1.4), (FOUR, np.nan), (TWO, 0.3), (TWO, np.nan)]
)
def test_what_is_not_of_unit_length_is_no_rotation(voyage, fields, length):
    columns = attitude("quaternion_enu", 10.0, 3.0)
    for values in columns.values():
        values[100:110] *= length
    done = voyage(columns, fields=fields)
    assert off(done).max() < 0.02
    assert (done.table["quality"] & int(Quality.BLANK) != 0).sum() >= 10


def test_rounding_and_turning_the_sign_leave_a_quaternion_one(voyage):
    """Two digits; and q and -q are one rotation, whichever a filter sends."""
    columns = {n: np.round(v, 2) for n, v in attitude("quaternion_enu", 10.0, 3.0).items()}
    for values in columns.values():
        values[::2] *= -1.0
    done = voyage(columns)
    assert off(done).max() < 1.5
    assert not (done.table["quality"] & int(Quality.BLANK) != 0).any()


def alone(columns) -> dict[str, np.ndarray]:
    return {"z": columns["q_z"], "w": columns["q_w"]}


def test_two_fields_alone_that_are_turned_over_say_no_heading(voyage):
    columns = alone(attitude("quaternion_enu", 180.0 + 2.0 * WAVE, 1.5))
    with pytest.raises(LogUnreadable, match="turned over") as refused:
        voyage(columns, fields='["z", "w"]')
    assert "x, y, z, w" in refused.value.hint


def test_two_fields_alone_of_a_heeled_ship_are_said_with_their_error(voyage):
    """The tilt shows in z² + w² = cos²(tilt / 2), and the heading is off by tilt² / 4 at most."""
    done = voyage(alone(attitude("quaternion_enu", 30.0, 10.0 * WAVE)), fields='["z", "w"]')
    (finding,) = [f for f in done.report.findings if f.kind == "implausible"]
    assert finding.channel == "heading"
    assert finding.value == pytest.approx(np.degrees(np.radians(30.8) ** 2 / 4), abs=0.5)
    assert off(done).max() <= finding.value + 1.0
    assert "x and y" in finding.sentence


def test_two_fields_alone_of_a_level_ship_need_nothing(voyage):
    done = voyage(alone(attitude("quaternion_enu", 3.0 * WAVE, 2.0)), fields='["z", "w"]')
    assert off(done).max() < 0.3 and done.report.findings == ()


@pytest.mark.parametrize(
    ("named", "fields"),
    [
        (dict(zip("xyzw", ("Q2", "Q3", "Q4", "Q1"), strict=True)), '["Q4", "Q1"]'),
        (dict(zip("xyzw", ("qx", "qy", "qz", "qw"), strict=True)), '["qz", "qw"]'),
        (dict(zip("xyzw", ("q0", "q1", "q2", "q3"), strict=True)), '["q2", "q3"]'),
    ],
)
def test_the_other_two_are_found_by_their_names(voyage, named, fields):
    columns = attitude("quaternion_ned", 25.0, 8.0 * WAVE)
    columns = {named[name[-1]]: values for name, values in columns.items()}
    assert off(voyage(columns, "quaternion_ned", fields)).max() < 0.02


def test_a_mirrored_pair_stays_mirrored(voyage):
    """sign = [-1, 1] makes a yaw that counts the other way round right, heeled or not."""
    columns = attitude("quaternion_ned", 25.0, 8.0 * WAVE)
    mirrored = columns | {"q_x": -columns["q_x"], "q_z": -columns["q_z"]}
    done = voyage(mirrored, "quaternion_ned", TWO, "sign = [-1.0, 1.0]")
    assert off(done).max() < 0.02


def test_a_mounting_is_of_a_quaternion_alone():
    with pytest.raises(ProfileError, match="mounting_deg"):
        sailing.profile(sailing.PROFILE.replace(GYRO, GYRO + "\nmounting_deg = [180.0, 0.0, 0.0]"))


@pytest.mark.parametrize(
    "fields", ['["q_z"]', '["q_x", "q_z", "q_w"]', '["a", "b", "c", "d", "e"]']
)
def test_a_quaternion_has_two_fields_or_four(fields):
    heading = f'[sensors.heading]\nkind = "quaternion_ned"\ntopic = "/imu"\nfields = {fields}'
    with pytest.raises(ProfileError, match="4 or 2 field"):
        sailing.profile(sailing.PROFILE.replace(GYRO, heading))
