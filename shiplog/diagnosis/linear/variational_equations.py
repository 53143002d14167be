"""The variational equations of a rollout: the effect of start, nodes and numbers, step by step.

    δ̇ = A(t) δ + B(t),   δ [6, 6 + 3J + P] = ∂x/∂(ξ, a, θ),   δ(0) = (I | 0 | 0)

A [6, 6] = ∂ẋ/∂x along the path: rows of x₀, y₀ and ψ from the kinematics, rows of u, v and r
∂f/∂x. B has rows of u, v and r only: hⱼ(t) by the acceleration of node j, ∂f/∂θ by a coefficient,
and ∂f/∂θ + ∂f/∂u ∂u/∂θ by a cause's number. Integrated by the same two-step Adams-Bashforth as
the path itself, so that the columns are derivatives of what was simulated and not of what it
approximates. Plain loops, compiled: a column costs some sixty operations a step, and an array
library spends most of its time moving them about.
"""

from __future__ import annotations

import numba
import numpy as np

from shiplog.nomenclature import frames

# Compiled into the loops below, whose caches do not notice when `frames` changes.
_in_earth_axes = numba.njit(fastmath={"contract"})(frames.in_earth_axes)


@numba.njit(cache=True, fastmath={"contract"})
def columns(states, by_state, by_driven, by_theta, moved, hats, step, bins):
    """(Z | H) [S, B, 6, 6 + 3J + P]: means of δ over bins, by start, accelerations at the nodes
    (channel by channel), and θ.

    states    [S, K, 6]     x*, the path at the instants of the steps
    by_state  [S, K, 3, 6]  ∂f/∂x; by_driven ∂f/∂u [S, K, 3, D] and by_theta ∂f/∂θ [S, K, 3, P]
    moved     [S, K, D, Q]  ∂u/∂θ, how what drives changes with each of the last Q of θ
    hats      [K, J]        hⱼ(tₖ)
    step      h [s]
    """
    count, instants = states.shape[:2]
    nodes, p, q = hats.shape[1], by_theta.shape[3], moved.shape[3]
    driving = moved.shape[2]
    per = (instants - 1) // bins
    at_theta = 6 + 3 * nodes
    at_moved = at_theta + p - q
    width = at_theta + p
    out = np.zeros((count, bins, 6, width))
    now, before = np.empty((6, width)), np.empty((6, width))
    acceleration, change = np.empty((3, width)), np.empty((6, width))
    for s in range(count):
        now[:] = 0.0
        before[:] = 0.0
        for i in range(6):
            now[i, i] = 1.0
        for k in range(instants - 1):
            acceleration[:] = 0.0
            for j in range(nodes):
                if hats[k, j] != 0.0:
                    for c in range(3):
                        acceleration[c, 6 + c * nodes + j] = hats[k, j]
            for c in range(3):
                for i in range(p):
                    acceleration[c, at_theta + i] = by_theta[s, k, c, i]
                for d in range(driving):
                    slope = by_driven[s, k, c, d]
                    for i in range(q):
                        acceleration[c, at_moved + i] += slope * moved[s, k, d, i]
            cos, sin = np.cos(states[s, k, 4]), np.sin(states[s, k, 4])
            velocity_north, velocity_east = _in_earth_axes(
                states[s, k, 1], states[s, k, 3], cos, sin
            )
            north, east = -velocity_east, velocity_north  # a quarter turn on: by heading
            new, old = (step, 0.0) if k == 0 else (1.5 * step, -0.5 * step)
            _slope(now, cos, sin, north, east, by_state[s, k], acceleration, change)
            _step(now, before, change, out[s, k // per], new, old, 0.5 / per)
    return out


@numba.njit(cache=True, fastmath={"contract"})
def _slope(now, cos, sin, north, east, a, acceleration, change):
    """δ̇ = A δ + B [6, W] into `change`: of the path's position, turned by ψ, and
    δν̇ = ∂f/∂x δx + `acceleration` [3, W]; `north`, `east` ∂(ẋ₀, ẏ₀)/∂ψ, `a` ∂f/∂x [3, 6]."""
    x, du, y, dv, heading, dr = now[0], now[1], now[2], now[3], now[4], now[5]
    for i in range(now.shape[1]):
        change[0, i] = _in_earth_axes(du[i], dv[i], cos, sin)[0] + north * heading[i]
    for i in range(now.shape[1]):
        change[2, i] = _in_earth_axes(du[i], dv[i], cos, sin)[1] + east * heading[i]
    for i in range(now.shape[1]):
        change[4, i] = dr[i]
    for c in range(3):
        row, force = change[2 * c + 1], acceleration[c]
        ax, au, ay, av, ah, ar = a[c, 0], a[c, 1], a[c, 2], a[c, 3], a[c, 4], a[c, 5]
        for i in range(now.shape[1]):
            row[i] = force[i] + au * du[i] + av * dv[i] + ar * dr[i] + ah * heading[i]
        if ax != 0.0 or ay != 0.0:
            for i in range(now.shape[1]):
                row[i] += ax * x[i] + ay * y[i]


@numba.njit(cache=True, fastmath={"contract"})
def _step(now, before, change, sums, new, old, half):
    """δₖ₊₁ = δₖ + `new` δ̇ₖ + `old` δ̇ₖ₋₁; the trapezium's share of a bin, `half` (δₖ + δₖ₊₁), into
    `sums`."""
    for c in range(6):
        at, was, slope, total = now[c], before[c], change[c], sums[c]
        for i in range(now.shape[1]):
            after = at[i] + new * slope[i] + old * was[i]
            total[i] += half * (at[i] + after)
            at[i] = after
            was[i] = slope[i]
