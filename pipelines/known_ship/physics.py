"""Forces on the known ship and their integration: surge, sway and yaw at low speed.

Axes as in MMG: x₀ north, y₀ east, heading ψ clockwise; body x ahead, y to starboard, origin at
midship. Forces are those of Yasukawa & Yoshimura (2015) in their division into hull, propeller,
rudder and wind; each part's own source stands at the part. Forms and numbers are chosen apart
from `shiplog.models`: a fit must not win because both sides were written with one pen.

Compiled by numba in about 2 s a process. Not cached: its cache would not notice that a field of
`Ship` has moved.
"""

from __future__ import annotations

import math
from collections import namedtuple
from dataclasses import fields

import numpy as np
from numba import njit

from pipelines.known_ship.ship import BANK_EAST, Effects, Ship

STEP = 0.02  # s; logged at 0.1 s
WATER, AIR = 998.0, 1.225  # kg/m³
THRUSTER = 1.3  # m ahead of midship, the one nobody records
# state: x₀ u y₀ v ψ r, measured δ_port δ_starboard n, and the rudder angles after a hidden lag
STATES = 11

_SHIP = [f.name for f in fields(Ship) if f.name != "name"]
_FORCES = [
    "current_north", "current_east", "tether", "tether_north", "tether_east", "fouling",
    "cross_flow_drag", "thrust_loss", "rudder_force", "payload", "payload_ahead",
    "rudder_offset_port", "rudder_offset_starboard", "rudder_lag", "rudder_delay",
    "propeller_side_force", "rudder_limit", "shallow_water", "shoal_length", "shoal_north",
    "shoal_east", "shoal_towards", "bank", "bank_length",
]  # fmt: skip
_DERIVED = ["wind_force_surge", "wind_force_sway", "wind_force_yaw", "drift_start", "drift_slope"]
Coefficients = namedtuple("Coefficients", _SHIP)
Hidden = namedtuple("Hidden", _FORCES + _DERIVED)

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
STATIONS = tuple(0.5 * _NODES)  # ξ = x/L, from stern to bow
STATION_WIDTHS = tuple(0.5 * _WEIGHTS)


def coefficients(ship: Ship) -> Coefficients:
    return Coefficients(*(float(getattr(ship, name)) for name in _SHIP))


def hidden(effects: Effects, campaign: tuple[float, float], duration: float) -> Hidden:
    """The force side of the effects. `campaign`: this voyage's start and end as shares of it."""
    forces = [float(getattr(effects, name)) for name in _FORCES]
    slope = effects.thrust_drift * (campaign[1] - campaign[0]) / duration
    return Hidden(
        *forces, *map(float, effects.wind_force), effects.thrust_drift * campaign[0], slope
    )


@njit
def shoal(h, north, east):
    """0 in deep water to `shallow_water` over the crest of a shoal: (h₀/h)², h the depth here.

    The bed falls off the crest as a hyperbola, h² = h₀² (1 + s²/l²) at s metres from it. What
    grows does so by a power of draught over depth, as measured in shallow tanks (Kijima, Katsuno,
    Nakiri & Furukawa 1990), each with a power of its own in `hull` and `rates`. The masses' own
    gradient is left out: below 0.2 N here.
    """
    off = -(north - h.shoal_north) * math.sin(h.shoal_towards) + (east - h.shoal_east) * math.cos(
        h.shoal_towards
    )
    return 1.0 / (1.0 + (off / h.shoal_length) ** 2)


@njit
def bank(c, h, east, u, psi):
    """Suction towards the bank at y₀ = `BANK_EAST` and the moment that turns the leading end out.

    Both grow with the square of the speed along the bank (Norrbin 1974) and fade with the gap as
    1/(1 + (gap/l)³), our own; they are bounded at the wall and nothing behind it.
    """
    gap = BANK_EAST - 0.5 * c.breadth - east
    if gap < -c.breadth:
        return 0.0, 0.0, 0.0
    cos, sin = math.cos(psi), math.sin(psi)
    near = 1.0 / (1.0 + (max(gap, 0.0) / h.bank_length) ** 3)
    pull = h.bank * 0.15 * 0.5 * WATER * c.length * c.draught * (u * cos) ** 2 * near
    lead = u / math.sqrt(u * u + 1e-4)  # which end leads
    return pull * sin, pull * cos, -0.25 * c.length * pull * cos * lead


@njit
def hull(c, h, u, v, r, shallow):
    """Hull force at velocity through the water, after Yoshimura, Nakao & Ishibashi (2009).

    Linear damping fades with |u|; cross-flow drag is integrated along the hull with a coefficient
    that grows towards the ends, as Hooft (1994) found. `shallow` is the shoal's (h₀/h)².
    """
    crest = h.shallow_water
    slow, damped = 1.0 + 0.3 * crest * shallow, 1.0 + 0.8 * crest * shallow
    blocked = 1.0 + 1.2 * crest * shallow * math.sqrt(shallow)
    q = 0.5 * WATER * c.length * c.draught
    speed = math.sqrt(u * u + v * v)
    astern = 0.5 - 0.5 * u / speed if speed > 0.0 else 0.0  # 0 straight ahead, 1 straight astern
    rough = 1.0 + h.fouling
    straight = c.resistance_ahead + (c.resistance_astern - c.resistance_ahead) * astern
    lr = c.length * r
    x = q * (-rough * straight * slow * u * speed + c.surge_turning * v * lr)
    y = q * (c.sway_damping * damped * v * abs(u) + c.sway_turning * lr * u)
    n = q * c.length * (c.yaw_drift * v * u + c.yaw_damping * damped * lr * abs(u))
    drag = q * c.cross_flow * (1.0 + h.cross_flow_drag) * blocked
    for i in range(len(STATIONS)):
        xi = STATIONS[i]
        across = v + lr * xi
        strip = drag * (1.0 + 4.0 * c.cross_flow_ends * xi * xi) * STATION_WIDTHS[i]
        y -= strip * abs(across) * across
        n -= strip * abs(across) * across * xi * c.length
    return x, y, n


@njit
def propeller(c, u, v, r, speed):
    """Open-water thrust [N] and inflow [m/s] of a propeller that turns ahead or stands, n ≥ 0.

    K_T = k₀ + k₁J + k₂J² times n² is a polynomial in n and the inflow, so it goes on smoothly to
    n = 0 (a standing propeller brakes) and, with u|u|, to astern motion. The wake fades as the
    flow at the propeller turns aside (Yasukawa & Yoshimura 2015; our own fading).
    """
    aside = v + c.propeller_at * r
    inflow = u
    if u > 0.0:
        ahead = u * u / (u * u + aside * aside)
        inflow = u * (1.0 - c.wake * ahead * ahead)
    nd = speed * c.diameter
    thrust = nd * nd * c.thrust_0 + nd * inflow * c.thrust_1 + inflow * abs(inflow) * c.thrust_2
    return WATER * c.diameter**2 * thrust, inflow


@njit
def blade(c, angle, u, v):
    """The part of one rudder outside the jet: lift until it stalls, then a flat plate.

    Lifting line with a smooth stall after Fujii's slope, all four quadrants; returns X and Y.
    """
    speed2 = u * u + v * v
    if speed2 == 0.0:
        return 0.0, 0.0
    attack = angle + math.atan2(v, u)
    s, k = math.sin(attack), math.cos(attack)
    steep = math.asin(min(1.0, abs(s)))
    attached = 1.0 / (1.0 + math.exp((steep - c.stall) / 0.06))
    lift = (attached * c.lift_slope + (1.0 - attached) * c.plate_drag) * s * k
    drag = c.friction + (attached * 0.45 + (1.0 - attached)) * c.plate_drag * s * s
    q = 0.5 * WATER * c.rudder_area * c.outside * math.sqrt(speed2)
    return q * (-drag * u + lift * v), q * (-drag * v - lift * u)


@njit
def rudders(c, h, u, v, r, thrust, inflow, port, starboard):
    """Both VecTwin rudders behind one propeller: X, Y, N at midship.

    The slipstream of momentum theory (Rankine, Froude) is split between them and leaves along
    each rudder. What it loses ahead or gains aside is the force: nothing is left ahead near ±75
    deg (hover), and the bucket throws it forward at ±105 deg. Behaviour after Hasegawa, Kang et
    al. (2006, 2008); the momentum form is ours. Rotation of the jet makes the two unlike.
    """
    disc = 0.25 * math.pi * c.diameter**2
    far = math.sqrt(max(inflow * inflow + 2.0 * thrust / (WATER * disc), 0.0))
    jet = WATER * disc * 0.5 * max(inflow + far, 0.0) * far  # momentum flux [N]
    gain = 1.0 + h.rudder_force
    aside = c.straightening * (v + c.rudder_at * r)
    x = y = n = 0.0
    for side in range(2):
        angle = starboard if side else port
        share = 1.0 - c.port_share if side else c.port_share
        station = c.rudder_aside if side else -c.rudder_aside
        spread = math.sqrt(far * far + aside * aside) + 1e-9
        attack_s = math.sin(angle + c.swirl) * far / spread + math.cos(angle) * aside / spread
        leaves = c.deflected * (1.0 - c.spill * attack_s * attack_s)
        fx = -share * jet * (far / spread - leaves * math.cos(angle + c.swirl))
        fy = -share * jet * (aside / spread + leaves * math.sin(angle + c.swirl))
        bx, by = blade(c, angle, u * (1.0 - 0.5 * c.wake) if u > 0.0 else u, aside)
        fx, fy = gain * (fx + bx), gain * (fy + by)
        x += fx
        y += fy * (1.0 + c.hull_lift)
        n += fy * (c.rudder_at + c.hull_lift * c.hull_lift_at) - fx * station
    return x, y, n


@njit
def wind_force(c, h, ahead, starboard):
    """Fujiwara, Ueno & Nimura (1998)-type harmonics of the apparent wind's direction.

    ahead, starboard   where the wind comes FROM, as a vector in body axes [m/s]
    """
    speed2 = ahead * ahead + starboard * starboard
    if speed2 == 0.0:
        return 0.0, 0.0, 0.0
    angle = math.atan2(starboard, ahead)
    q = 0.5 * AIR * speed2
    x = -q * c.frontal_area * (
        c.wind_surge * math.cos(angle) + c.wind_surge_3 * math.cos(3.0 * angle)
    )  # fmt: skip
    y = -q * c.lateral_area * (
        c.wind_sway * math.sin(angle) + c.wind_sway_3 * math.sin(3.0 * angle)
    )  # fmt: skip
    n = -q * c.lateral_area * c.length * (
        c.wind_yaw * math.sin(angle) + c.wind_yaw_2 * math.sin(2.0 * angle)
    )  # fmt: skip
    return (
        x * (1.0 + h.wind_force_surge), y * (1.0 + h.wind_force_sway), n * (1.0 + h.wind_force_yaw)
    )  # fmt: skip


@njit
def rates(c, h, state, port, starboard, order, wind, push, time, out):
    """dx/dt [11] of `state` [11] into `out`; port and starboard are the rudder angles that act.

    wind   [2] where the true wind comes from, north and east [m/s]
    push   [4] side thrust [N], and accelerations that nothing explains [m/s², m/s², rad/s²]

    Rigid body with added mass about midship; a current moves the water that added mass and
    hull feel, and is even and steady, so that only velocity through the water accelerates.
    """
    u, v, psi, r = state[1], state[3], state[4], state[5]
    cos, sin = math.cos(psi), math.sin(psi)
    uc = h.current_north * cos + h.current_east * sin
    vc = -h.current_north * sin + h.current_east * cos
    uw, vw = u - uc, v - vc  # through the water

    shallow = shoal(h, state[0], state[2]) if h.shallow_water > 0.0 else 0.0
    x, y, n = hull(c, h, uw, vw, r, shallow)
    thrust, inflow = propeller(c, uw, vw, r, state[8])
    weaker = (1.0 - h.thrust_loss) * (1.0 + h.drift_start + h.drift_slope * time)
    thrust *= weaker
    x += thrust * (1.0 - c.deduction)
    y += thrust * h.propeller_side_force
    n += thrust * h.propeller_side_force * c.propeller_at
    rx, ry, rn = rudders(c, h, uw, vw, r, thrust, inflow, port, starboard)
    wx, wy, wn = wind_force(
        c, h, wind[0] * cos + wind[1] * sin + u, -wind[0] * sin + wind[1] * cos + v
    )
    x, y, n = x + rx + wx, y + ry + wy, n + rn + wn
    if h.tether > 0.0:
        north, east = h.tether_north - state[0], h.tether_east - state[2]
        pull = h.tether / math.sqrt(north * north + east * east + 1.0)  # slack near the point
        x += pull * (north * cos + east * sin)
        y += pull * (-north * sin + east * cos)
    if h.bank > 0.0:
        bx, by, bn = bank(c, h, state[2], uw, psi)
        x, y, n = x + bx, y + by, n + bn
    y += push[0]
    n += push[0] * THRUSTER

    mass = c.mass + h.payload
    moment = c.mass * c.gravity_ahead + h.payload * h.payload_ahead  # m x_G
    inertia = c.inertia + h.payload * h.payload_ahead**2
    crest = h.shallow_water * shallow
    mx, my = mass + c.added_surge, mass + c.added_sway * (1.0 + 0.7 * crest)
    inertia += 0.2 * c.inertia * crest  # J_zz is some 0.4 of it, and grows by half
    udot = (x + my * vw * r + moment * r * r) / mx
    ya = y - mx * uw * r
    na = n - moment * uw * r
    det = my * inertia - moment * moment
    vdot = (ya * inertia - moment * na) / det
    rdot = (my * na - moment * ya) / det

    out[0] = u * cos - v * sin
    out[1] = udot + push[1] + r * vc  # the current's components in body axes turn with the ship
    out[2] = u * sin + v * cos
    out[3] = vdot + push[2] - r * uc
    out[4] = r
    out[5] = rdot + push[3]
    for i in range(2):
        wanted = (order[i] - state[6 + i]) / c.rudder_time
        out[6 + i] = min(max(wanted, -c.rudder_rate), c.rudder_rate)
        lag = h.rudder_lag
        out[9 + i] = (state[6 + i] - state[9 + i]) / lag if lag > 0.0 else out[6 + i]
    out[8] = (order[2] - state[8]) / c.propeller_time


@njit
def _past(track, last, state, column, steps):
    """`column` of the track at `steps` (may be a fraction) steps, linear in between."""
    if steps <= 0.0:
        return track[0, column]
    if steps >= last:  # within the present step: the stage itself is the newest we have
        return track[last, column] if steps == last else state[column]
    before = int(steps)
    part = steps - before
    return track[before, column] * (1.0 - part) + track[before + 1, column] * part


@njit
def advance(c, h, track, start, steps, dt, order, wind, push):
    """Runge-Kutta of fourth order: rows start+1 .. start+steps of `track` [K, 11].

    order   [3] what the operator has set, held: port, starboard [rad], propeller [rev/s]
    wind    [2K - 1, 2] where the true wind comes from, north and east [m/s], at half steps
    push    [2K - 1, 4] side thrust [N] and random accelerations, at half steps
    """
    k = np.empty((4, STATES))
    state = np.empty(STATES)
    for i in range(start, start + steps):
        for stage in range(4):
            part = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            for j in range(STATES):
                state[j] = track[i, j] + (part * dt * k[stage - 1, j] if stage else 0.0)
            if h.rudder_delay > 0.0:
                when = i + part - h.rudder_delay / dt
                port = _past(track, i, state, 9, when)
                starboard = _past(track, i, state, 10, when)
            else:
                port, starboard = state[9], state[10]
            port, starboard = port + h.rudder_offset_port, starboard + h.rudder_offset_starboard
            if h.rudder_limit > 0.0:
                port = min(max(port, -h.rudder_limit), h.rudder_limit)
                starboard = min(max(starboard, -h.rudder_limit), h.rudder_limit)
            half = 2 * i + int(2.0 * part)
            rates(
                c, h, state, port, starboard, order, wind[half], push[half], (i + part) * dt,
                k[stage],
            )  # fmt: skip
        for j in range(STATES):
            track[i + 1, j] = track[i, j] + dt / 6.0 * (
                k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j]
            )
