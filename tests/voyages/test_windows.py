"""Windows by the paper's equations: counts of Table 3, tracing, noise, and no window over a gap."""

from datetime import UTC, datetime, timedelta

import numpy as np
import polars as pl
import pytest

from shiplog.exceptions import WindowError
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.augmentation import AUGMENTATIONS

START = datetime(2026, 5, 1, tzinfo=UTC)
STATES = ("x0", "surge", "y0", "sway", "heading", "yaw_rate")


def seconds(lengths, gap_after=None):
    """1 Hz tables in which surge counts the rows of all voyages, so that each can be traced."""
    parts = []
    for number, length in enumerate(lengths):
        time = [START + timedelta(days=number, seconds=i) for i in range(length)]
        segment = [0 if gap_after is None or i < gap_after else 1 for i in range(length)]
        parts.append(pl.DataFrame({"voyage": f"v{number}", "time": time, "segment": segment}))
    frame = pl.concat(parts).with_columns(pl.col("time").cast(pl.Datetime("ns", "UTC")))
    count = frame.height
    columns = {name: np.zeros(count) for name in STATES}
    columns["surge"] = np.arange(count, dtype=float)
    columns["heading"] = (0.1 * np.arange(count) + np.pi) % (2 * np.pi) - np.pi
    columns |= {"rudder": np.arange(count) * 2.0, "wind_speed": np.ones(count),
                "wind_angle": np.zeros(count)}  # fmt: skip
    return frame.with_columns(**{k: pl.Series(v) for k, v in columns.items()})


def planned(frame, name, size=100):
    a = AUGMENTATIONS[name]
    return windows.plan(frame.lazy(), size, a.step, a.copies).collect()


def cut(frame, plan, size=100):
    return windows.cut(frame, plan, size, ("rudder",), ("wind_speed", "wind_angle"))


@pytest.mark.parametrize(
    ("name", "lengths", "count"),
    [
        ("ref", (500, 1801), 23), ("sli2", (500, 1801), 44), ("sli10", (500, 1801), 212),
        ("jit2", (500, 1801), 46), ("jit10", (500, 1801), 230), ("sli2xjit2", (500, 1801), 88),
        ("sli10xjit10", (500, 1801), 2120), ("d-ref", (500, 1801, 500, 1801), 46),
        ("ref", (1201,), 12),
    ],
)  # fmt: skip
def test_the_papers_datasets_have_the_papers_sizes(name, lengths, count):
    assert planned(seconds(lengths), name).height == count


def test_every_sample_can_be_traced_to_its_row():
    frame = seconds((250, 320))
    plan = planned(frame, "sli2")
    made = cut(frame, plan)
    for i, row in enumerate(plan.to_dicts()):
        first = (0 if row["voyage"] == "v0" else 250) + row["start"]
        assert made.state[i, :, 1].tolist() == list(range(first, first + 100))
        assert made.actuator[i, :, 0].tolist() == [2.0 * k for k in range(first, first + 100)]
        assert made.plan["elapsed"][i] == row["start"]


@pytest.mark.parametrize(("length", "count"), [(99, 0), (100, 1), (199, 1), (200, 2)])
def test_the_last_window_ends_with_the_last_row(length, count):
    frame = seconds((length,))
    plan = planned(frame, "ref")
    assert plan.height == count
    if count:
        assert cut(frame, plan).state[-1, -1, 1] == 100 * count - 1


def test_no_window_crosses_a_gap():
    frame = seconds((250,), gap_after=130)
    made = cut(frame, planned(frame, "sli10"))
    assert made.plan.select("segment", "start").rows() == [
        (0, 0), (0, 10), (0, 20), (0, 30), (1, 0), (1, 10), (1, 20),
    ]  # fmt: skip
    assert made.state[4, 0, 1] == 130.0


def test_heading_is_unwrapped_within_each_window():
    frame = seconds((250,))
    made = cut(frame, planned(frame, "ref"))
    assert np.diff(made.state[..., 4], axis=1) == pytest.approx(np.full((2, 99), 0.1))


def test_picked_windows_are_theirs_row_by_row():
    made = cut(seconds((250, 320)), planned(seconds((250, 320)), "sli2"))
    some = made.pick(np.array([5, 0]))
    assert some.plan.rows() == [made.plan.row(5), made.plan.row(0)]
    for name in ("state", "actuator", "wind", "dt", "velocity"):
        values = getattr(made, name)
        assert values.dtype == np.float64
        assert np.array_equal(getattr(some, name), values[[5, 0]])


def test_a_window_longer_than_every_segment_says_so():
    frame = seconds((60, 80))
    with pytest.raises(WindowError, match="longest, of v1, has 80 seconds"):
        cut(frame, planned(frame, "ref"))
