"""10 Hz to 1 Hz: circular means, centred bins, and gaps that stay gaps."""

import math
from datetime import UTC, datetime, timedelta

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal

from shiplog.nomenclature.channels import Quality
from shiplog.voyages.rows import one_hertz

START = datetime(2026, 5, 1, 12, 0, 0, tzinfo=UTC)


def rows(seconds=20, voyage="a", start=START, **columns):
    count = seconds * 10
    time = [start + timedelta(milliseconds=100 * i) for i in range(count)]
    base = {"heading": np.zeros(count), "surge": np.arange(count) * 0.1, "quality": [0] * count}
    frame = pl.DataFrame({"voyage": [voyage] * count, "time": time, **(base | columns)})
    return frame.with_columns(pl.col("time").cast(pl.Datetime("ns", "UTC")))


def seconds(frame):
    parts = [part.lazy() for part in frame.partition_by("voyage")]
    return one_hertz.resample(parts, ("heading", "surge"), ("heading",))


def test_the_mean_of_359_and_1_degree_is_north():
    heading = np.radians(np.tile([359.0, 1.0], 100))
    result = seconds(rows(heading=heading))["heading"].to_numpy()[1:-1]  # whole seconds
    assert result == pytest.approx(np.zeros(len(result)), abs=1e-12)


def test_a_mean_across_south_stays_south():
    heading = np.tile(np.radians([179.0, -179.0]), 100)
    result = np.abs(seconds(rows(heading=heading))["heading"].to_numpy())[1:-1]
    assert result == pytest.approx(np.full(len(result), math.pi))


def test_bins_are_centred_on_their_stamp():
    result = seconds(rows())
    assert result["time"][1] == START + timedelta(seconds=1)
    # Rows 0.5 to 1.4 s of surge = t have the mean 0.95; truncating would have given 1.45.
    assert result["surge"][1] == pytest.approx(0.95)
    assert result["samples"][1] == 10


def test_a_second_with_fewer_than_five_good_rows_is_missing_and_starts_a_segment():
    quality = np.zeros(200, int)
    quality[95:101] = int(Quality.GAP)  # rows 9.5 to 10.0 s of the second stamped 10
    result = seconds(rows(quality=quality))
    assert START + timedelta(seconds=10) not in result["time"].to_list()
    before = result.filter(pl.col("time") < START + timedelta(seconds=10))
    after = result.filter(pl.col("time") > START + timedelta(seconds=10))
    assert before["segment"].unique().to_list() == [0]
    assert after["segment"].unique().to_list() == [1]


@pytest.mark.parametrize("mark", [Quality.LIMITS, Quality.SPIKE, Quality.BLANK, Quality.FROZEN])
def test_unusable_rows_stay_out_of_the_mean(mark):
    quality = np.zeros(200, int)
    surge = np.ones(200)
    surge[52], quality[52] = 1e6, int(mark)
    result = seconds(rows(surge=surge, quality=quality))
    assert result["surge"].to_list() == [1.0] * len(result)
    assert result.filter(pl.col("samples") == 9).height == 1


def test_a_held_row_is_used_and_a_jump_starts_a_segment():
    quality = np.zeros(200, int)
    quality[30:40] = int(Quality.HELD)
    quality[100] = int(Quality.JUMP)
    result = seconds(rows(quality=quality))
    assert result["segment"].n_unique() == 2
    assert result.filter(pl.col("segment") == 0).height == 10


def test_a_jump_on_a_row_that_is_not_used_still_starts_a_segment():
    quality = np.zeros(200, int)
    quality[100] = int(Quality.JUMP | Quality.GAP)
    result = seconds(rows(quality=quality))
    assert result["segment"].n_unique() == 2
    assert START + timedelta(seconds=10) not in result["time"].to_list()


def test_voyages_are_apart_and_the_order_of_rows_does_not_matter():
    both = pl.concat([rows(voyage="b"), rows(voyage="a")])
    result = seconds(both.sample(fraction=1.0, shuffle=True, seed=3))
    keys = ("voyage", "time", "samples", "segment")
    assert result.select(keys).equals(seconds(both).select(keys))
    assert result["surge"].to_numpy() == pytest.approx(seconds(both)["surge"].to_numpy())
    assert result["segment"].unique().to_list() == [0]
    assert result["voyage"].unique(maintain_order=True).to_list() == ["a", "b"]


def test_a_voyage_of_days_is_the_same_in_pieces(monkeypatch, tmp_path):
    frame = rows(60, start=START + timedelta(milliseconds=300))
    whole = seconds(frame)
    monkeypatch.setattr(one_hertz, "ONE_DAY", timedelta(seconds=7))
    assert len(list(one_hertz.days(frame.lazy()))) > 5
    assert_frame_equal(seconds(frame), whole)
    one_hertz.sink_averages([frame.lazy()], ("heading", "surge"), ("heading",), tmp_path / "out")
    sunk = pl.read_parquet(tmp_path / "out" / "*.parquet")
    assert_frame_equal(one_hertz.segments(sunk).select(whole.columns), whole)


def test_the_same_data_under_two_names_is_found():
    noise = np.random.default_rng(0).normal(size=(4, 300))
    names = ("surge", "sway", "heading", "yaw_rate")
    original = pl.DataFrame(dict(zip(names, noise, strict=True)) | {"voyage": ["a"] * 300})
    copy = original[:50].with_columns(voyage=pl.lit("b"))
    other = original.select(voyage=pl.lit("c"), surge="sway", sway="surge", heading="heading",
                            yaw_rate="yaw_rate")  # fmt: skip
    columns = ["voyage", *names]
    all_rows = pl.concat([original.select(columns), copy.select(columns), other.select(columns)])
    assert one_hertz.shared_rows(all_rows).rows() == [("a", "b", 50)]
    again = copy.select(columns).with_columns(voyage=pl.lit("d"))
    assert one_hertz.twins(pl.concat([all_rows, again])) == {"b": "a", "d": "a"}


def test_a_row_that_two_voyages_have_many_times_is_shared_as_often_as_both_have_it():
    """Simulated straight courses: 30 s and 20 s of one state share 20 s, not 30 times 20."""
    steady = pl.DataFrame({"surge": [1.0], "sway": 0.0, "heading": 0.5, "yaw_rate": 0.0})

    def sailed(name, count):
        return pl.concat([steady] * count).with_columns(voyage=pl.lit(name))

    found = one_hertz.shared_rows(pl.concat([sailed("a", 30), sailed("b", 20), sailed("c", 5)]))
    assert found.rows() == [("a", "b", 20)]


def test_two_halves_and_the_whole_of_one_log_are_one_group():
    noise = np.random.default_rng(0).normal(size=(4, 60))
    whole = pl.DataFrame(dict(zip(one_hertz.COMPARED, noise, strict=True)))

    def named(name, part):
        return part.with_columns(voyage=pl.lit(name))

    voyages = [named("c", whole[:30]), named("b", whole[30:]), named("a", whole)]
    assert one_hertz.twins(pl.concat(voyages)) == {"b": "a", "c": "a"}
    voyages = [named("a", whole[:30]), named("b", whole[30:]), named("c", whole)]
    assert one_hertz.twins(pl.concat(voyages)) == {"b": "a", "c": "a"}


def test_no_second_is_before_the_first_row():
    """From 0.05 s on, the first average has five rows, and its stamp is 0.05 s before them."""
    result = seconds(rows(start=START + timedelta(milliseconds=50)))
    assert (result["time"][0], result["samples"][0]) == (START, 5)
    assert result["elapsed"].to_list()[:3] == [0.0, 0.0, 1.0]


def test_seconds_count_from_the_first_row_even_where_it_cannot_be_used():
    quality = np.zeros(200, int)
    quality[:50] = int(Quality.GAP)
    result = seconds(rows(quality=quality, start=START + timedelta(milliseconds=300)))
    assert result["time"][0] == START + timedelta(seconds=6)  # 5.7 s after the first row
    assert result["elapsed"].to_list() == [5.0 + i for i in range(result.height)]
