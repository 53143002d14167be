"""A foreign simulator, plain or with causes in it, where equations would be compiled.

A simulator of others is asked, row by row: nothing is compiled of it. With causes in it,

    ν̇ = f(x_w, u, ω + V) + c(x, u, ω; q),   x_w = x less Rᵀ(ψ) V

V is the water's velocity (`Cause.water`), f the simulator's accelerations, and c what the causes
add: forces, changed coefficients of the ship's stand-in, and the turning frame of a current. c is
shiplog's own and compiled, as the extended model of a base that does nothing. By the chain rule,
with (a, b) = Rᵀ(ψ) V,

    ∂ν̇/∂ψ = f_ψ - b f_u + a f_v + c_ψ,   ∂ν̇/∂V = -R (f_u, f_v) + f_ω,   ∂ν̇/∂q = ∂ν̇/∂V ∂V/∂q + c_q
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from shiplog.machine import trees
from shiplog.machine.arrays import Array, jnp
from shiplog.models.base import kinematics
from shiplog.models.causes import Cause
from shiplog.models.extended import Extended
from shiplog.nomenclature.frames import in_body_axes, in_earth_axes
from shiplog.simulation.each_its_own import EachItsOwn
from shiplog.simulation.kernel import rollouts
from shiplog.simulation.window_series import WindowSeries, series
from shiplog.voyages.windows.windows import Windows, seconds_since

SUBSTEPS = 4  # of Heun's in a measured step, with causes that push: 0.25 s of a ship of metres


class Simulator(Protocol):
    """What `shiplog.foreign.model` gives; see there."""

    def accelerations(self, state: np.ndarray, driven: np.ndarray) -> np.ndarray: ...
    def slopes(
        self, state: np.ndarray, driven: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]: ...
    def roll(
        self, start: np.ndarray, driven: np.ndarray, dt: np.ndarray, begin: np.ndarray
    ) -> tuple[np.ndarray, list[Any]]: ...
    def along(
        self, start: np.ndarray, acceleration: np.ndarray, driven: np.ndarray, step: float
    ) -> np.ndarray: ...


@trees.tree(data=[])
@dataclass(frozen=True)
class Nothing:
    """A base whose accelerations are zero."""

    @property
    def names(self) -> tuple[str, ...]:
        return ()

    @property
    def substeps(self) -> int:
        return 1

    @property
    def smooth(self) -> float:
        return 0.0

    def acceleration(self, theta: Array, state: Array, actuator: Array, true_wind: Array) -> Array:
        still = 0.0 * state[..., 1]
        return jnp.stack((still, still, still), -1)


def simulator_of(model: Any) -> Simulator | None:
    """The foreign simulator that a model is, or that causes were put into; None of equations."""
    base = getattr(model, "base", model)
    return base if hasattr(base, "roll") else None


def values(model: Any, theta: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """ν̇ [n, 3] of rows (state, what drives) [n, 6 + D]; θ [P], or [n, P] one row each."""
    simulator = simulator_of(model)
    assert simulator is not None
    state, driven = inputs[:, :6], inputs[:, 6:]
    if not isinstance(model, Extended):
        return simulator.accelerations(state, driven)
    wet, given, water = _wet(model, theta, state, driven)
    return simulator.accelerations(wet, given) + _added(model, theta, inputs, water)


def slopes(
    model: Any, theta: np.ndarray, state: np.ndarray, driven: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """ν̇ [n, 3], ∂ν̇/∂x [n, 3, 6], ∂ν̇/∂(u, share, ω) [n, 3, D] and ∂ν̇/∂θ [n, 3, P]."""
    simulator = simulator_of(model)
    assert simulator is not None
    if not isinstance(model, Extended):
        middle, by_state, by_driven = simulator.slopes(state, driven)
        return middle, by_state, by_driven, np.zeros((len(state), 3, 0))
    wet, given, (ahead, starboard) = _wet(model, theta, state, driven)
    middle, by_state, own = simulator.slopes(wet, given)
    of_u, of_v = by_state[..., 1], by_state[..., 3]
    by_state = by_state.copy()
    by_state[..., 4] += ahead[:, None] * of_v - starboard[:, None] * of_u
    by_driven = np.insert(own, own.shape[-1] - 2, 0.0, axis=-1)  # by the share of the campaign
    c, s = np.cos(state[:, 4])[:, None], np.sin(state[:, 4])[:, None]
    by_water = -np.stack(in_earth_axes(of_u, of_v, c, s), -1) + own[..., -2:]
    by_theta = by_water @ _water_by(model, theta)
    if not model.causes:
        return middle, by_state, by_driven, by_theta
    extra = rollouts.row_slopes(rest_of(model), theta, np.concatenate((state, driven), 1))
    if extra is None:
        extra = _by_jax(rest_of(model), theta, state, driven)
    return tuple(  # type: ignore[return-value]  # four, as `extra` has
        one + other
        for one, other in zip((middle, by_state, by_driven, by_theta), extra, strict=True)
    )


def rollout(
    model: Any, theta: np.ndarray, data: WindowSeries, begin: np.ndarray | None = None
) -> np.ndarray:
    """States [N, I, 6]. As the simulator itself goes on, in water that moves where a current is
    all that acts; with causes that push, by Heun's rule and what drives straight in between."""
    simulator = simulator_of(model)
    assert simulator is not None
    began = np.zeros(len(data.measured)) if begin is None else begin
    start = data.measured[:, 0]
    if not isinstance(model, Extended):
        driven = np.concatenate((data.actuator, data.wind), -1)
        return simulator.roll(start, driven, data.dt, began)[0]
    if _pushed(model, theta):
        return _by_heun(model, theta, data)
    return _in_water(model, theta, data, began)


def along(
    model: Any, theta: np.ndarray, start: np.ndarray, acceleration: np.ndarray,
    driven: np.ndarray, step: float,
) -> np.ndarray | None:  # fmt: skip
    """States [S, K, 6] of a segment's path, as `diagnosis.linear.foreign_paths` has it, by the
    simulator alone, in one request; None where causes push, whose forces it does not know."""
    simulator = simulator_of(model)
    assert simulator is not None
    if not isinstance(model, Extended):
        return simulator.along(start, acceleration, driven, step)
    if _pushed(model, theta):
        return None
    wet, _, _ = _wet(model, theta, start, driven[:, 0])
    given, water = _without_share(driven), _water(model, theta)
    given[..., -2:] += water
    found = simulator.along(wet, acceleration, given, step)
    return _from_water(found, water, step * np.arange(driven.shape[1]))


@dataclass(frozen=True)
class Failure:
    """Where a simulator failed: the rest of the voyage goes on in the next window."""

    voyage: str
    second: float
    words: str


def sentences(name: str, failures: Iterable[Failure]) -> list[str]:
    """One for each kind of failure in each voyage: when it first happened, and how often."""
    found: dict[tuple[str, str], list[float]] = {}
    for one in failures:
        found.setdefault((one.voyage, one.words), []).append(one.second)
    return [
        f"{name} {words}, at {min(seconds):.1f} s of {voyage}"
        + (f" and {len(seconds) - 1} more times." if len(seconds) > 1 else ".")
        for (voyage, words), seconds in found.items()
    ]


@dataclass(frozen=True)
class ForeignSimulator:
    """A simulator as a run of it holds it: it has no numbers, and no uncertainty of them.

    failures   what went wrong so far, each once; it grows
    """

    model: Any
    theta: np.ndarray
    covariance: np.ndarray
    failures: dict[Failure, None]

    def simulate(self, windows: Windows) -> np.ndarray:
        """States [N, I, 6], as shiplog.simulation.rollout gives them; not a number after a
        failure."""
        data = series(windows)
        driven = np.concatenate((data.actuator, data.wind), -1)
        began, names = windows.plan["elapsed"].to_numpy(), windows.plan["voyage"].to_list()
        found, troubles = self.model.roll(data.measured[:, 0], driven, data.dt, began)
        for one in troubles:
            self.failures.setdefault(Failure(names[one.row], one.second, one.words))
        return found

    def spread(self, windows: Windows) -> np.ndarray:
        """[N, I, 6], zero."""
        return np.zeros(windows.state.shape)


# Parts


def rest_of(model: Extended) -> Extended:
    """What causes add to a simulator's accelerations, in water that moves: c."""
    return replace(model, base=Nothing())


def _pushed(model: Extended, theta: np.ndarray) -> bool:
    """Whether a cause with numbers that are not zero adds an acceleration, and does not only move
    the water or change readings: one whose numbers are zero adds nothing."""
    at = len(model.base.names)
    for cause in model.causes:
        numbers = theta[..., at : at + cause.count]
        pushes = cause.changes_ship or type(cause).force is not Cause.force
        if pushes and np.any(numbers):
            return True
        at += cause.count
    return False


def _added(
    model: Extended, theta: np.ndarray, inputs: np.ndarray, water: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """c [n, 3], in water that goes `water` ahead and to starboard."""
    if not _pushed(model, theta):
        (ahead, starboard), r = water, inputs[:, 5]
        return np.stack((r * starboard, -r * ahead, np.zeros_like(r)), -1)
    rest = rest_of(model)
    if theta.ndim == 2:
        rest = EachItsOwn(rest, theta.shape[1])
        inputs = np.concatenate((inputs[:, :-2], theta, inputs[:, -2:]), 1)
        theta = np.zeros(0)
    found = rollouts.values(rest, theta, inputs)
    if found is None:
        from shiplog.simulation import jax_rollouts

        found = jax_rollouts.values(rest, theta, inputs)
    return found


def _water(model: Extended, theta: np.ndarray) -> np.ndarray:
    """V [2], or [n, 2] of θ [n, P]."""
    found, at = np.zeros((*theta.shape[:-1], 2)), len(model.base.names)
    for cause in model.causes:
        p = [theta[..., at + i] for i in range(cause.count)]
        moving = cause.water(p)
        if moving is not None:
            found = found + np.stack(np.broadcast_arrays(*moving), -1)
        at += cause.count
    return found


def _water_by(model: Extended, theta: np.ndarray) -> np.ndarray:
    """∂V/∂θ [2, P], by central differences: a cause's water may be anything of its numbers."""
    h = 1e-4
    moved = [
        _water(model, theta + h * e) - _water(model, theta - h * e) for e in np.eye(len(theta))
    ]
    return np.stack(moved, -1) / (2.0 * h) if moved else np.zeros((2, 0))


def _wet(
    model: Extended, theta: np.ndarray, state: np.ndarray, driven: np.ndarray
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """State and what drives as the simulator has them: through the water, without the share of the
    campaign; and the water's velocity ahead and to starboard."""
    water = np.broadcast_to(_water(model, theta), (len(state), 2))
    c, s = np.cos(state[:, 4]), np.sin(state[:, 4])
    ahead, starboard = in_body_axes(water[:, 0], water[:, 1], c, s)
    wet = state.copy()
    wet[:, 1] -= ahead
    wet[:, 3] -= starboard
    given = _without_share(driven)
    given[:, -2:] += water
    return wet, given, (ahead, starboard)


def _without_share(driven: np.ndarray) -> np.ndarray:
    """What drives [..., A + 2], of that with the share of the campaign [..., A + 3]."""
    return np.delete(driven, driven.shape[-1] - 3, axis=-1)


def _in_water(
    model: Extended, theta: np.ndarray, data: WindowSeries, begin: np.ndarray
) -> np.ndarray:
    """The simulator on a path through water that moves with V, in axes that move with it: a steady
    current changes nothing else."""
    driven = np.concatenate((data.actuator, data.wind), -1)
    wet, _, _ = _wet(model, theta, data.measured[:, 0], driven[:, 0])
    given, water = _without_share(driven), _water(model, theta)
    given[..., -2:] += water
    simulator = simulator_of(model)
    assert simulator is not None
    found, _ = simulator.roll(wet, given, data.dt, begin)
    return _from_water(found, water, seconds_since(data.dt))


def _from_water(found: np.ndarray, water: np.ndarray, since: np.ndarray) -> np.ndarray:
    """States [N, I, 6] over ground, of those in axes that go with the water; `since` [N, I] or [I]
    s since they were the same."""
    if not water.any():
        return found
    found = found.copy()
    c, s = np.cos(found[..., 4]), np.sin(found[..., 4])
    ahead, starboard = in_body_axes(water[0], water[1], c, s)
    found[..., 1] += ahead
    found[..., 3] += starboard
    found[..., 0] += water[0] * since
    found[..., 2] += water[1] * since
    return found


def _by_heun(model: Extended, theta: np.ndarray, data: WindowSeries) -> np.ndarray:
    driven = np.concatenate((data.actuator, data.wind), -1)
    x, states = data.measured[:, 0], [data.measured[:, 0]]

    def rate(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return kinematics(x, values(model, theta, np.concatenate((x, u), 1)))

    with np.errstate(all="ignore"):
        for i in range(data.dt.shape[1]):
            h = data.dt[:, i, None] / SUBSTEPS
            change = (driven[:, i + 1] - driven[:, i]) / SUBSTEPS
            for k in range(SUBSTEPS):
                now = driven[:, i] + k * change
                first = rate(x, now)
                second = rate(x + h * first, now + change)
                x = x + 0.5 * h * (first + second)
            states.append(x)
    return np.stack(states, 1)


def _by_jax(
    model: Extended, theta: np.ndarray, state: np.ndarray, driven: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Of causes that no kernel can be made of."""
    import jax

    def one(x: Any, u: Any, p: Any) -> Any:
        return model.acceleration(p, x, u[:-2], u[-2:])

    from shiplog.machine.arrays import double

    trees.tell_jax()
    with double():
        value = jax.vmap(one, in_axes=(0, 0, None))(state, driven, theta)
        by = jax.vmap(jax.jacrev(one, argnums=(0, 1, 2)), in_axes=(0, 0, None))
        return tuple(np.asarray(values) for values in (value, *by(state, driven, theta)))
