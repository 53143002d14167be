"""Runs that were extended by causes."""

import numpy as np
import pytest

from shiplog.simulation.extended_simulator import Extension


def test_numbers_that_a_cause_did_not_have_when_a_run_was_extended_change_nothing():
    """The catalogue's bank has three numbers; an earlier one had its strength alone."""
    arrays = {"coefficients": np.zeros(3), "covariance": np.array([[0.04, 0.01], [0.01, 0.09]])}
    causes = [{"label": "bank", "name": "bank", "made": {}, "numbers": [0.7]},
              {"label": "yaw_rate_bias", "name": "yaw_rate_bias", "made": {},
               "numbers": [0.001]}]  # fmt: skip
    kept = Extension.of({"causes": causes, "shares": {}, "lengths": {}}, arrays)
    assert kept.numbers["bank"].tolist() == [0.7, 0.0, 0.0]
    assert kept.covariance["bank"] == pytest.approx(np.diag([0.04, 0.0, 0.0]), abs=1e-9)
    assert kept.numbers["yaw_rate_bias"].tolist() == [0.001]
    assert kept.covariance["yaw_rate_bias"].tolist() == [[0.09]]
