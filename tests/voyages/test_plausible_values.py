"""Values that no ship can have, and marks that stand for none: blank, one finding a channel."""

import numpy as np
import pytest
import sailing

from shiplog.exceptions import ProfileError
from shiplog.voyages.ingest.ingest import ingest

GEODETIC = sailing.PROFILE.replace(
    'kind = "local"\ntopic = "/position"\nfields = ["x_m", "y_m"]\nunit = "m"',
    'kind = "geodetic"\ntopic = "/fix"\nfields = ["lat", "lon"]\nunit = "deg"',
)
ROWS = [100, 101, 102, 103, 104, 300]  # of 320 samples at 10 Hz


def voyage(tmp_path, topic, field, change, text=sailing.PROFILE, seconds=32.0):
    """The circle with the values [n] of one field changed, ingested."""
    parts = sailing.series(seconds)
    if "/fix" in text:
        position = parts.pop("/position")
        north, east = position.columns["x_m"], position.columns["y_m"]
        degrees = {"lat": 54.0 + north / 111_320.0, "lon": 10.0 + east / 65_000.0}
        parts["/fix"] = sailing.Series("/fix", "test.Fix", position.time, degrees)
    parts[topic].columns[field] = change(np.array(parts[topic].columns[field]))
    return ingest(sailing.write(tmp_path / "a.mcap", parts), sailing.profile(text))


def put(value, rows=ROWS):
    def change(values):
        values[rows] = value
        return values

    return change


def found(one, *kinds):
    """Of values; what a whole voyage says of the ship is another test's."""
    kinds = kinds or ("implausible", "not_available")
    found = [f for f in one.report.findings if f.kind in kinds and f.channel != "ship"]
    return [f for f in found if "true wind turns" not in f.sentence]


def usable(one):
    return one.table.filter((one.table["quality"] & 47) == 0)


@pytest.mark.parametrize(
    ("topic", "field", "value", "channel", "column", "most"),
    [
        ("/velocity", "sog_kn", 4860.0, "velocity", "surge", 1.0),  # 2500 m/s
        ("/velocity", "sog_kn", -4860.0, "velocity", "surge", 1.0),
        ("/gyro", "rate_degpmin", 3e6, "yaw_rate", "yaw_rate", 0.05),
        ("/wind", "speed_mps", 250.0, "wind", "wind_speed", 5.0),
        ("/wind", "speed_mps", -30.0, "wind", "wind_speed", 5.0),
        ("/position", "x_m", 9e6, "position", "x0", 21.0),
        ("/position", "y_m", -7e4, "position", "y0", 21.0),
        ("/propeller", "speed_rpm", 1e6, "propeller", "propeller", 12.0),
        ("/propeller", "speed_rpm", -1e5, "propeller", "propeller", 12.0),
        ("/rudder", "angle_deg", 400.0, "rudder", "rudder", 0.2),
    ],
)
def test_what_cannot_be_is_blank_and_one_finding(
    tmp_path, topic, field, value, channel, column, most
):
    text = sailing.PROFILE.replace("limits = [-35.0, 35.0]\n", "")
    one = voyage(tmp_path, topic, field, put(value), text)
    (finding,) = found(one, "implausible", "not_available", "blank", "gap", "spike", "jump")
    assert (finding.kind, finding.channel) == ("implausible", channel)
    assert f"{len(ROWS)} of " in finding.sentence and "limits" in finding.sentence
    assert finding.start_s == pytest.approx(10.0, abs=0.11)
    assert np.abs(usable(one)[column].to_numpy()).max() <= most
    blank = one.table.filter((one.table["quality"] & 3) != 0)
    assert 5 <= blank.height <= 12


@pytest.mark.parametrize(
    ("topic", "field", "value"),
    [("/velocity", "sog_kn", 40.0), ("/wind", "speed_mps", 70.0), ("/propeller", "speed_rpm", 3e4),
     ("/gyro", "rate_degpmin", 60 * 180.0), ("/position", "x_m", 1500.0),
     ("/propeller", "speed_rpm", 0.0), ("/gyro", "heading_deg", 360.0),
     ("/wind", "direction_deg", 360.0),
     ("/velocity", "sog_kn", 0.0), ("/velocity", "sog_kn", -0.02), ("/gyro", "heading_deg", 400.0)],
)  # fmt: skip
def test_what_can_be_stays(tmp_path, topic, field, value):
    assert not found(voyage(tmp_path, topic, field, put(value)))


def test_a_profile_widens_what_can_be_and_narrows_it(tmp_path):
    fast = sailing.PROFILE.replace(
        'units = ["kn", "deg"]\n', 'units = ["kn", "deg"]\nlimits = [0.0, 5000.0]\n'
    )
    assert not found(voyage(tmp_path, "/velocity", "sog_kn", put(4860.0), fast))
    slow = sailing.PROFILE.replace(
        'units = ["kn", "deg"]\n', 'units = ["kn", "deg"]\nlimits = [-3.0, 3.0]\n'
    )
    (finding,) = found(voyage(tmp_path, "/velocity", "sog_kn", put(4.0), slow))
    assert finding.kind == "implausible" and "-3 to 3 kn" in finding.sentence
    rate = sailing.PROFILE.replace(
        'unit = "deg/min"\n', 'unit = "deg/min"\nsign = -1.0\nlimits = [-200.0, 100.0]\n'
    )
    (finding,) = found(voyage(tmp_path, "/gyro", "rate_degpmin", put(150.0), rate))
    assert finding.channel == "yaw_rate" and finding.value == 150.0


def test_an_actuator_s_own_limits_are_the_word_on_it(tmp_path):
    one = voyage(tmp_path, "/rudder", "angle_deg", put(400.0))
    assert not found(one) and found(one, "limits")


@pytest.mark.parametrize("sensor", ["position", "heading"])
def test_limits_of_what_has_none_are_refused(sensor):
    text = sailing.PROFILE.replace(
        f"[sensors.{sensor}]\n", f"[sensors.{sensor}]\nlimits = [0.0, 1.0]\n"
    )
    with pytest.raises(ProfileError, match="limits"):
        sailing.profile(text)


@pytest.mark.parametrize("limits", ["[1.0, 0.0]", "[1.0, 1.0]"])
def test_limits_that_hold_nothing_are_refused(limits):
    text = sailing.PROFILE.replace("[sensors.wind]\n", f"[sensors.wind]\nlimits = {limits}\n")
    with pytest.raises(ProfileError, match="lower one stands first"):
        sailing.profile(text)


@pytest.mark.parametrize("length, least", [(1.0, 600.0), (20.0, 50.0), (300.0, 3.0)])
def test_how_fast_a_ship_can_turn_goes_with_its_length(tmp_path, length, least):
    """Its ends do not go athwart at 10 m/s: 2 x 10 / L, at 300 m 3.8 deg/s."""
    text = sailing.PROFILE.replace("length_m = 3.0", f"length_m = {length}")
    (tmp_path / "slow").mkdir()
    assert not found(voyage(tmp_path / "slow", "/gyro", "rate_degpmin", put(60 * least), text))
    (finding,) = found(voyage(tmp_path, "/gyro", "rate_degpmin", put(60 * 3 * least), text))
    assert finding.channel == "yaw_rate" and "`unit`" in finding.sentence


@pytest.mark.parametrize(
    ("where", "kind"),
    [((0.0, 0.0), "not_available"), ((91.0, 181.0), "not_available"), ((0.0, 10.0), "implausible"),
     ((54.0, 0.0), "implausible"), ((54.0, -10.0), "implausible"), ((10.0, 54.0), "implausible"),
     ((95.0, 10.0), "implausible"), ((214.7483647, 214.7483647), "not_available")],
)  # fmt: skip
def test_a_position_that_is_no_position(tmp_path, where, kind):
    parts = sailing.series(60.0)
    position = parts.pop("/position")
    lat = 54.0 + position.columns["x_m"] / 111_320.0
    lon = 10.0 + position.columns["y_m"] / 65_000.0
    lat[ROWS], lon[ROWS] = where
    parts["/fix"] = sailing.Series("/fix", "t.Fix", position.time, {"lat": lat, "lon": lon})
    one = ingest(sailing.write(tmp_path / "a.mcap", parts), sailing.profile(GEODETIC))
    (finding,) = found(one, "implausible", "not_available", "blank", "gap", "spike", "jump")
    assert (finding.kind, finding.channel) == (kind, "position")
    assert usable(one)["x0"].abs().max() < 50.0


def test_a_ship_on_the_equator_is_where_it_is(tmp_path):
    for name, lat, lon in (("equator", 0.0, 10.0), ("null island", 0.0, 0.0), ("date", 5.0, 180.0)):
        parts = sailing.series(60.0)
        position = parts.pop("/position")
        lats = lat + position.columns["x_m"] / 111_320.0
        lons = lon + position.columns["y_m"] / 111_320.0
        lons = (lons + 180.0) % 360.0 - 180.0
        parts["/fix"] = sailing.Series("/fix", "t.Fix", position.time, {"lat": lats, "lon": lons})
        one = ingest(sailing.write(tmp_path / f"{name}.mcap", parts), sailing.profile(GEODETIC))
        assert not found(one), name


MARKS = [  # topic, field, mark, the unit in which the field counts, channel
    ("/velocity", "sog_kn", 102.3, "velocity"),  # AIS
    ("/velocity", "sog_kn", 655.35 * 3600 / 1852, "velocity"),  # MAVLink, NMEA 2000: cm/s
    ("/gyro", "heading_deg", 511.0, "heading"),  # AIS
    ("/gyro", "heading_deg", 655.35, "heading"),  # MAVLink: cdeg
    ("/gyro", "heading_deg", np.degrees(6.5535), "heading"),  # NMEA 2000: 1e-4 rad
    ("/gyro", "heading_deg", -1.0, "heading"),  # of a telephone
    ("/gyro", "heading_deg", 65535.0, "heading"),
    ("/gyro", "rate_degpmin", -128.0, "yaw_rate"),  # AIS, as it is sent
    ("/gyro", "rate_degpmin", -((128 / 4.733) ** 2), "yaw_rate"),  # and as it is decoded
    ("/wind", "speed_mps", 655.35, "wind"),
    ("/wind", "speed_mps", -1.0, "wind"),
    ("/wind", "direction_deg", np.degrees(6.5535), "wind"),
    ("/rudder", "angle_deg", np.degrees(3.2767), "rudder"),
    ("/rudder", "angle_deg", 32767.0, "rudder"),
    ("/propeller", "speed_rpm", 16383.75, "propeller"),
    ("/propeller", "speed_rpm", 65535.0, "propeller"),
    ("/propeller", "speed_rpm", -32768.0, "propeller"),
    ("/velocity", "cog_deg", 655.35, "velocity"),
    ("/velocity", "cog_deg", np.degrees(6.5535), "velocity"),
]


@pytest.mark.parametrize(("topic", "field", "mark", "channel"), MARKS)
def test_a_mark_for_not_available_is_blank(tmp_path, topic, field, mark, channel):
    text = sailing.PROFILE.replace("limits = [-35.0, 35.0]\n", "")
    one = voyage(tmp_path, topic, field, put(mark), text)
    (finding,) = found(one, "implausible", "not_available", "blank", "gap", "spike", "jump")
    assert (finding.kind, finding.channel) == ("not_available", channel)
    assert f"{len(ROWS)} of " in finding.sentence
    assert finding.start_s == pytest.approx(10.0, abs=0.11)


def test_a_course_of_360_among_others_is_none(tmp_path):
    def east(values):
        values = 90.0 + 0.1 * np.arange(len(values)) % 20
        values[200:240] = 360.0
        return values

    one = voyage(tmp_path, "/velocity", "cog_deg", east)
    (finding,) = found(one)
    assert finding.kind == "not_available" and "360 deg" in finding.sentence
    assert 38 <= one.table["surge"].null_count() <= 42


def test_a_course_of_360_at_rest_is_no_motion(tmp_path):
    """Nothing is unknown of a velocity of zero, whatever its direction."""
    parts = sailing.series(60.0)
    columns = parts["/velocity"].columns
    columns["cog_deg"] = np.full(len(columns["cog_deg"]), 120.0)
    columns["cog_deg"][200:240] = 360.0
    columns["sog_kn"] = np.where(columns["cog_deg"] == 360.0, 0.0, 1.5)
    one = ingest(sailing.write(tmp_path / "a.mcap", parts), sailing.profile())
    assert one.table["surge"].null_count() == 0


@pytest.mark.parametrize("step", [0.1, 1.0, 30.0])
def test_an_instrument_that_writes_360_for_north_is_believed(tmp_path, step):
    """Courses in (0, 360]: through north, in steps of the instrument's, and of a fast turn."""

    def through_north(values):
        turned = (300.0 + step * np.arange(len(values))) % 360.0
        return np.where(turned < 1e-9, 360.0, turned)

    assert not found(voyage(tmp_path, "/velocity", "cog_deg", through_north))


def test_a_course_that_stays_at_north_is_north(tmp_path):
    assert not found(voyage(tmp_path, "/velocity", "cog_deg", lambda v: np.full(len(v), 360.0)))


@pytest.mark.parametrize("mark", [102.3, 655.35, 65535.0, -1.0])
def test_a_mark_amid_its_likes_is_a_value(tmp_path, mark):
    """Local positions, in any unit, go through every number."""

    def line(values):
        return mark + 20.0 * np.linspace(-1.0, 1.0, len(values)) ** 3

    def exact(values):
        values = line(values)
        values[300] = mark
        return values

    assert not found(voyage(tmp_path, "/position", "x_m", exact))
    if mark < 110.0:
        fast = sailing.PROFILE.replace(
            'units = ["kn", "deg"]\n', 'units = ["kn", "deg"]\nlimits = [-200.0, 200.0]\n'
        )
        (tmp_path / "b").mkdir()
        assert not found(voyage(tmp_path / "b", "/velocity", "sog_kn", exact, fast))


PULSES = sailing.PROFILE.replace(
    'kind = "propeller"\ntopic = "/propeller"\nfield = "speed_rpm"\nunit = "rpm"',
    'kind = "thruster"\ntopic = "/propeller"\nfield = "speed_rpm"\nunit = "pwm"\noffset = 1500.0',
)


@pytest.mark.parametrize("pulse", [0.0, 65535.0])
def test_no_pulse_is_no_command(tmp_path, pulse):
    def pulses(values):
        values = 1500.0 + 300.0 * np.sin(np.arange(len(values)) / 50.0)
        values[ROWS] = pulse
        return values

    one = voyage(tmp_path, "/propeller", "speed_rpm", pulses, PULSES)
    (finding,) = found(one, "implausible", "not_available", "blank", "gap")
    assert finding.kind == "not_available" and finding.channel == "propeller"
    assert one.table["propeller"].min() >= -0.76


def test_a_pulse_that_no_servo_takes_is_none(tmp_path):
    one = voyage(tmp_path, "/propeller", "speed_rpm", lambda v: put(9000.0)(0 * v + 1600.0), PULSES)
    (finding,) = found(one)
    assert finding.kind == "implausible" and one.table["propeller"].max() == pytest.approx(0.25)


def test_pulses_that_count_from_neutral_may_be_0(tmp_path):
    relative = PULSES.replace("offset = 1500.0\n", "")
    assert relative != PULSES

    def pulses(values):
        return np.round(300.0 * np.sin(np.arange(len(values)) / 50.0))

    assert not found(voyage(tmp_path, "/propeller", "speed_rpm", pulses, relative))


def test_values_that_the_profile_calls_missing_are_blank(tmp_path):
    text = sailing.PROFILE.replace(
        'unit = "deg/min"\n', 'unit = "deg/min"\nmissing = [7.5, -999.0]\n'
    )
    one = voyage(tmp_path, "/gyro", "rate_degpmin", put(7.5), text)
    assert one.table["yaw_rate"].null_count() >= 5
    assert not found(one) and found(one, "blank")


def test_a_draft_s_length_narrows_nothing(tmp_path):
    """`length_m = 1.0  # CHECK`: nobody has looked at it, and the ship may be any."""
    text = sailing.PROFILE.replace("length_m = 3.0", "length_m = 300.0")
    profile = sailing.profile(text).model_copy(update={"unchecked": ("ship.length_m",)})
    parts = sailing.series(60.0)
    parts["/gyro"].columns["rate_degpmin"][ROWS] = 60 * 90.0
    assert not found(ingest(sailing.write(tmp_path / "a.mcap", parts), profile))


def test_a_receiver_without_a_fix_for_most_of_the_log(tmp_path):
    parts = sailing.series(60.0)
    position = parts.pop("/position")
    lat = 54.0 + position.columns["x_m"] / 111_320.0
    lon = 10.0 + position.columns["y_m"] / 65_000.0
    lat[:400], lon[:400] = 0.0, 0.0
    parts["/fix"] = sailing.Series("/fix", "t.Fix", position.time, {"lat": lat, "lon": lon})
    one = ingest(sailing.write(tmp_path / "a.mcap", parts), sailing.profile(GEODETIC))
    (finding,) = found(one)
    assert finding.kind == "not_available" and "400 of 600" in finding.sentence
    assert usable(one)["x0"].abs().max() < 50.0


def test_a_speed_astern_in_whole_knots_is_a_speed(tmp_path):
    assert not found(
        voyage(tmp_path, "/velocity", "sog_kn", lambda v: np.where(np.arange(len(v)) < 300, 1, -1))
    )


def test_one_turn_at_a_rate_that_ais_uses_as_a_mark_is_a_turn(tmp_path):
    assert not found(voyage(tmp_path, "/gyro", "rate_degpmin", put(-128.0, [100, 300])))
