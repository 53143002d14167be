"""Surge, sway, yaw and roll: the motion of ships whose published equations have a heel.

Axes as everywhere here, horizontal; φ is positive with the starboard side down. With the mass
matrix M [3, 3] of sway, roll and yaw about midship, of the ship's own publication,

    (m + m_x) u̇ = X + m (v r + x_G r² - z_G p r)
    M (v̇, ṗ, ṙ) = (Y - m u r, K + m z_G u r, N - m x_G u r)

where X, Y, K, N are the family's, its Coriolis terms of added mass among them. What comes from
outside (wind, bank, lines) acts `lever` above the axis of roll: K = lever · Y.

Published derivatives hold ahead, at moderate drift. `ahead_share` says where; beyond it a family
goes on with terms by |u| and `cross_flow`, drag by strips with an exponent of 2.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np
from numba import njit

from pipelines.experiments.other_families.gear import remember, sent, slew
from pipelines.experiments.other_families.motion import STATE, acting_of, add_environment
from pipelines.experiments.other_families.ship import WATER
from pipelines.experiments.other_families.water import shallow

STATES = 2  # φ and p, behind all others
Roll = namedtuple("Roll", "mass height lever")  # [3, 3] without payload; z_G and lever [m]

WHOLE, GONE = 0.85, 0.5  # of u²/(u² + v² + (Lr/3)²): where derivatives hold, and where not at all
STATIONS = 7


@njit
def ahead_share(u, v, lr):
    """1 where the published derivatives hold, 0 astern and athwart; smooth in between."""
    if u <= 0.0:
        return 0.0
    share = u * u / (u * u + v * v + lr * lr / 9.0)
    part = min(max((share - GONE) / (WHOLE - GONE), 0.0), 1.0)
    return part * part * (3.0 - 2.0 * part)


@njit
def cross_flow(length, draught, drag, v, r):
    """Y and N of the drag of strips, each ½ρ C_D T |v + x r| (v + x r) dx (Faltinsen 1990)."""
    y = n = 0.0
    q = 0.5 * WATER * draught * drag * length / STATIONS
    for i in range(STATIONS):
        x = ((i + 0.5) / STATIONS - 0.5) * length
        across = v + x * r
        y -= q * abs(across) * across
        n -= q * abs(across) * across * x
    return y, n


@njit
def _solve(m, y, k, n, out):
    """M⁻¹ (y, k, n) of a 3 by 3, by its cofactors."""
    a, b, c = m[0, 0], m[0, 1], m[0, 2]
    d, e, f = m[1, 0], m[1, 1], m[1, 2]
    g, h, i = m[2, 0], m[2, 1], m[2, 2]
    det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    out[0] = ((e * i - f * h) * y + (c * h - b * i) * k + (b * f - c * e) * n) / det
    out[1] = ((f * g - d * i) * y + (a * i - c * g) * k + (c * d - a * f) * n) / det
    out[2] = ((d * h - e * g) * y + (b * g - a * h) * k + (a * e - b * d) * n) / det


@njit
def rates(forces, c, b, roll, w, d, h, state, acting, order, wind, push, time, out):
    """d(state)/dt into `out`. `push` [4]: side force [N], accelerations of process noise."""
    u, v, psi, r = state[3], state[4], state[2], state[5]
    phi, p = state[-2], state[-1]
    cos, sin = math.cos(psi), math.sin(psi)
    uc = h.current_north * cos + h.current_east * sin
    vc = -h.current_north * sin + h.current_east * cos
    uw, vw = u - uc, v - vc
    f, beyond, turned = np.zeros(4), np.zeros(3), np.empty(3)
    grow, gain = np.ones(6), np.empty(len(h.gain))
    if h.keel > 0.0:
        along = (state[0] - h.slope_north) * math.cos(h.slope_towards)
        along += (state[1] - h.slope_east) * math.sin(h.slope_towards)
        shallow(h.keel, along, h.slope_half, b.breadth / b.draught, grow)
    grow[0] *= 1.0 + h.fouling
    for i in range(len(h.gain)):
        gain[i] = h.gain[i] * (1.0 + h.drift_start + h.drift_slope * time)
    forces(c, uw, vw, r, phi, p, acting, gain, grow, 1.0 + h.cross_flow, h.aside, f)
    add_environment(h, b, w, state, uw, wind, push[0], time, beyond)

    mass = b.mass + h.payload
    moment = b.mass * b.gravity + h.payload * h.payload_ahead
    m = roll.mass.copy()
    m[0, 0] += h.payload + b.m_y * (grow[4] - 1.0)
    m[0, 2] += h.payload * h.payload_ahead
    m[2, 0] += h.payload * h.payload_ahead
    m[2, 2] += h.payload * h.payload_ahead**2 + b.j_z * (grow[5] - 1.0)
    x = f[0] + beyond[0] + mass * vw * r + moment * r * r - b.mass * roll.height * p * r
    y = f[1] + beyond[1] - mass * uw * r
    n = f[2] + beyond[2] - moment * uw * r
    k = f[3] + roll.lever * beyond[1] + b.mass * roll.height * uw * r
    _solve(m, y, k, n, turned)
    out[0] = u * cos - v * sin
    out[1] = u * sin + v * cos
    out[2] = r
    out[3] = x / (mass + b.m_x) + push[1] + r * vc
    out[4] = turned[0] + push[2] - r * uc
    out[5] = turned[2] + push[3]
    out[-2], out[-1] = p, turned[1]
    count = len(acting)
    for j in range(count):
        wanted = order[j] - state[STATE + j]
        out[STATE + j] = min(max(wanted / d.time[j], -d.rate[j]), d.rate[j])
        lag = h.lag if d.steers[j] else 0.0
        if lag > 0.0 or h.gear.rate[j] < math.inf:
            wanted = sent(h.gear, j, state[STATE + j]) - state[STATE + count + j]
            out[STATE + count + j] = slew(h.gear, j, wanted, lag)
        else:
            out[STATE + count + j] = out[STATE + j]


@njit
def advance(forces, c, b, roll, w, d, h, track, start, steps, dt, order, wind, push):
    """As `motion.advance`; rows start+1 .. start+steps of `track` [K, 6 + 2A + 2]."""
    width = track.shape[1]
    k = np.empty((4, width))
    state = np.empty(width)
    acting = np.empty((width - STATE - STATES) // 2)
    for i in range(start, start + steps):
        for stage in range(4):
            part = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            for j in range(width):
                state[j] = track[i, j] + (part * dt * k[stage - 1, j] if stage else 0.0)
            acting_of(h, d, track, i, part, dt, state, acting)
            half = 2 * i + int(2.0 * part)
            rates(
                forces, c, b, roll, w, d, h, state, acting, order, wind[half], push[half],
                (i + part) * dt, k[stage],
            )  # fmt: skip
        for j in range(width):
            track[i + 1, j] = track[i, j] + dt / 6.0 * (
                k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j]
            )
        if h.gear.wrong:
            remember(h.gear, track[i + 1, STATE:])
