"""Rows of a table whose time steps back: a count that goes on, a second recording, or late rows."""

import numpy as np
import polars as pl
import pytest

from shiplog.exceptions import ProfileError
from shiplog.logs.conversion.steps_back import explain_steps, of_one_recording

SECOND = 1_000_000_000
WEEK, DAY = 604_800, 86_400
JUNE = 1_717_200_000  # 2024-06-01 00:00:00
AUTUMN = 1_729_989_000  # 2024-10-27 00:30:00, of a clock that was put back at 03:00
T = np.arange(3000) / 5.0  # s, ten minutes at 5 Hz


def ns(seconds):
    return np.rint(np.asarray(seconds, float) * 1000).astype(np.int64) * 1_000_000


def kinds(found):
    return [finding.kind for _, finding in found.findings]


@pytest.mark.parametrize(
    "count",
    [
        2**32 * 1e-6, 2**32 * 1e-3, 2**31 * 1e-3, 2**16 * 1e-2, WEEK, DAY,
    ],
    ids=["2^32 us", "2^32 ms", "2^31 ms", "2^16 of 10 ms", "GPS week", "day"],
)  # fmt: skip
@pytest.mark.parametrize("left", [0.2, 17.3, 300.0])
def test_a_counter_that_wraps_counts_on(count, left):
    truth = count - left + T
    found = explain_steps(ns(truth % count))
    assert (found.time - found.time[0]) * 1e-9 == pytest.approx(T, abs=2e-3)
    assert not found.part.any()
    assert kinds(found) == ["wrapped"]


def test_two_wraps_and_a_signed_counter():
    t = np.arange(0.0, 200.0, 0.2) + 40.0
    found = explain_steps(ns(t % 65.536))
    assert (found.time - found.time[0]) * 1e-9 == pytest.approx(t - 40.0, abs=2e-3)
    assert found.findings[0][1].value == 3.0
    signed = (T + 2**31 * 1e-6 - 50.0 + 2**31 * 1e-6) % (2**32 * 1e-6) - 2**31 * 1e-6
    assert (explain_steps(ns(signed)).time - ns(signed)[0]) * 1e-9 == pytest.approx(T, abs=2e-3)


@pytest.mark.parametrize("left", [3.0, 200.0])
def test_1024_weeks_are_counted_on_from_either_side(left):
    rolled = JUNE + T - np.where(left <= T, 1024 * WEEK, 0.0)
    found = explain_steps(ns(rolled))
    assert found.time * 1e-9 == pytest.approx(JUNE + T, abs=2e-3)
    found = explain_steps(ns(JUNE + T - np.where(left <= T, 0.0, 1024 * WEEK)))
    assert found.time * 1e-9 == pytest.approx(JUNE + T, abs=2e-3)
    assert kinds(found) == ["wrapped"]


@pytest.mark.parametrize("rows", [1, 3, 40])
@pytest.mark.parametrize("late", [True, False], ids=["late", "early"])
def test_a_date_that_changes_some_rows_off_midnight_is_put_right(rows, late):
    t = JUNE + DAY - 300.0 + T
    midnight = int(np.searchsorted(T, 300.0))
    off = np.zeros(len(t))
    if late:
        off[midnight : midnight + rows] = -DAY
    else:
        off[midnight - rows : midnight] = DAY
    assert explain_steps(ns(t + off)).time * 1e-9 == pytest.approx(t, abs=2e-3)


def test_the_end_and_the_beginning_of_summer_time_are_counted_on():
    t = np.arange(0.0, 4 * 3600.0, 1.0)
    local = AUTUMN + t - np.where(AUTUMN + t >= 1_729_998_000, 3600.0, 0.0)  # 03:00 is 02:00
    found = explain_steps(ns(local))
    assert (found.time - found.time[0]) * 1e-9 == pytest.approx(t)
    assert (kinds(found), found.part.max()) == (["clock_offset"], 0)
    begin = 1_711_848_600  # 2024-03-31 01:30:00
    found = explain_steps(ns(begin + t + np.where(begin + t >= 1_711_850_400, 3600.0, 0.0)))
    assert (found.time - found.time[0]) * 1e-9 == pytest.approx(t)
    assert kinds(found) == ["clock_offset"]


@pytest.mark.parametrize("start", [0.0, 12.6, JUNE], ids=["from 0", "from 12.6 s", "dated"])
@pytest.mark.parametrize("length", [47.3, 61.0, 250.0])
@pytest.mark.parametrize("hz", [1, 5, 10])
def test_a_recorder_that_was_started_again_makes_a_second_part(start, length, hz):
    first, second = np.arange(0.0, length, 1 / hz), np.arange(0.0, 40.0, 1 / hz)
    rng = np.random.default_rng(0)
    jitter = rng.uniform(0.0, 0.02, len(first) + len(second))
    t = ns(start + np.concatenate((first, second)) + jitter)
    found = explain_steps(t)
    assert (found.time == t).all()
    assert (found.part == np.repeat([0, 1], [len(first), len(second)])).all()
    assert [(of, f.kind) for of, f in found.findings] == [(0, "restarted"), (1, "restarted")]
    assert f"at row {len(first) + 1} " in found.findings[0][1].sentence


@pytest.mark.parametrize("back", [0.9, 2.5, 7.0, 100.0])
def test_a_clock_that_was_set_back_while_it_recorded_makes_a_second_part(back):
    t = JUNE + T - np.where(T < 300.0, 0.0, back)
    found = explain_steps(ns(t))
    assert (found.part == (T >= 300.0)).all()


def test_rows_that_were_written_late_are_late():
    rows = np.arange(3000)
    swapped = rows.copy()
    swapped[[100, 101, 700, 701]] = swapped[[101, 100, 701, 700]]
    block = np.concatenate((rows[:500], rows[600:1200], rows[500:600], rows[1200:]))
    halves = np.concatenate((rows[1500:], rows[:1500]))
    shuffled = np.random.default_rng(0).permutation(rows)
    for order in (swapped, block, halves, rows[::-1], shuffled):
        found = explain_steps(ns(JUNE + T[order]))
        assert not found.part.any() and found.findings == ()
        assert sorted(found.time.tolist()) == ns(JUNE + T).tolist()
    found = explain_steps(ns(T[halves]))  # two files of one count, in the wrong order
    assert not found.part.any()


def test_a_table_of_one_instrument_after_the_other_is_one_recording():
    t = np.concatenate((T, T + 0.03))
    found = explain_steps(ns(JUNE + t), np.repeat([3, 8], len(T)))
    assert not found.part.any() and found.findings == ()


@pytest.mark.parametrize("start", [1_711_846_800, AUTUMN, JUNE + DAY - 100], ids=str)
def test_utc_over_a_change_of_time_or_date_is_left_alone(start):
    t = start + np.arange(0.0, 7200.0, 0.5)
    t[5000:] += 3600.0  # a pause of an hour
    found = explain_steps(ns(t))
    assert (found.time == ns(t)).all() and found.findings == ()


def test_more_starts_than_a_recorder_has_are_refused_by_name():
    t = np.tile(np.arange(0.0, 60.0, 0.2), 25)
    with pytest.raises(ProfileError, match="not started so often") as error:
        explain_steps(ns(t))
    assert "[table]" in (error.value.hint or "")


def test_a_topics_table_counts_on_and_a_second_start_is_refused():
    t = pl.Series("t", ns((T + 4200.0) % (2**32 * 1e-6))).set(pl.Series(T == 7.0), None)
    found = of_one_recording(t, "imu.csv")
    assert found.null_count() == 1
    on = found.drop_nulls().to_numpy() * 1e-9
    assert on == pytest.approx(T[T != 7.0] + 4200.0, abs=2e-3)
    twice = pl.Series("t", ns(np.concatenate((T, T))))
    with pytest.raises(ProfileError, match=r"imu.csv: .* row 3001 ") as error:
        of_one_recording(twice, "imu.csv")
    assert "cut the tables" in (error.value.hint or "")
