"""Whether a trial's windows have greater errors than the nominal ones, and what follows."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import weighed

from shiplog.diagnosis.hypotheses.table import Hypotheses
from shiplog.diagnosis.verdict.held_out import HeldOut

COUNT = 12
STEPS = 5


def windows(errors: np.ndarray) -> SimpleNamespace:
    """One window an error of its surge velocity, all along it."""
    state = np.zeros((len(errors), STEPS, 6))
    error = state.copy()
    error[..., 1] = np.asarray(errors)[:, None]
    return SimpleNamespace(state=state, error=error, dt=np.ones((len(errors), STEPS - 1)))


class Simulator:
    """The model: its path of a window has the window's error."""

    theta = None

    def states(self, cut, theta):
        return cut.state + cut.error


def worse(trial: np.ndarray, nominal: np.ndarray | None) -> bool:
    of = None if nominal is None else windows(nominal)
    return HeldOut(windows(trial), Simulator(), None, None, of).worse_than_nominal


def test_greater_errors_are_greater_by_their_ranks():
    """Of two times twelve values of which all of one are greater, the probability is one in
    24!/(12! 12!) = 2.7 million; of the same values it is a half."""
    errors = np.linspace(1.0, 2.0, COUNT)
    assert not worse(errors, errors)
    assert worse(errors + 1.01, errors)
    assert not worse(errors, errors + 1.01)
    assert worse(errors, None)


def test_one_window_with_most_of_the_error_decides_nothing():
    errors = np.linspace(1.0, 2.0, COUNT)
    assert not worse(np.append(errors, 1000.0), errors)


@pytest.mark.parametrize("same", [True, False])
def test_a_trial_that_is_simulated_as_the_nominal_voyages_has_no_new_dependence(same):
    """None of the families may then have changed, and the prior is shared by what is left."""
    of = replace(weighed.trial(), as_nominal=same)
    assert bool(of.families) != same
    table = Hypotheses(of, of.first, {})
    kinds = {"time", "motion"} & set(table.trial.families)
    assert (not kinds) == same
