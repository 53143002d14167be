"""A 3 m tanker model as a team of its own would write it: numpy, and nothing of shiplog.

f(state, inputs, t) gives dx/dt of x = (x0, u, y0, v, psi, r) at midship, along north and east, SI.
Inputs: rudders to port and starboard [rad], propeller [rev/s], apparent wind [m/s, rad].
"""

import numpy as np

WATER, AIR = 998.0, 1.225
L, D = 3.0, 0.201
XI, WIDTH = (0.5 * one for one in np.polynomial.legendre.leggauss(12))


def hull(u, v, r):
    q, lr = 0.5 * WATER * L * D, L * r
    speed = np.sqrt(u * u + v * v)
    astern = 0.5 - 0.5 * u / np.maximum(speed, 1e-12)
    straight = 0.0230 + 0.0100 * astern
    x = q * (-straight * u * speed - 0.17 * v * lr)
    y = q * (-0.34 * v * np.abs(u) + 0.10 * lr * u)
    n = q * L * (-0.13 * v * u - 0.065 * lr * np.abs(u))
    for xi, width in zip(XI, WIDTH, strict=True):
        across = v + lr * xi
        push = q * 0.86 * (1.0 + 4.0 * 0.55 * xi * xi) * width * np.abs(across) * across
        y, n = y - push, n - push * xi * L
    return x, y, n


def screw(u, v, r, speed):
    aside = v - 1.42 * r
    ahead = u * u / np.maximum(u * u + aside * aside, 1e-12)
    inflow = np.where(u > 0.0, u * (1.0 - 0.45 * ahead * ahead), u)
    nd = 0.100 * speed
    thrust = nd * nd * 0.335 - nd * inflow * 0.310 - inflow * np.abs(inflow) * 0.160
    return WATER * 0.100**2 * thrust, inflow


def blade(angle, u, v):
    speed = np.sqrt(u * u + v * v)
    attack = angle + np.arctan2(v, u)
    s, k = np.sin(attack), np.cos(attack)
    attached = 1.0 / (1.0 + np.exp((np.arcsin(np.minimum(1.0, np.abs(s))) - 0.62) / 0.06))
    lift = (attached * 2.6 + (1.0 - attached) * 1.25) * s * k
    drag = 0.025 + (attached * 0.45 + (1.0 - attached)) * 1.25 * s * s
    q = 0.5 * WATER * 0.0103 * 0.40 * speed
    return q * (-drag * u + lift * v), q * (-drag * v - lift * u)


def rudders(u, v, r, thrust, inflow, port, starboard):
    disc = 0.25 * np.pi * 0.100**2
    far = np.sqrt(np.maximum(inflow * inflow + 2.0 * thrust / (WATER * disc), 0.0))
    jet = WATER * disc * 0.5 * np.maximum(inflow + far, 0.0) * far
    aside = 0.60 * (v - 1.50 * r)
    x = y = n = 0.0
    for angle, share, station in ((port, 0.515, -0.075), (starboard, 0.485, 0.075)):
        spread = np.sqrt(far * far + aside * aside) + 1e-9
        turned = angle + 0.025
        across = np.sin(turned) * far / spread + np.cos(angle) * aside / spread
        leaves = 0.93 * (1.0 - 0.10 * across * across)
        fx = -share * jet * (far / spread - leaves * np.cos(turned))
        fy = -share * jet * (aside / spread + leaves * np.sin(turned))
        bx, by = blade(angle, np.where(u > 0.0, u * (1.0 - 0.5 * 0.45), u), aside)
        fx, fy = fx + bx, fy + by
        x, y = x + fx, y + fy * 1.20
        n = n + fy * (-1.50 - 0.20 * 1.30) - fx * station
    return x, y, n


def wind(speed, angle):
    q = 0.5 * AIR * speed * speed
    x = -q * 0.135 * (0.80 * np.cos(angle) - 0.07 * np.cos(3.0 * angle))
    y = -q * 0.520 * (1.02 * np.sin(angle) + 0.06 * np.sin(3.0 * angle))
    n = -q * 0.520 * L * (0.020 * np.sin(angle) + 0.100 * np.sin(2.0 * angle))
    return x, y, n


def f(state, inputs, t):
    _, u, _, v, psi, r = state
    port, starboard, speed, air, angle = inputs
    thrust, inflow = screw(u, v, r, speed)
    parts = hull(u, v, r), rudders(u, v, r, thrust, inflow, port, starboard), wind(air, angle)
    x, y, n = (sum(part[i] for part in parts) for i in range(3))
    x = x + 0.80 * thrust
    mx, my, moment, inertia = 244.6 + 17.0, 244.6 + 221.0, 244.6 * 0.094, 240.0
    du = (x + my * v * r + moment * r * r) / mx
    ya, na = y - mx * u * r, n - moment * u * r
    det = my * inertia - moment * moment
    dv, dr = (ya * inertia - moment * na) / det, (my * na - moment * ya) / det
    north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    return np.array([north, du, east, dv, r, dr])
