"""What somebody would write instead of shiplog's gradient: torch's autograd, JAX, diffrax.

Each takes weights [W₁, b₁, ...], standardised inputs and windows as arrays and gives the loss of
Eq. 8 and its gradient. Scales are one and zero, so that nobody pays for them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import torch

diffrax: Any = None
if find_spec("diffrax"):  # of the extra `bench`
    diffrax = import_module("diffrax")

WEIGHTS = np.array([100.0, 100.0, 10.0 * 180.0 / math.pi])  # of the velocities' errors
UNROLLED = (1, 4)  # steps of JAX's scan that are compiled as one

Arrays = Sequence[np.ndarray]
Job = Callable[[], tuple[float, list[np.ndarray]]]


def autograd(weights: Arrays, velocity: np.ndarray, driven: np.ndarray) -> Job:
    """All six states, a list of them, and backward(): what the paper's authors likely wrote."""
    parameters = [torch.tensor(w, requires_grad=True) for w in weights]
    states = torch.zeros(*velocity.shape[:2], 6, dtype=parameters[0].dtype)
    states[..., [1, 3, 5]] = torch.as_tensor(velocity)
    inputs = torch.as_tensor(driven)
    w = torch.zeros(6, dtype=states.dtype)
    w[[1, 3, 5]] = torch.as_tensor(WEIGHTS, dtype=states.dtype)

    def acceleration(nu: torch.Tensor, u: torch.Tensor) -> torch.Tensor:
        h = torch.cat((nu, u), -1)
        for i in range(0, len(parameters) - 2, 2):
            h = torch.tanh(torch.nn.functional.linear(h, parameters[i], parameters[i + 1]))
        return torch.nn.functional.linear(h, parameters[-2], parameters[-1])

    def job() -> tuple[float, list[np.ndarray]]:
        for p in parameters:
            p.grad = None
        x, path = states[0], [states[0]]
        for k in range(len(states) - 1):
            surge, sway, heading, rate = x[:, 1], x[:, 3], x[:, 4], x[:, 5]
            c, s = torch.cos(heading), torch.sin(heading)
            nu = torch.stack((surge, sway, rate), -1)
            a = acceleration(nu, inputs[k])
            slope = torch.stack(
                (surge * c - sway * s, a[:, 0], surge * s + sway * c, a[:, 1], rate, a[:, 2]), -1
            )
            x = x + slope
            path.append(x)
        d = (((torch.stack(path) - states) * w) ** 2).sum(-1)
        loss = (0.5 * (d[1:] + d[:-1])).sum(0).mean()
        loss.backward()
        return loss.item(), [p.grad.numpy() for p in parameters if p.grad is not None]

    return job


def _network(weights, nu, u):
    h = jnp.concatenate((nu, u), -1)
    for i in range(0, len(weights) - 2, 2):
        h = jnp.tanh(h @ weights[i].T + weights[i + 1])
    return h @ weights[-2].T + weights[-1]


def _loss(path, velocity):
    d = (((path - velocity) * WEIGHTS.astype(velocity.dtype)) ** 2).sum(-1)
    return (0.5 * (d[1:] + d[:-1])).sum(0).mean()


def _compiled(loss, weights: Arrays) -> Job:
    gradient = jax.jit(jax.value_and_grad(loss))
    given = [jnp.asarray(w) for w in weights]

    def job() -> tuple[float, list[np.ndarray]]:
        value, slopes = jax.block_until_ready(gradient(given))
        return float(value), [np.asarray(s) for s in slopes]

    return job


def scan(weights: Arrays, velocity: np.ndarray, driven: np.ndarray, unroll: int) -> Job:
    """jit of lax.scan, velocities only."""
    measured, inputs = jnp.asarray(velocity), jnp.asarray(driven)

    def loss(given):
        def step(nu, u):
            nu = nu + _network(given, nu, u)
            return nu, nu

        _, path = jax.lax.scan(step, measured[0], inputs[:-1], unroll=unroll)
        return _loss(jnp.concatenate((measured[:1], path)), measured)

    return _compiled(loss, weights)


def by_diffrax(weights: Arrays, velocity: np.ndarray, driven: np.ndarray) -> Job | None:
    """diffrax's Euler in steps of a second; `SaveAt(ts=...)` gives another gradient, which is
    wrong by 4e-3."""
    if diffrax is None:
        return None
    measured, inputs = jnp.asarray(velocity), jnp.asarray(driven)
    count = len(velocity) - 1

    def loss(given):
        def field(t, nu, args):
            return _network(given, nu, inputs[jnp.round(t).astype(int)])

        found = diffrax.diffeqsolve(
            diffrax.ODETerm(field), diffrax.Euler(), 0.0, float(count), 1.0, measured[0],
            saveat=diffrax.SaveAt(steps=True), max_steps=count,
        )  # fmt: skip
        return _loss(jnp.concatenate((measured[:1], found.ys)), measured)

    return _compiled(loss, weights)


def peers(weights: Arrays, velocity: np.ndarray, driven: np.ndarray) -> dict[str, Job]:
    """name → job; those of JAX are compiled for one thread by the environment of the process."""
    found: dict[str, Job] = {"torch autograd, six states": autograd(weights, velocity, driven)}
    for unroll in UNROLLED:
        found[f"JAX scan, unroll {unroll}"] = scan(weights, velocity, driven, unroll)
    euler = by_diffrax(weights, velocity, driven)
    return found if euler is None else {**found, "diffrax Euler": euler}
