"""The noise of an instrument is found again, whatever the ship did while it was recorded."""

import numpy as np
import pytest
import sailing

from shiplog.logs.health.health_report import Instrument
from shiplog.voyages.rows import noise_estimate

STEP_NS = 100_000_000


def times(count, hz=10.0):
    return sailing.START + np.round(np.arange(count) * 1e9 / hz).astype(np.int64)


def estimated(value, hz=10.0, **given):
    return noise_estimate.sigma(times(len(value), hz), value.reshape(len(value), -1), **given)


@pytest.mark.parametrize("sigma", [0.003, 0.1, 4.0])
@pytest.mark.parametrize("hz", [1.0, 10.0, 50.0])
@pytest.mark.parametrize(
    "motion",
    [
        lambda t: 0.0 * t,
        lambda t: 5.0 * t,
        lambda t: 30.0 * np.sin(2.0 * np.pi * t / 60.0),
        lambda t: 400.0 * np.sin(2.0 * np.pi * t / 400.0) + 3.0 * np.sin(2.0 * np.pi * t / 25.0),
    ],
    ids=["rest", "straight", "swing", "two swings"],
)
def test_the_sigma_of_white_noise_is_found_whatever_the_motion(sigma, hz, motion):
    rng = np.random.default_rng(1)
    t = np.arange(4000) / hz
    # a swing of 30 in a minute at 1 Hz has fifth differences of 4e-4: below the least noise here
    assert estimated(motion(t) + rng.normal(0.0, sigma, 4000), hz) == pytest.approx(sigma, rel=0.1)


def test_the_noisiest_column_counts():
    rng = np.random.default_rng(2)
    both = np.stack((rng.normal(0.0, 0.1, 3000), rng.normal(0.0, 0.3, 3000)), axis=1)
    assert estimated(both) == pytest.approx(0.3, rel=0.1)


def test_rest_does_not_make_it_less():
    rng = np.random.default_rng(3)
    value = np.sin(np.arange(4000) / 100.0) + rng.normal(0.0, 0.2, 4000)
    value[300:3300] = 0.0  # a filter of the instrument says that it stands still
    assert estimated(value) == pytest.approx(0.2, rel=0.15)


@pytest.mark.parametrize("gap", [1, 40, 5000])
def test_gusts_jumps_gaps_and_spikes_do_not_make_it_more(gap):
    rng = np.random.default_rng(4)
    value = rng.normal(0.0, 0.2, 4000)
    value[1000:1400] += 8.0 * np.sin(np.arange(400) / 2.0)  # a squall
    value[2000:] += 500.0
    value[::100] += 30.0
    stamps = times(4000)
    stamps[3000:] += gap * STEP_NS
    found = noise_estimate.sigma(stamps, value[:, None])
    assert found == pytest.approx(0.2, rel=0.2)


@pytest.mark.parametrize("every", [2, 5, 10])
def test_an_instrument_slower_than_its_log_is_taken_at_its_own_rate(every):
    rng = np.random.default_rng(5)
    value = np.repeat(rng.normal(0.0, 0.2, 800), every)
    assert len(noise_estimate.own_samples(value[:, None])) == 800
    assert estimated(value) == pytest.approx(0.2, rel=0.15)


@pytest.mark.parametrize("step", [0.01, 1.0, 5.0])
def test_a_step_is_a_noise_of_its_own(step):
    t = np.arange(4000) / 10.0
    coarse = step * np.round(20.0 * step * np.sin(t / 40.0) / step)
    assert estimated(coarse, resolution=step) == pytest.approx(step / np.sqrt(12.0), rel=0.05)
    # of noise as large as the step, the step's own share is in the differences already
    noisy = np.random.default_rng(6).normal(0.0, step, 4000)
    found = estimated(step * np.round(noisy / step), resolution=step)
    assert found == pytest.approx(np.hypot(step, step / np.sqrt(12.0)), rel=0.15)


def test_a_rate_that_a_filter_has_smoothed_is_no_finer_than_a_thousandth():
    smooth = 2.0 * np.sin(np.arange(4000) / 200.0)
    assert estimated(smooth) < 1e-6
    assert estimated(smooth, rate=True) == pytest.approx(2e-3, rel=0.02)


def test_a_few_samples_say_nothing():
    assert estimated(np.arange(10.0) % 3.0) == 0.0
    assert estimated(np.arange(10.0) % 3.0, resolution=1.2) == pytest.approx(0.34641, rel=1e-4)
    assert noise_estimate.sigma(np.zeros(0, np.int64), np.zeros((0, 1))) == 0.0


def test_what_ingest_found_stands_where_the_profile_says_nothing():
    found = [Instrument("yaw_rate", 10.0, 0.0, "deg/s", s) for s in (0.2, 0.3, 0.9)]
    found += [Instrument("heading", 10.0, 0.0, "deg", 7.0), Instrument("wind", 1.0, 0, "m/s", 0.4)]
    profile = sailing.profile()  # yaw rate in deg/min and wind without sigma, heading with one
    sensors = noise_estimate.completed(profile, found).sensors
    assert sensors.yaw_rate.sigma == 18.0
    assert sensors.noise("yaw_rate") == pytest.approx(np.radians(0.3))
    assert sensors.wind.sigma == 0.4
    assert sensors.heading.sigma == 0.05
    assert profile.sensors.yaw_rate.sigma is None


@pytest.fixture
def voyage(tmp_path):
    return sailing.store_of(tmp_path, ["a", "b"], seconds=60.0)


def test_the_store_remembers_what_was_estimated(voyage):
    report = voyage.report("a")
    sigma = {one.channel: one.sigma for one in report.instruments}
    turning = np.degrees(sailing.SPEED / sailing.RADIUS)
    assert sigma["yaw_rate"] == pytest.approx(1e-3 * turning, rel=0.01)  # a thousandth of the rate
    assert sigma["wind"] == pytest.approx(4e-3, rel=0.01)  # and of the speed
    remembered = voyage.profile(["a", "b"]).sensors
    assert remembered.yaw_rate.sigma == pytest.approx(1e-3 * turning * 60.0, rel=0.05)
    assert remembered.heading.sigma == 0.05
