"""Inside and outside of the training data, on data whose answer is plain."""

import numpy as np
import polars as pl
import pytest

from shiplog.simulation import coverage


def seconds(count, wind_from, seed, surge=0.3):
    rng = np.random.default_rng(seed)
    return pl.DataFrame(
        {
            "voyage": ["a"] * count, "segment": [0] * count,
            "surge": rng.normal(surge, 0.05, count), "sway": rng.normal(0, 0.02, count),
            "yaw_rate": rng.normal(0, 0.02, count), "rudder": rng.uniform(-0.5, 0.5, count),
            "wind_speed": rng.uniform(2.0, 3.0, count),
            "wind_angle": np.radians(wind_from) + rng.normal(0, 0.1, count),
        }
    )  # fmt: skip


@pytest.fixture
def trained():
    return coverage.learn(seconds(3000, 0.0, 0), ("rudder",), has_wind=True)


def test_more_of_the_same_is_covered(trained):
    distance = trained.distance(seconds(500, 0.0, 1))
    assert (distance <= 1.0).mean() > 0.9


def test_a_wind_from_the_other_side_is_not_and_is_named(trained):
    test = seconds(100, 90.0, 2)
    windows = pl.DataFrame({"voyage": ["a"], "segment": [0], "start": [0]})
    row = trained.table(test, windows, 100).to_dicts()[0]
    assert row["coverage"] == 0.0
    assert row["outside_wind"] == 1.0
    assert row["outside_surge"] < 0.1
    sentence = coverage.reason(row, test)
    assert sentence in [
        f"not in the training data: wind around 2.5 m/s from {a} deg (100%)" for a in (89, 90, 91)
    ]
    assert "surge" not in sentence


def test_a_speed_never_sailed_is_named_and_the_wind_is_not(trained):
    test = seconds(100, 0.0, 3, surge=0.8)
    windows = pl.DataFrame({"voyage": ["a"], "segment": [0], "start": [0]})
    row = trained.table(test, windows, 100).to_dicts()[0]
    assert row["outside_surge"] > 0.95
    assert "surge" in coverage.reason(row, test) and "wind" not in coverage.reason(row, test)


def test_a_hole_in_the_middle_of_the_training_speeds_is_outside():
    slow, fast = seconds(1500, 0.0, 0, surge=0.0), seconds(1500, 0.0, 1, surge=1.2)
    trained = coverage.learn(pl.concat([slow, fast]), ("rudder",), has_wind=True)
    between = seconds(200, 0.0, 2, surge=0.6)
    assert trained.mark_outside(between)["surge"].mean() > 0.95
    assert trained.mark_outside(fast)["surge"].mean() == 0.0


def test_the_paper_s_wind_bins_do_not_jump_at_the_bow():
    training = seconds(3000, 0.0, 0)
    turned = training.with_columns(wind_angle=pl.col("wind_angle") + 2 * np.pi)
    trained = coverage.learn(training, ("rudder",), has_wind=True)
    assert trained.distance(turned).max() < 1e-6
    assert not trained.mark_outside(turned)["wind"].any()


def test_a_ship_without_wind_sensor_has_no_wind_to_leave():
    training = seconds(500, 0.0, 0).drop("wind_speed", "wind_angle")
    trained = coverage.learn(training, ("rudder",), has_wind=False)
    assert "wind" not in trained.mark_outside(training)
    assert (trained.distance(training) == 0.0).all()
