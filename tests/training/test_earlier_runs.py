"""Runs that were made when the equations had fewer coefficients open as they were."""

import numpy as np
import pytest

from shiplog.exceptions import RunError
from shiplog.training.runs.earlier_runs import kept

TODAY = ("hull.c_d", "hull.x_u", "rudder.eps", "rudder.inboard", "network.w1_0", "network.c1_0")
NEUTRAL = {"hull.x_u": 0.0, "rudder.inboard": 1.0}.get


def test_kept_numbers_find_their_places_and_new_terms_stay_out():
    place = kept(("hull.c_d", "rudder.eps"), 4, TODAY, NEUTRAL)
    assert place.vector(np.array([0.9, 1.1, 7.0, 8.0])).tolist() == [0.9, 0.0, 1.1, 1.0, 7.0, 8.0]
    assert place.vector(np.arange(4.0), 1e-9).tolist() == [0.0, 1e-9, 1.0, 1e-9, 2.0, 3.0]
    whole = place.matrix(np.arange(16.0).reshape(4, 4))
    assert whole[[1, 3]].tolist() == whole[:, [1, 3]].T.tolist() == [[0.0] * 6] * 2
    assert (
        whole[np.ix_([0, 2, 4, 5], [0, 2, 4, 5])].tolist() == np.arange(16.0).reshape(4, 4).tolist()
    )


def test_todays_runs_stay_as_they_are():
    values = np.arange(6.0)
    place = kept(TODAY[:4], 6, TODAY, NEUTRAL)
    assert place.vector(values).tolist() == values.tolist()
    assert place.matrix(np.diag(values)).tolist() == np.diag(values).tolist()


@pytest.mark.parametrize(
    ("physics", "count", "word"),
    [
        (("hull.c_d", "rudder.eps", "hull.abolished"), 5, "hull.abolished"),
        (("hull.c_d",), 3, "rudder.eps"),  # has no neutral value
        (("hull.c_d", "rudder.eps"), 3, "3 numbers instead of 4"),
    ],
)
def test_a_run_of_other_equations_is_refused(physics, count, word):
    with pytest.raises(RunError, match=word):
        kept(physics, count, TODAY, NEUTRAL)
