"""The low-speed MMG of a single screw and rudder in CasADi symbols: the peer of `rollouts`.

Written from the published equations, not from shiplog.models.mmg, so that each checks the other.
Only the ship's sizes and the order of θ are shared. Function.buffer() hands numpy's memory over
uncopied, which is CasADi's fastest way in and out of Python.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import casadi  # type: ignore
import numpy as np

from shiplog.models.mmg.geometry import Geometry
from shiplog.simulation.window_series import WindowSeries

cs: Any = casadi  # SWIG's generated stubs do not know SX's operators
Named = dict[str, Any]  # a part's coefficients, by what follows the dot in their names
Force = tuple[Any, Any, Any]  # X, Y, N at midship

PITCH_RATIO, AIR_DENSITY, GRAVITY = 0.7151, 1.225, 9.80665
STILL = 1e-12  # m²/s²
COMPILED = {
    "jit": True,
    "compiler": "shell",
    "jit_options": {"flags": "-O3 -march=native", "verbose": False},
}


def _choose(*cases: Any) -> Any:
    """condition, value, condition, value, ..., otherwise."""
    value = cases[-1]
    for condition, found in zip(cases[-3::-2], cases[-2::-2], strict=True):
        value = cs.if_else(condition, found, value)
    return value


def _root(square: Any) -> Any:
    return cs.sqrt(cs.fmax(square, STILL))


def _crossflow(v: Any, a: Any) -> tuple[Any, Any]:
    """∫|v + aξ|(v + aξ) dξ and the same times ξ, over [-½, ½]."""
    one_sided = cs.fabs(a) <= 2.0 * cs.fabs(v)
    b = cs.if_else(one_sided, 1.0, a)
    w1, w0 = v + b / 2.0, v - b / 2.0
    c1, c0 = cs.fabs(w1) ** 3, cs.fabs(w0) ** 3
    both = (c1 - c0) / (3.0 * b)
    moment = ((w1 * c1 - w0 * c0) / 4.0 - v * (c1 - c0) / 3.0) / b**2
    # one sign along the hull: |w|w = ±(v² + 2vaξ + a²ξ²), and only even powers of ξ survive
    same = cs.sign(v) * (v * v + a * a / 12.0)
    return cs.if_else(one_sided, same, both), cs.if_else(one_sided, cs.fabs(v) * a / 6.0, moment)


def _hull(p: Named, g: Geometry, u: Any, v: Any, r: Any) -> Force:
    """Resistance over the drift angle, damping, cross-flow drag, and what needs no headway."""
    size, q = g.length, 0.5 * g.density * g.length * g.draught
    beta = cs.fabs(cs.atan2(v, cs.if_else(u * u + v * v < STILL, 1.0, u)))
    straight = p["x_0f"] + (p["x_0a"] - p["x_0f"]) * beta / math.pi
    force, _ = _crossflow(v, p["c_ry"] * size * r)
    _, moment = _crossflow(v, p["c_rn"] * size * r)
    x = q * (straight * u * _root(u * u + v * v) + p["x_vr"] * size * v * r)
    y = q * (p["y_v"] * v * cs.fabs(u) + p["y_r"] * size * r * u - p["c_d"] * force)
    n = p["n_v"] * v * u + p["n_r"] * size * r * cs.fabs(u) - p["c_d"] * moment
    bis = math.sqrt(GRAVITY * size)  # m/s
    x += q * bis * p["x_u"] * u
    y += q * bis * (p["y_vl"] * v + p["y_rl"] * size * r)
    n += bis * (p["n_vl"] * v + p["n_rl"] * size * r)
    return x, y, q * size * n


def _propeller(p: Named, g: Geometry, n: Any, u: Any, v: Any, r: Any) -> tuple[Force, Any, Any]:
    """Forces; the share of u that arrives at the screw; K_T."""
    (screw,) = g.propellers
    d, q = screw.diameter, 0.5 * g.density * g.length * g.draught
    stopped = n == 0.0
    j_s = u / (cs.if_else(stopped, 1.0, n) * d)
    aside = (v + screw.ahead * r) / _root(u * u + v * v)
    wake = p["w_p0"] - p["tau"] * cs.fabs(aside) - p["c_p"] * aside**2
    arriving = cs.if_else(u > 0.0, cs.fmin(cs.fmax(1.0 - wake, 1e-9), 1.0), 1.0)
    j = j_s * arriving  # astern nothing is lost: 1
    k_ahead = p["k0"] + p["k1"] * j + p["k2"] * j**2
    k_astern = cs.if_else(j_s >= p["c10"], p["c6"] + p["c7"] * j_s, p["c3"])
    k_t = _choose(stopped, 0.0, n > 0.0, k_ahead, k_astern)
    thrust = g.density * d**4 * n**2
    x = thrust * cs.if_else(n > 0.0, (1.0 - p["t"]) * k_ahead, k_astern)

    def side(letter: str) -> Any:
        c = [p[f"{letter}{i}"] for i in range(1, 9)]
        middle = cs.if_else(j_s <= -0.06, c[0] + c[1] * j_s, c[4])
        reversing = cs.if_else(j_s < -0.35, c[2] + c[3] * j_s, middle)
        braking = PITCH_RATIO**2 * (c[5] * j_s**2 + c[6] * j_s + c[7])
        return _choose(n < 0.0, reversing, cs.logic_and(n > 0.0, u < 0.0), braking, 0.0)

    force = x, q * (n * d) ** 2 * side("a"), q * g.length * (n * d) ** 2 * side("b")
    return force, arriving, k_t


def _rudder(
    p: Named, g: Geometry, delta: Any, n: Any, u: Any, v: Any, r: Any, arriving: Any, k_t: Any
) -> Force:
    """One rudder in the slipstream of the screw that turns n times a second."""
    (screw,), (blade,) = g.propellers, g.rudders
    d, size = screw.diameter, g.length
    eta = d / blade.span
    eps, u_p = p["eps"], u * arriving
    jet = 8.0 * n**2 * d**2 / math.pi
    far = _root(u_p**2 + jet * cs.fmax(k_t, 0.0))
    inside = u_p + p["k_x"] / eps * (far - u_p)
    driven = eps * _root(eta * inside**2 + (1.0 - eta) * u_p**2)
    u_b = eps * u_p
    u_a = u_b + n * d * p["k_xr"] * _root(8.0 / math.pi * cs.fabs(k_t))
    signed = eta * cs.sign(u_a) * u_a**2 + (1.0 - eta) * u_b**2 + p["c_pr"] * u**2
    coasting = cs.sign(signed) * _root(cs.fabs(signed))
    pushing = cs.logic_and(n > 0.0, k_t > 0.0)
    u_r = _choose(pushing, driven, u >= 0.0, coasting, u)
    gamma = cs.if_else(v + blade.ahead * r >= 0.0, p["gamma_p"], p["gamma_n"])
    v_r = -gamma * (v + p["l_r"] * size * r)
    square = u_r**2 + v_r**2
    alpha = delta - cs.atan2(v_r, cs.if_else(square == 0.0, 1.0, u_r))
    sine, cosine = cs.sin(alpha), cs.cos(alpha)
    pressure = 0.5 * g.density * blade.area * square
    across = pressure * p["f_alpha"] * sine * (1.0 + p["f_3"] * sine**2)
    chord = pressure * p["f_t"] * (1.0 - cosine)
    f_x = chord * cs.cos(delta) - across * cs.sin(delta)
    f_y = -across * cs.cos(delta) - chord * cs.sin(delta)
    moment = (blade.ahead + p["a_h"] * p["x_h"] * size) * f_y
    return (1.0 - p["t_r"]) * f_x, (1.0 + p["a_h"]) * f_y, moment


def _air(p: Named, g: Geometry, from_ahead: Any, from_starboard: Any) -> Force:
    """Harmonics of the apparent wind's angle; where the wind comes from, in body axes [m/s]."""
    u_a2 = from_ahead**2 + from_starboard**2
    c1, s1 = from_ahead / _root(u_a2), -from_starboard / _root(u_a2)
    cos, sin = [1.0, c1], [0.0, s1]
    for _ in range(4):  # cos (k+1)g = 2 cos g cos kg - cos (k-1)g, and so for sin
        cos.append(2.0 * c1 * cos[-1] - cos[-2])
        sin.append(2.0 * c1 * sin[-1] - sin[-2])
    q = 0.5 * AIR_DENSITY * u_a2
    x = p["x0"] + sum(p[f"x{k}"] * cos[k] for k in (1, 3, 5))
    x *= q * g.frontal_area
    y = q * g.lateral_area * sum(p[f"y{k}"] * sin[k] for k in (1, 3, 5))
    n = q * g.lateral_area * g.length * sum(p[f"n{k}"] * sin[k] for k in (1, 2, 3))
    return x, y, n


def acceleration(
    g: Geometry, names: Sequence[str], theta: Any, x: Any, actuator: Any, wind: Any
) -> Any:
    """u̇, v̇, ṙ of x = (x₀, u, y₀, v, ψ, r) and the true wind (from, along x₀ and y₀)."""
    p: dict[str, Named] = {}
    for i, name in enumerate(names):
        part, _, key = name.partition(".")
        p.setdefault(part, {})[key] = theta[i]
    (screw,), (blade,) = g.propellers, g.rudders
    u, v, psi, r = x[1], x[3], x[4], x[5]
    delta, n = actuator[blade.column], actuator[screw.column]
    c, s = cs.cos(psi), cs.sin(psi)
    pushed, arriving, k_t = _propeller(p["propeller"], g, n, u, v, r)
    parts = (
        _hull(p["hull"], g, u, v, r),
        pushed,
        _rudder(p["rudder"], g, delta, n, u, v, r, arriving, k_t),
        _air(p["wind"], g, c * wind[0] + s * wind[1] + u, -s * wind[0] + c * wind[1] + v),
    )
    all_x, all_y, all_n = (sum(part[i] for part in parts) for i in range(3))

    unit = 0.5 * g.density * g.length**2 * g.draught
    m, x_g = g.mass, g.x_g
    m_x, m_y = p["body"]["m_x"] * unit, p["body"]["m_y"] * unit
    i_z = p["body"]["i_j"] * unit * g.length**2 + x_g**2 * m
    right_y = all_y - (m + m_x) * u * r
    right_n = all_n - x_g * m * u * r
    det = (m + m_y) * i_z - (x_g * m) ** 2
    return cs.vertcat(
        (all_x + (m + m_y) * v * r + x_g * m * r**2) / (m + m_x),
        (i_z * right_y - x_g * m * right_n) / det,
        ((m + m_y) * right_n - x_g * m * right_y) / det,
    )


class Peer:
    """CasADi functions for one shape of data, with memory that they read from and write to.

    compiled   one step through the C compiler instead of CasADi's virtual machine
    """

    def __init__(
        self, g: Geometry, names: Sequence[str], data: WindowSeries, compiled: bool = False
    ) -> None:
        count, samples, wide = data.actuator.shape
        self.count, self.steps, self.parameters = count, samples - 1, len(names)
        self.wide = wide + 3
        self.options = COMPILED if compiled else {}
        self._step(g, names, wide)
        # [driving, step, window] in memory order, as CasADi lays matrices out by column
        drive = np.concatenate(
            (data.actuator[:, :-1], data.wind[:, :-1], data.dt[..., None]), axis=-1
        )
        self.drive = np.ascontiguousarray(drive).ravel()
        self.start = np.ascontiguousarray(data.measured[:, 0]).ravel()

    def _step(self, g: Geometry, names: Sequence[str], wide: int) -> None:
        theta, x = cs.SX.sym("theta", len(names)), cs.SX.sym("x", 6)
        drive = cs.SX.sym("drive", self.wide)
        nu = acceleration(g, names, theta, x, drive[:wide], drive[wide : wide + 2])
        c, s = cs.cos(x[4]), cs.sin(x[4])
        rate = cs.vertcat(c * x[1] - s * x[3], nu[0], s * x[1] + c * x[3], nu[1], x[5], nu[2])
        after = x + drive[wide + 2] * rate
        self.acceleration = cs.Function("acceleration", [x, drive, theta], [nu])
        self.step = cs.Function("step", [x, drive, theta], [cs.cse(after)], self.options)
        slope = cs.SX.sym("slope", 6, len(names))
        by_x, by_theta = cs.jacobian(after, x), cs.jacobian(after, theta)
        moved = cs.densify(by_x @ slope + by_theta)
        self.along = cs.Function(
            "along", [x, slope, drive, theta], cs.cse([after, moved]), self.options
        )

    def _chain(self) -> Any:
        """A window: (x, drives [·, steps], θ) → states [6, steps]."""
        x, theta = cs.MX.sym("x", 6), cs.MX.sym("theta", self.parameters)
        drive = cs.MX.sym("drive", self.wide, self.steps)
        chain = self.step.mapaccum(self.steps)
        states = chain(x, drive, cs.repmat(theta, 1, self.steps))
        return cs.Function("window", [x, drive, theta], [states])

    def rollout(self) -> Callable[[np.ndarray], np.ndarray]:
        """θ → states [N, I - 1, 6]."""
        every = self._chain().map("every", "serial", self.count, [2], [])
        out = np.zeros((self.count, self.steps, 6))
        return self._bound(every, (self.start, self.drive, None), out)

    def forward(self) -> Callable[[np.ndarray], np.ndarray]:
        """θ → derivatives [N, P, I - 1, 6] by CasADi's own forward mode of the whole chain."""
        window, size = self._chain(), self.parameters
        x, theta = cs.MX.sym("x", 6), cs.MX.sym("theta", size)
        drive = cs.MX.sym("drive", self.wide, self.steps)
        seeds = (
            cs.MX(6, size),
            cs.MX(self.wide, self.steps * size),
            cs.MX(cs.DM.eye(size)),
        )
        slopes = window.forward(size)(x, drive, theta, window(x, drive, theta), *seeds)
        one = cs.Function("slopes", [x, drive, theta], [slopes])
        every = one.map("every", "serial", self.count, [2], [])
        out = np.zeros((self.count, size, self.steps, 6))
        return self._bound(every, (self.start, self.drive, None), out)

    def variational(self) -> Callable[[np.ndarray], np.ndarray]:
        """θ → derivatives [N, I - 1, P, 6]: x and ∂x/∂θ stepped together, Jacobians per step."""
        x, theta = cs.MX.sym("x", 6), cs.MX.sym("theta", self.parameters)
        drive = cs.MX.sym("drive", self.wide, self.steps)
        chain = self.along.mapaccum("along_all", self.steps, 2)
        first = cs.MX.zeros(6, self.parameters)
        _, slopes = chain(x, first, drive, cs.repmat(theta, 1, self.steps))
        one = cs.Function("slopes", [x, drive, theta], [slopes])
        every = one.map("every", "serial", self.count, [2], [])
        out = np.zeros((self.count, self.steps, self.parameters, 6))
        return self._bound(every, (self.start, self.drive, None), out)

    def _bound(
        self, function: Any, inputs: tuple[np.ndarray | None, ...], out: np.ndarray
    ) -> Callable[[np.ndarray], np.ndarray]:
        """The function over fixed memory; None stands for θ."""
        if function.nnz_out(0) != out.size:
            raise ValueError(f"{function.name()} gives {function.nnz_out(0)}, not {out.size}")
        held = np.zeros(self.parameters)
        memory = [held if values is None else values for values in inputs]
        buffer, evaluate = function.buffer()
        for i, values in enumerate(memory):
            buffer.set_arg(i, values.data)
        buffer.set_res(0, out.reshape(-1).data)

        def call(theta: np.ndarray) -> np.ndarray:
            held[:] = theta
            evaluate()
            return out

        # The buffer holds bare addresses: what is behind them must live as long as the call.
        call.memory = (buffer, function, memory)  # type: ignore[attr-defined]
        return call
