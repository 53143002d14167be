"""One finding for one thing: what was not measured, what came late, what a filter takes."""

from dataclasses import replace

import known_motion as known
import numpy as np
import polars as pl
import pytest
import sailing
from test_sound_instruments import Instruments, record, stored

from shiplog.logs.conversion.write import write_log
from shiplog.logs.health.health_report import Finding, VoyageReport
from shiplog.nomenclature.channels import Quality
from shiplog.report.evaluation import tables
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.sensors import sensor_consistency, velocity_filter

ONE_HZ = Instruments(hz=1.0)


def without(parts, topic, rows):
    """The topic's values blank in some rows."""
    columns = {name: np.where(rows, np.nan, v) for name, v in parts[topic].columns.items()}
    return {**parts, topic: replace(parts[topic], columns=columns)}


@pytest.mark.parametrize("each", [1, 2], ids=["all", "every other one"])
def test_what_is_blank_for_a_while_is_one_stretch(tmp_path, each):
    """Samples a second apart, blank from 100 to 140 s: neither gaps between them, nor stamps that
    count in coarse steps, nor an instrument that is slower than it is."""
    parts, text = record(ONE_HZ, seconds=300.0)
    second = np.arange(300)
    rows = (second >= 100) & (second <= 140) & (second % each == 0)
    voyage = stored(tmp_path, without(parts, "/velocity", rows), text)
    found = voyage.report.findings
    assert {(f.kind, f.channel) for f in found} == {("blank", "velocity")}
    assert len(found) == {1: 1, 2: 20 + 1}[each]  # between two that are, each one is measured
    listed = [f for f in found if f.start_s and f.end_s]
    ends = min(f.start_s or 0.0 for f in listed), max(f.end_s or 0.0 for f in listed)
    assert ends == pytest.approx((99.0, 141.0), abs=0.11)
    marks = voyage.table["quality"].to_numpy()
    assert not (marks & int(Quality.GAP)).any()
    (speed,) = [one for one in voyage.report.instruments if one.channel == "velocity"]
    assert (speed.rate_hz, speed.clock_s) == (1.0, 0.0)


def test_a_message_that_was_lost_beside_a_blank_one_is_a_gap(tmp_path):
    parts, text = record(ONE_HZ, seconds=300.0)
    second = np.arange(300)
    parts = without(parts, "/velocity", second == 150)
    kept = (second < 151) | (second > 160)
    parts["/velocity"] = replace(
        parts["/velocity"], time=parts["/velocity"].time[kept],
        columns={name: v[kept] for name, v in parts["/velocity"].columns.items()},
    )  # fmt: skip
    kinds = [f.kind for f in stored(tmp_path, parts, text).report.findings]
    assert sorted(kinds) == ["blank", "gap"]


@pytest.mark.parametrize("topic", ["/velocity", "/fix"])
@pytest.mark.parametrize("hz", [1.0, 10.0])
def test_a_heading_does_not_jump_while_another_channel_is_blank(tmp_path, topic, hz):
    """The heading turned by up to 80 deg meanwhile, and its rate says so."""
    parts, text = record(Instruments(hz=hz), seconds=300.0)
    t = np.arange(len(parts[topic].time)) / hz
    voyage = stored(tmp_path, without(parts, topic, (t > 100.0) & (t < 160.0)), text)
    assert [f.sentence for f in voyage.report.findings if f.kind == "jump"] == []


def test_over_a_minute_that_nobody_recorded_a_ship_can_have_turned(tmp_path):
    parts, text = record(Instruments(hz=5.0), seconds=300.0)
    t = np.arange(1500) / 5.0
    kept = (t < 112.5) | (t > 157.5)  # half a period of its turns
    parts = {
        name: replace(
            one, time=one.time[kept], columns={k: v[kept] for k, v in one.columns.items()}
        )
        for name, one in parts.items()
    }
    kinds = {f.kind for f in stored(tmp_path, parts, text).report.findings}
    assert kinds == {"gap"}


def test_what_the_conversion_told_of_a_status_is_not_said_again(tmp_path):
    parts, text = record(Instruments(hz=2.0), seconds=200.0)
    t = np.arange(400) / 2.0
    parts = without(parts, "/fix", (t >= 40.0) & (t < 80.0))
    told = Finding("status", "/fix", "80 of 400 messages on /fix are blank.", 40.0, 79.5, 80.0)
    path = tmp_path / "a.mcap"
    write_log(path, list(parts.values()), ship="swinging", findings=[told])
    voyage = ingest(path, sailing.profile(text))
    assert [f.kind for f in voyage.report.findings] == ["status"]
    assert (voyage.table["quality"].to_numpy() & int(Quality.BLANK)).any()


def test_a_row_that_is_lost_for_all_channels_is_one_line():
    """Of a table, one row stands for all of them; in JSON each channel has its own."""
    of = ("heading", "position", "rpm", "rudder", "velocity")
    lost = [
        Finding("gap", name, f"{name} has no sample for 0.5 s from {at} s.", at, at + 0.5, 0.5,
                unit="s")
        for at in (9.9, 20.0) for name in of
    ]  # fmt: skip
    alone = Finding("blank", "heading", "heading is blank for 2.0 s from 40.0 s.", 40.0, 42.0, 2.0)
    lines = tables.voyage_lines(VoyageReport("trip", 1, 0, 1, 200.0, (*lost, alone)))
    assert lines[1:] == [
        "  gap: heading, position, rpm, rudder, and 1 more have no sample for 0.5 s from 9.9 s.",
        "  gap: heading, position, rpm, rudder, and 1 more have no sample for 0.5 s from 20.0 s.",
        "  blank: heading is blank for 2.0 s from 40.0 s.",
    ]


PROFILE = known.profile(actuators=())
NOISE = known.Noise(position=0.02, speed=0.01, course=0.1)


def smoothed(ship: known.Sailed, seconds: float, mean: bool) -> pl.DataFrame:
    """The ship's table, its velocity over ground smoothed: by a filter of the first order of so
    many seconds, or by a mean over twice as many."""
    raw = known.measured(ship, noise=NOISE)
    course = np.radians(raw["v1"])
    v = raw["v0"] * np.exp(1j * course)
    if mean:
        upto = np.concatenate((np.zeros(1), np.cumsum(v)))
        rows = round(20.0 * seconds)
        v = np.concatenate((v[: rows - 1], (upto[rows:] - upto[:-rows]) / rows))
    else:
        for i in range(1, len(v)):
            v[i] = v[i - 1] + (v[i] - v[i - 1]) * 0.1 / seconds
    raw |= {"v0": np.abs(v), "v1": np.degrees(np.angle(v)) % 360.0}
    return known.table(raw, PROFILE)


def found(table) -> dict:
    compared = sensor_consistency.compared(table, PROFILE)
    return {(e.kind, e.channel): e for e in compared.estimates if e.notable}


@pytest.mark.parametrize("mean", [False, True], ids=["first order", "mean"])
@pytest.mark.parametrize(("seconds", "turn"), [(1.5, 6.0), (2.5, 4.0)])
def test_a_filter_is_late_and_has_no_scale(seconds, turn, mean):
    notable = found(smoothed(known.swinging(turn=turn), seconds, mean))
    assert set(notable) == {("clock_offset", "velocity")}
    assert notable["clock_offset", "velocity"].value == pytest.approx(seconds, abs=0.25)


@pytest.mark.parametrize("scale", [0.96, 1.03])
def test_a_scale_beside_a_delay_is_still_found(scale):
    table = smoothed(known.swinging(turn=4.0), 1.0, False)
    table = table.with_columns(pl.col("surge", "sway") * scale)
    notable = found(table)
    assert notable["velocity_scale", "velocity"].value == pytest.approx(scale, abs=0.01)


def test_what_a_filter_takes_of_a_circle_in_closed_form():
    """Of a velocity that turns with r: 1 - cos(φ - r τ)/sqrt(1 + (r τ)²) with tan φ = r τ."""
    t, rate, late = np.arange(0.0, 600.0, 0.1), 0.2, 2.0
    circle = np.stack((np.cos(rate * t), np.sin(rate * t)), axis=1)
    phase = np.arctan(rate * late)
    exact = 1.0 - np.cos(phase - rate * late) / np.hypot(1.0, rate * late)
    assert velocity_filter.takes(circle, late, 0.1) == pytest.approx(exact, rel=0.06)
