"""Forces on the known ship and their integration: surge, sway and yaw at low speed.

Axes as in MMG: x₀ north, y₀ east, heading ψ clockwise; body x ahead, y to starboard, origin at
midship. Forces are those of Yasukawa & Yoshimura (2015) in their division into hull, propeller,
rudder and wind; each part's own source stands at the part. Forms and numbers are chosen apart
from `shiplog.models`: a fit must not win because both sides were written with one pen. Two forms
are those of `shiplog.models.mmg` all the same: thrust as a parabola of the advance ratio, and the
force of a rudder over its angle, which both take from the momentum of the slipstream. Exponents
and shares that a blind case draws come from `laws`.

Compiled by numba in about 2 s a process. Not cached: its cache would not notice that a field of
`Ship` has moved.
"""

from __future__ import annotations

import math
from collections import namedtuple
from dataclasses import fields

import numpy as np
from numba import njit

from pipelines.experiments.simulated_ship.gear import (
    acting,
    drive,
    external_of,
    gear_of,
    past,
    pulls,
    settle,
)
from pipelines.experiments.simulated_ship.laws import Laws, force_numbers
from pipelines.experiments.simulated_ship.place import WATER, bank, grown, powered, shoal
from pipelines.experiments.simulated_ship.ship import BANK_EAST, Effects, Ship

STEP = 0.02  # s; logged at 0.1 s
AIR = 1.225  # kg/m³
THRUSTER = 1.3  # m ahead of midship, the one nobody records
CROSS_FLOW_SPEED = 0.1  # m/s across a strip, as usual: there any power of it is the square
# state: x₀ u y₀ v ψ r, measured δ_port δ_starboard n, and all three after a hidden lag or rate
STATES = 12

_SHIP = [f.name for f in fields(Ship) if f.name != "name"]
_FORCES = [
    "current_north", "current_east", "tether", "tether_north", "tether_east", "fouling",
    "cross_flow_drag", "thrust_loss", "rudder_force", "payload", "payload_ahead",
    "rudder_offset_port", "rudder_offset_starboard", "rudder_lag", "rudder_delay",
    "propeller_side_force", "rudder_limit", "shallow_water", "shoal_length", "shoal_north",
    "shoal_east", "shoal_towards", "bank", "bank_length",
]  # fmt: skip
_DERIVED = ["wind_force_surge", "wind_force_sway", "wind_force_yaw", "drift_start", "drift_slope"]
_LAWS = list(force_numbers(Laws()))
Coefficients = namedtuple("Coefficients", _SHIP + _LAWS)
Hidden = namedtuple("Hidden", [*_FORCES, *_DERIVED, "gear", "external"])

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
STATIONS = tuple(0.5 * _NODES)  # ξ = x/L, from stern to bow
STATION_WIDTHS = tuple(0.5 * _WEIGHTS)


def coefficients(ship: Ship, laws: Laws | None = None) -> Coefficients:
    own = (float(getattr(ship, name)) for name in _SHIP)
    return Coefficients(*own, *force_numbers(laws or Laws()).values())


def hidden(effects: Effects, campaign: tuple[float, float], duration: float) -> Hidden:
    """The force side of the effects. `campaign`: this voyage's start and end as shares of it."""
    forces = [float(getattr(effects, name)) for name in _FORCES]
    slope = effects.thrust_drift * (campaign[1] - campaign[0]) / duration
    return Hidden(
        *forces,
        *map(float, effects.wind_force),
        effects.thrust_drift * campaign[0],
        slope,
        gear_of(effects.gear, campaign, duration),
        external_of(effects.external),
    )


@njit
def hull(c, h, u, v, r, shallow):
    """Hull force at velocity through the water, after Yoshimura, Nakao & Ishibashi (2009).

    Linear damping fades with |u|, but not below `hull_low_speed`, where it stays linear in the
    motion (Fossen 2011); cross-flow drag is integrated along the hull with a coefficient that
    grows towards the ends, as Hooft (1994) found. `shallow` is the shoal's (h₀/h)².
    """
    crest = h.shallow_water
    slow = 1.0 + grown(c.shallow_resistance * crest, shallow, c.shallow_resistance_power)
    swaying = 1.0 + grown(c.shallow_sway_damping * crest, shallow, c.shallow_sway_damping_power)
    yawing = 1.0 + grown(c.shallow_yaw_damping * crest, shallow, c.shallow_yaw_damping_power)
    turning = 1.0 + grown(c.shallow_sway_turning * crest, shallow, c.shallow_sway_turning_power)
    drifting = 1.0 + grown(c.shallow_yaw_drift * crest, shallow, c.shallow_yaw_drift_power)
    blocked = 1.0 + grown(c.shallow_cross_flow * crest, shallow, c.shallow_cross_flow_power)
    q = 0.5 * WATER * c.length * c.draught
    speed = math.sqrt(u * u + v * v)
    astern = 0.5 - 0.5 * u / speed if speed > 0.0 else 0.0  # 0 straight ahead, 1 straight astern
    along = abs(u)
    if c.hull_low_speed > 0.0:
        along = math.sqrt(u * u + c.hull_low_speed**2)
        speed = math.sqrt(speed * speed + c.hull_low_speed**2)
    rough = 1.0 + h.fouling
    straight = c.resistance_ahead + (c.resistance_astern - c.resistance_ahead) * astern
    lr = c.length * r
    x = q * (-rough * straight * slow * u * speed + c.surge_turning * v * lr)
    y = q * (c.sway_damping * swaying * v * along + c.sway_turning * turning * lr * u)
    n = q * c.length * (c.yaw_drift * drifting * v * u + c.yaw_damping * yawing * lr * along)
    drag = q * c.cross_flow * (1.0 + h.cross_flow_drag) * blocked
    for i in range(len(STATIONS)):
        xi = STATIONS[i]
        across = v + lr * xi
        strip = drag * (1.0 + _ends(c, xi)) * STATION_WIDTHS[i]
        if c.hull_cross_flow_power == 2.0:
            push = strip * abs(across) * across
        else:
            square = powered(across, c.hull_cross_flow_power, CROSS_FLOW_SPEED)
            push = strip * math.copysign(square, across)
        y -= push
        n -= push * xi * c.length
    return x, y, n


@njit
def _ends(c, xi):
    """How much more cross-flow drag there is at ξ = x/L than amidships."""
    if c.hull_end_power == 2.0:
        more = 4.0 * c.cross_flow_ends * xi * xi
    else:
        more = c.cross_flow_ends * abs(2.0 * xi) ** c.hull_end_power
    return more * c.hull_end_growth * (1.0 + c.hull_end_skew * 2.0 * xi)


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

    The cross-force parameter δ makes an oblique wind push harder than its components would
    (Blendermann 1994); the terms of `laws.Air` are such as Isherwood (1973) found.

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
    if c.air_cross_force > 0.0:
        ratio = c.wind_surge * c.frontal_area / (c.wind_sway * c.lateral_area)
        oblique = 1.0 - 0.5 * c.air_cross_force * (1.0 - ratio) * math.sin(2.0 * angle) ** 2
        x, y, n = x / oblique, y / oblique, n / oblique
    x -= q * c.frontal_area * (c.air_surge_0 + c.air_surge_2 * math.cos(2.0 * angle))
    y -= q * c.lateral_area * c.air_sway_2 * math.sin(2.0 * angle)
    n -= q * c.lateral_area * c.length * c.air_yaw_3 * math.sin(3.0 * angle)
    return (
        x * (1.0 + h.wind_force_surge), y * (1.0 + h.wind_force_sway), n * (1.0 + h.wind_force_yaw)
    )  # fmt: skip


@njit
def masses(c, h, shallow):
    """Mass with added mass, in surge and in sway; m x_G; moment of inertia with what is added."""
    mass = c.mass + h.payload
    moment = c.mass * c.gravity_ahead + h.payload * h.payload_ahead
    inertia = c.inertia + h.payload * h.payload_ahead**2
    crest = h.shallow_water
    more_x = c.shallow_added_surge * grown(crest, shallow, c.shallow_added_surge_power)
    more_y = c.shallow_added_sway * grown(crest, shallow, c.shallow_added_sway_power)
    more_j = grown(crest, shallow, c.shallow_added_inertia_power)
    mx, my = mass + c.added_surge * (1.0 + more_x), mass + c.added_sway * (1.0 + more_y)
    inertia += c.shallow_added_inertia * c.inertia * more_j  # J_zz is some 0.4 of it
    return mx, my, moment, inertia


@njit
def rates(c, h, state, port, starboard, screw, order, wind, push, time, out):
    """dx/dt [12] of `state` [12] into `out`; port, starboard and screw are what acts.

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

    shallow = shoal(c, h, state[0], state[2]) if h.shallow_water > 0.0 else 0.0
    x, y, n = hull(c, h, uw, vw, r, shallow)
    thrust, inflow = propeller(c, uw, vw, r, screw)
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
    if h.external.any:
        campaign = h.gear.begin + h.gear.slope * time
        ex, ey, en = pulls(h.external, BANK_EAST, c.breadth, state[0], state[2], psi, campaign)
        x, y, n = x + ex, y + ey, n + en
    y += push[0]
    n += push[0] * THRUSTER

    mx, my, moment, inertia = masses(c, h, shallow)
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
        if h.gear.wrong:
            out[9 + i] = drive(h.gear, i, state[6 + i], state[9 + i], lag)
    out[8] = (order[2] - state[8]) / c.propeller_time
    out[11] = drive(h.gear, 2, state[8], state[11], 0.0) if h.gear.wrong else out[8]


@njit
def advance(c, h, track, start, steps, dt, order, wind, push):
    """Runge-Kutta of fourth order: rows start+1 .. start+steps of `track` [K, 12].

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
                port = past(track, i, state, 9, when)
                starboard = past(track, i, state, 10, when)
            else:
                port, starboard = state[9], state[10]
            port, starboard = port + h.rudder_offset_port, starboard + h.rudder_offset_starboard
            if h.rudder_limit > 0.0:
                port = min(max(port, -h.rudder_limit), h.rudder_limit)
                starboard = min(max(starboard, -h.rudder_limit), h.rudder_limit)
            screw = state[8]
            if h.gear.wrong:
                port, starboard, screw = acting(h, track, i, part, dt, state)
            half = 2 * i + int(2.0 * part)
            rates(
                c, h, state, port, starboard, screw, order, wind[half], push[half], (i + part) * dt,
                k[stage],
            )  # fmt: skip
        for j in range(STATES):
            track[i + 1, j] = track[i, j] + dt / 6.0 * (
                k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j]
            )
        if h.gear.wrong:
            settle(h.gear, track[i + 1, 6], track[i + 1, 7], track[i + 1, 8])
