"""A log to a table at midship, against a path known in closed form; faults where they were put."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
import sailing

from shiplog.exceptions import ChannelMissing, LogUnreadable, ProfileError
from shiplog.logs.conversion.write import Series
from shiplog.nomenclature import frames
from shiplog.nomenclature.channels import Quality
from shiplog.report.evaluation import tables
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.rows import fault_detection, resampling


def changed(parts, topic, **columns):
    one = parts[topic]
    return {**parts, topic: replace(one, columns={**one.columns, **columns})}


def kept(parts, topic, mask):
    one = parts[topic]
    columns = {name: values[mask] for name, values in one.columns.items()}
    return {**parts, topic: Series(one.topic, one.schema, one.time[mask], columns)}


@pytest.fixture
def voyage(tmp_path):
    def build(parts=None, text=sailing.PROFILE):
        return ingest(sailing.write(tmp_path / "turn.mcap", parts), sailing.profile(text))

    return build


def kinds(report):
    return [(f.kind, f.channel) for f in report.findings]


def test_a_turning_ship_is_reduced_to_midship(voyage):
    table = voyage().table
    t = (table["time"].to_physical().to_numpy() - sailing.START) * 1e-9
    heading = 3.0 + sailing.SPEED / sailing.RADIUS * t
    # Interpolating a circle between samples 0.1 s apart leaves r²·U·dt²/8 = 2e-6 m.
    assert table["x0"].to_numpy() == pytest.approx(20.0 * np.sin(heading), abs=1e-5)
    assert table["y0"].to_numpy() == pytest.approx(-20.0 * np.cos(heading), abs=1e-5)
    assert table["surge"].to_numpy() == pytest.approx(0.8, abs=1e-5)
    assert table["sway"].to_numpy() == pytest.approx(0.0, abs=1e-5)
    assert table["yaw_rate"].to_numpy() == pytest.approx(0.04)
    wrapped = (heading + np.pi) % (2 * np.pi) - np.pi
    assert table["heading"].to_numpy() == pytest.approx(wrapped, abs=1e-9)
    assert table["rudder"].to_numpy() == pytest.approx(np.radians(10) * np.sin(0.2 * t), abs=1e-4)
    assert table["propeller"].to_numpy() == pytest.approx(5.0 + 0.1 * t)
    angle = np.radians((350.0 + 0.5 * t + 180) % 360 - 180)
    assert table["wind_angle"].to_numpy() == pytest.approx(angle, abs=1e-6)
    assert (table["quality"] == 0).all()


def test_a_compass_at_its_own_rate_is_interpolated_through_south(voyage):
    parts = sailing.series()
    t = np.arange(0.011, 59.5, 0.103)
    gyro = {
        "heading_deg": np.degrees(3.0 + 0.04 * t) % 360.0,
        "rate_degpmin": np.full(len(t), np.degrees(0.04) * 60),
    }
    own = Series("/gyro", "test.Gyro", sailing.stamps(t), gyro)
    table = voyage({**parts, "/gyro": own}).table
    t = (table["time"].to_physical().to_numpy() - sailing.START) * 1e-9
    wrapped = (3.0 + 0.04 * t + np.pi) % (2 * np.pi) - np.pi
    assert table["heading"].to_numpy() == pytest.approx(wrapped, abs=1e-9)


def test_the_table_is_10_hz_and_whole(voyage):
    done = voyage()
    assert done.table["time"].diff().drop_nulls().unique().to_list() == [
        done.table["time"][1] - done.table["time"][0]
    ]
    assert done.table["time"].diff()[1].total_seconds() == 0.1
    assert done.table.null_count().sum_horizontal()[0] == 0
    assert done.report.messages_read == sum(len(s.time) for s in sailing.series().values())
    assert done.report.messages_lost == 0 and done.report.findings == ()


def test_arrival_does_not_matter(voyage, tmp_path):
    late = {
        topic: replace(one, log_time=one.time + 700_000_000 * (topic == "/velocity"))
        for topic, one in sailing.series().items()
    }
    clean = voyage().table
    assert voyage(late).table.equals(clean)


def test_a_dropout_is_a_gap_of_that_channel_with_its_times(voyage):
    parts = sailing.series()
    t = (parts["/velocity"].time - sailing.START) * 1e-9
    done = voyage(kept(parts, "/velocity", (t < 20.0) | (t > 23.0)))
    (gap,) = [f for f in done.report.findings if f.kind == "gap"]
    assert gap.channel == "velocity"
    first = done.table["time"][0].timestamp() - sailing.START * 1e-9
    assert gap.start_s + first == pytest.approx(20.0, abs=0.11)
    assert gap.value == pytest.approx(3.0, abs=0.25)
    lost = done.table.filter(pl.col("surge").is_null())
    assert (lost["quality"] & int(Quality.GAP) != 0).all()
    assert done.table["x0"].null_count() == 0


def jittered(sigma, seconds=300.0):
    """The circle with stamps next to the instants measured, by less than half a period."""
    rng = np.random.default_rng(1)
    off = {t: sigma * rng.standard_normal(len(s.time)) for t, s in sailing.series(seconds).items()}
    return {
        topic: replace(one, time=one.time + (off[topic].clip(-0.045, 0.045) * 1e9).astype(np.int64))
        for topic, one in sailing.series(seconds).items()
    }


@pytest.mark.parametrize("sigma", [0.015, 0.03])
def test_stamps_that_jitter_are_no_gaps(voyage, sigma):
    parts = jittered(sigma)
    assert (np.diff(parts["/velocity"].time) > 150_000_000).sum() > 10
    assert [f for f in voyage(parts).report.findings if f.kind == "gap"] == []


@pytest.mark.parametrize("sigma", [0.0, 0.015])
@pytest.mark.parametrize("lost", [[1000], [1000, 1004, 1300], [3, 2997]])
def test_a_lost_message_is_a_gap_whatever_the_jitter(voyage, sigma, lost):
    parts = jittered(sigma)
    estimated = kept(parts, "/velocity", ~np.isin(np.arange(len(parts["/velocity"].time)), lost))
    gaps = [f for f in voyage(estimated).report.findings if f.kind == "gap"]
    assert {f.channel for f in gaps} == {"velocity"}
    assert [f.start_s for f in gaps] == pytest.approx([0.1 * i for i in lost], abs=0.25)


def test_a_spike_is_marked_and_left_as_it_is(voyage):
    parts = sailing.series()
    x = parts["/position"].columns["x_m"].copy()
    x[300] += 5.0
    done = voyage(changed(parts, "/position", x_m=x))
    assert ("spike", "position") in kinds(done.report)
    marked = done.table.filter(pl.col("quality") & int(Quality.SPIKE) != 0)
    assert 1 <= marked.height <= 2
    assert (done.table["x0"] - voyage().table["x0"]).abs().max() > 2.0


@pytest.mark.parametrize("no_value", [np.nan, -np.inf, 1.7976931348623157e308, -(2.0**63)])
@pytest.mark.parametrize("field", ["speed_mps", "direction_deg"])
def test_a_lone_value_that_is_none_is_blank(voyage, field, no_value):
    """Also the largest float and the least whole number, which some programs write for it."""
    parts = sailing.series()
    wind = parts["/wind"].columns[field].copy()
    wind[100:110] = no_value
    done = voyage(changed(parts, "/wind", **{field: wind}))
    assert kinds(done.report) == [("blank", "wind")]
    assert done.table.filter(pl.col("quality") & int(Quality.BLANK) != 0).height >= 10


@pytest.mark.parametrize("count", [0, 1])
def test_an_instrument_without_two_samples_has_no_rate(voyage, count):
    parts = sailing.series()
    few = kept(parts, "/wind", np.arange(len(parts["/wind"].time)) < count)
    assert "wind" not in {one.channel for one in voyage(few).report.instruments}


def test_a_quaternion_that_nobody_filled_in_is_blank(voyage):
    """ROS sends (0, 0, 0, 0) before there is an orientation: no heading to the east."""
    parts = sailing.series()
    heading = 3.0 + sailing.SPEED / sailing.RADIUS * np.arange(600) * 0.1
    half = 0.5 * (np.pi / 2.0 - heading)
    z, w = np.sin(half), np.cos(half)
    z[100:110] = w[100:110] = 0.0
    turned = Series("/imu", "test.Imu", parts["/gyro"].time, {"z": z, "w": w})
    text = sailing.PROFILE.replace(
        '[sensors.heading]\ntopic = "/gyro"\nfield = "heading_deg"\nunit = "deg"',
        '[sensors.heading]\nkind = "quaternion_enu"\ntopic = "/imu"\nfields = ["z", "w"]',
    )
    done, clean = voyage({**parts, "/imu": turned}, text), voyage()
    assert ("blank", "heading") in kinds(done.report)
    off = frames.wrap((done.table["heading"] - clean.table["heading"]).drop_nulls().to_numpy())
    assert np.abs(off).max() < 1e-6 and len(off) < clean.table.height


def test_a_rudder_beyond_its_limits_is_marked_not_clipped(voyage):
    parts = sailing.series()
    angle = parts["/rudder"].columns["angle_deg"].copy()
    angle[200:205] = 50.0
    done = voyage(changed(parts, "/rudder", angle_deg=angle))
    (finding,) = [f for f in done.report.findings if f.kind == "limits"]
    assert finding.channel == "rudder"
    assert done.table["rudder"].min() == pytest.approx(-np.radians(50.0))
    assert done.table.filter(pl.col("quality") & int(Quality.LIMITS) != 0).height >= 4


@pytest.mark.parametrize(
    "limits, beyond", [("[0.0, 360.0]", 0), ("[-180.0, 180.0]", 0), ("[90.0, 270.0]", 300)]
)
def test_limits_of_an_azimuth_hold_wherever_its_turn_is_cut(voyage, limits, beyond):
    """One turn in 60 s, 0.6 deg a row: half of the turn, 300 rows, is outside 90 to 270 deg."""
    parts = sailing.series()
    angle = 0.6 * np.arange(600.0)
    turning = Series("/az", "shiplog.Azimuth", parts["/gyro"].time, {"angle_deg": angle})
    text = sailing.PROFILE + (
        '[[actuators]]\nname = "az"\nkind = "azimuth"\ntopic = "/az"\nfield = "angle_deg"\n'
        f'unit = "deg"\nlimits = {limits}\n'
    )
    table = voyage({**parts, "/az": turning}, text).table
    marked = table["quality"].to_numpy() & int(Quality.LIMITS) != 0
    assert marked.sum() == pytest.approx(beyond, abs=4)


def test_a_frozen_position_is_found_and_its_catching_up_is_no_jump(voyage):
    parts = sailing.series()
    x, y = (parts["/position"].columns[n].copy() for n in ("x_m", "y_m"))
    x[300:340], y[300:340] = x[299], y[299]
    done = voyage(changed(parts, "/position", x_m=x, y_m=y))
    assert ("held", "position") in kinds(done.report)
    assert "jump" not in [f.kind for f in done.report.findings]
    frozen = done.table.filter(pl.col("quality") & int(Quality.FROZEN) != 0)
    assert frozen.height == pytest.approx(40, abs=2)


def test_a_jump_of_the_position_starts_anew(voyage):
    parts = sailing.series()
    x = parts["/position"].columns["x_m"].copy()
    x[300:] += 6.0
    done = voyage(changed(parts, "/position", x_m=x))
    assert ("jump", "position") in kinds(done.report)
    assert done.table.filter(pl.col("quality") & int(Quality.JUMP) != 0).height >= 1


def test_without_a_yaw_rate_sensor_the_heading_is_differentiated(voyage):
    text = sailing.PROFILE.replace("[sensors.yaw_rate]", "[ignored]")
    start = text.index("[ignored]")
    text = text[:start] + text[text.index("[sensors.wind]") :]
    assert voyage(text=text).table["yaw_rate"].to_numpy() == pytest.approx(0.04, abs=1e-6)


SLOW = {"/position": 1.0, "/velocity": 1.0, "/gyro": 0.5, "/wind": 1.0, "/rudder": 1.0}


def slow(parts):
    """The same log at about one message a second, its headings in whole degrees."""
    parts = dict(parts)
    for topic, period in SLOW.items():
        every = round(10 * period)
        parts = kept(parts, topic, np.arange(len(parts[topic].time)) % every == 0)
    heading = np.round(parts["/gyro"].columns["heading_deg"]) % 360.0
    return changed(parts, "/gyro", heading_deg=heading)


def without_wind(report):
    """Of a ship that circles in these logs the apparent wind stands still: a vane that is stuck."""
    return [pair for pair in kinds(report) if pair != ("implausible", "wind")]


def test_a_slow_coarse_log_is_reported_to_be_one_and_is_not_full_of_faults(voyage):
    done = voyage(slow(sailing.series(300.0)))
    assert not without_wind(done.report)
    assert (done.table["quality"] == 0).mean() > 0.99
    found = {one.channel: (one.rate_hz, one.resolution) for one in done.report.instruments}
    assert found["position"] == (1.0, 0.0)
    assert found["heading"] == (2.0, pytest.approx(1.0))
    assert found["propeller"] == (10.0, 0.0)
    assert done.report.slowest.rate_hz == 1.0
    lines = "\n".join(tables.voyage_lines(done.report))
    assert "rudder, velocity" in lines and "at 1 Hz" in lines and "heading 1 deg" in lines


def test_a_step_in_a_slow_log_is_found_once(voyage):
    parts = slow(sailing.series(300.0))
    x = parts["/position"].columns["x_m"].copy()
    x[150:] += 5.0
    report_ = voyage(changed(parts, "/position", x_m=x)).report
    ((kind, channel),) = without_wind(report_)
    assert (kind, channel) == ("jump", "position")
    assert report_.findings[0].value == pytest.approx(5.0, abs=0.1)
    assert report_.findings[0].start_s == pytest.approx(149.5, abs=0.6)


def test_a_turn_through_a_gap_in_the_compass_is_no_jump(voyage):
    parts = sailing.series()
    heading = parts["/gyro"].columns["heading_deg"]
    south = int(np.flatnonzero(np.diff(np.sign(heading - 180.0)))[0])  # where ingest wraps
    mask = np.ones(len(heading), bool)
    mask[south - 10 : south + 10] = False
    assert "jump" not in {kind for kind, _ in kinds(voyage(kept(parts, "/gyro", mask)).report)}


def test_usable_seconds_and_windows_are_counted(voyage):
    parts = sailing.series(330.0)
    mask = np.ones(len(parts["/gyro"].time), bool)
    mask[1500:1600] = False  # ten seconds: 150 s before and 170 s after
    report_ = voyage(kept(parts, "/gyro", mask)).report
    assert report_.usable_s == pytest.approx(320, abs=2)
    assert report_.windows == 2


def test_many_findings_of_a_kind_are_summed_up_and_all_are_kept(voyage):
    parts = sailing.series(300.0)
    mask = np.ones(len(parts["/wind"].time), bool)
    for second in range(10, 290, 4):
        mask[10 * second : 10 * second + 6 + second // 100] = False
    done = voyage(kept(parts, "/wind", mask)).report
    assert len([f for f in done.findings if f.kind == "gap"]) == fault_detection.LISTED + 1
    (line,) = [line for line in tables.voyage_lines(done) if "gap" in line]
    total = sum(f.value for f in done.findings)
    assert f"{total:.1f} s in all" in line and "from 201.9 s" in line
    assert len(tables.voyage_lines(done)) < 25


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('topic = "/gyro"', 'topic = "/giro"', "did you mean '/gyro'"),
        ('field = "heading_deg"', 'field = "headin_deg"', "did you mean 'heading_deg'"),
        ('fields = ["sog_kn"', 'fields = ["zzz"', "Fields found: cog_deg"),
    ],
)
def test_a_topic_or_field_that_is_not_there_names_those_that_are(voyage, old, new, expected):
    with pytest.raises(ChannelMissing, match=r"(?s)turn\.mcap.*") as caught:
        voyage(text=sailing.PROFILE.replace(old, new))
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("length_m = 3.0", "lenght_m = 3.0", "did you mean 'length_m'"),
        ('unit = "deg/min"', 'unit = "deg/hour"', "unit 'deg/hour' is not known"),
        ('kind = "sog_cog"', 'kind = "sogcog"', "it can be"),
        ('name = "propeller"', 'name = "rudder"', "already taken"),
        ('fields = ["x_m", "y_m"]', 'fields = ["x_m"]', "needs 2 field(s)"),
        ("sigma = 0.05", "sigmas = 0.05", "did you mean 'sigma'"),
    ],
)
def test_a_profile_that_cannot_be_is_refused_with_advice(old, new, expected):
    with pytest.raises(ProfileError) as caught:
        sailing.profile(sailing.PROFILE.replace(old, new))
    assert expected in str(caught.value)


DAY = 86_400_000_000_000


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """The circle as it is, ingested; nobody changes it."""
    folder = tmp_path_factory.mktemp("clean")
    return ingest(sailing.write(folder / "turn.mcap", sailing.series()), sailing.profile())


def restamped(parts, topic, rows, by):
    """Stamps moved by so many ns; the recorder's clock tells the truth."""
    one = parts[topic]
    time = one.time.copy()
    time[rows] += by
    return {**parts, topic: replace(one, time=time, log_time=one.time)}


@pytest.mark.parametrize(
    ("topic", "rows", "by"),
    [("/gyro", 300, 10 * DAY), ("/velocity", 300, -10 * DAY), ("/gyro", [5, 300], -sailing.START),
     ("/rudder", [5, 300], -sailing.START), ("/rudder", 299, 1024 * 7 * DAY),
     ("/velocity", 300, 3600 * 10**9), ("/gyro", 300, 120 * 10**9),
     ("/gyro", slice(0, 200), -sailing.START), ("/velocity", slice(0, 200), -sailing.START),
     ("/rudder", slice(0, 200), -sailing.START)],
    ids=["ten days late", "ten days early", "1970", "1970, an order", "week rollover", "an hour",
         "two minutes", "starts in 1970", "GNSS starts in 1970", "an order starts in 1970"],
)  # fmt: skip
def test_a_stamp_that_cannot_belong_is_left_out_and_reported(voyage, clean, topic, rows, by):
    done = voyage(restamped(sailing.series(), topic, rows, by))
    assert done.table.height <= clean.table.height
    both = done.table.join(clean.table, on="time", suffix="_clean")
    assert both.height == done.table.height  # no row at any other time
    for name in ("x0", "surge", "heading", "rudder"):
        off = (both[name] - both[f"{name}_clean"]).drop_nulls()
        assert float(off.abs().max()) < 1e-9
    output = [f for f in done.report.findings if f.kind == "jump"]
    assert {f.channel for f in output} == {topic}
    count = 200 if isinstance(rows, slice) else np.size(rows)
    assert output[0].sentence.startswith(f"{count} of ")
    assert output[0].sentence.endswith("away by the messages' own stamps.")
    assert output[0].value == pytest.approx(abs(by) * 1e-9, abs=60.0)


def test_a_sensor_that_fell_out_for_long_and_came_back_for_a_moment_is_data(voyage):
    parts = sailing.series(2000.0)
    t = (parts["/velocity"].time - sailing.START) * 1e-9
    done = voyage(kept(parts, "/velocity", (t < 1500.0) | (t > 1999.5)))
    assert "/velocity" not in [f.channel for f in done.report.findings]
    assert done.table["surge"].to_numpy()[-3:] == pytest.approx(sailing.SPEED, abs=1e-5)


def test_a_slow_sensor_has_no_strays():
    time = sailing.START + np.arange(0, 200) * 180 * 10**9  # a report every three minutes
    assert not resampling.strays(time, time + 10**9).any()
    assert not resampling.strays(time, sailing.START + np.arange(0, 200)).any()  # replayed at once


def test_stamps_scattered_over_years_are_refused_and_not_laid_on_a_grid(voyage):
    parts = sailing.series()
    gyro = parts["/gyro"]
    time = sailing.START + np.arange(len(gyro.time)) * 12 * 3600 * 10**9
    with pytest.raises(LogUnreadable, match="days apart"):
        voyage({**parts, "/gyro": replace(gyro, time=time)})
