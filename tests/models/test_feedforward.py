"""The network's own rollouts against the rollout of any other model."""

import numpy as np
import pytest
import torch
from small_networks import by_autograd, network, windows

from shiplog.models import compiled_network
from shiplog.models.base import kinematics
from shiplog.models.feedforward import exogenous
from shiplog.models.network_shape import Shape
from shiplog.nomenclature.frames import in_earth_axes
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


@pytest.mark.parametrize("wind_input", ["angle", "components"])
def test_compiled_it_is_the_same_network_and_an_azimuth_turned_round_stands_where_it_stood(
    wind_input,
):
    """A record counts azimuths on past 180 deg; the second actuator is one, the others are not."""
    data = windows(4, 12)
    model = network(Shape(3, width=9, depth=2, wind_input=wind_input), data)
    state, actuator = data.state[:, 0], data.actuator[:, 0]
    heading = state[:, 4]
    speed, angle = data.wind[:, 0, 0], data.wind[:, 0, 1]
    # where it comes from, in body axes
    true = speed * np.cos(angle) - state[:, 1], speed * np.sin(angle) - state[:, 3]
    wind = np.stack(in_earth_axes(*true, np.cos(heading), np.sin(heading)), -1)
    driven = exogenous(torch.from_numpy(actuator), torch.from_numpy(data.wind[:, 0]), wind_input)
    with torch.no_grad():
        wanted = model.acceleration(torch.from_numpy(state[:, [1, 3, 5]]), driven).numpy()

    compiled = compiled_network.compiled(model, (1,))
    turned = actuator + np.array([0.0, 6.0 * np.pi, 0.0])
    for at in (actuator, turned):
        found = np.asarray(compiled.acceleration(np.zeros(0), state, at, wind))
        assert found == pytest.approx(wanted, rel=1e-5, abs=1e-7)
