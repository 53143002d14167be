"""Equations of motion of all families but the public package's, and their integration.

Rigid body and added mass about midship (Fossen 2021, eqs. 6.114 to 6.119). A current is even,
steady and irrotational, so the equations hold for the velocity through the water. A family gives
its hull and its drives:

    forces(c, u, v, r, acting, gain, grow, cross, aside, out)
        c             its coefficients
        u, v, r       through the water [m/s, m/s, rad/s]
        acting [A]    what the actuators do [rad, rev/s]
        gain [D]      share of each drive's thrust that is left
        grow [6]      factors of shallow water, order `water.GROWTHS`
        cross         factor of the cross-flow drag
        aside         share of each screw's thrust that pushes to starboard as well
        out [3]       X, Y, N at midship; written

Compiled by numba; the first call of a family takes some seconds in each process.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np
from numba import njit

from pipelines.experiments.other_families.gear import held, remember, sent, slew
from pipelines.experiments.other_families.lines import add_external
from pipelines.experiments.other_families.water import bank_force, shallow, wind_force

# x₀ y₀ ψ u v r; then A recorded actuators, then A after a hidden lag or rate; of a ship that rolls,
# φ and p last
STATE = 6

Hidden = namedtuple(
    "Hidden",
    "current_north current_east wind tether tether_north tether_east tether_slack "
    "tow_north tow_east tow_start tow_slope "
    "fouling cross_flow payload payload_ahead aside "
    "keel slope_half slope_north slope_east slope_towards "
    "bank bank_reach bank_east lag delay limit offset gain drift_start drift_slope "
    "couple couple_from couple_to device_at gear external share_start share_slope",
)
Drive = namedtuple("Drive", "time rate low high steers circular drive")


@njit
def _past(track, last, state, column, steps):
    """`column` of the track at `steps` (may be a fraction) steps, linear in between."""
    if steps <= 0.0:
        return track[0, column]
    if steps >= last:
        return track[last, column] if steps == last else state[column]
    before = int(steps)
    part = steps - before
    return track[before, column] * (1.0 - part) + track[before + 1, column] * part


@njit
def acting_of(h, d, track, row, part, dt, state, acting):
    """What the actuators do, of what is recorded: lag, delay, offset, limit, cross-coupling."""
    if h.gear.wrong:
        _geared(h, d, track, row, part, dt, state, acting)
        return
    count = len(acting)
    for j in range(count):
        acting[j] = state[STATE + count + j] if d.steers[j] and h.lag > 0.0 else state[STATE + j]
        if d.steers[j]:
            if h.delay > 0.0:
                column = STATE + count + j if h.lag > 0.0 else STATE + j
                acting[j] = _past(track, row, state, column, row + part - h.delay / dt)
            acting[j] += h.offset[j]
            if h.limit > 0.0:
                acting[j] = min(max(acting[j], -h.limit), h.limit)
    if h.couple != 0.0:
        acting[h.couple_to] += h.couple * state[STATE + h.couple_from]


@njit
def _geared(h, d, track, row, part, dt, state, acting):
    """The same where a unit does not do as ordered, in the order that `gear` has."""
    count, g = len(acting), h.gear
    campaign = h.share_start + h.share_slope * (row + part) * dt
    for j in range(count):
        lagged = (d.steers[j] and h.lag > 0.0) or g.rate[j] < math.inf
        column = STATE + count + j if lagged else STATE + j
        acting[j] = state[column] if lagged else sent(g, j, state[column])
        if d.steers[j]:
            if h.delay > 0.0:  # a step of play is left out: it is below the delay
                acting[j] = _past(track, row, state, column, row + part - h.delay / dt)
            acting[j] += h.offset[j]
            if h.limit > 0.0:
                acting[j] = min(max(acting[j], -h.limit), h.limit)
    if h.couple != 0.0:
        acting[h.couple_to] += h.couple * state[STATE + h.couple_from]
    for j in range(count):
        acting[j] = held(g, j, acting[j], d.circular[j], campaign)


@njit
def add_environment(h, b, w, state, uw, wind, side, time, out):
    """Add to `out`: wind, bank, a line to a buoy, a tow, a thruster that nobody records."""
    psi = state[2]
    cos, sin = math.cos(psi), math.sin(psi)
    wind_force(
        w, wind[0] * cos + wind[1] * sin + state[3], -wind[0] * sin + wind[1] * cos + state[4],
        h.wind, out,
    )  # fmt: skip
    if h.bank != 0.0:
        gap = h.bank_east - 0.5 * b.breadth - state[1]
        bank_force(b, h.bank, h.bank_reach, gap, psi, uw, out)
    north = (h.tow_start + h.tow_slope * time) * h.tow_north
    east = (h.tow_start + h.tow_slope * time) * h.tow_east
    if h.tether > 0.0:
        away_north, away_east = h.tether_north - state[0], h.tether_east - state[1]
        far = math.sqrt(away_north**2 + away_east**2 + h.tether_slack**2)
        north += h.tether * away_north / far
        east += h.tether * away_east / far
    out[0] += north * cos + east * sin
    out[1] += -north * sin + east * cos + side
    out[2] += side * h.device_at
    if h.external.any:
        campaign = h.share_start + h.share_slope * time
        add_external(h.external, state[0], state[1], psi, b.breadth, campaign, out)


@njit
def rates(forces, c, b, w, d, h, state, acting, order, wind, push, time, work, out):
    """d(state)/dt into `out`. `push` [4]: side force [N], accelerations of process noise."""
    u, v, psi, r = state[3], state[4], state[2], state[5]
    cos, sin = math.cos(psi), math.sin(psi)
    uc = h.current_north * cos + h.current_east * sin
    vc = -h.current_north * sin + h.current_east * cos
    uw, vw = u - uc, v - vc
    f, grow, gain = work[0], work[1], work[2]
    for i in range(6):
        grow[i] = 1.0
    if h.keel > 0.0:
        along = (state[0] - h.slope_north) * math.cos(h.slope_towards)
        along += (state[1] - h.slope_east) * math.sin(h.slope_towards)
        shallow(h.keel, along, h.slope_half, b.breadth / b.draught, grow)
    grow[0] *= 1.0 + h.fouling
    for i in range(len(h.gain)):
        gain[i] = h.gain[i] * (1.0 + h.drift_start + h.drift_slope * time)
    forces(c, uw, vw, r, acting, gain, grow, 1.0 + h.cross_flow, h.aside, f)
    add_environment(h, b, w, state, uw, wind, push[0], time, f)

    mass = b.mass + h.payload
    moment = b.mass * b.gravity + h.payload * h.payload_ahead
    m_x, m_y, m_yr = b.m_x, b.m_y * grow[4], b.m_yr
    m33 = b.inertia + h.payload * h.payload_ahead**2 + b.j_z * grow[5]
    m22, m23 = mass + m_y, moment + m_yr
    x = f[0] + mass * vw * r + moment * r * r + b.added * (m_y * vw + m_yr * r) * r
    y = f[1] - mass * uw * r - b.added * m_x * uw * r
    n = f[2] - moment * uw * r - b.munk * (m_y - m_x) * uw * vw - b.added * m_yr * uw * r
    det = m22 * m33 - m23 * m23
    out[0] = u * cos - v * sin
    out[1] = u * sin + v * cos
    out[2] = r
    out[3] = x / (mass + m_x) + push[1] + r * vc  # a current's body components turn with the ship
    out[4] = (m33 * y - m23 * n) / det + push[2] - r * uc
    out[5] = (m22 * n - m23 * y) / det + push[3]
    count = len(acting)
    for j in range(count):
        wanted = order[j] - state[STATE + j]
        if d.circular[j]:
            wanted = math.atan2(math.sin(wanted), math.cos(wanted))
        wanted = min(max(wanted / d.time[j], -d.rate[j]), d.rate[j])
        out[STATE + j] = wanted
        out[STATE + count + j] = wanted
        if h.gear.rate[j] < math.inf or (h.gear.wrong and h.lag > 0.0):
            wanted = sent(h.gear, j, state[STATE + j]) - state[STATE + count + j]
            if d.circular[j]:
                wanted = math.atan2(math.sin(wanted), math.cos(wanted))
            out[STATE + count + j] = slew(h.gear, j, wanted, h.lag if d.steers[j] else 0.0)
        elif h.lag > 0.0:
            out[STATE + count + j] = (state[STATE + j] - state[STATE + count + j]) / h.lag


@njit
def advance(forces, c, b, w, d, h, track, start, steps, dt, order, wind, push):
    """Runge-Kutta of the fourth order: rows start+1 .. start+steps of `track` [K, 6 + 2A].

    order   [A] held
    wind    [2K - 1, 2] where the true wind comes from, north and east [m/s], at half steps
    push    [2K - 1, 4] side force [N], accelerations, at half steps
    """
    width = track.shape[1]
    k = np.empty((4, width))
    state = np.empty(width)
    acting = np.empty((width - STATE) // 2)
    work = np.empty((3, 8))
    for i in range(start, start + steps):
        for stage in range(4):
            part = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            for j in range(width):
                state[j] = track[i, j] + (part * dt * k[stage - 1, j] if stage else 0.0)
            acting_of(h, d, track, i, part, dt, state, acting)
            half = 2 * i + int(2.0 * part)
            rates(
                forces, c, b, w, d, h, state, acting, order, wind[half], push[half],
                (i + part) * dt, work, k[stage],
            )  # fmt: skip
        for j in range(width):
            track[i + 1, j] = track[i, j] + dt / 6.0 * (
                k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j]
            )
        if h.gear.wrong:
            remember(h.gear, track[i + 1, STATE:])
