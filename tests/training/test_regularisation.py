"""The ridge's firmness: what a voyage misleads about, another one corrects."""

import numpy as np
import pytest
from test_output_error import Straight, driven, measured, noisy

from shiplog.simulation import sensitivities
from shiplog.simulation.window_series import WindowSeries
from shiplog.training.physics import regularisation
from shiplog.training.physics.cross_validation import as_good
from shiplog.training.physics.output_error import Identified, identify

FACTORS = (0.25, 0.5, 1.0, 2.0, 4.0)
START = np.array([0.05, 0.03, 0.0])


def judged(data: WindowSeries, unseen: WindowSeries, spread: np.ndarray):
    """Every factor's fit to `data`, and its L on the unseen windows."""

    def fit(factor: float, begin: np.ndarray | None) -> Identified:
        return identify(Straight(), START, spread, data, factor=factor, begin=begin)

    found = regularisation.ladder(fit, FACTORS)
    return found, {
        f: sensitivities.losses(Straight(), one.values, unseen) for f, one in found.items()
    }


# ---------------------------------------------------------------- which voyage teaches what


def test_a_voyage_that_says_nothing_is_not_listened_to():
    """It hardly moves the second actuator, so its noise sets what that one is worth; the unseen
    voyage moves it, and the start was right: the firmest ridge is the nearest to the truth."""
    data = driven(2, seed=1)
    data.actuator[..., 1] *= 0.01
    data = noisy(measured(Straight(), START, data), seed=2)
    unseen = noisy(measured(Straight(), START, driven(2, seed=3)), seed=4)
    found, losses = judged(data, unseen, np.array([0.01, 0.1, 0.01]))
    off = np.array([abs(one.values[1] - START[1]) for one in found.values()])
    assert (np.diff(off) > 0).all() and off[-1] > 5.0 * off[0]
    assert (np.diff([loss.mean() for loss in losses.values()]) > 0).all()
    assert regularisation.choose(losses) == 0.25


def test_a_voyage_that_misleads_is_held_back():
    """The screw of the training voyage has half more thrust than the unseen one's, which the start
    has right."""
    other = np.array([1.5, 1.0, 1.0]) * START
    data = noisy(measured(Straight(), other, driven(2, seed=1)), seed=2, sigma=0.5)
    unseen = measured(Straight(), START, driven(2, seed=3))
    found, losses = judged(data, unseen, np.full(3, 0.001))
    thrusts = [one.values[0] for one in found.values()]
    assert START[0] < thrusts[0] and (np.diff(thrusts) > 0).all() and thrusts[-1] < 1.5 * START[0]
    slope = np.concatenate((np.zeros((8, 1)), np.cumsum(unseen.actuator[:, :-1, 0], 1)), 1)
    ahead = ((found[4.0].values[0] - START[0]) * slope * 100.0) ** 2
    assert losses[4.0].mean() > np.trapezoid(ahead, axis=1).mean() > 0.0
    assert regularisation.choose(losses) == 0.25


def test_a_start_that_two_voyages_contradict_is_let_go():
    """Both say the same, ten plausible spreads away from the start."""
    truth = START + 0.01
    data = noisy(measured(Straight(), truth, driven(2, seed=1)), seed=2, sigma=0.5)
    unseen = measured(Straight(), truth, driven(2, seed=3))
    _, losses = judged(data, unseen, np.full(3, 0.001))
    assert regularisation.choose(losses) > 1.0


def test_each_rung_is_the_fit_with_that_ridge_alone():
    """Warm starts change nothing where the noise is the sensors' own."""
    data = noisy(measured(Straight(), START * 1.3, driven(2)), seed=5, sigma=0.5)
    spread = np.full(3, 0.001)
    found, _ = judged(data, data, spread)
    assert list(found) == list(FACTORS)
    for factor, one in found.items():
        alone = identify(Straight(), START, factor * spread, data)
        moved = (alone.values - START) / (factor * spread)
        assert (one.values - START) / (factor * spread) == pytest.approx(moved, abs=0.01)
    assert np.abs(moved).max() > 0.05


def test_rungs_begin_where_their_neighbour_ended():
    begun = {}

    def fit(factor: float, begin: np.ndarray | None) -> Identified:
        begun[factor] = None if begin is None else begin[0]
        return Identified(
            np.array([factor]), np.eye(1), np.ones(1, bool), 1.0, (1.0, 1.0), 1, True, ""
        )

    assert list(regularisation.ladder(fit, (4.0, 0.25, 0.5, 2.0))) == [0.25, 0.5, 1.0, 2.0, 4.0]
    assert begun == {1.0: None, 2.0: 1.0, 4.0: 2.0, 0.5: 1.0, 0.25: 0.5}


# ---------------------------------------------------------------- the rule


def windows(**less: float) -> dict[float, np.ndarray]:
    """Made-up L of 25 windows: f05=10 is a mean 10 below the plausible ridge, ± 10 a window."""
    rng = np.random.default_rng(7)
    plain = rng.gamma(2.0, 50.0, 25) + 200.0
    losses = {1.0: plain}
    for name, gain in less.items():
        noise = rng.normal(size=25)
        noise = 10.0 * (noise - noise.mean()) / noise.std(ddof=1)
        losses[{"f025": 0.25, "f05": 0.5, "f2": 2.0, "f4": 4.0}[name]] = plain - gain + noise
    return losses


@pytest.mark.parametrize(
    ("less", "wanted"),
    [
        ({"f05": 1.9, "f2": -5.0}, 1.0),  # a gain of 1.9 ± 10/√25 = 2 is chance
        ({"f05": 2.1, "f2": -5.0}, 0.5),
        ({"f05": -5.0, "f2": 30.0, "f4": 5.0}, 2.0),
        ({"f05": 20.0, "f025": 21.0}, 0.5),  # 1 ± √2 · 2 more is chance: the nearer to 1
        ({"f05": 20.0, "f025": 40.0}, 0.25),
        ({"f05": 20.0, "f2": 20.5}, 0.5),  # of two as near and as good, the firmer
        ({"f05": -10.0, "f2": -10.0}, 1.0),
    ],
)
def test_the_nearest_to_plausible_within_one_standard_error_is_chosen(less, wanted):
    assert regularisation.choose(windows(**less)) == wanted


def test_too_few_windows_overrule_nothing():
    assert regularisation.choose({1.0: np.array([300.0]), 0.5: np.array([3.0])}) == 1.0
    lost = {1.0: np.array([300.0, np.inf]), 0.5: np.array([3.0, np.inf])}
    assert as_good(lost) == [] and regularisation.choose(lost) == 1.0


def test_a_ridge_that_lets_a_window_run_away_is_no_choice():
    losses = windows(f05=-50.0, f2=50.0)
    losses[2.0][3] = np.inf
    assert regularisation.choose(losses) == 1.0
    for one in losses.values():
        one[5] = np.inf  # what every one of them loses says nothing
    losses[2.0][3] = losses[1.0][3] - 50.0
    assert regularisation.choose(losses) == 2.0
    losses[1.0][6] = np.inf  # here the plausible one loses what the looser one holds
    losses[0.5][6] = np.inf
    assert regularisation.choose(losses) == 2.0
