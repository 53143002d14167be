"""NMEA 2000: one voyage in every notation, and what a reader of it must do right."""

import math

import made_nmea2000 as n2k
import numpy as np
import pytest
from circle_layouts import DATUM, RATE, SENSORS, START, Voyage, direct, profile_of, same

from shiplog.commands.convert import convert, draft
from shiplog.commands.prepare import check_logs, ingest_logs
from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion import formats
from shiplog.logs.conversion.nmea2000 import read_nmea2000
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.unchecked_lines import unchecked_lines
from shiplog.voyages.store.store import Store

ROLES = ("position", "sog_cog", "heading", "yaw_rate", "wind", "rudder", "propeller")
TOPICS = {  # of a log of NMEA 2000, instead of those of the profile in MCAP
    '"/gnss/fix"': '"/gnss/position"', 'topic = "/propeller/shaft_1"': 'topic = "/propeller/main"',
    'field = "speed_rps"\nunit = "rps"': 'field = "engine_rpm"\nunit = "rpm"\ngear_ratio = 2.0',
    '[sensors.yaw_rate]\ntopic = "/gyro"': '[sensors.yaw_rate]\ntopic = "/gyro/rate"',
}  # fmt: skip
COARSE = {"wind_speed": 0.006, "propeller": 0.004}  # 0.01 m/s; 0.25 rpm of the engine


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """The voyage in MCAP, and the same profile for a log of NMEA 2000."""
    profile = profile_of(*ROLES)
    text = '[ship]\nname = "circle"\nlength_m = 20.0\n' + "".join(SENSORS[one] for one in ROLES)
    for old, new in TOPICS.items():
        assert old in text
        text = text.replace(old, new)
    return profiles.parse(text + DATUM, "nmea2000"), direct(
        tmp_path_factory.mktemp("known"), profile, Voyage()
    )


def written(tmp_path, lines, name="boat.log"):
    path = tmp_path / name
    path.write_text(n2k.text(lines), newline="")
    return path


def topics(tmp_path, messages, notation=n2k.candump_l):
    found = read_nmea2000(written(tmp_path, notation(messages)))
    return {one.topic: one for one in found.series}, found.findings


@pytest.mark.parametrize("notation", n2k.NOTATIONS)
def test_the_voyage_equals_that_in_mcap_in_every_notation(tmp_path, known, notation):
    profile, table = known
    path = written(tmp_path, n2k.NOTATIONS[notation](n2k.circle()))
    assert formats.recognise(path).name == "NMEA 2000 logs"
    done = convert([path], None, tmp_path / "logs")
    assert not done.refused and not done.lost
    same(done.logs[0], profile, table, coarser=COARSE)


def test_the_library_reads_the_same_numbers(tmp_path):
    """nmea2000, an independent reader of the same lines."""
    library = pytest.importorskip("nmea2000.decoder", reason="pip install nmea2000")
    decoder = library.NMEA2000Decoder()
    theirs: dict[int, list] = {}
    for line in n2k.canboat(message for message in n2k.circle()):
        message = decoder.decode(line)
        if message is not None:
            fields = {one.id: one.value for one in message.fields}
            theirs.setdefault(message.PGN, []).append(fields)
    ours, _ = topics(tmp_path, n2k.circle())
    deg = 180.0 / math.pi
    for pgn, name, topic, column, factor in (
        (127250, "heading", "/gyro", "heading_deg", deg),
        (127251, "rate", "/gyro/rate", "yaw_rate_degps", deg),
        (127245, "position", "/rudder/main", "angle_deg", deg),
        (127488, "speed", "/propeller/main", "engine_rpm", 1.0),
        (129025, "latitude", "/gnss/position", "latitude", 1.0),
        (129026, "sog", "/gnss/velocity", "sog_mps", 1.0),
        (129029, "longitude", "/gnss/fix", "longitude", 1.0),
        (130306, "windAngle", "/wind/apparent", "direction_deg", deg),
    ):
        wanted = np.array([float(fields[name]) for fields in theirs[pgn]]) * factor
        np.testing.assert_allclose(ours[topic].columns[column], wanted, rtol=1e-12, atol=1e-9)


def test_a_draft_asks_for_the_ship_and_its_gear(tmp_path):
    path = written(tmp_path, n2k.candump_l(n2k.circle()))
    text = draft(path)
    drafted = profiles.parse(text, "draft")
    assert [(one.kind, one.topic, one.unit) for one in drafted.actuators] == [
        ("propeller", "/propeller/main", "rpm"), ("rudder", "/rudder/main", "deg")
    ]  # fmt: skip
    assert drafted.sensors.position.topic == "/gnss/position"  # ten a second, the fix one
    assert drafted.sensors.wind.topic == "/wind/apparent"
    assert drafted.actuators[0].gear_ratio == 1.0
    assert "actuators.propeller_main.gear_ratio" in unchecked_lines(text)
    assert "ahead or astern" not in text
    (tmp_path / "boat.toml").write_text(text)
    done = ingest_logs([path], str(tmp_path / "boat.toml"), Store(tmp_path / "store"))
    assert done.complete and done.reports[0].name == "boat"


# --- engines ------------------------------------------------------------------------------------


def test_a_gear_astern_turns_the_propeller_back(tmp_path):
    ahead, _ = topics(tmp_path, n2k.circle())
    back, _ = topics(tmp_path, n2k.circle(astern=True))
    turned = back["/propeller/main"].columns["engine_rpm"]
    assert (turned == -ahead["/propeller/main"].columns["engine_rpm"]).all() and turned[0] < 0


def test_neutral_drives_nothing_and_an_unknown_gear_is_no_direction(tmp_path):
    def messages():
        for k in range(40):
            yield START + k, 127488, 9, n2k.engine(1, 800.0)
            if k in (0, 10, 20):
                yield START + k - 0.1, 127493, 9, n2k.gear(1, {0: 1, 10: 0, 20: 3}[k])

    found, _ = topics(tmp_path, messages())
    rpm = found["/propeller/main"].columns["engine_rpm"]
    assert (rpm[1:10] == 0.0).all()  # neutral
    assert (rpm[11:20] == 800.0).all()
    assert (
        np.isnan(rpm[21:31]).all() and np.isnan(rpm[32:]).all()
    )  # unknown; then said too long ago


def test_without_a_gear_astern_is_asked_and_never_taken_as_ahead(tmp_path):
    messages = [one for one in n2k.circle() if one[1] != 127493]
    text = draft(written(tmp_path, n2k.candump_l(messages)))
    assert "CHECK: ahead or astern? PGN 127488 has no sign, and no 127493 says the gear" in text
    assert "actuators.propeller_main.topic" in unchecked_lines(text)


def test_two_engines_keep_their_own_gears(tmp_path):
    def messages():
        for k in range(5):
            yield START + k, 127493, 4, n2k.gear(0, 0)
            yield START + k, 127493, 4, n2k.gear(1, 2)
            for engine in (0, 1):
                yield START + k, 127488, 4, n2k.engine(engine, 900.0 + engine)

    found, _ = topics(tmp_path, messages())
    assert found["/propeller/engine_0"].columns["engine_rpm"].tolist() == [900.0] * 5
    assert found["/propeller/engine_1"].columns["engine_rpm"].tolist() == [-901.0] * 5


def test_a_gear_ratio_is_of_what_turns():
    body = '[ship]\nname="a"\nlength_m=5\n' + "".join(
        f'[sensors.{name}]\nkind="{kind}"\ntopic="/s"\nfields={fields}\n'
        for name, kind, fields in (("position", "local", ["x", "y"]), ("velocity", "body",
                                   ["u", "v"]), ("heading", "angle", ["h"]))
    )  # fmt: skip
    geared = (
        body + '[[actuators]]\nname="p"\nkind="propeller"\ntopic="/p"\nfield="n"\nunit="rpm"\n'
        "limits=[-2400, 2400]\ngear_ratio=2.0\n"
    )
    propeller = profiles.parse(geared, "p").actuators[0]
    assert propeller.scale() == [(0.0, pytest.approx(1 / 120))]
    assert propeller.si_limits == pytest.approx((-20.0, 20.0))
    with pytest.raises(Exception, match="gear_ratio"):
        profiles.parse(geared.replace('"propeller"', '"rudder"').replace("rpm", "deg"), "p")


# --- clocks -------------------------------------------------------------------------------------


@pytest.mark.parametrize("notation", ["YDWG", "Actisense", "iKonvert", "candump -td"])
def test_what_has_no_date_takes_that_of_the_log(tmp_path, notation):
    """And not the day of reading."""
    found, _ = topics(tmp_path, n2k.circle(), n2k.NOTATIONS[notation])
    assert abs(found["/gyro"].time[0] - round(START * 1e9)) < 1_000_000


def test_midnight_is_passed(tmp_path):
    midnight = 1_618_012_800.0
    found, _ = topics(tmp_path, n2k.still(midnight - 20, 40), n2k.ydwg)
    assert (np.diff(found["/gnss/position"].time) == 1_000_000_000).all()
    assert found["/gnss/position"].time[20] == round(midnight * 1e9)


def test_a_log_that_nobody_dates_counts_from_1970(tmp_path):
    messages = [one for one in n2k.circle() if one[1] not in (126992, 129029)]
    found, said = topics(tmp_path, messages, n2k.ydwg)
    assert any("no date" in one.sentence for one in said)
    assert 0 <= found["/gyro"].time[0] < 86_400_000_000_000


def test_lines_without_stamps_lie_between_those_that_state_utc(tmp_path):
    lines = (line.split(")  ", 1)[1] for line in n2k.candump(n2k.circle()))
    path = tmp_path / "bare.txt"
    path.write_text(n2k.text(lines))
    found = read_nmea2000(path)
    gyro = next(one for one in found.series if one.topic == "/gyro")
    assert np.abs(gyro.time - Voyage().ns).max() < 1_000_000_000
    assert any("no stamps" in one.sentence for one in found.findings)


def test_a_recorders_clock_that_is_off_is_put_right(tmp_path):
    late = [(unix + 3600.0, *rest) for unix, *rest in n2k.circle()]
    found, said = topics(tmp_path, late)
    assert abs(found["/gyro"].time[0] - round(START * 1e9)) < 1_000_000
    assert any("3600.0 s ahead" in one.sentence for one in said)


def test_a_fix_has_its_own_time(tmp_path):
    """129029 comes 0.3 s after its fix."""
    late = [
        (unix + (0.3 if pgn == 129029 else 0.0), pgn, *rest) for unix, pgn, *rest in n2k.circle()
    ]
    found, _ = topics(tmp_path, late)
    assert (found["/gnss/fix"].time % 1_000_000_000 == 0).all()


# --- blanks, references, several ----------------------------------------------------------------


def test_what_is_not_available_is_blank(tmp_path):
    def messages():
        for k in range(4):
            yield START + k, 129025, 3, n2k.position(56.0, 12.0)
            yield START + k, 129029, 3, n2k.gnss(START + k, 56.0, 12.0, method=0 if k < 2 else 1)
            yield (
                START + k,
                129026,
                3,
                bytes.fromhex("01fcffffffffffff" if k else "01fc102764000000"),
            )
            yield START + k, 127251, 17, bytes.fromhex("01ffffff7fffffff")

    found, said = topics(tmp_path, messages())
    assert np.isnan(found["/gnss/fix"].columns["latitude"]).tolist() == [True, True, False, False]
    assert np.isnan(found["/gnss/position"].columns["latitude"]).sum() >= 2
    sog = found["/gnss/velocity"].columns["sog_mps"]
    assert sog[0] == 1.0 and np.isnan(sog[1:]).all()
    assert "/gyro/rate" not in found  # a whole topic without a value is none
    assert any(one.kind == "status" for one in said)


def test_a_magnetic_heading_is_made_true(tmp_path):
    """By 127258, where the message itself has no variation; true and magnetic stay apart."""

    def messages():
        for k in range(4):
            yield START + k, 127258, 3, n2k.variation(math.radians(5.0))
            yield START + k, 127250, 17, n2k.heading(1.0, magnetic=True)
            yield START + k, 127250, 18, n2k.heading(1.1)
            yield START + k, 127250, 19, n2k.heading(1.0, True, math.radians(-1), math.radians(4))

    found, said = topics(tmp_path, messages())
    by_other = found["/gyro/compass/source_17"].columns["heading_deg"]
    assert by_other == pytest.approx(np.full(4, math.degrees(1.0) + 5.0), abs=0.01)
    own = found["/gyro/compass/source_19"].columns["heading_deg"]
    assert own == pytest.approx(np.full(4, math.degrees(1.0) + 4.0 - 1.0), abs=0.01)
    assert found["/gyro"].columns["heading_deg"] == pytest.approx(np.full(4, math.degrees(1.1)))
    assert any("RMC" not in one.sentence and "variation" in one.sentence for one in said)


def test_only_the_apparent_wind_is_the_wind_of_a_log(tmp_path):
    def messages():
        for k in range(4):
            for reference in range(5):
                yield START + k, 130306, 5, n2k.wind(5.0 + reference, 1.0, reference)

    found, _ = topics(tmp_path, messages())
    assert found["/wind/apparent"].columns["speed_mps"].tolist() == [7.0] * 4
    assert set(found) == {"/wind/apparent", "/wind/true", "/wind/true_north", "/wind/true_magnetic"}


def test_sources_stay_apart(tmp_path):
    """Two compasses of one kind; of a rudder that two senders report one is the actuator."""

    def messages():
        for k in range(60):
            angle = 0.3 * math.sin(0.2 * k)
            yield START + k, 127251, 17, n2k.rate_of_turn(0.01)
            yield START + k, 127251, 18, n2k.rate_of_turn(0.02)
            yield START + k, 127245, 7, n2k.rudder(0, angle)
            yield START + k + 0.1, 127245, 8, n2k.rudder(252, angle)
            yield START + k, 127245, 9, n2k.rudder(0, None, order=0.1)

    found, _ = topics(tmp_path, messages())
    assert {"/gyro/rate/source_17", "/gyro/rate/source_18"} <= set(found)
    rudders = {name: one for name, one in found.items() if name.startswith("/rudder")}
    assert set(rudders) == {"/rudder/rudder_0", "/rudder/rudder_252"}  # none of the empty one
    assert [name for name, one in rudders.items() if "actuator" in one.metadata] == [
        "/rudder/rudder_0"
    ]  # fmt: skip


def test_an_order_stands_for_a_rudder_only_where_no_position_is_sent(tmp_path):
    def messages():
        for k in range(40):
            yield START + k, 127245, 7, n2k.rudder(0, None, order=0.01 * k)

    found, _ = topics(tmp_path, messages())
    rudder = found["/rudder/main"]
    assert rudder.columns["angle_deg"][10] == pytest.approx(math.degrees(0.1), abs=1e-6)
    assert "CHECK: a set-point" in rudder.metadata["doubt"]


def test_the_rate_of_turn_is_that_of_the_bow_to_starboard(tmp_path):
    found, _ = topics(tmp_path, n2k.circle())
    rate = found["/gyro/rate"].columns["yaw_rate_degps"]
    assert rate == pytest.approx(np.full(601, math.degrees(RATE)), abs=2e-6)


# --- damage -------------------------------------------------------------------------------------


def test_comments_are_none_and_damaged_lines_are_counted(tmp_path):
    lines = list(n2k.candump_l(n2k.circle()))
    lines[0:0] = ["# recorded on the quay", ""]
    lines[50] = lines[50][:39]  # half a byte
    lines[60] = "\x07\x07garbage"
    path = written(tmp_path, lines)
    done = check_logs([path])
    assert not done.complete and "2 damaged lines" in next(iter(done.lost.values()))
    assert done.reports[0].messages_read > 4000


def test_a_message_of_which_a_frame_is_missing_is_left_out(tmp_path):
    lines = [
        line for k, line in enumerate(n2k.candump_l(n2k.circle()))
        if not ("#" in line and line.split("#")[0].endswith("F80503") and k % 40 == 3)
    ]  # fmt: skip
    whole = topics(tmp_path, n2k.circle())[0]["/gnss/fix"]
    found = read_nmea2000(written(tmp_path, lines))
    fix = next(one for one in found.series if one.topic == "/gnss/fix")
    assert len(fix.time) < len(whole.time)
    assert set(fix.columns["latitude"]) <= set(whole.columns["latitude"])


def test_a_bus_of_something_else_says_what_to_log(tmp_path):
    tanks = [one for one in n2k.circle() if one[1] == 127505]
    with pytest.raises(ChannelMissing) as refused:
        read_nmea2000(written(tmp_path, n2k.candump_l(tanks)))
    assert "127505 (601)" in refused.value.message and "127245 (rudder)" in refused.value.hint


def test_three_columns_of_whole_numbers_are_no_bus(tmp_path):
    (tmp_path / "table.txt").write_text(
        "".join(f"{10000 + k} {20000 + k} 3040\n" for k in range(9))
    )
    assert formats.recognise(tmp_path / "table.txt").name == "CSV or Parquet tables"
