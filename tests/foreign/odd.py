"""Functions f(state, inputs, t) that tests give to shiplog, each odd in its own way.

A point mass with drag: du/dt = n - u, dv/dt = -v, dr/dt = delta - r, so that answers are known.
"""

import math
import os
import random
import time

import numpy as np

STEP = 0.1


def derivative(state, inputs, t):
    """For one row: `if` of an array raises."""
    _, u, _, v, psi, r = state
    delta, n = inputs[0], inputs[1]
    push = n if n > 0.0 else 0.0
    c, s = math.cos(psi), math.sin(psi)
    return [u * c - v * s, push - u, u * s + v * c, -v, r, delta - r]


def rows(state, inputs, t):
    """[n, 6] or [6]."""
    u, v, psi, r = (state[..., i] for i in (1, 3, 4, 5))
    delta, n = inputs[..., 0], inputs[..., 1]
    c, s = np.cos(psi), np.sin(psi)
    found = (u * c - v * s, np.maximum(n, 0.0) - u, u * s + v * c, -v, r, delta - r)
    return np.stack(found, -1)


def columns(state, inputs, t):
    """[6, n] or [6]."""
    return np.stack(
        [
            one
            for one in np.moveaxis(
                rows(np.moveaxis(state, 0, -1), np.moveaxis(inputs, 0, -1), t), -1, 0
            )
        ]
    )


def acceleration(state, inputs, t):
    return rows(state, inputs, t)[..., [1, 3, 5]]


def following(state, inputs, t):
    """The next state, by Euler's rule."""
    return state + STEP * rows(state, inputs, t)


def changing(state, inputs, t):
    found = rows(state, inputs, t)
    state *= 0.0
    return found


def drawing(state, inputs, t):
    return rows(state, inputs, t) * (1.0 + 0.01 * random.random())


def raising(state, inputs, t):
    """For one row, from 30 s on."""
    if t >= 30.0:
        raise RuntimeError("no more fuel")
    return derivative(state, inputs, t)


def blank(state, inputs, t):
    found = rows(state, inputs, t)
    return np.where(np.asarray(t)[..., None] >= 30.0, np.nan, found)


def ending(state, inputs, t):
    if t >= 30.0:
        os._exit(3)
    return derivative(state, inputs, t)


def waiting(state, inputs, t):
    if 30.0 <= t < 30.05:
        time.sleep(3600.0)
    return derivative(state, inputs, t)


def greedy(state, inputs, t):
    return np.ones(1 << 40)


def short(state, inputs, t):
    return [0.0, 1.0]


def calling(state, inputs, t):
    import socket

    socket.create_connection(("127.0.0.1", 9), timeout=1.0)
    return derivative(state, inputs, t)


def of_place(state, inputs, t):
    found = rows(state, inputs, t)
    found[..., 1] -= 1e-3 * np.asarray(state)[..., 0]
    return found
