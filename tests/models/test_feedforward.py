"""The network's own rollouts against the rollout of any other model."""

import numpy as np
import pytest
import torch
from small_networks import by_autograd, network, windows

from shiplog.models.base import kinematics
from shiplog.models.feedforward import exogenous
from shiplog.models.network_shape import Shape
from shiplog.simulation import scoring
from shiplog.simulation.rollout import rollout, simulate


@pytest.mark.parametrize("wind_input", ["angle", "components"])
def test_a_network_rolls_itself_out_as_the_integrator_does(wind_input):
    data = windows(4, 12)
    model = network(Shape(3, width=9, depth=2, wind_input=wind_input), data)

    def dynamics(state, actuator, wind):
        driven = exogenous(torch.from_numpy(actuator), torch.from_numpy(wind), wind_input)
        with torch.no_grad():
            acceleration = model.acceleration(torch.from_numpy(state[:, [1, 3, 5]]), driven)
        return kinematics(state, acceleration.numpy())

    found = simulate(model, data)
    wanted = rollout(dynamics, data.state[:, 0], data.actuator, data.wind, data.dt)
    assert found.dtype == np.float64 and found.shape == data.state.shape
    assert found == pytest.approx(wanted, rel=1e-12, abs=1e-12)


def test_its_score_is_the_loss_that_training_makes_smaller():
    data = windows(4, 12)
    model = network(Shape(3, width=9, depth=2), data)
    loss = scoring.score(model, data).errors["loss"]
    assert loss.mean() == pytest.approx(by_autograd(model, data).item(), rel=1e-12)
