"""Errors planted in known channels, regimes and minutes, and read back."""

import json

import afloat
import numpy as np
import polars as pl
import pytest

from shiplog.ship_profile import file as profiles
from shiplog.simulation import error_breakdown
from shiplog.simulation.scoring import window_loss
from shiplog.simulation.window_series import WindowSeries

COUNT, SIZE = 30, 100


@pytest.fixture
def driven() -> tuple[WindowSeries, pl.DataFrame]:
    """Three voyages of ten windows of 100 s; what the ship does changes every 20 s or so."""
    rng = np.random.default_rng(3)

    def changing(low: float, high: float) -> np.ndarray:
        return np.repeat(rng.uniform(low, high, (COUNT, SIZE // 20)), 20, axis=1)

    measured = np.zeros((COUNT, SIZE, 6))
    measured[..., 1], measured[..., 5] = changing(-0.4, 0.6), changing(-0.1, 0.1)
    measured[..., 3] = 0.02 * rng.standard_normal((COUNT, SIZE))
    measured[..., 0], measured[..., 2] = changing(-20.0, 20.0), changing(-20.0, 20.0)
    measured[..., 4] = changing(-3.0, 3.0)
    actuator = np.stack((changing(-0.6, 0.6), changing(-0.6, 0.6), changing(2.0, 12.0)), -1)
    wind = np.stack((changing(-4.0, 4.0), changing(-4.0, 4.0)), -1)
    data = WindowSeries(measured, actuator, wind, np.ones((COUNT, SIZE - 1)), np.ones(COUNT))
    windows = pl.DataFrame(
        {
            "voyage": np.repeat(["a", "b", "c"], 10),
            "elapsed": np.tile(100.0 * np.arange(10), 3),
            "share": (np.arange(COUNT) + 0.5) / COUNT,
        }
    )
    return data, windows


def little(data: WindowSeries) -> np.ndarray:
    """The same small error everywhere: 1 mm/s, 1 mm/s, and as much weighted in yaw."""
    error = np.zeros_like(data.measured)
    error[..., 1] = error[..., 3] = 1e-3
    error[..., 5] = np.radians(0.01)
    return error


def test_shares_are_those_of_the_loss(driven):
    """d = (100 e_u)² + (100 e_v)² + (10 e_r in deg/s)²: 1, 4 and 1 parts of 6."""
    data, windows = driven
    error = little(data)
    error[..., 3] *= 2.0
    found = error_breakdown.explain(error, data, windows, afloat.PROFILE)
    assert found.channels[0].channel == "sway"
    assert {c.channel: c.share for c in found.channels} == pytest.approx(
        {"sway": 4.0 / 6.0, "surge": 1.0 / 6.0, "yaw_rate": 1.0 / 6.0}
    )
    assert all(c.where == "everywhere alike" for c in found.channels)
    losses = found.timeline.group_by("window", maintain_order=True).agg(pl.col("loss").sum())
    assert losses["loss"].to_numpy() == pytest.approx(window_loss(error, data.dt), rel=1e-9)
    json.dumps([c.as_json() for c in found.channels])


def astern(data: WindowSeries, windows: pl.DataFrame) -> np.ndarray:
    return data.measured[..., 1] < -0.15


def in_the_north_east(data: WindowSeries, windows: pl.DataFrame) -> np.ndarray:
    x0, y0 = data.measured[..., 0], data.measured[..., 2]
    return (x0 >= np.median(x0)) & (y0 >= np.median(y0))


def late(data: WindowSeries, windows: pl.DataFrame) -> np.ndarray:
    return np.broadcast_to(windows["share"].to_numpy()[:, None] > 2 / 3, (COUNT, SIZE))


def wind_from_starboard(data: WindowSeries, windows: pl.DataFrame) -> np.ndarray:
    heading, (u, v) = data.measured[..., 4], np.moveaxis(data.measured[..., [1, 3]], -1, 0)
    north, east = np.moveaxis(data.wind, -1, 0)
    ahead = np.cos(heading) * north + np.sin(heading) * east + u
    aside = np.cos(heading) * east - np.sin(heading) * north + v
    return (aside > np.abs(ahead)) & (np.hypot(ahead, aside) < 4.0)


@pytest.mark.parametrize(
    ("regime", "words"),
    [(astern, ["astern"]), (in_the_north_east, ["in the north-east of its waters"]),
     (late, ["in the last third of the campaign"]), (wind_from_starboard, ["wind from starboard"])],
)  # fmt: skip
def test_where_it_is_wrong_is_reported(driven, regime, words):
    data, windows = driven
    error, inside = little(data), regime(data, windows)
    error[..., 5] = np.where(inside, np.radians(0.5), error[..., 5])
    found = error_breakdown.explain(error, data, windows, afloat.PROFILE)
    worst = found.channels[0]
    assert worst.channel == "yaw_rate"
    assert worst.share > 0.99
    for word in words:
        assert word in worst.where
    assert worst.within > 0.5
    assert worst.occurs < 0.4
    others = {c.channel: c.where for c in found.channels[1:]}
    assert others == {"surge": "everywhere alike", "sway": "everywhere alike"}


def test_an_azimuth_that_is_held_astern_is_not_moving(driven):
    """It passes 180 deg to and fro by a tenth of a degree, in a third of the time."""
    ferry = profiles.load("milliampere")
    data, windows = driven
    steps = np.random.default_rng(8).uniform(size=(COUNT, SIZE // 20)) < 1 / 3
    astern = np.repeat(steps, 20, axis=1)
    trembling = np.pi * np.where(np.arange(SIZE) // 2 % 2, 0.999, -0.999)
    actuator = np.full((COUNT, SIZE, len(ferry.actuators)), 0.5)
    actuator[..., 0] = np.where(astern, trembling, 0.0)
    error = little(data)
    error[..., 5] = np.where(astern, np.radians(0.5), error[..., 5])
    data = data._replace(actuator=actuator)
    found = error_breakdown.explain(error, data, windows, ferry)
    assert found.channels[0].channel == "yaw_rate" and found.channels[0].share > 0.99
    assert "moving" not in found.channels[0].where


def test_two_conditions_are_reported_where_both_are_needed(driven):
    data, windows = driven
    error = little(data)
    both = astern(data, windows) & late(data, windows)
    error[..., 1] = np.where(both, 0.05, error[..., 1])
    where = error_breakdown.explain(error, data, windows, afloat.PROFILE).channels[0].where
    assert where.startswith("astern, in the last third of the campaign (")


def test_the_worst_minute_is_found(driven):
    data, windows = driven
    error = little(data)
    error[17, 30:80, 1] = 0.1  # voyage b, 730 to 780 s: 100 a second, against 0.01 a channel
    found = error_breakdown.explain(error, data, windows, afloat.PROFILE)
    assert found.worst is not None
    assert found.worst.voyage == "b"
    assert 720.0 <= found.worst.start_s <= 730.0
    inside = 50 * 100.02 + 10 * 0.03
    whole = 50 * 100.02 + 0.03 * (COUNT * SIZE - 50 - COUNT)  # ends of a window count half
    assert found.worst.share == pytest.approx(inside / whole, rel=1e-6)


def test_one_bad_window_does_not_say_where(driven):
    data, windows = driven
    error = little(data)
    error[4] *= 100.0
    found = error_breakdown.explain(error, data, windows, afloat.PROFILE)
    assert all(c.where == "everywhere alike" for c in found.channels)


def test_a_window_that_ran_away_is_counted_and_left_out(driven):
    data, windows = driven
    error = little(data)
    error[4, 50:] = np.inf
    found = error_breakdown.explain(error, data, windows, afloat.PROFILE)
    assert found.diverged == 1
    assert sum(c.share for c in found.channels) == pytest.approx(1.0)
    assert found.timeline.height == COUNT * SIZE


def test_nothing_wrong_is_nothing(driven):
    data, windows = driven
    found = error_breakdown.explain(np.zeros_like(data.measured), data, windows, afloat.PROFILE)
    assert found.channels == ()
    assert found.worst is None
