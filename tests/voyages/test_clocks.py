"""Clocks that are wrong as a whole: the voyage is the same, and what was done is said."""

from dataclasses import replace

import numpy as np
import pytest
import sailing

from shiplog.logs.health import dates
from shiplog.logs.reading.check import check
from shiplog.voyages.ingest.ingest import ingest

SECOND = 1_000_000_000
DAY = 86_400 * SECOND
IN_1970 = 12 * SECOND - sailing.START  # a computer that starts without a date, 12 s before
IN_2015 = 1_420_070_400 * SECOND - sailing.START  # another, at the date of its last update
IN_2123 = 36_525 * DAY
ALL = tuple(sailing.series())
FAR = 1e-6  # s: medians of such times are rounded to 128 ns


def stamped(by, topics=ALL, recorder=0):
    """The circle with the stamps on some topics moved [ns], and the recorder's clock."""
    return {
        topic: replace(
            one, time=one.time + (by if topic in topics else 0), log_time=one.time + recorder
        )
        for topic, one in sailing.series().items()
    }


@pytest.fixture
def voyage(tmp_path):
    def build(parts):
        return ingest(sailing.write(tmp_path / "turn.mcap", parts), sailing.profile())

    return build


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """The circle on one clock, ingested; nobody changes it."""
    folder = tmp_path_factory.mktemp("clean")
    return ingest(sailing.write(folder / "turn.mcap", sailing.series()), sailing.profile())


def offsets(report):
    return [f for f in report.findings if f.kind == "clock_offset"]


def assert_same(table, clean, moved_s=0.0):
    """Every row, so many seconds later."""
    assert table.height == clean.height
    for name in clean.columns[1:]:
        assert table[name].to_numpy() == pytest.approx(
            clean[name].to_numpy(), abs=1e-9, nan_ok=True
        )
    off = (table["time"].to_physical() - clean["time"].to_physical()).to_numpy() * 1e-9
    assert off == pytest.approx(np.full(len(off), moved_s), abs=FAR)


@pytest.mark.parametrize("by", [IN_1970, IN_2123], ids=["1970", "2123"])
def test_where_no_clock_can_be_right_the_voyage_is_as_measured_without_a_date(voyage, clean, by):
    done = voyage(stamped(by, recorder=by))
    assert_same(done.table, clean.table, by * 1e-9)
    (finding,) = offsets(done.report)
    assert finding.sentence.startswith("No clock of the messages on ")
    assert finding.sentence.endswith("when the voyage was is not known.")


@pytest.mark.parametrize(
    ("by", "day"), [(IN_1970, "1970-01-01"), (IN_2123, "2123-11-15")], ids=["1970", "2123"]
)
def test_stamps_that_cannot_be_are_moved_onto_the_recorders_clock(voyage, clean, by, day):
    done = voyage(stamped(by))
    assert_same(done.table, clean.table)
    *told, moved = offsets(done.report)
    assert {f"{day} by the messages' own stamps" in f.sentence for f in told} == {True, False}
    assert all("by the recorder's clock they are of 2023-11-14." in f.sentence for f in told)
    assert "They were moved as a whole" in moved.sentence
    assert moved.value == pytest.approx(by * 1e-9, abs=1e-3)


GYRO, GNSS = ("/gyro",), ("/position", "/velocity")


@pytest.mark.parametrize(
    ("topics", "by", "recorder"),
    [(GYRO, IN_1970, 0), (GNSS, IN_1970, IN_2015), (GYRO, IN_2015, IN_1970), (GNSS, IN_2015, 0),
     (GYRO, IN_2123, IN_2015), (GNSS, IN_2123, IN_1970), (GNSS, IN_1970, IN_1970),
     (GYRO, IN_2015, IN_2015)],
)  # fmt: skip
def test_one_clock_of_several_is_moved_onto_the_one_that_can_be_right(
    voyage, clean, topics, by, recorder
):
    done = voyage(stamped(by, topics, recorder))
    assert_same(done.table, clean.table)
    (moved,) = [f for f in offsets(done.report) if "They were moved" in f.sentence]
    assert moved.value == pytest.approx(by * 1e-9, abs=1e-3)
    assert moved.channel == ("/gyro" if topics == ("/gyro",) else "log")


def test_a_recorder_that_was_not_set_is_reported_and_changes_nothing(voyage, clean, tmp_path):
    done = voyage(stamped(0, recorder=IN_1970))
    assert_same(done.table, clean.table)
    (finding,) = offsets(check(tmp_path / "turn.mcap"))
    assert finding.sentence.endswith(
        "are of 1970-01-01 by the recorder's clock, which cannot be; by the messages' own stamps "
        "they are of 2023-11-14."
    )
    assert finding.value == pytest.approx(IN_1970 * 1e-9, abs=1.0)


def test_a_clock_within_a_day_of_the_others_is_left_to_what_the_sensors_say(voyage):
    done = voyage(stamped(-2 * SECOND, ("/gyro",)))
    assert [f for f in offsets(done.report) if "moved" in f.sentence] == []


def test_simulated_time_keeps_its_pace(voyage, clean):
    """Stamps that count from 0, twice as fast as the clock of the computer that recorded them."""
    parts = {
        topic: replace(
            one, time=one.time - sailing.START,
            log_time=sailing.START + (one.time - sailing.START) // 2,
        )
        for topic, one in sailing.series().items()
    }  # fmt: skip
    done = voyage(parts)
    off = (done.table["time"] - clean.table["time"]).dt.total_nanoseconds().to_numpy() * 1e-9
    assert np.ptp(off) < FAR  # as long as it was
    assert done.table["x0"].to_numpy() == pytest.approx(clean.table["x0"].to_numpy(), abs=1e-9)


def test_clocks_that_nothing_ties_together_are_reported_with_what_to_do(voyage):
    """The recorder wrote all at once, long after: it cannot say when the gyro's clock began."""
    parts = {
        topic: replace(one, log_time=sailing.START + (one.time - sailing.START) // 30)
        for topic, one in stamped(IN_1970, ("/gyro",)).items()
    }
    parts["/gyro"] = replace(parts["/gyro"], log_time=parts["/position"].log_time)
    done = voyage(parts)
    told = [f for f in offsets(done.report) if "no time in common" in f.sentence]
    assert {f.channel for f in told} == {"position", "velocity", "wind", "rudder", "propeller"}
    assert "Set another `clock` for it in the profile" in told[0].sentence
    assert done.report.usable_s == 0


@pytest.mark.parametrize(
    ("day", "can_be"),
    [
        ("1970-01-01", False), ("1980-01-06", False), ("1980-12-31", False), ("1981-01-01", True),
        ("2026-06-01", True), ("2029-05-01", True), ("2029-06-02", False), ("2043-01-01", False),
    ],
)  # fmt: skip
def test_what_a_log_can_be_of(monkeypatch, day, can_be):
    """By a computer that says 2026-06-01; one that says 1970 cannot tell what is to come."""
    instant = int(np.datetime64(day, "ns").astype(np.int64))
    now = int(np.datetime64("2026-06-01", "ns").astype(np.int64))
    monkeypatch.setattr("time.time_ns", lambda: now)
    assert dates.possible(instant) == can_be
    monkeypatch.setattr("time.time_ns", lambda: 12 * SECOND)
    assert dates.possible(instant) == (can_be or day > "2026")
