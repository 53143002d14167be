"""Publish times that are of the writing of a file: no clock of a publisher, and no false offset."""

import numpy as np
import polars as pl
import pytest

from shiplog.logs.health import faults
from shiplog.logs.health.health_report import Finding

SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
YEARS = 2 * 365 * 86_400 * SECOND
T = np.arange(3000) * SECOND // 10  # five minutes at 10 Hz


def frame(published, late=0):
    times = {"log_time": START + T + late, "publish_time": published, "stamp": START + T}
    return pl.DataFrame({name: pl.Series(values, dtype=pl.Int64) for name, values in times.items()})


@pytest.mark.parametrize("pace", [30, 1000, 100_000], ids=lambda pace: f"{pace} times as fast")
@pytest.mark.parametrize(
    "after", [YEARS, 86_400 * SECOND, 400 * SECOND], ids=["years", "day", "now"]
)
def test_a_writer_that_stamps_now_says_nothing_of_clocks(after, pace):
    written = frame(START + after + T // pace)
    assert not faults.of_publishers(written)
    assert faults.clocks({"/gyro": written, "/gnss": written}) == []


@pytest.mark.parametrize("late", [0.4, -3.0, 18.0])
def test_the_recorder_is_then_held_against_the_stamps(late):
    written = frame(START + YEARS + T // 1000, int(late * SECOND))
    (finding,) = faults.clocks({"/gyro": written})
    assert finding.value == pytest.approx(late)
    assert "recorder's clock" in finding.sentence and "own stamps" in finding.sentence
    assert ("GPS time" in finding.sentence) == (late == 18.0)


@pytest.mark.parametrize("off", [-YEARS, -2 * SECOND, 2 * SECOND, YEARS])
def test_a_publisher_whose_clock_is_off_is_still_reported(off):
    published = frame(START + off + T)
    assert faults.of_publishers(published)
    found = faults.clocks({"/gyro": published})
    assert {round(abs(f.value or 0.0)) for f in found} == {abs(off) // SECOND}


def late_topics(**late: float):
    """Topics whose messages are logged so many seconds after they are published and stamped."""
    published = {name: frame(START + T, int(by * SECOND)) for name, by in late.items()}
    return {f"/{name}": one for name, one in published.items()}


@pytest.mark.parametrize("by", [0.3, 0.8, 1.4])
def test_topics_that_come_late_while_others_do_not_are_no_clock(by):
    (finding,) = faults.clocks(late_topics(fix=by, velocity=by, gyro=0.01))
    assert finding.value == pytest.approx(by)
    assert "recorder's clock" not in finding.sentence and "came late" in finding.sentence
    assert "/fix, /velocity" in finding.sentence and "/gyro" not in finding.sentence


@pytest.mark.parametrize("by", [-0.8, 2.5, 18.0])
def test_what_no_latency_can_be_is_a_clock(by):
    (finding,) = faults.clocks(late_topics(fix=by, gyro=0.01))
    assert "The recorder's clock is" in finding.sentence


def test_two_latencies_are_two():
    found = faults.clocks(late_topics(fix=0.12, other=1.06, gyro=0.01))
    assert [f.value for f in found] == pytest.approx([0.12, 1.06])


@pytest.mark.parametrize(("told", "said"), [(0.8, 0), (0.7, 0), (0.1, 1), (-0.8, 1)])
def test_an_offset_that_the_conversion_told_is_not_said_again(told, said):
    known = Finding("clock_offset", "/fix", "Sentences come late.", value=told, unit="s")
    assert len(faults.clocks(late_topics(fix=0.8, gyro=0.01), [known])) == said
