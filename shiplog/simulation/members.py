"""ν̇ of many members of a model at once: members differ in their state, their inputs and, where
coefficients are drawn from their covariance, in their coefficients.

Physics are run by the kernel of their kind (`kernel.rollouts.values`), JAX where none can be made.
A model whose coefficients differ from member to member is the same equations with the coefficients
among what drives it, so that one call serves all members.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from shiplog.nomenclature.channels import VELOCITY_IN_STATE
from shiplog.simulation import foreign_model
from shiplog.simulation.each_its_own import EachItsOwn
from shiplog.simulation.kernel import rollouts
from shiplog.simulation.window_series import apparent_wind

# Rows of state, inputs and coefficients that stay in a core's cache (70 numbers of 8 bytes each)
ROWS_AT_A_TIME = 2048

# (state [N, 6], actuator [N, A], true wind [N, 2]) -> ν̇ [N, 3]
Rates = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def of_physics(model: Any, theta: np.ndarray, more: int = 0) -> Rates:
    """Of equations with their coefficients θ [P], or [N, P] one row a member.

    more   columns of ones behind the actuators: the share of the campaign of an extended model,
           at its end
    """
    if foreign_model.simulator_of(model) is not None:
        return _of_foreign(model, theta, more)
    own = theta.ndim == 2
    whole = EachItsOwn(model, theta.shape[-1]) if own else model
    fixed = np.zeros(0) if own else theta
    inputs = np.zeros((0, 0))
    of: Callable[[np.ndarray], np.ndarray] | None = None

    def rates(state: np.ndarray, actuator: np.ndarray, wind: np.ndarray) -> np.ndarray:
        nonlocal inputs, of
        count, driving = actuator.shape
        if inputs.shape[0] != count:
            last = theta if own else np.zeros((count, 0))
            inputs = np.ones((count, 6 + driving + more + last.shape[1] + 2))
            inputs[:, 6 + driving + more : -2] = last
            of = of or rollouts.valuer(whole, fixed, inputs.shape[1] - 6) or _by_jax(whole, fixed)
        inputs[:, :6], inputs[:, 6 : 6 + driving], inputs[:, -2:] = state, actuator, wind
        assert of is not None
        if count <= ROWS_AT_A_TIME:
            return of(inputs)
        parts = range(0, count, ROWS_AT_A_TIME)
        return np.concatenate([of(inputs[at : at + ROWS_AT_A_TIME]) for at in parts])

    return rates


def _of_foreign(model: Any, theta: np.ndarray, more: int) -> Rates:
    """Of a simulator of others, with causes in it or not."""

    def rates(state: np.ndarray, actuator: np.ndarray, wind: np.ndarray) -> np.ndarray:
        inputs = np.concatenate((state, actuator, np.ones((len(state), more)), wind), 1)
        return foreign_model.values(model, theta, inputs)

    return rates


def _by_jax(model: Any, theta: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    from shiplog.simulation import jax_rollouts

    return lambda rows: jax_rollouts.values(model, theta, rows)


class Accelerates(Protocol):
    """A network: ν̇ [N, 3] of velocities [N, 3], actuators [N, A] and apparent wind [N, 0|2]."""

    def accelerations(
        self, velocity: np.ndarray, actuator: np.ndarray, wind: np.ndarray
    ) -> np.ndarray: ...


def of_networks(networks: list[Accelerates], member: np.ndarray, has_wind: bool) -> Rates:
    """Of trained networks; `member` [N] says which one each member is, the first for all others."""

    def rates(state: np.ndarray, actuator: np.ndarray, wind: np.ndarray) -> np.ndarray:
        velocity = state[:, list(VELOCITY_IN_STATE)]
        blowing = apparent_wind(state, wind) if has_wind else np.zeros((len(state), 0))
        found = np.empty((len(state), 3))
        which = member if len(member) == len(state) else np.zeros(len(state), dtype=int)
        for i, network in enumerate(networks):
            rows = which == i
            if not rows.any():
                continue
            found[rows] = network.accelerations(velocity[rows], actuator[rows], blowing[rows])
        return found

    return rates
