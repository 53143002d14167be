"""`--to shipmmg`: parameter objects of shipmmg, the MMG standard method with a polynomial hull.

Of a ship with one screw and the rudder behind it. Screw, rudder and masses are of the same form
and are taken over; the hull's cross-flow force is fitted with the polynomial of v' = v/U and
r' = r L/U by least squares over the run's training data (Yasukawa & Yoshimura 2015).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shiplog.exceptions import ModelError
from shiplog.export import hull_terms, written_python
from shiplog.export.filled import inert
from shiplog.export.job import Job
from shiplog.export.not_loaded import NotLoaded
from shiplog.export.trial import SECONDS, Difference
from shiplog.machine import files
from shiplog.models.mmg import body, hull
from shiplog.models.mmg.model import MMG, named
from shiplog.nomenclature.channels import STATE

CONSUMER = "shipmmg"
X_TERMS = ((0, 0), (2, 0), (1, 1), (0, 2), (4, 0))  # powers of v' and r'
Y_TERMS = ((1, 0), (0, 1), (3, 0), (2, 1), (1, 2), (0, 3))
X_NAMES = ("R_0_dash", "X_vv_dash", "X_vr_dash", "X_rr_dash", "X_vvvv_dash")
Y_NAMES = tuple(f"_{n}_dash" for n in ("v", "r", "vvv", "vvr", "vrr", "rrr"))
TOLERANCE = 1e-9  # of its integration


@dataclass(frozen=True)
class Parameters:
    """basic, manoeuvring   names and values of shipmmg's two objects
    explained  share of the hull's force X, Y, N that the polynomial has
    """

    basic: dict[str, float]
    manoeuvring: dict[str, float]
    density: float
    explained: tuple[float, float, float]


def parameters(job: Job) -> Parameters:
    """Raises ModelError for a ship of another form, with what differs."""
    model, theta = hull_terms.physics(job)
    g = model.geometry
    _refuse_other(job, model)
    p = {name: float(value) for name, value in named(model.names, theta).items()}
    screw, blade = g.propellers[0], g.rudders[0]
    m_x, m_y, yaw = (float(one) for one in body.masses(p, g))
    inertia = min(g.mass * (hull_terms.YAW_RADIUS * g.length) ** 2, yaw)
    eps = p["rudder.eps"]
    basic = {
        "L_pp": g.length, "B": job.run.profile.ship.breadth, "d": g.draught, "x_G": g.x_g,
        "D_p": screw.diameter, "m": g.mass, "I_zG": inertia, "A_R": blade.area,
        "η": min(screw.diameter / blade.span, 1.0), "m_x": m_x, "m_y": m_y, "J_z": yaw - inertia,
        "f_α": p["rudder.f_alpha"], "ϵ": eps, "t_R": p["rudder.t_r"], "x_R": blade.ahead,
        "a_H": p["rudder.a_h"], "x_H": p["rudder.x_h"] * g.length,
        # its β is of the centre of gravity: v + ℓ_R L r = (v - x_G r) + (ℓ_R + x_G/L) L r
        "γ_R_minus": p["rudder.gamma_p"], "γ_R_plus": p["rudder.gamma_n"],
        "l_R": p["rudder.l_r"] + g.x_g / g.length, "κ": p["rudder.k_x"] / eps,
        "t_P": p["propeller.t"], "w_P0": p["propeller.w_p0"], "x_P": screw.ahead / g.length,
    }  # fmt: skip
    manoeuvring = {"k_0": p["propeller.k0"], "k_1": p["propeller.k1"], "k_2": p["propeller.k2"]}
    w = hull_terms.velocities(job)
    u, v, r = w.T
    speed = np.sqrt(u**2 + (v - r * g.x_g) ** 2)
    unit = 0.5 * g.density * g.length * g.draught * speed**2
    force = np.array(hull.hull(p, g, u, v, r))
    explained = []
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = np.nan_to_num(v / speed), np.nan_to_num(r * g.length / speed)
    for i, letter in enumerate("XYN"):
        powers = X_TERMS if letter == "X" else Y_TERMS
        size = unit * (g.length if letter == "N" else 1.0)
        phi = np.stack([size * a**j * b**k for j, k in powers], 1)
        scale = np.maximum(np.linalg.norm(phi, axis=0), 1e-300)
        c = np.linalg.lstsq(phi / scale, force[:, i], rcond=1e-8)[0] / scale
        left = np.sum((phi @ c - force[:, i]) ** 2) / np.sum(force[:, i] ** 2)
        explained.append(float(1.0 - left))
        names = X_NAMES if letter == "X" else tuple(letter + n for n in Y_NAMES)
        c[0] = -c[0] if letter == "X" else c[0]  # a resistance
        manoeuvring |= dict(zip(names, c.tolist(), strict=True))
    x, y, n = explained
    return Parameters(basic, manoeuvring, g.density, (x, y, n))


def _refuse_other(job: Job, model: MMG) -> None:
    g, other = model.geometry, []
    if len(g.propellers) != 1 or len(g.rudders) != 1:
        other.append(f"{len(g.propellers)} screws and {len(g.rudders)} rudders instead of one each")
    elif g.rudders[0].behind is None:
        other.append("a rudder that stands in no slipstream")
    elif max(abs(g.propellers[0].starboard), abs(g.rudders[0].starboard)) > 1e-3:
        other.append("a screw or rudder off the centreline")
    if g.thrusters:
        other.append(f"{len(g.thrusters)} thrusters")
    if other:
        raise ModelError(
            f"{job.run.profile.ship.name} is no ship of shipmmg's form: it has "
            f"{' and '.join(other)}.",
            hint="--to fmu, cpp, python and mss have its equations as they are.",
        )


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    found = parameters(job)
    head = [
        f"{job.run.profile.ship.name}: the run {job.run.name}, {job.run.label}, written by "
        f"{job.ship.author}.",
        "simulate_mmg_3dof(basic_params, maneuvering_params, ..., ρ=DENSITY) sails it.",
        *record, *(f"Not in it: {one}" for one in losses(job)),
    ]  # fmt: skip
    lines = ['"""', *(inert(line) for line in head), '"""', "",
             "from shipmmg.mmg_3dof import Mmg3DofBasicParams, Mmg3DofManeuveringParams", "",
             f"DENSITY = {found.density!r}  # kg/m3",
             "basic_params = Mmg3DofBasicParams("]  # fmt: skip
    lines += [f"    {name}={value!r}," for name, value in found.basic.items()]
    lines += [")", "maneuvering_params = Mmg3DofManeuveringParams("]
    lines += [f"    {name}={value!r}," for name, value in found.manoeuvring.items()]
    files.write_text(path, "\n".join([*lines, ")", ""]))


def losses(job: Job) -> tuple[str, ...]:
    x, y, n = (100.0 * (1.0 - one) for one in parameters(job).explained)
    held = job.run.extension
    found = [
        "The hull's cross-flow force: shipmmg's polynomial explains all but "
        f"{x:.2g} % of the surge force, {y:.2g} % of the sway force, {n:.2g} % of the yaw moment "
        "over the training data.",
        "Wake: it falls by exp(-4 β_P²) there, and linearly in the run.",
        "Wind, a screw astern or stopped, coasting: shipmmg has none of them.",
        "Rates of the actuators and Euler's steps: it integrates the rudder as given.",
    ]
    if job.run.kind.residual:
        found.append("Its residual network.")
    if held is not None:
        found.append(f"Its causes: {', '.join(c.label for c in held.causes)}.")
    return tuple(found)


def compare(job: Job, path: Path) -> Difference:
    """In still water and calm, with the actuators as `simulate` moved them. Raises NotLoaded
    without shipmmg."""
    try:
        from shipmmg.mmg_3dof import (  # pyright: ignore[reportMissingImports]  # an optional extra
            simulate_mmg_3dof,
        )
    except ImportError as error:
        raise NotLoaded("shipmmg is not installed (pip install shipmmg)") from error
    known = written_python.names_of(path, path.stem)
    sailed, _ = job.sailor.sail(job.trial.schedule, members=1, seconds=SECONDS)
    names = [a.kind for a in job.run.profile.actuators]
    rudder, screw = (sailed.actuator[0, :, names.index(k)] for k in ("rudder", "propeller"))
    start = sailed.state[0, 0]
    done = simulate_mmg_3dof(
        known["basic_params"], known["maneuvering_params"], sailed.time, rudder, screw,
        u0=start[1], v0=start[3], r0=start[5], x0=start[0], y0=start[2], ψ0=start[4],
        ρ=known["DENSITY"], rtol=TOLERANCE, atol=TOLERANCE,
    )  # fmt: skip
    if not done.success:
        raise NotLoaded(f"its integration ended early: {done.message}")
    u, v, r, x, y, psi = done.sol(sailed.time)[:6]
    apart = np.abs(np.stack((x, u, y, v, psi, r), 1) - sailed.state[0])
    worst = np.where(np.isfinite(apart), apart, math.inf).max(0)
    by_channel = {c.name: float(worst[i]) for i, c in enumerate(STATE)}
    return Difference(by_channel, float(sailed.time[-1]))


def version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("shipmmg")
    except PackageNotFoundError:
        return ""
