"""The engine against autograd in float64, and the network against its own definition."""

import math

import polars as pl
import pytest
import torch

from shiplog import channels, engine
from shiplog.models.feedforward import FeedForward, Scaling, Shape, exogenous, scaling
from shiplog.windows import Windows


def windows(count=5, size=20, actuators=3, wind=2, seed=0):
    g = torch.Generator().manual_seed(seed)

    def random(*shape):
        return torch.randn(*shape, generator=g, dtype=torch.float64)

    return Windows(
        pl.DataFrame({"copy": [0] * count}), 0.3 * random(count, size, 6),
        random(count, size, actuators), random(count, size, wind).abs() * 2,
        0.5 + torch.rand(count, size - 1, generator=g, dtype=torch.float64),
    )  # fmt: skip


def network(shape, data, seed=0):
    model = FeedForward(shape, scaling(data, shape.wind_input)).double()
    return model.initialise(torch.Generator().manual_seed(seed))


def by_autograd(model, data):
    """Eqs. 6, 8 and 9 word by word, with velocities only."""
    driven = exogenous(data.actuator, data.wind, model.shape.wind_input)
    velocity, errors = data.velocity[:, 0], []
    for i in range(data.dt.shape[1] + 1):
        errors.append(velocity - data.velocity[:, i])
        if i < data.dt.shape[1]:
            velocity = velocity + data.dt[:, i, None] * model.acceleration(velocity, driven[:, i])
    w = torch.tensor([100.0, 100.0, 10.0 * 180.0 / math.pi], dtype=torch.float64)
    d = ((torch.stack(errors, 1) * w) ** 2).sum(-1)
    return ((d[:, 1:] + d[:, :-1]) / 2 * data.dt).sum(1).mean()


SHAPES = {
    "the paper's": (Shape(3, width=16), {}),
    "components": (Shape(3, width=16, wind_input="components"), {}),
    "tanh on the input": (Shape(3, width=16, input_tanh=True), {}),
    "no wind": (Shape(2, wind=False, width=16), {"actuators": 2, "wind": 0}),
    "eight actuators, shallow": (Shape(8, width=9, depth=1), {"actuators": 8}),
    "one window": (Shape(3, width=16), {"count": 1}),
}


@pytest.mark.parametrize(("shape", "sizes"), SHAPES.values(), ids=SHAPES.keys())
def test_loss_and_gradient_are_autograds(shape, sizes):
    data = windows(**sizes)
    model = network(shape, data)
    expected = by_autograd(model, data)
    expected.backward()
    weights = [p.detach() for p in model.weights]
    batch = engine.batch(data, model.scaling, shape, torch.float64)
    loss, gradients = engine.loss_and_gradient(weights, batch, model.scaling, shape)
    assert loss == pytest.approx(expected.item(), rel=1e-12)
    for gradient, parameter in zip(gradients, model.weights, strict=True):
        assert torch.allclose(gradient, parameter.grad, rtol=1e-10, atol=1e-12 * loss)
    assert engine.loss_only(weights, batch, model.scaling, shape) == loss


def test_float32_agrees_to_its_precision():
    data = windows()
    shape = Shape(3)
    model = network(shape, data)
    weights = [p.detach() for p in model.weights]
    exact = engine.batch(data, model.scaling, shape, torch.float64)
    single = engine.batch(data, model.scaling, shape, torch.float32)
    a, ga = engine.loss_and_gradient(weights, exact, model.scaling, shape)
    b, gb = engine.loss_and_gradient([w.float() for w in weights], single, model.scaling, shape)
    assert b == pytest.approx(a, rel=1e-5)
    for x, y in zip(ga, gb, strict=True):
        assert (x - y).norm() <= 1e-5 * x.norm()


def test_a_network_of_zeros_accelerates_by_the_mean_and_the_loss_has_a_closed_form():
    """ν̇ = μ constant: with measured ν = 0 the error after k s is kμ, and Σ gives the loss."""
    size, mean = 11, torch.tensor([0.01, -0.02, 0.005], dtype=torch.float64)
    data = windows(1, size)
    data = Windows(data.plan, torch.zeros_like(data.state), data.actuator, data.wind,
                   torch.ones_like(data.dt))  # fmt: skip
    shape = Shape(3, width=4)
    one = torch.ones(8, dtype=torch.float64)
    scale = Scaling(0 * one, one, mean, torch.ones(3, dtype=torch.float64))
    model = FeedForward(shape, scale).double()
    weights = [torch.zeros_like(p) for p in model.weights]
    loss = engine.loss_only(weights, engine.batch(data, scale, shape, torch.float64), scale, shape)
    squares = sum(k * k for k in range(10)) + 10 * 10 / 2  # trapezoid: half of the last
    w = torch.tensor(channels.VELOCITY_WEIGHTS, dtype=torch.float64)
    assert loss == pytest.approx(squares * float(((w * mean) ** 2).sum()))


def test_the_papers_network_has_the_papers_size():
    model = network(Shape(3), windows())
    assert sum(p.numel() for p in model.weights) == 200_451
    assert [tuple(w.shape) for w in model.weights[::2]] == [
        (256, 8), (256, 256), (256, 256), (256, 256), (3, 256),
    ]  # fmt: skip


def test_the_papers_wind_angle_is_between_0_and_360_degrees():
    wind = torch.tensor([[4.0, -math.pi / 2]])
    assert exogenous(torch.zeros(1, 1), wind, "angle").tolist()[0] == pytest.approx(
        [0.0, 4.0, 1.5 * math.pi]
    )
    assert exogenous(torch.zeros(1, 1), wind, "components").tolist()[0] == pytest.approx(
        [0.0, 0.0, -4.0], abs=1e-6
    )


def test_scaling_standardises_the_reference_set_and_spares_a_constant_channel():
    data = windows(4, 50)
    data.actuator[..., 1] = 10.23
    scale = scaling(data, "angle")
    inputs = torch.cat((data.velocity, exogenous(data.actuator, data.wind, "angle")), -1)
    standard = ((inputs - scale.input_mean) / scale.input_std).flatten(0, 1)
    varying = [0, 1, 2, 3, 5, 6, 7]
    assert torch.allclose(standard.mean(0), torch.zeros(8).double(), atol=1e-12)
    assert torch.allclose(standard[:, varying].std(0, unbiased=False), torch.ones(7).double())
    assert (standard[:, 4].abs() < 1e-9).all()
    rate = data.velocity.diff(dim=1) / data.dt[..., None]
    assert torch.allclose(scale.output_mean, rate.flatten(0, 1).mean(0))
