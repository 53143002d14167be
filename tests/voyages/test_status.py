"""Values that their own message calls not valid; the messages as their definitions have them."""

from __future__ import annotations

import json

import numpy as np
import polars as pl
import pytest
import sailing
from mcap.writer import Writer

from shiplog.exceptions import LogUnreadable
from shiplog.nomenclature.channels import Quality
from shiplog.voyages.ingest.ingest import ingest

COUNT = 600
LOST = slice(200, 220)  # 2 s of 60
HEADING = 3.0 + 0.04 * np.arange(COUNT) * 0.1
SENSORS = {
    "position": ("geodetic", "/fix", ["latitude", "longitude"], "deg"),
    "velocity": ("ned", "/velocity", ["north", "east"], "m/s"),
    "heading": ("angle", "/heading", ["yaw"], "rad"),
    "yaw_rate": ("rate", "/heading", ["rate"], "rad/s"),
}
CIRCLE = {
    "latitude": 54.0 + 20.0 * np.sin(HEADING) / 111_300.0,
    "longitude": 10.0 - 20.0 * np.cos(HEADING) / 65_440.0,
    "north": 0.8 * np.cos(HEADING), "east": 0.8 * np.sin(HEADING),
    "yaw": HEADING % (2 * np.pi), "rate": np.full(COUNT, 0.04),
}  # fmt: skip


def nested(way: list[str], value) -> dict:
    return {way[0]: value if len(way) == 1 else nested(way[1:], value)}


def merged(one: dict, other: dict) -> dict:
    both = dict(one)
    for key, value in other.items():
        both[key] = merged(both[key], value) if isinstance(both.get(key), dict) else value
    return both


@pytest.fixture
def voyage(tmp_path):
    """A circle in JSON messages, with more fields beside a topic's values and a schema's name."""

    def build(topic, schema, beside, renamed=(), more="", least=None):
        names = dict(renamed)
        path = tmp_path / "circle.mcap"
        with path.open("wb") as stream:
            writer = Writer(stream)
            writer.start()
            topics = {}
            for _, name, fields, _ in SENSORS.values():
                topics.setdefault(name, []).extend(fields)
            numbers = {
                name: writer.register_channel(name, "json", writer.register_schema(
                    schema if name == topic else "t.Plain", "jsonschema", b"{}"))
                for name in topics
            }  # fmt: skip
            for i in range(COUNT):
                time = sailing.START + i * 100_000_000
                for name, fields in topics.items():
                    message = {"timestamp": {"sec": time // 10**9, "nsec": time % 10**9}}
                    for field in fields:
                        way = names.get(field, field).split(".")
                        message = merged(message, nested(way, float(CIRCLE[field][i])))
                    for way, values in beside.items() if name == topic else ():
                        value = values[i]
                        value = value.item() if hasattr(value, "item") else value
                        message = merged(message, nested(way.split("."), value))
                    writer.add_message(numbers[name], time, json.dumps(message).encode(), time)
            writer.finish()
        text = '[ship]\nname = "c"\nlength_m = 10.0\n[site]\ndatum = [54.0, 10.0]\n'
        for name, (kind, where, fields, unit) in SENSORS.items():
            paths = json.dumps([names.get(field, field) for field in fields])
            text += f'[sensors.{name}]\nkind = "{kind}"\ntopic = "{where}"\nfields = {paths}\n'
            text += f'unit = "{unit}"\n' + (more if where == topic else "")
        return ingest(path, sailing.profile(text))

    return build


def during(bad, good):
    """A column that is `bad` while the fix is lost."""
    return [bad if i in range(COUNT)[LOST] else good for i in range(COUNT)]


def blank(done, *columns) -> set[str]:
    """Columns without a value in the rows in the middle of the lost ones."""
    rows = done.table[205:215]
    assert all(rows["quality"] & int(Quality.BLANK) != 0)
    return {name for name in columns if rows[name].null_count() == rows.height}


NAV_SAT_FIX = ("/fix", "sensor_msgs/msg/NavSatFix", {"status.status": during(-1, 0)})


@pytest.mark.parametrize(
    ("topic", "schema", "beside"),
    [
        NAV_SAT_FIX,
        ("/fix", "gps_common/msg/GPSFix", {"status.status": during(-1, 18)}),
        ("/fix", "px4_msgs/msg/SensorGps", {"fix_type": during(0, 3)}),
        ("/fix", "px4_msgs/msg/SensorGps", {"fix_type": during(1, 6)}),
        ("/fix", "mavros_msgs/msg/GPSRAW", {"fix_type": during(1, 2)}),
        ("/fix", "ublox_msgs/msg/NavPVT", {"fix_type": during(5, 3)}),
        ("/fix", "sbg_driver/msg/SbgGpsPos", {"status.status": during(1, 0)}),
        ("/fix", "novatel_oem7_msgs/msg/BESTPOS", {"sol_status.status": during(6, 0)}),
        ("/fix", "novatel_gps_msgs/msg/NovatelPosition",
         {"solution_status": during("INSUFFICIENT_OBS", "SOL_COMPUTED")}),
        ("/fix", "px4_msgs/msg/VehicleGlobalPosition", {"dead_reckoning": during(True, False)}),
        ("/fix", "nmea_msgs/msg/Gpgga", {"gps_qual": during(6, 2)}),
        ("/fix", "t.Own", {"valid": during(False, True)}),
        ("/fix", "t.Own", {"quality_indicator": during(0, 4)}),
        ("/fix", "t.Own", {"fix": during("No fix", "3D")}),
        ("/fix", "septentrio_gnss_driver/msg/PVTGeodetic", {"error": during(7, 0)}),
    ],
)  # fmt: skip
def test_a_position_without_a_fix_is_blank_and_said(voyage, topic, schema, beside):
    done = voyage(topic, schema, beside)
    assert blank(done, "x0", "y0", "heading", "surge") == {"x0", "y0"}
    (finding,) = done.report.findings
    assert (finding.kind, finding.channel, finding.value) == ("status", "position", 20.0)
    assert finding.start_s == pytest.approx(20.0, abs=0.01)
    assert finding.end_s == pytest.approx(21.9, abs=0.01)
    assert next(iter(beside)) in finding.sentence and "/fix" in finding.sentence
    assert (done.table["quality"] != 0).sum() <= 24
    assert not done.report.serious


@pytest.mark.parametrize(
    ("topic", "schema", "beside", "channel", "columns"),
    [
        ("/velocity", "px4_msgs/msg/VehicleLocalPosition", {"v_xy_valid": during(0, 1)},
         "velocity", {"surge", "sway"}),
        ("/velocity", "waterlinked_a50/msg/DVL", {"velocity_valid": during(False, True)},
         "velocity", {"surge", "sway"}),
        ("/velocity", "nmea_msgs/msg/Gprmc", {"position_status": during("V", "A")},
         "velocity", {"surge", "sway"}),
        ("/heading", "sbg_driver/msg/SbgEkfEuler", {"status.heading_valid": during(False, True)},
         "heading", {"heading", "surge", "sway"}),
        ("/heading", "ublox_msgs/msg/NavRELPOSNED9", {"flags": during(0x037, 0x137)},
         "heading", {"heading", "surge", "sway"}),
        ("/heading", "sensor_msgs/msg/Imu",
         {"orientation_covariance": during([-1.0] + 8 * [0.0], 9 * [0.01])},
         "heading", {"heading", "surge", "sway"}),
    ],
)  # fmt: skip
def test_other_sensors_have_words_of_their_own(voyage, topic, schema, beside, channel, columns):
    done = voyage(topic, schema, beside)
    assert blank(done, "x0", "heading", "surge", "sway") >= columns - {"surge", "sway"}
    (finding,) = [f for f in done.report.findings if f.kind == "status"]
    assert (finding.channel, finding.value) == (channel, 20.0)
    assert not [f for f in done.report.findings if f.kind in ("blank", "held", "jump")]


@pytest.mark.parametrize(
    ("schema", "beside"),
    [
        ("sensor_msgs/msg/NavSatFix", {"status.status": np.full(COUNT, -2)}),  # not known
        ("sbg_driver/msg/SbgGpsPos", {"status.status": np.zeros(COUNT, int)}),
        ("t.Own", {"status.status": np.full(COUNT, 0)}),
        ("t.Own", {"valid": np.arange(COUNT) % 7}),  # a counter is no flag
        ("t.Own", {"fix_type": np.full(COUNT, 3), "status": np.full(COUNT, "OK", object)}),
        ("px4_msgs/msg/SensorGps", {"heading_valid": np.zeros(COUNT, bool)}),  # of the heading
        ("t.Own", {"status": [{"valid": True}] * COUNT}),
        ("t.Own", {"status": np.full(COUNT, "A", object), "fix_quality": np.full(COUNT, 5)}),
        ("foxglove.LocationFix", {"frame_id": np.full(COUNT, "gps", object)}),
    ],
)
def test_what_is_valid_or_says_nothing_of_a_position_has_no_finding(voyage, schema, beside):
    done = voyage("/fix", schema, beside)
    assert done.report.findings == () and (done.table["quality"] == 0).all()


def test_the_word_of_the_part_that_holds_the_values_counts(voyage):
    """Two fixes in one message: the profile reads `main`, and the other's word is not of it."""
    names = {"latitude": "main.latitude", "longitude": "main.longitude"}
    beside = {"main.fix_type": np.full(COUNT, 3), "spare.fix_type": during(0, 3)}
    assert voyage("/fix", "t.Two", beside, names).report.findings == ()
    beside = {"main.fix_type": during(0, 3), "spare.fix_type": np.full(COUNT, 3)}
    assert blank(voyage("/fix", "t.Two", beside, names), "x0") == {"x0"}


def test_a_log_without_any_fix_is_refused_with_its_word(voyage):
    beside = {"status.status": np.full(COUNT, -1)}
    with pytest.raises(LogUnreadable, match=r"status\.status = -1, no fix") as refused:
        voyage("/fix", "sensor_msgs/msg/NavSatFix", beside)
    assert 'status = "ignore"' in refused.value.hint


def test_a_word_that_is_wrong_can_be_ignored(voyage):
    beside = {"status.status": np.full(COUNT, -1)}
    done = voyage("/fix", "sensor_msgs/msg/NavSatFix", beside, more='status = "ignore"\n')
    assert done.report.findings == ()
    assert done.table.select(pl.col("quality").max()).item() == 0
