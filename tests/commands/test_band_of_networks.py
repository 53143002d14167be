"""The band of a network's run, by validation voyages of which some have no window."""

from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
import sailing

from shiplog.commands.train_networks import _band
from shiplog.nomenclature.channels import STATE
from shiplog.simulation import prediction_interval
from shiplog.training.settings.run_config import Config
from shiplog.voyages.rows import one_hertz
from shiplog.voyages.windows.split_settings import Split

SECONDS, SHORT, COUNT = 10, 5, 20


class Wrong:
    """Simulates what was measured with a random walk of its own on it."""

    def simulate(self, windows):
        steps = np.random.default_rng(0).normal(size=windows.state.shape)
        steps[:, 0] = 0.0
        return windows.state + np.cumsum(steps, axis=1)


def test_a_voyage_without_a_window_is_no_observation_of_the_band():
    """Of 40 voyages half are too short. A split conformal interval of n voyages takes the quantile
    0.9 (1 + 1/n): 0.945 of twenty, and 0.9225 if the forty were counted."""
    profile = sailing.profile()
    columns = [*(c.name for c in STATE), *profile.actuator_names, *profile.wind_names]
    names = tuple(f"v{i:02d}" for i in range(2 * COUNT))
    rows = pl.concat(
        pl.DataFrame({"voyage": [name] * length} | {c: [0.0] * length for c in columns})
        .with_columns(elapsed=pl.int_range(length).cast(pl.Float64))
        .with_columns(time=pl.datetime(2026, 1, 1, time_unit="ns") + pl.duration(
            seconds=pl.col("elapsed")))
        for name, length in zip(names, (SECONDS, SHORT) * COUNT, strict=True)
    )  # fmt: skip
    config = Config(split=Split(training=("t",), validation=names), window=SECONDS)
    run = SimpleNamespace(config=config, profile=profile, models=lambda: {0: Wrong()})
    band = _band(run, one_hertz.segments(rows))  # type: ignore[arg-type]  # a stand-in for a run
    error = Wrong().simulate(SimpleNamespace(state=np.zeros((COUNT, SECONDS, 6))))
    half = band.half_width(np.zeros_like(error))
    inside = prediction_interval.coverage(error, half)
    assert inside == pytest.approx(np.full(6, 0.945), abs=0.006)  # of 180 samples
