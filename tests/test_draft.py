"""A drafted profile reads the log it was drafted from, and says what it guessed."""

from pathlib import Path

import polars as pl
import pytest

from shiplog import profile as profiles
from shiplog.draft import draft
from shiplog.exceptions import LogUnreadable
from shiplog.ingest import ingest

SAMPLE = Path(__file__).parents[1] / "sample_logs" / "voyage_1.mcap"


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
