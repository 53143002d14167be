"""The 90 % band: calibrated on errors, and no wider than it must be."""

import numpy as np
import pytest

from shiplog.simulation import prediction_interval


def walks(count: int, seed: int) -> np.ndarray:
    """Errors [N, 40, 6] that grow as √t, each channel with a size of its own, zero at first."""
    steps = np.random.default_rng(seed).normal(size=(count, 40, 6)) * (1, 0.1, 1, 0.1, 0.01, 0.01)
    steps[:, 0] = 0.0
    return np.cumsum(steps, axis=1)


def test_a_calibrated_band_holds_nine_in_ten_of_fresh_errors():
    old, new = walks(2000, 0), walks(2000, 1)
    for own in (np.zeros_like(old), np.full_like(old, 0.5) * np.abs(old).mean((0, 1))):
        learnt = prediction_interval.calibrate(old, own, groups=1000)
        shares = prediction_interval.coverage(new, learnt.half_width(own))
        assert shares == pytest.approx(np.full(6, 0.9), abs=0.03)
    plain = prediction_interval.calibrate(old, np.zeros_like(old), groups=1000)
    assert plain.growth[10:34, 0] == pytest.approx(np.sqrt(np.arange(10, 34)), rel=0.06)
    assert plain.factor == pytest.approx(np.full(6, 1.645), rel=0.05)  # Gaussian


@pytest.mark.parametrize(
    ("groups", "level", "wanted"),
    [(1, 0.9, 0.95), (18, 0.9, 0.95), (30, 0.9, 0.93), (900, 0.9, 0.901), (4, 0.5, 0.625)],
)
def test_few_voyages_ask_for_a_wider_quantile(groups, level, wanted):
    """level (1 + 1/groups), no further than 0.95, of the very errors that it was calibrated on."""
    errors = walks(500, 2)
    nothing = np.zeros_like(errors)
    learnt = prediction_interval.calibrate(errors, nothing, groups, level)
    inside = prediction_interval.coverage(errors, learnt.half_width(nothing))
    assert inside == pytest.approx(np.full(6, wanted), abs=2e-4)


def test_more_spread_of_its_own_is_a_wider_band():
    errors = walks(200, 3)
    learnt = prediction_interval.calibrate(errors, np.full_like(errors, 0.05), groups=20)
    narrow, wide = (learnt.half_width(np.full((3, 40, 6), s)) for s in (0.0, 0.2))
    assert (wide > narrow).all()
    assert narrow == pytest.approx(np.broadcast_to(learnt.factor * learnt.growth, (3, 40, 6)))
    wanted = learnt.factor * np.sqrt(0.04 + learnt.growth**2)
    assert wide[1] == pytest.approx(wanted)


def test_what_the_spread_explains_is_not_counted_twice():
    """Errors as large as the model says: the growth left over is the least, 5 % of the square."""
    errors = walks(2000, 4)
    size = np.sqrt((errors**2).mean(0))
    learnt = prediction_interval.calibrate(errors, np.broadcast_to(size, errors.shape), groups=1000)
    assert learnt.growth[10:34] == pytest.approx(np.sqrt(0.05) * size[10:34], rel=0.05)


def test_rollouts_that_diverged_widen_no_band():
    errors = walks(100, 5)
    own = np.full_like(errors, 0.01)
    wild = np.concatenate((errors, np.full((1, 40, 6), np.inf), np.full((1, 40, 6), np.nan)))
    plain = prediction_interval.calibrate(errors, own, 20)
    same = prediction_interval.calibrate(wild, np.concatenate((own, own[:2])), 20)
    assert same.growth.tolist() == plain.growth.tolist()
    assert same.factor.tolist() == plain.factor.tolist()


@pytest.mark.parametrize("size", [2, 3, 6, 10])
def test_a_rollout_shorter_than_the_smoothing_has_a_band(size):
    """Errors of 1 all along: whatever of them is averaged, the growth is 1."""
    learnt = prediction_interval.calibrate(np.ones((5, size, 6)), np.zeros((5, size, 6)), 20)
    assert learnt.growth[0].tolist() == [0.0] * 6
    assert learnt.growth[1:] == pytest.approx(np.ones((size - 1, 6)))
    assert learnt.factor == pytest.approx(np.ones(6))


def test_the_share_inside_is_counted_without_the_first_samples():
    error = np.zeros((2, 3, 6))
    error[:, 0] = 9.0  # where a rollout begins there is no error to speak of
    error[0, 1, 0], error[1, 1:, 0] = -2.0, (0.5, np.nan)
    error[:, 1:, 1] = -1.0
    half = np.ones((2, 3, 6))
    assert prediction_interval.coverage(error, half).tolist() == [0.5, 1.0, 1.0, 1.0, 1.0, 1.0]


def test_the_spread_of_seeds():
    one = np.zeros((1, 2, 6))
    assert not prediction_interval.seeds_spread([one]).any()
    assert prediction_interval.seeds_spread([one, one + 2.0, one + 4.0]) == pytest.approx(one + 2.0)
    assert np.isinf(prediction_interval.seeds_spread([one, one * np.nan])).all()
