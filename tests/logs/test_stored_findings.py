"""What a conversion found travels with the log, to `check`, `ingest` and `voyage.json`."""

import json

import numpy as np
import pytest
from made_nmea import gga, hdt, rmc, sentence

from shiplog.commands.convert import convert
from shiplog.logs.conversion.write import Series, write_log
from shiplog.logs.health.health_report import Finding
from shiplog.logs.health.stored_findings import MOST, as_record, of_record
from shiplog.logs.reading.check import check
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest.ingest import ingest

PROFILE = """[ship]
name = "t"
length_m = 20.0
[sensors.position]
kind = "geodetic"
topic = "/gnss/fix"
fields = ["latitude", "longitude"]
unit = "deg"
[sensors.velocity]
kind = "sog_cog"
topic = "/gnss/velocity"
fields = ["sog_mps", "cog_deg"]
units = ["m/s", "deg"]
[sensors.heading]
topic = "/gyro"
field = "heading_deg"
unit = "deg"
"""


def test_a_finding_is_the_same_after_the_way():
    found = [Finding("status", "/a", "A sentence, with ü.", 1.5, 2.5, 3.0, None, 4.0, "s", "unit"),
             Finding("dropped", "log", "Another.")]  # fmt: skip
    assert of_record({"findings": as_record(found)}) == found


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "1", '{"kind": "status"}', '{"kind": "no such", "channel": "", '
             '"sentence": ""}', '{"kind": "status", "channel": "a", "sentence": 3}'],
)  # fmt: skip
def test_a_record_that_is_not_ours_is_no_finding(text):
    assert of_record({"findings": {"0000": text}}) == []
    assert of_record({}) == []


def test_a_log_has_no_more_of_them_than_anybody_reads():
    many = [Finding("dropped", "log", str(k)) for k in range(MOST + 5)]
    assert len(of_record({"findings": as_record(many)})) == MOST


def test_check_and_ingest_report_what_convert_found(tmp_path):
    lines = []
    for t in range(120):
        bad = 40 <= t < 80
        lines += [gga(t, quality=6 if bad else 4), rmc(t, mode="E" if bad else "A"), hdt(t)]
    (tmp_path / "a.nmea").write_text("\n".join(lines))
    (path,) = convert([tmp_path / "a.nmea"], None, tmp_path / "logs").logs
    for report in (check(path), ingest(path, profiles.parse(PROFILE, "t")).report):
        said = [f for f in report.findings if f.kind == "status"]
        assert [(f.channel, f.start_s, f.end_s, f.value) for f in said] == [
            ("/gnss/fix", 40.0, 79.0, 40.0), ("/gnss/velocity", 40.0, 79.0, 40.0),
        ]  # fmt: skip
        assert all("dead reckoning" in f.sentence for f in said)


def test_a_contradiction_of_the_compass_is_serious(tmp_path):
    lines = [b for t in range(120) for b in (rmc(t), sentence(f"HCHDG,{40 + t / 60:.2f},,,20.0,W"))]
    (tmp_path / "a.nmea").write_text("\n".join(lines))
    (path,) = convert([tmp_path / "a.nmea"], None, tmp_path / "logs").logs
    report = ingest(path, profiles.parse(PROFILE, "t")).report
    assert report.serious and [f.reason for f in report.contradictions] == ["frame"]


def test_a_log_without_findings_has_no_record(tmp_path):
    from shiplog.logs.reading.read import contents

    one = Series("/gyro", "shiplog.Gyro", np.arange(3) + 10**18, {"heading_deg": np.zeros(3)})
    write_log(tmp_path / "a.mcap", [one], ship="t")
    assert set(contents(tmp_path / "a.mcap").metadata) == {"voyage"}
    found = [Finding("dropped", "log", "One.")]
    write_log(tmp_path / "b.mcap", [one], ship="t", findings=found)
    assert (
        json.loads(contents(tmp_path / "b.mcap").metadata["findings"]["0000"])["kind"] == "dropped"
    )
