"""Functions of others, in the child: how they are called, and what is odd of them is said."""

from pathlib import Path

import numpy as np
import pytest

from shiplog.foreign.callables import PythonFunction, Refused
from shiplog.foreign.trying import checked, slopes
from shiplog.foreign.worker import Called

HERE = Path(__file__).parent
ODD = HERE / "odd.py"


def rows(count=9):
    rng = np.random.default_rng(3)
    state = rng.normal(size=(count, 6)) * (50.0, 1.0, 50.0, 0.2, 1.0, 0.1)
    inputs = np.stack((rng.uniform(-0.5, 0.5, count), rng.uniform(-1.0, 5.0, count)), 1)
    wind = rng.normal(size=(count, 2))
    return np.concatenate((state, inputs, wind, np.linspace(0.0, 20.0, count)[:, None]), 1)


def accelerations(of):
    """du/dt = max(n, 0) - u, dv/dt = -v, dr/dt = delta - r."""
    u, v, r, delta, n = (of[:, i] for i in (1, 3, 5, 6, 7))
    return np.stack((np.maximum(n, 0.0) - u, -v, delta - r), 1)


def opened(function, path=ODD):
    found = Called(path, function, 2, False)
    found.probe(rows())
    return found


@pytest.mark.parametrize(
    ("function", "returns", "layout"),
    [
        ("derivative", "derivative", "row by row"),
        ("rows", "derivative", "rows"),
        ("columns", "derivative", "columns"),
        ("acceleration", "acceleration", "rows"),
        ("following", "next state", "rows"),
    ],
)
def test_how_a_function_is_called_is_found_out(function, returns, layout):
    found = opened(function)
    assert (found.returns, found.layout, found.changes) == (returns, layout, False)
    values, troubles = found.rates(rows())
    assert values == pytest.approx(accelerations(rows()), abs=1e-10)
    assert not troubles


def test_what_is_odd_is_found():
    assert opened("changing").changes
    assert checked(opened("drawing"), rows())["random"] > 1e-4
    assert checked(opened("rows"), rows())["random"] == 0.0
    assert checked(opened("of_place"), rows())["place"] > 0.05
    assert checked(opened("rows"), rows())["place"] == 0.0


@pytest.mark.parametrize(
    ("function", "words"),
    [
        ("short", "returns an array of shape (2,)"),
        ("greedy", "MemoryError"),
        ("missing", "no function 'missing'"),
    ],
)
def test_what_cannot_be_used_is_refused(function, words):
    with pytest.raises(Refused, match=words.replace("(", r"\(").replace(")", r"\)")):
        opened(function)


def test_a_rollout_goes_as_the_equation_does():
    """u(t) = n + (u0 - n) exp(-t) of a constant n: Heun's error is of the third order."""
    of = opened("rows")
    start = np.zeros((1, 6))
    start[0, 1] = 3.0
    driven = np.tile([0.0, 1.0, 0.0, 0.0], (1, 6, 1))
    states, troubles = of.roll(start, driven, np.ones((1, 5)), np.zeros(1))
    assert states[0, :, 1] == pytest.approx(1.0 + 2.0 * np.exp(-np.arange(6.0)), abs=2e-3)
    assert not troubles


def test_a_failure_ends_its_window_and_no_other():
    of = opened("raising")
    driven = np.tile([0.0, 1.0, 0.0, 0.0], (2, 21, 1))
    begin = np.array([20.0, 0.0])
    states, troubles = of.roll(np.zeros((2, 6)), driven, np.ones((2, 20)), begin)
    (one,) = troubles
    assert (one.row, one.words) == (0, "raised RuntimeError: no more fuel")
    assert one.second == pytest.approx(30.0, abs=0.1 + 1e-9)
    assert np.isfinite(states[1]).all()
    assert np.isfinite(states[0, :10]).all() and np.isnan(states[0, 11:]).all()


def test_one_bad_row_of_many_is_not_a_number_and_the_others_are():
    values = rows()
    values[4, -1] = 40.0  # s
    found, troubles = opened("blank").rates(values)
    (one,) = troubles
    assert (one.row, one.second) == (4, 40.0)
    assert np.isnan(found[4]).all() and np.isfinite(np.delete(found, 4, 0)).all()


def test_differences_are_the_derivatives():
    """∂(max(n, 0) - u)/∂(u, n) = (-1, 1) where n > 0; ∂(delta - r)/∂(r, delta) = (-1, 1)."""
    some = rows()
    some[:, 7] = np.abs(some[:, 7]) + 1.0
    (middle, by), _ = slopes(opened("rows"), some, np.full(some.shape[1] - 1, 1e-3))
    assert middle == pytest.approx(accelerations(some))
    expected = np.zeros_like(by)
    expected[:, 0, [1, 7]] = (-1.0, 1.0)
    expected[:, 1, 3] = -1.0
    expected[:, 2, [5, 6]] = (-1.0, 1.0)
    assert by == pytest.approx(expected, abs=1e-9)


@pytest.mark.long
def test_jax_gives_its_own_derivatives():
    of = opened("f", HERE / "of_jax.py")
    assert (of.library, of.layout) == ("jax", "columns")
    exact = of.exact(rows())
    assert exact is not None
    (_, by), _ = slopes(opened("rows"), rows(), np.full(rows().shape[1] - 1, 1e-4))
    assert exact[:, 1:] == pytest.approx(by[:, 1:], abs=1e-5)
    n = rows()[:, 7]
    assert exact[:, 0, 7] == pytest.approx(1.0 / np.cosh(n) ** 2, abs=1e-5)


@pytest.mark.long
def test_torch_gets_its_own_arrays():
    of = opened("f", HERE / "of_torch.py")
    assert (of.library, of.layout) == ("torch", "rows")
    assert of.rates(rows())[0] == pytest.approx(accelerations(rows()), abs=1e-9)


def test_a_function_has_a_name():
    with pytest.raises(Refused, match="no function 'f'"):
        PythonFunction(ODD, "", 2, False)
