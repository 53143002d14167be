"""A drafted profile reads the log it was drafted from, and says what it guessed."""

import math
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from shiplog.commands.convert import convert
from shiplog.drafting import draft, draft_table
from shiplog.exceptions import LogUnreadable, ProfileError
from shiplog.logs.conversion.write import Series, write_log
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split import choose_split

SAMPLE = Path(__file__).parents[2] / "sample_logs" / "voyage_1.mcap"


def test_a_contract_log_drafts_the_profile_it_was_recorded_with():
    drafted = profiles.parse(draft(SAMPLE), "draft")
    shipped = profiles.load("esso-vectwin")
    assert drafted.wanted() == shipped.wanted()
    for name, sensor in shipped.sensors.items():
        assert drafted.sensors.kind(name) == shipped.sensors.kind(name)
        assert getattr(drafted.sensors, name).scale() == sensor.scale()
    assert {a.kind for a in drafted.actuators} == {"rudder", "propeller"}
    assert {a.topic: a.scale() for a in drafted.actuators} == {
        a.topic: a.scale() for a in shipped.actuators
    }


def test_what_a_log_cannot_say_is_marked_and_the_table_is_that_of_a_ship_without_lever_arm():
    text = draft(SAMPLE)
    assert "length_m = 1.0  # CHECK" in text and "lever_arm_m = [0.0, 0.0]  # CHECK" in text
    mine = ingest(SAMPLE, profiles.parse(text, "draft")).table
    known = ingest(SAMPLE, profiles.load("esso-vectwin")).table
    apart = (mine["x0"] - known["x0"]) ** 2 + (mine["y0"] - known["y0"]) ** 2
    assert apart.sqrt().to_numpy() == pytest.approx(0.3)  # the antenna, 0.3 m ahead of midship
    assert mine.select(pl.corr("yaw_rate", known["yaw_rate"])).item() == pytest.approx(1.0)


def test_a_log_that_is_none_is_refused(tmp_path):
    (tmp_path / "x.mcap").write_bytes(b"PK\x03\x04 a zip")
    with pytest.raises(LogUnreadable):
        draft(tmp_path / "x.mcap")


@pytest.mark.shared
def test_a_foreign_ship_drafts_what_its_owner_wrote(shared_data):
    folder = shared_data / "other_ship"
    owner = profiles.load(folder / "other_ship.toml")
    drafted = profiles.parse(draft(folder / "nominal_1.mcap"), "draft")
    assert drafted.wanted() == owner.wanted()
    assert drafted.sensors.kind("position") == "local"
    assert drafted.sensors.kind("velocity") == "body"


@pytest.mark.shared
def test_a_log_without_ship_says_so_channel_by_channel(shared_data):
    text = draft(shared_data / "mcap" / "json" / "foxglove_tutorial_battery_speed_location.mcap")
    assert 'kind = "geodetic"' in text
    assert "No heading was recognised" in text and "No actuator was recognised" in text


def log_of(path: Path, topics: dict[str, dict[str, list[float]]]) -> Path:
    """A foreign log: each topic's fields, 10 Hz."""
    series = []
    for number, (topic, columns) in enumerate(topics.items()):
        count = len(next(iter(columns.values())))
        time = 1_700_000_000_000_000_000 + 100_000_000 * np.arange(count)
        values = {name: np.asarray(column, float) for name, column in columns.items()}
        series.append(Series(topic, f"foreign.Topic{number}", time, values))
    write_log(path, series, ship="")
    return path


def section(text: str, name: str) -> str:
    """A section of a draft, as far as the next empty line."""
    return text.split(f"[{name}]")[1].split("\n\n")[0]


def test_names_that_toml_or_a_column_cannot_have_as_they_are(tmp_path):
    """Two rudders in Japanese letters are two columns; a ship's name keeps its marks."""
    turning = {"angle_deg": [1.0, 2.0, 3.0]}
    topics = {
        "/fix": {"latitude": [59.0] * 3, "longitude": [10.0] * 3},
        "/gnss/vel": {"sog_mps": [1.0] * 3, "cog_deg": [2.0] * 3},
        "/gyro": {"heading_deg": [3.0] * 3},
        "/rudder/右舷": turning, "/rudder/左舷": turning, '/"x"': {"y": [0.0] * 3},
    }  # fmt: skip
    log = log_of(tmp_path / "a.mcap", topics)
    write_log(
        tmp_path / "b.mcap",
        [Series(t, f"foreign.T{i}", np.arange(3) * 10**8, {n: np.array(v) for n, v in c.items()})
         for i, (t, c) in enumerate(topics.items())],
        ship='M/V "Foo" \\ 2',
    )  # fmt: skip
    profile = profiles.parse(draft(tmp_path / "b.mcap"), "draft")
    assert profile.ship.name == 'M/V "Foo" \\ 2'
    assert profile.actuator_names == ("rudder", "rudder_2")
    assert {a.topic for a in profile.actuators} == {"/rudder/右舷", "/rudder/左舷"}
    assert ingest(log, profiles.parse(draft(log), "draft")).table.height == 3


def test_set_points_come_last_and_instruments_before_estimates(tmp_path):
    path = log_of(
        tmp_path / "rich.mcap",
        {
            "/guidance/reference/acceleration": {"heading": [0.0, 0.1]},
            "/navigation/estimate": {"heading": [1.0, 1.1], "latitude": [1, 2],
                                     "longitude": [1, 2]},
            "/boat/compass": {"heading": [1.2, 1.3]},
            "/boat/gps": {"latitude": [59.5, 59.6], "longitude": [10.1, 10.2]},
            "/cmd/velocity": {"sog_mps": [9.0, 9.0], "cog_deg": [1.0, 2.0]},
            "/actuator_ref/rudder": {"angle_deg": [30.0, 30.0]},
            "/rudder/feedback": {"angle_deg": [3.0, 4.0]},
            "/desired/propeller": {"rpm": [100.0, 100.0]},
        },
    )  # fmt: skip
    text = draft(path)
    heading = section(text, "sensors.heading")
    assert 'topic = "/boat/compass"  # 10 Hz, 2 messages' in heading
    assert '# Second choice: kind = "angle", topic = "/navigation/estimate"' in heading
    position = section(text, "sensors.position")
    assert 'topic = "/boat/gps"' in position
    assert "latitude: 59.5 to 59.6; first 59.5, 59.6" in position
    # Nothing measures the velocity or the propeller: the orders stand there, marked.
    assert "CHECK: a set-point" in section(text, "sensors.velocity")
    drafted = profiles.parse(text, "draft")
    assert [a.topic for a in drafted.actuators] == ["/rudder/feedback", "/desired/propeller"]
    assert 'topic = "/desired/propeller"  # CHECK: a set-point' in text


def test_a_topic_without_a_value_is_not_drafted(tmp_path):
    nothing = [float("nan")] * 2
    path = log_of(
        tmp_path / "blank.mcap",
        {"/a/compass": {"heading": nothing}, "/b/magnetic": {"heading": [1.0, 2.0]}},
    )
    assert 'topic = "/b/magnetic"' in section(draft(path), "sensors.heading")


def test_a_log_of_many_vessels_asks_which(tmp_path):
    path = log_of(
        tmp_path / "ais.mcap",
        {
            f"ais/{mmsi}/1": {"lat": [n, n], "lon": [n, n], "sog": [1, 1], "cog": [n, n],
                              "heading": [n, n]}
            for n, mmsi in enumerate((265000001, 265000002, 2190047))
        },
    )  # fmt: skip
    with pytest.raises(ProfileError, match=r"3 vessels.*265000001 \(2 messages\)"):
        draft(path)
    with pytest.raises(ProfileError, match="none is 7"):
        draft(path, "7")
    drafted = profiles.parse(draft(path, "265000002"), "draft")
    assert set(drafted.wanted()) == {"ais/265000002/1"}


TABLE = """mmsi;time;lat;lon;SOG [kn];cog;psi_ref;psi;yaw_rate;rudder_cmd;rudder;delta;pwm_1
219;2024-05-01T00:00:00Z;59,1;10,1;4,0;10;99;100,000;0,0200;5;3,0;0,052359878;1500
219;2024-05-01T00:00:01Z;59,2;10,2;4,0;11;99;101,146;0,0200;5;4,0;0,069813170;1700
219;2024-05-01T00:00:02Z;59,3;10,3;4,0;12;99;102,292;0,0200;5;5,0;0,087266463;1600
220;2024-05-01T00:00:00Z;1,0;1,0;0,0;0;99;0,0;0,0;5;0,0;0,0;1500
220;2024-05-01T00:00:01Z;1,0;1,0;0,0;0;99;0,0;0,0;5;0,0;0,0;1500
"""


def test_a_table_drafts_what_converts_it(tmp_path):
    """Column by column: the ship, set-points left out, one rudder twice, and a rate's unit."""
    path = tmp_path / "fleet.csv"
    path.write_text(TABLE)
    with pytest.raises(ProfileError, match=r"219 \(3 rows\), 220 \(2 rows\)"):
        draft_table(path)
    text = draft_table(path, "219")
    profile = profiles.parse(text, "draft")
    channels = {name: (c.channel, c.unit) for name, c in profile.table.items()}
    assert channels["SOG [kn]"] == ("sog", "kn")
    assert channels["psi"] == ("heading", "deg")
    # 0.02 rad/s turn the heading by the 1.146 deg of a second that stand next to it.
    assert channels["yaw_rate"] == ("yaw_rate", "rad/s")
    assert [a.name for a in profile.actuators] == ["rudder", "pwm_1"]
    assert profile.actuators[1].scale() == [(1500.0, 1 / 400)]
    assert "rudder_cmd" not in channels and "psi_ref" not in channels
    assert 'channel = "vessel", only = "219"' in text
    done = convert([path], profile, tmp_path)
    assert not done.refused
    table = ingest(done.logs[0], profile).table
    assert table["time"][0].isoformat() == "2024-05-01T00:00:00+00:00"
    # Over ground 4 kn towards 10 deg, the bow at 100 deg: the ship goes straight to port.
    assert table["sway"][0] == pytest.approx(-4 * 1852 / 3600)
    assert table["rudder"][0] == pytest.approx(math.radians(3.0))
    assert table["pwm_1"][10] == pytest.approx(0.5)


@pytest.mark.parametrize("word", ["---", "n/a", ""])
def test_a_word_among_numbers_changes_nothing_in_a_draft(tmp_path, word):
    own = "\n".join(TABLE.splitlines()[:4])
    rows = [own, *(f"219;2024-05-01T00:00:0{3 + i};59,3;10,3;4,0;12;99;{102 + i};0,02;5;5,0;0,1;"
                   "1600" for i in range(4))]  # fmt: skip
    (tmp_path / "good.csv").write_text("\n".join(rows))
    gone = f"219;2024-05-01T00:00:07;59,3;10,3;4,0;12;99;{word};{word};5;{word};{word};1600"
    (tmp_path / "words.csv").write_text("\n".join([*rows, gone]))
    good, words = (profiles.parse(draft_table(tmp_path / f"{name}.csv"), "draft")
                   for name in ("good", "words"))  # fmt: skip
    assert words.table == good.table and words.actuators == good.actuators


def test_a_heading_in_words_alone_is_drafted_and_left_to_its_reader(tmp_path):
    lines = ["time,lat,lon,heading,yaw_rate", *(f"{i},59.1,10.1,NNE,1.0" for i in range(4))]
    (tmp_path / "w.csv").write_text("\n".join(lines))
    assert "'NNE'" in draft_table(tmp_path / "w.csv")


def test_a_draft_without_actuators_is_ingested_and_refused_by_train(tmp_path):
    profile = profiles.parse(
        '[ship]\nname = "drifter"\nlength_m = 3.0\n'
        '[sensors.position]\nkind = "local"\ntopic = "/p"\nfields = ["x0_m", "y0_m"]\n'
        '[sensors.velocity]\nkind = "body"\ntopic = "/p"\nfields = ["u", "v"]\n'
        '[sensors.heading]\ntopic = "/p"\nfield = "psi"\n',
        "drifter",
    )
    flat = [0.0] * 300
    path = log_of(
        tmp_path / "d.mcap", {"/p": {"x0_m": flat, "y0_m": flat, "u": flat, "v": flat, "psi": flat}}
    )
    store = Store(tmp_path / "store")
    store.add(ingest(path, profile))
    assert store.profile(["d"]).columns[-1] == "yaw_rate"
    with pytest.raises(ProfileError, match="no actuators"):
        choose_split(store, ["d"], [], "ref", 10)
