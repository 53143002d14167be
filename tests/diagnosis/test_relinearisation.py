"""Gauss-Newton on functions whose steps are known in closed form."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from shiplog.diagnosis.hypotheses import evaluate, evidence
from shiplog.diagnosis.hypotheses.evaluate import RELINEARISATIONS
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.trial.fitted import Estimate, Start

NOISE = 0.1


def fits(monkeypatch, function, slope) -> tuple[Any, list[float]]:
    """A trial that sees function(x) with NOISE where it is 0; the points x that were asked for."""
    asked: list[float] = []

    def linearise(numbers, *_):
        asked.append(float(numbers["x"][0]))
        linear = SimpleNamespace(farthest=0.0)
        return SimpleNamespace(numbers=numbers, path=None, linear=linear)

    def fit(_trial, point, *_):
        (x,) = point.numbers["x"]
        off, by = -function(x) / NOISE, slope(x) / NOISE
        step = off / by
        density = -0.5 * off**2
        value = density + 0.5 * (step * by) ** 2 - np.log(by)
        return Estimate("", value, 1.0, {"x": np.array([x + step])}, np.eye(1) / by**2,
                     density=density)  # fmt: skip

    monkeypatch.setattr(evidence, "fit", fit)
    monkeypatch.setattr(evidence, "scan", lambda *given, **_: (fit(*given), []))
    return SimpleNamespace(linearise=linearise, first=None, fixed=(), clipped=dict), asked


def converge(trial, included, numbers, path, lowest=-np.inf):
    fit = evaluate.evaluate(trial, included, Remainder(), Start(numbers, path), lowest)
    return fit.point, fit.estimate


def test_what_is_linear_takes_one_step(monkeypatch):
    trial, asked = fits(monkeypatch, lambda x: 2.0 * (x - 3.0), lambda x: 2.0)
    _, found = converge(trial, ("x",), {"x": np.zeros(1)}, None)
    assert found.numbers["x"] == pytest.approx([3.0])
    assert found.evidence == pytest.approx(-np.log(2.0 / NOISE))
    assert asked == pytest.approx([0.0, 3.0])


@pytest.mark.parametrize("begin", [1.0, 2.0, 5.0])
def test_a_step_too_far_is_halved(monkeypatch, begin):
    """Newton's steps on arctan run away from 0 where they begin beyond 1.39."""
    trial, asked = fits(monkeypatch, np.arctan, lambda x: 1.0 / (1.0 + x**2))
    _, found = converge(trial, ("x",), {"x": np.array([begin])}, None)
    assert found.numbers["x"] == pytest.approx([0.0], abs=0.2 * NOISE)
    assert found.evidence == pytest.approx(-np.log(1.0 / NOISE), abs=0.1)
    assert len(asked) <= RELINEARISATIONS


def test_a_fit_without_end_has_the_evidence_of_the_best_numbers_that_it_met(monkeypatch):
    """Newton's steps on a cube root go to -2x for ever: each is a step too far."""
    trial, asked = fits(monkeypatch, np.cbrt, lambda x: np.abs(x) ** (-2.0 / 3.0) / 3.0)
    point, found = converge(trial, ("x",), {"x": np.array([1.0])}, None)
    best = min(np.abs(asked))
    assert abs(point.numbers["x"][0]) == best and found.numbers == point.numbers
    by = best ** (-2.0 / 3.0) / 3.0 / NOISE
    assert found.evidence == pytest.approx(-0.5 * best ** (2.0 / 3.0) / NOISE**2 - np.log(by))


def test_numbers_of_a_fit_without_end_are_in_the_order_of_their_covariance(monkeypatch):
    """A set begins with the cause that was added last, and its covariance is in alphabetical
    order: a tenth of the spread of b is not that of a."""
    trial, _ = fits(monkeypatch, np.cbrt, lambda x: np.abs(x) ** (-2.0 / 3.0) / 3.0)

    def linearise(numbers, *_):
        if numbers["b"][0] != 1.0:
            raise np.linalg.LinAlgError
        return SimpleNamespace(numbers=numbers, path=None, linear=SimpleNamespace(farthest=0.0))

    def fit(*_):
        numbers = {"a": np.array([9.0]), "b": np.array([9.0])}
        return Estimate("", 0.0, 1.0, numbers, np.diag([1.0, 0.01]), density=0.0)

    trial.linearise = linearise
    monkeypatch.setattr(evidence, "scan", lambda *given, **_: (fit(*given), []))
    _, found = converge(trial, ("a", "b"), {"b": np.array([1.0]), "a": np.array([2.0])}, None)
    spread = dict(zip(found.numbers, np.sqrt(np.diag(found.covariance)), strict=True))
    assert spread == pytest.approx({"a": 1.0, "b": 0.1})
    assert found.numbers == {"a": [2.0], "b": [1.0]}


def test_steps_that_get_shorter_slowly_go_on_until_little_is_left(monkeypatch):
    """A slope that is a half too steep leaves a third of the way at each step: 30, 10, 3.3 ..."""
    trial, asked = fits(monkeypatch, lambda x: x, lambda x: 1.5)
    _, found = converge(trial, ("x",), {"x": np.array([3.0])}, None)
    assert abs(found.numbers["x"][0]) < evaluate.LEFT * NOISE
    assert asked[:3] == pytest.approx([3.0, 1.0, 1.0 / 3.0])


def test_numbers_that_the_model_has_already_are_never_halved(monkeypatch):
    """Where the model diverges with them alone there is no fit; where it diverges with another
    cause too, that one is halved until it holds: 4, 2, 1. From there to the best, 0, its steps are
    damped: by a quarter, which two halvings left, then by a half."""
    trial, asked = fits(monkeypatch, lambda x: x, lambda x: 1.0)
    trial.fixed = ("held",)
    seen, plain = [], trial.linearise

    def linearise(numbers, *more):
        seen.append(float(numbers["held"][0]))
        if numbers.get("x", np.full(1, 9.0))[0] > 1.0:
            raise np.linalg.LinAlgError
        return plain(numbers, *more)

    def fit(_trial, point, *_):
        numbers = {"held": point.numbers["held"], "x": np.zeros(1)}
        return Estimate("", 0.0, 1.0, numbers, np.eye(2), density=0.0)

    trial.linearise = linearise
    monkeypatch.setattr(evidence, "scan", lambda *given, **_: (fit(*given), []))
    monkeypatch.setattr(evidence, "fit", fit)
    held = {"held": np.array([3.0])}
    trial.first = SimpleNamespace()
    _, alone = converge(trial, ("held",), held, None)
    assert alone.evidence == -np.inf and alone.numbers["held"] == [3.0]
    _, both = converge(trial, ("held", "x"), {**held, "x": np.array([4.0])}, None)
    assert both.evidence == 0.0
    assert asked == [1.0, 0.75, 0.375] and set(seen) == {3.0}


@pytest.mark.parametrize(("noise", "converges"), [(4.0, True), (1.0, False)])
def test_a_path_that_nominal_noise_holds_too_firmly_refutes_no_numbers(
    monkeypatch, noise, converges
):
    """Of noise 4 times the nominal one, the first path leaves 100 nats less, with any numbers. The
    next one is as that noise allows, and nothing is halved. Where the noise is nominal, the numbers
    are too far off, and are halved until there are no halvings left."""
    trial, asked = fits(monkeypatch, lambda x: x, lambda x: 1.0)
    plain, held = trial.linearise, []

    def linearise(numbers, near, noise_factor, remainder):
        held.append(noise_factor)
        return plain(numbers)

    def scan(_trial, point, *_, **__):
        density = 0.0 if held[-1] == 4.0 else -100.0
        return Estimate("", density, noise, point.numbers, np.eye(1), density=density), []

    trial.linearise, trial.first = linearise, SimpleNamespace()
    monkeypatch.setattr(evidence, "scan", scan)
    monkeypatch.setattr(evidence, "fit", lambda *given: scan(*given)[0])
    _, found = converge(trial, ("x",), {"x": np.array([1.0])}, None, lowest=-50.0)
    assert np.isfinite(found.evidence) == converges
    if converges:
        assert held[:2] == [1.0, 4.0] and set(asked) == {1.0}
    else:
        assert set(held) == {1.0} and asked == [1.0, 0.5, 0.25, 0.125]
