"""Times in every form, tables in every cut, and what is reported of what cannot be converted."""

import logging
import time

import numpy as np
import polars as pl
import pytest

from shiplog.commands.convert import convert
from shiplog.exceptions import ChannelMissing, ProfileError
from shiplog.logs.conversion import clock, heartbeat
from shiplog.logs.conversion.columns import schema_of
from shiplog.logs.conversion.delimited import read_table
from shiplog.logs.conversion.nmea import is_nmea, read_nmea_log
from shiplog.logs.conversion.topics import folder_to_series
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest.ingest import ingest


@pytest.mark.parametrize(
    "text",
    [
        "a,b\n1.5,2\n2.5,3\n", "a;b\n1,5;2\n2,5;3\n", "a\tb\n1.5\t2\n2.5\t3\n",
        "a|b\n1.5|2\n2.5|3\n",
        "# a  b\n 1.5   2\n 2.5   3\n", "made by hand\n\na;b\n[m];[s]\n1,5;2\n2,5;3\n",
        '"a","b"\r\n"1.5","2"\r\n"2.5","3"\r\n',
    ],
)  # fmt: skip
def test_a_table_is_the_same_however_it_is_cut(tmp_path, text):
    (tmp_path / "t.csv").write_bytes(text.encode())
    frame = read_table(tmp_path / "t.csv").frame
    assert frame.to_dict(as_series=False) == {"a": [1.5, 2.5], "b": [2, 3]}


PROFILE = """[ship]
name = "s"
length_m = 5.0
[sensors.position]
kind = "local"
topic = "/ship/state"
fields = ["x0_m", "y0_m"]
[sensors.velocity]
kind = "body"
topic = "/ship/state"
fields = ["surge_mps", "sway_mps"]
[sensors.heading]
topic = "/gyro"
field = "heading_deg"
unit = "deg"
[sensors.yaw_rate]
topic = "/gyro"
field = "yaw_rate_degps"
unit = "deg/s"
[table]
t = "time"
x = "x0"
y = "y0"
u = "surge"
v = "sway"
psi = { channel = "heading", unit = "deg" }
sog = "sog"
cog = { channel = "cog", unit = "deg" }
"""
RUNS = PROFILE + 'run = "voyage"\n'


def read_nmea(path):
    """Series of a text, and how many of its sentences were damaged."""
    found = read_nmea_log([path], path.name)
    return found.series, found.damaged


def test_a_missing_yaw_rate_is_differentiated_and_reported(tmp_path, caplog):
    count = 100
    turned = 350.0 + 2.0 * np.arange(count) / 10  # deg, through north
    columns = {"t": np.arange(count) / 10, "psi": turned % 360}
    pl.DataFrame(columns | {n: np.zeros(count) for n in "xyuv"}).write_csv(tmp_path / "t.csv")
    profile = profiles.parse(PROFILE, "mine")
    with caplog.at_level(logging.WARNING):
        done = convert([tmp_path / "t.csv"], profile, tmp_path)
    assert "no yaw rate" in caplog.text and "heading's derivative" in caplog.text
    rate = ingest(done.logs[0], profile).table["yaw_rate"].to_numpy()
    assert np.degrees(rate) == pytest.approx(2.0, abs=1e-6)


def test_a_velocity_of_another_kind_says_which_kind_to_write(tmp_path):
    (tmp_path / "t.csv").write_text("t,x,y,psi,sog,cog\n0,0,0,0,1,0\n1,1,0,0,1,0\n")
    done = convert([tmp_path / "t.csv"], profiles.parse(PROFILE, "mine"), tmp_path)
    (why,) = done.refused.values()
    assert "no column for surge, sway" in why and 'kind = "sog_cog"' in why
    assert not list(tmp_path.glob("*.mcap"))


def test_a_channel_that_does_not_exist_is_answered_with_those_that_do():
    with pytest.raises(ProfileError, match="latitud") as refused:
        profiles.parse(PROFILE + 'lat = "latitud"\n', "mine")
    for channel in ("latitude", "longitude", "sog", "velocity_north", "heading", "time", "vessel"):
        assert channel in str(refused.value).split("Its channels:")[1]


def test_words_among_numbers_are_blanks_and_reported(tmp_path, caplog):
    rows = [f"{i / 10},{i},0,1,0,{'---' if i == 3 else 5.0}" for i in range(30)]
    (tmp_path / "t.csv").write_text("\n".join(["t,x,y,u,v,psi", *rows]))
    profile = profiles.parse(PROFILE, "mine")
    done = convert([tmp_path / "t.csv"], profile, tmp_path)
    assert "1 values of psi are no numbers, such as '---'" in caplog.text
    assert ingest(done.logs[0], profile).table["heading"].null_count() >= 1
    assert not done.refused


def test_rows_without_a_time_are_lost_and_blank_rows_are_none(tmp_path):
    rows = [f"{i / 10 if i != 3 else ''},{i},0,1,0,5" for i in range(30)]
    (tmp_path / "t.csv").write_text("\n".join(["t,x,y,u,v,psi", *rows, ",,,,,", ",,,,,"]))
    done = convert([tmp_path / "t.csv"], profiles.parse(PROFILE, "mine"), tmp_path)
    assert done.lost == {str(tmp_path / "t.csv"): "1 row without a time"}


@pytest.mark.parametrize("scaled", ["offset = -30.0", "sign = 0.001"])
def test_a_time_with_an_offset_is_refused_and_not_taken_without_it(tmp_path, scaled):
    text = PROFILE.replace('t = "time"', f't = {{ channel = "time", unit = "s", {scaled} }}')
    assert text != PROFILE
    profile = profiles.parse(text, "mine")
    (tmp_path / "t.csv").write_text("t,x,y,u,v,psi\n0,0,0,1,0,5\n1,1,0,1,0,5\n")
    refused = str(convert([tmp_path / "t.csv"], profile, tmp_path).refused)
    assert "'t' has a `sign` or an `offset`, and is a time" in refused
    (tmp_path / "dump").mkdir()
    (tmp_path / "dump" / "gyro.csv").write_text("t,psi\n0,5\n1,5\n")
    assert "is a time" in str(convert([tmp_path / "dump"], profile, tmp_path).refused)


def test_times_that_begin_before_zero_are_refused_with_a_way_out(tmp_path):
    """A manoeuvre whose clock is 0 at the execute."""
    (tmp_path / "t.csv").write_text("t,x,y,u,v,psi\n-1,0,0,1,0,5\n0,1,0,1,0,5\n")
    refused = str(convert([tmp_path / "t.csv"], profiles.parse(PROFILE, "m"), tmp_path).refused)
    assert "before 1970" in refused and "add the same number to all times" in refused


def test_rows_that_go_back_in_time_are_sorted_and_reported(tmp_path, caplog):
    rows = [f"{i / 10},{i},0,1,0,5" for i in range(30)]
    (tmp_path / "t.csv").write_text("\n".join(["t,x,y,u,v,psi", *reversed(rows)]))
    profile = profiles.parse(PROFILE, "mine")
    done = convert([tmp_path / "t.csv"], profile, tmp_path)
    assert "goes back in time 29 times" in caplog.text
    assert ingest(done.logs[0], profile).table["x0"].is_sorted()


@pytest.mark.parametrize(
    ("runs", "names"),
    [
        (["1.1", "1.2", "1.2"], {"1.1", "1.2"}), (["1.0", "2.0", "2.0"], {"1", "2"}),
        (["1.5", "2.0", "2.0"], {"1.5", "2.0"}), (["a", "b", "b"], {"a", "b"}),
    ],
)  # fmt: skip
def test_voyages_are_called_as_the_table_calls_them(tmp_path, runs, names):
    rows = [f"{i},{i},0,1,0,5,{run}" for i, run in enumerate(runs)]
    (tmp_path / "t.csv").write_text("\n".join(["t,x,y,u,v,psi,run", *rows]))
    done = convert([tmp_path / "t.csv"], profiles.parse(RUNS, "mine"), tmp_path)
    assert {path.stem for path in done.logs} == names and not done.lost


def test_rows_of_no_voyage_are_counted_as_lost(tmp_path):
    for name, runs in (("some", ["a", "", '" "', "a"]), ("none", ["", "", '" "', ""])):
        rows = [f"{i},{i},0,1,0,5,{run}" for i, run in enumerate(runs)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["t,x,y,u,v,psi,run", *rows]))
    done = convert([tmp_path / "some.csv", tmp_path / "none.csv"],
                   profiles.parse(RUNS, "mine"), tmp_path)  # fmt: skip
    assert done.lost == {str(tmp_path / "some.csv"): "2 rows whose voyage is blank"}
    assert [path.stem for path in done.logs] == ["a"]
    assert "run is blank in every row" in done.refused[str(tmp_path / "none.csv")]


def test_a_topic_of_the_contract_keeps_its_schema_and_another_gets_one_of_its_own():
    assert schema_of("/gyro", ["yaw_rate_degps"]) == "shiplog.Gyro"
    assert schema_of("/gyro", ["yaw_rate_degps", "volts"]) == "shiplog.table.gyro"
    assert schema_of("/2nd engine", ["speed"]) == "shiplog.table._2nd_engine"


def test_a_table_of_a_folder_that_cannot_be_read_is_lost(tmp_path):
    (tmp_path / "dump").mkdir()
    (tmp_path / "dump" / "a.csv").write_text("stamp_ns,x\n1000000000,1\n2000000000,2\n")
    (tmp_path / "dump" / "b.parquet").write_bytes(b"PAR1x")
    done = convert([tmp_path / "dump"], None, tmp_path)
    assert [path.name for path in done.logs] == ["dump.mcap"] and not done.refused
    assert "b.parquet cannot be read" in done.lost[str(tmp_path / "dump")]


def dumped(tmp_path, text):
    (tmp_path / "dump").mkdir()
    (tmp_path / "dump" / "a__b.csv").write_text(text)
    (topic,), _ = folder_to_series(tmp_path / "dump", None)
    return pl.DataFrame(topic.columns)


def test_fields_of_one_plain_name_are_all_kept(tmp_path, caplog):
    header = "stamp_ns,pose.x,pose_x,pose_x_2,速度,角度"
    table = dumped(tmp_path, header + "\n1000000000,1,2,3,4,5\n2000000000,6,7,8,9,10\n")
    assert table.rows() == [(1, 2, 3, 4, 5), (6, 7, 8, 9, 10)]
    assert table.columns == ["pose_x", "pose_x_2", "pose_x_2_2", "__", "___2"]
    assert "'pose_x' becomes the field pose_x_2" in caplog.text


def test_a_word_in_a_column_of_a_folder_is_a_blank(tmp_path, caplog):
    caplog.set_level(logging.INFO)
    rows = "".join(f"{i}000000000,{v},ok\n" for i, v in enumerate((1.5, "n/a", 3.5, 4.5), 1))
    table = dumped(tmp_path, "stamp_ns,angle,state\n" + rows)
    assert table["angle"].fill_nan(None).to_list() == [1.5, None, 3.5, 4.5]
    assert "1 values of angle are no numbers" in caplog.text
    assert "'state' holds no numbers" in caplog.text and "state" not in table.columns


def test_short_first_rows_are_filled_with_blanks_where_they_are_a_habit(tmp_path):
    rows = "".join(f"{i},2,3\n" for i in range(2, 6))
    (tmp_path / "t.csv").write_text("time,a,b\n0,1\n1,1\n" + rows)
    assert read_table(tmp_path / "t.csv").frame["b"].to_list() == [None, None, 3, 3, 3, 3]


def test_commas_that_group_thousands_are_no_decimal_commas(tmp_path):
    def rpm(text):
        (tmp_path / "t.csv").write_text(text)
        return read_table(tmp_path / "t.csv").frame["rpm"].to_list()

    assert rpm('time,rpm\n0,998\n1,"1,002"\n2,"1,234,567"\n') == [998, 1002, 1234567]
    assert rpm('time,rpm\n0,998.5\n1,"1,002.25"\n') == [998.5, 1002.25]
    assert rpm('time,rpm\n0,"1,5"\n1,"1,002"\n') == [1.5, 1.002]  # one of them is no group
    assert rpm("time;rpm\n0;998\n1;1,002\n2;0,998\n") == [998, 1.002, 0.998]
    rpm("time;rpm\n0;998\n1;1,002\n")  # and of this nobody can say
    assert read_table(tmp_path / "t.csv").undecided == {"rpm": "1,002"}


def test_two_columns_of_one_channel_are_refused(tmp_path):
    text = PROFILE.replace("[table]", '[table]\n"u2" = { channel = "surge" }', 1)
    assert text != PROFILE
    (tmp_path / "t.csv").write_text("")
    profile = profiles.parse(text, "m")
    names = [*profile.table]
    (tmp_path / "t.csv").write_text(",".join(names) + "\n" + ",".join("1" for _ in names) + "\n")
    refused = str(convert([tmp_path / "t.csv"], profile, tmp_path).refused)
    assert "are all 'surge' in [table]" in refused and "u2" in refused


def test_a_table_without_rows_or_profile_is_refused(tmp_path):
    (tmp_path / "t.csv").write_text("t,x\n")
    done = convert([tmp_path / "t.csv"], profiles.parse(PROFILE, "m"), tmp_path)
    assert "no row" in str(done.refused)
    assert "only a profile says" in str(convert([tmp_path / "t.csv"], None, tmp_path).refused)


BURST = ["$GPGGA,101010.00,6326.4000,N,01025.2000,E,4,19,0.6,2.9,M,40.9,M,,",
         "$GPRMC,101010.00,A,6326.4000,N,01025.2000,E,2.0,90.0,110425,,,A",
         "$HEHDT,345.0,T", "$GPHDT,346.0,T", "$WIMWV,30.0,R,10.0,K,A", "$IIMWV,,R,,N,V",
         "$AGRSA,-5.0,A,4.0,A", "$XXABC,1,2"]  # fmt: skip


def test_what_nmea_says_in_its_own_units(tmp_path, caplog):
    """By hand: knots, minutes of arc, km/h; two headings are two topics; what is broken is
    reported."""
    caplog.set_level(logging.INFO)
    lines = [*BURST, "$HEHDT,350.0,T*00", "!AIVDM,1,1,,A,13u?etPv2;0n:dDPwUM1U1Cb069D,0*24"]
    (tmp_path / "a.nmea").write_text("\n".join(lines))
    assert is_nmea(tmp_path / "a.nmea")
    series, damaged = read_nmea(tmp_path / "a.nmea")
    topics = {s.topic: {n: c.tolist() for n, c in s.columns.items()} for s in series}
    assert topics["/gnss/fix"]["latitude"] == pytest.approx([63 + 26.4 / 60])
    assert topics["/gnss/fix"]["longitude"] == pytest.approx([10 + 25.2 / 60])
    assert topics["/gnss/velocity"]["sog_mps"] == pytest.approx([2 * 1852 / 3600])
    assert topics["/gyro/he"] == {"heading_deg": [345.0]}
    assert topics["/gyro/gp"] == {"heading_deg": [346.0]}
    assert topics["/wind/apparent"] == {"speed_mps": [pytest.approx(10 / 3.6)],
                                        "direction_deg": [30.0]}  # fmt: skip
    assert topics["/rudder/starboard"] == {"angle_deg": [-5.0]}
    assert topics["/rudder/port"] == {"angle_deg": [4.0]}
    assert damaged == 1 and "1 damaged" in caplog.text and "not valid" in caplog.text
    assert "VDM (1)" in caplog.text and "ABC (1)" in caplog.text
    assert {int(t) for s in series for t in s.time} == {1_744_366_210_000_000_000}
    done = convert([tmp_path / "a.nmea"], None, tmp_path)
    assert "1 damaged" in done.lost[str(tmp_path / "a.nmea")]


def test_a_maker_s_own_sentence_is_not_used_and_not_damaged(tmp_path, caplog):
    caplog.set_level(logging.INFO)
    own = ["$PFEC,GPatt,12.0,1.0,2.0*3A", "$PSRF103,00,00,01,01*25", "$PGRME,3.1,M,4.2,M,5.2,M"]
    (tmp_path / "a.nmea").write_text("\n".join([*BURST, *own, "$GPRM"]))
    assert read_nmea(tmp_path / "a.nmea")[1] == 1  # the last one: cut off
    assert "PFEC (1)" in caplog.text and "PSRF103 (1)" in caplog.text


def nmea_topics(tmp_path, lines):
    (tmp_path / "a.nmea").write_text("\n".join(lines))
    return {s.topic: s for s in read_nmea(tmp_path / "a.nmea")[0]}


def test_starboard_stays_starboard_where_port_alone_is_not_valid(tmp_path):
    two = ["$AGRSA,5.0,A,3.0,A", "$AGRSA,6.0,A,3.0,V", "$AGRSA,7.0,V,4.0,A"]
    topics = nmea_topics(tmp_path, [*BURST[:2], *two])
    starboard, port = (topics[f"/rudder/{s}"].columns["angle_deg"] for s in ("starboard", "port"))
    np.testing.assert_equal(starboard, [5.0, 6.0, np.nan])  # not valid: blank
    np.testing.assert_equal(port, [3.0, np.nan, 4.0])
    one = nmea_topics(tmp_path, [*BURST[:2], "$AGRSA,5.0,A,0.0,V", "$AGRSA,6.0,A,,"])
    assert one["/rudder/main"].columns["angle_deg"].tolist() == [5.0, 6.0]
    assert not [topic for topic in one if topic.startswith("/rudder/") and topic != "/rudder/main"]


def test_the_clock_of_a_receiver_without_a_fix_is_not_believed(tmp_path):
    cold = ["$GPRMC,000010,V,,,,,,,060180", "$HEHDT,1.0,T", "$HEHDT,2.0,T"]
    topics = nmea_topics(tmp_path, [*cold, *BURST])
    assert topics["/gyro/he"].columns["heading_deg"].tolist() == [345.0]
    assert {int(t) for s in topics.values() for t in s.time} == {1_744_366_210_000_000_000}


def test_a_date_beyond_every_log_is_a_damaged_sentence(tmp_path):
    (tmp_path / "a.nmea").write_text("\n".join(["$GPZDA,101009.00,11,04,9999,00,00", *BURST]))
    series, damaged = read_nmea(tmp_path / "a.nmea")
    assert damaged == 1
    assert {int(t) for s in series for t in s.time} == {1_744_366_210_000_000_000}


def test_the_best_sentence_says_where_the_ship_is_whatever_comes_first(tmp_path):
    """By hand: GLL and VTG differ from GGA and RMC, and stand before them."""
    lines = ["$GPGLL,6300.0000,N,01000.0000,E,101010.00,A,A", "$GPVTG,10.0,T,,M,9.0,N,,K,A", *BURST]
    (tmp_path / "a.nmea").write_text("\n".join(lines))
    topics = {s.topic: s.columns for s in read_nmea(tmp_path / "a.nmea")[0]}
    assert topics["/gnss/fix"]["altitude"].tolist() == [2.9]  # only GGA has one
    assert topics["/gnss/velocity"]["cog_deg"].tolist() == [90.0]


@pytest.mark.parametrize(
    "where", [",,,", "6326.4000,N,,", ",N,01025.2000,E", "6326.4000,,01025.2000,E"]
)
def test_a_fix_without_a_position_is_no_position_off_africa(tmp_path, where):
    """Dead reckoning (quality 6) that has begun nowhere yet: not 0 deg N, 0 deg E."""
    lines = [f"$GPGGA,101011.00,{where},6,00,,,M,,M,,", *BURST]
    fix = nmea_topics(tmp_path, lines)["/gnss/fix"]
    assert np.isnan(fix.columns["latitude"]).tolist() == [True, False]
    assert np.isnan(fix.columns["longitude"]).tolist() == [True, False]


def test_headings_between_two_fixes_are_spread_over_the_time_between_them(tmp_path):
    lines = []
    for second in range(3):
        lines.append(f"$GPRMC,1010{second:02d}.00,A,6326.4,N,01025.2,E,2.0,90.0,110425,,,A")
        lines += [f"$HEHDT,{10 * second + k}.0,T" for k in range(4)]
    (tmp_path / "a.nmea").write_text("\n".join(lines))
    series, _ = read_nmea(tmp_path / "a.nmea")
    (heading,) = [s for s in series if s.topic == "/gyro"]
    assert np.diff(heading.time).tolist() == [250_000_000] * 11


def test_nmea_that_says_nothing_or_has_no_time_is_refused(tmp_path):
    (tmp_path / "a.nmea").write_text("$XXABC,1,2\n")
    with pytest.raises(ChannelMissing, match="Sentences found: ABC"):
        read_nmea(tmp_path / "a.nmea")
    (tmp_path / "b.nmea").write_text("$HEHDT,1.0,T\n")
    with pytest.raises(ChannelMissing, match="has no time"):
        read_nmea(tmp_path / "b.nmea")


def test_long_work_speaks_and_short_work_does_not(caplog):
    caplog.set_level(logging.INFO)
    with heartbeat.saying("reading", every_s=0.01):
        while "reading" not in caplog.text:
            time.sleep(0.01)
    spoken = len(caplog.records)
    with heartbeat.saying("brief", every_s=60.0):
        pass
    assert len(caplog.records) == spoken
    assert heartbeat.EVERY_S <= 2.0


@pytest.mark.parametrize(
    "stamp",
    ["2016-12-31T23:59:60Z", "2024-02-30 00:00:00", "9999-12-31T23:59:59Z",
     "0001-01-01T00:00:00+23:59"],
)  # fmt: skip
def test_a_receive_stamp_that_is_no_time_costs_no_log(tmp_path, stamp):
    """A leap second, a damaged digit, or what stands for no time at all: the line takes the time
    of those around it."""
    lines = [f"2024-02-28T10:00:0{k}Z $HEHDT,{k}.0,T" for k in range(5)]
    lines.insert(2, f"{stamp} $HEHDT,9.0,T")
    (tmp_path / "a.nmea").write_text("\n".join(lines))
    (series,), damaged = read_nmea(tmp_path / "a.nmea")
    assert damaged == 0
    assert (series.topic, series.time[0] // 10**9) == ("/gyro", 1_709_114_400)
    assert len(series.time) >= 5 and np.diff(series.time).max() <= 10**9


def test_a_date_that_was_not_written_is_no_date():
    found = clock.dates(pl.Series([240124.0, None, float("nan")]))
    assert found.null_count() == 2 and found[0] == 1_706_054_400_000_000_000
