"""The rollout's gradient against autograd in float64, and the network against its definition."""

import math
import os
from contextlib import contextmanager

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from small_networks import by_autograd, network, windows

from shiplog.models.feedforward import FeedForward, Scaling, driven_by, exogenous, scaling
from shiplog.models.network_shape import Shape
from shiplog.nomenclature import channels
from shiplog.training.network import kernel, network_gradient
from shiplog.voyages.windows.windows import Windows


def bodies():
    """What this machine can compute the gradient with."""
    highest = kernel.level()
    levels = [] if highest is None else kernel.LEVELS[: kernel.LEVELS.index(highest) + 1]
    return ["off", *levels]


@contextmanager
def body(name):
    before = os.environ.get(kernel.SWITCH)
    os.environ[kernel.SWITCH] = name
    try:
        yield
    finally:
        os.environ.pop(kernel.SWITCH)
        if before is not None:
            os.environ[kernel.SWITCH] = before


@st.composite
def problems(draw):
    """A network of any width and depth, and windows of any length and number."""
    actuators, wind = draw(st.integers(1, 9)), draw(st.sampled_from((0, 2)))
    shape = Shape(
        actuators, bool(wind), draw(st.integers(1, 70)), draw(st.integers(1, 5)),
        draw(st.sampled_from(("angle", "components"))), draw(st.booleans()),
    )  # fmt: skip
    data = windows(
        draw(st.integers(1, 60)), draw(st.integers(2, 25)), actuators, wind,
        draw(st.integers(0, 2**31)),
    )  # fmt: skip
    return shape, data


def relative(found, expected):
    """Euclidean norm of the difference of two lists of tensors over that of the latter."""
    found, expected = (torch.cat([t.flatten().double() for t in of]) for of in (found, expected))
    return float((found - expected).norm() / expected.norm())


@pytest.mark.parametrize("name", bodies())
@settings(max_examples=40, deadline=None, derandomize=True)
@given(problem=problems())
def test_loss_and_gradient_are_autograds(name, problem):
    shape, data = problem
    model = network(shape, data)
    expected = by_autograd(model, data)
    expected.backward()
    slopes = [p.grad for p in model.weights]
    weights = [p.detach() for p in model.weights]
    for dtype, close in ((torch.float64, 1e-12), (torch.float32, 1e-5)):
        given = [w.to(dtype) for w in weights]
        batch = network_gradient.batch(data, model.scaling, shape, dtype)
        with body(name):
            loss, found = network_gradient.loss_and_gradient(given, batch, model.scaling, shape)
            alone = network_gradient.loss_only(given, batch, model.scaling, shape)
        assert loss == pytest.approx(expected.item(), rel=close)
        assert alone == pytest.approx(loss, rel=close)
        assert relative(found, slopes) <= close
        assert [g.shape for g in found] == [w.shape for w in weights]


def test_the_papers_network_on_the_papers_windows():
    data = windows(8, 100)
    shape = Shape(3)
    model = network(shape, data)
    by_autograd(model, data).backward()
    weights = [p.detach() for p in model.weights]
    for name in bodies():
        for dtype, close in ((torch.float64, 1e-12), (torch.float32, 1e-5)):
            batch = network_gradient.batch(data, model.scaling, shape, dtype)
            given = [w.to(dtype) for w in weights]
            with body(name):
                _, found = network_gradient.loss_and_gradient(given, batch, model.scaling, shape)
            assert relative(found, [p.grad for p in model.weights]) <= close


@pytest.mark.parametrize("shape", [Shape(3, width=7, depth=2), Shape(3, width=5, input_tanh=True)])
def test_several_networks_at_once_are_each_by_itself(shape):
    """As a GPU wants them: weights and windows of each network along a further dimension."""
    sets = [windows(6, 12, seed=seed) for seed in (1, 2, 3)]
    models = [network(shape, sets[0], seed) for seed in (4, 5, 6)]
    scale = models[0].scaling
    batches = [network_gradient.batch(one, scale, shape, torch.float64) for one in sets]
    lists = [[p.detach() for p in model.weights] for model in models]
    all_windows = network_gradient.Batch(
        *(torch.stack([getattr(b, name) for b in batches], 1)
          for name in ("velocity", "driven", "dt"))
    )  # fmt: skip
    weights = [torch.stack(of) for of in zip(*lists, strict=True)]
    losses, gradients = network_gradient.joint_gradient(weights, all_windows, scale, shape)
    for number, (own, batch) in enumerate(zip(lists, batches, strict=True)):
        loss, expected = network_gradient.by_torch(own, batch, scale, shape)
        assert float(losses[number]) == pytest.approx(loss, rel=1e-12)
        assert relative([g[number] for g in gradients], expected) <= 1e-12


needs_kernel = pytest.mark.skipif(kernel.level() is None, reason="the kernel was not built")


@needs_kernel
@pytest.mark.parametrize("count", [1, 24, 25, 130])
def test_the_kernels_bits_do_not_depend_on_the_number_of_threads(count):
    data = windows(count, 9)
    shape = Shape(3, width=40, depth=2)
    model = network(shape, data)
    weights = [p.detach().float() for p in model.weights]
    batch = network_gradient.batch(data, model.scaling, shape, torch.float32)
    scale = model.scaling.to(torch.float32)
    scales = [scale.input_mean[:3], scale.input_std[:3], scale.output_mean, scale.output_std,
              torch.tensor(channels.VELOCITY_WEIGHTS) ** 2]  # fmt: skip
    arguments = (weights, batch.velocity, batch.driven, batch.dt, scales, False, True)
    one, *others = (
        kernel.loss_and_gradient(*arguments, kernel.level(), threads) for threads in (1, 2, 3, 8)
    )
    for loss, gradient in others:
        assert loss == one[0]
        assert all(torch.equal(a, b) for a, b in zip(gradient, one[1], strict=True))


@pytest.mark.parametrize("name", bodies())
def test_a_rollout_that_runs_away_has_no_finite_loss(name):
    """And no exception: the recipes see it and go on from the best weights."""
    data = windows(30, 12)
    shape = Shape(3, width=20, depth=2)
    model = network(shape, data)
    for wrong in (1e300, math.nan):
        weights = [p.detach().clone() for p in model.weights]
        weights[-1][1] = wrong
        batch = network_gradient.batch(data, model.scaling, shape, torch.float64)
        with body(name):
            loss, _ = network_gradient.loss_and_gradient(weights, batch, model.scaling, shape)
        assert not math.isfinite(loss)


@pytest.mark.parametrize("name", bodies())
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_adam_is_torchs(name, dtype):
    g = torch.Generator().manual_seed(3)
    weights = [torch.randn(s, generator=g, dtype=torch.float64).to(dtype) for s in ((7, 5), (7,))]
    moments = [torch.zeros_like(w) for w in [*weights, *weights]]
    parameters = [torch.nn.Parameter(w.clone()) for w in weights]
    reference = torch.optim.Adam(parameters, lr=0.01, weight_decay=0.02)
    for step in range(1, 30):
        gradients = [torch.randn(w.shape, generator=g, dtype=torch.float64).to(dtype)
                     for w in weights]  # fmt: skip
        for parameter, gradient in zip(parameters, gradients, strict=True):
            parameter.grad = gradient.clone()
        reference.step()
        with body(name):
            network_gradient.adam(weights, moments, gradients, step, 0.01, 0.02)
    close = 1e-12 if dtype == torch.float64 else 1e-5
    assert relative(weights, [p.detach() for p in parameters]) <= close


def test_a_switch_takes_a_lower_level_but_no_higher_one():
    highest = kernel.level()
    with body("off"):
        assert kernel.level() is None
    if highest is not None:
        with body("portable"):
            assert kernel.level() == "portable"
        with body("avx512"):
            assert kernel.level() == highest


def test_a_network_of_zeros_accelerates_by_the_mean_and_the_loss_has_a_closed_form():
    """ν̇ = μ constant: with measured ν = 0 the error after k s is kμ, and Σ gives the loss."""
    size, mean = 11, torch.tensor([0.01, -0.02, 0.005], dtype=torch.float64)
    data = windows(1, size)
    data = Windows(data.plan, np.zeros_like(data.state), data.actuator, data.wind,
                   np.ones_like(data.dt))  # fmt: skip
    shape = Shape(3, width=4)
    one = torch.ones(8, dtype=torch.float64)
    scale = Scaling(0 * one, one, mean, torch.ones(3, dtype=torch.float64))
    model = FeedForward(shape, scale).double()
    weights = [torch.zeros_like(p) for p in model.weights]
    loss = network_gradient.loss_only(
        weights, network_gradient.batch(data, scale, shape, torch.float64), scale, shape
    )
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
    velocity = torch.from_numpy(data.velocity)
    inputs = torch.cat((velocity, driven_by(data, "angle")), -1)
    standard = ((inputs - scale.input_mean) / scale.input_std).flatten(0, 1)
    varying = [0, 1, 2, 3, 5, 6, 7]
    assert torch.allclose(standard.mean(0), torch.zeros(8).double(), atol=1e-12)
    assert torch.allclose(standard[:, varying].std(0, unbiased=False), torch.ones(7).double())
    assert (standard[:, 4].abs() < 1e-9).all()
    rate = velocity.diff(dim=1) / torch.from_numpy(data.dt)[..., None]
    assert torch.allclose(scale.output_mean, rate.flatten(0, 1).mean(0))
