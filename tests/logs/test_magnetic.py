"""Magnetic headings made true: by the sentence, by RMC, by the World Magnetic Model."""

import numpy as np
import pytest
from made_nmea import SPEED, heading, iso, kinds, late, read, seconds, sentence, utc, when
from pygeomag import GeoMag

from shiplog.logs.conversion.magnetic import Track, by_model

SECONDS = range(60)
# deg east at 54 N, 10 E on 2024-06-01, the 153rd of 366 days; NOAA's own points are tested below
OF_MODEL = GeoMag(base_year=2024).calculate(54.0, 10.0, 0.0, 2024.0 + 152.4 / 366.0).d
NOAA = [  # published test values of WMM2020 and WMM2025 at sea level: year, deg N, deg E, deg
    (2020, 80.0, 0.0, -1.28), (2020, 0.0, 120.0, 0.16), (2020, -80.0, 240.0, 69.36),
    (2025, 80.0, 0.0, 1.28), (2025, 0.0, 120.0, -0.16), (2025, -80.0, 240.0, 68.78),
]  # fmt: skip


def epoch(year):
    return np.datetime64(f"{year}-01-01", "ns").astype(np.int64)


@pytest.mark.parametrize(("year", "north", "east", "declination"), NOAA)
def test_the_model_has_its_published_values(year, north, east, declination):
    time = np.array([epoch(year)])
    found, _ = by_model(time, Track(time, np.array([north]), np.array([east])))
    assert found == pytest.approx([declination], abs=0.01)


def test_outside_its_years_the_model_says_so():
    for year, known in ((2003, False), (2007, True), (2033, True), (2040, False)):
        time = np.array([epoch(year)])
        found, name = by_model(time, Track(time, np.array([54.0]), np.array([10.0])))
        assert (found is not None) == known and ("beyond" in name) == known


def fix(t, variation=","):
    where = "5400.0000,N,01000.0000,E"
    date = when(t, "%d%m%y")
    return sentence(f"GPRMC,{utc(t)},A,{where},{SPEED * 1.944:.2f},45.0,{date},{variation},A")


def compass(t, off, body="HCHDG,{:.3f},,,,"):
    return sentence(body.format((float(heading(t)) - off) % 360))


CASES = {  # what the compass shows too little, the sentence, RMC's variation, the source
    "HDG with both": (2.5, "HCHDG,{:.3f},1.5,W,4.0,E", ",", "sentence"),
    "HDG, deviation east": (3.0, "HCHDG,{:.3f},1.0,E,2.0,E", ",", "sentence"),
    "HDG, minus with W": (-3.2, "HCHDG,{:.3f},,,-3.2,W", ",", "sentence"),
    "HDG, variation only": (5.0, "HCHDG,{:.3f},,,05.0,E", ",", "sentence"),
    "HDG, RMC's variation": (4.5, "HCHDG,{:.3f},,,,", "4.5,E", "RMC"),
    "HDM": (OF_MODEL, "HCHDM,{:.3f},M", ",", "WMM-2020"),
    "HDG, all blank": (OF_MODEL, "HCHDG,{:.3f},,,,", ",", "WMM-2020"),
    "HDM, RMC says 0": (OF_MODEL, "HCHDM,{:.3f},M", "0.0,E", "WMM-2020"),
    "VHW": (OF_MODEL, "IIVHW,,T,{:.3f},M,4.0,N,,K", ",", "WMM-2020"),
}


@pytest.mark.parametrize("case", CASES)
def test_a_compass_is_made_true(tmp_path, case):
    off, body, variation, source = CASES[case]
    lines = [b for t in SECONDS for b in (fix(t, variation), compass(t, off, body))]
    topics, found = read(tmp_path, lines)
    gyro = topics["/gyro"]
    assert late(gyro, heading, "heading_deg") < (0.05 if source.startswith("WMM") else 2e-3)
    assert list(gyro.columns) == ["heading_deg"]
    assert gyro.metadata["variation_source"] == source
    given = "1.5" in body or "1.0,E" in body
    assert ("sigma_deg" in gyro.metadata) != given
    if case != "HDG, minus with W":  # 8 deg from the model: that one contradicts it
        assert kinds(found) == ["heading_offset"]


@pytest.mark.parametrize("stated", ["0.0,E", "12.0,E", "5.0,W"])
def test_a_variation_that_the_model_contradicts_is_a_contradiction(tmp_path, stated):
    lines = [b for t in SECONDS for b in (fix(t), compass(t, 0.0, "HCHDG,{:.3f},,," + stated))]
    _, found = read(tmp_path, lines)
    (said,) = found.findings
    assert (said.kind, said.reason, said.channel) == ("contradiction", "frame", "/gyro")
    value, letter = stated.split(",")
    signed = float(value) * (1 if letter == "E" else -1)
    assert said.value == pytest.approx(signed - OF_MODEL, abs=0.05)


def test_a_compass_next_to_a_gyro_is_a_topic_of_its_own(tmp_path):
    lines = [b for t in SECONDS for b in (
        fix(t), sentence(f"HEHDT,{heading(t):.4f},T"), compass(t, 5.0, "HCHDG,{:.3f},,,05.0,E"),
        compass(t, 5.0, "HCHDM,{:.3f},M"))]  # fmt: skip
    topics, _ = read(tmp_path, lines)
    headings = {name for name in topics if name.startswith("/gyro")}
    assert headings == {"/gyro", "/gyro/compass"}
    assert late(topics["/gyro/compass"], heading, "heading_deg") < 2e-3
    assert "variation_deg" not in topics["/gyro"].metadata


def test_without_place_and_variation_a_compass_stays_magnetic(tmp_path):
    lines = [f"{iso(t)} {compass(t, 0.0, 'HCHDM,{:.3f},M')}" for t in SECONDS]
    topics, found = read(tmp_path, lines)
    (one,) = topics.values()
    assert list(one.columns) == ["magnetic_heading_deg"]
    assert "is magnetic" in found.findings[0].sentence
    assert seconds(one) == pytest.approx(np.arange(60), abs=1e-6)
