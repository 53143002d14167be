"""A hull's force fitted with products of velocities, the terms that a simulator's plugin has.

    F(u, v, r) ≈ Σ c_k φ_k(u, v, r),  φ one of w_j, w_j |w_k| and w_j w_k

by least squares over the run's training data, of each of X, Y and N at midship. What of the force
over these data is left is the loss: 1 - Σ (F - F̂)² / Σ F².
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.exceptions import ModelError
from shiplog.export.job import Job
from shiplog.models import PHYSICS
from shiplog.models.mmg import body, hull
from shiplog.models.mmg.model import MMG, named
from shiplog.nomenclature.channels import VELOCITY_IN_STATE

YAW_RADIUS = 0.25  # of the length: radius of gyration of a ship (Yasukawa & Yoshimura 2015)
AXES = {"U": 0, "V": 1, "R": 2}
DAMPING = {"xU", "xUabsU", "yV", "yVabsV", "nR", "nRabsR"}
TERM = re.compile(r"^[xyn]([UVR])(?:(abs)?([UVR]))?$")


@dataclass(frozen=True)
class Fitted:
    """values    term, such as "yVabsU", → coefficient, SI
    explained  of X, Y and N: share of the hull's force over the training data
    mass       kg; x_g m ahead of midship
    added      m_x, m_y [kg] and J [kg m²]
    inertia    I about the centre of gravity [kg m²]
    """

    values: Mapping[str, float]
    explained: tuple[float, float, float]
    mass: float
    x_g: float
    added: tuple[float, float, float]
    inertia: float


def fit(job: Job, terms: Sequence[str], coriolis: bool = False) -> Fitted:
    """`coriolis`: whether the forces that added masses make of turning are in the terms, too:
    X = m_y v r, Y = -m_x u r. Raises ModelError for a run that has no hull of an MMG."""
    model, theta = physics(job)
    g, p = model.geometry, named(model.names, theta)
    m_x, m_y, yaw = (float(one) for one in body.masses(p, g))
    w = velocities(job)
    force = np.array(hull.hull(p, g, w[:, 0], w[:, 1], w[:, 2]))
    if coriolis:
        force[:, 0] += m_y * w[:, 1] * w[:, 2]
        force[:, 1] -= m_x * w[:, 0] * w[:, 2]
    values: dict[str, float] = {}
    explained = []
    for i, letter in enumerate("xyn"):
        mine = [t for t in terms if t.startswith(letter)]
        phi = np.stack([term(t, w) for t in mine], 1)
        c = _solved(mine, phi, force[:, i])
        values |= dict(zip(mine, c.tolist(), strict=True))
        left = np.sum((phi @ c - force[:, i]) ** 2) / np.sum(force[:, i] ** 2)
        explained.append(float(1.0 - left))
    radius = YAW_RADIUS * g.length
    inertia = min(g.mass * radius**2, yaw)
    added = m_x, m_y, yaw - inertia
    x, y, n = explained
    return Fitted(values, (x, y, n), g.mass, g.x_g, added, inertia)


def _solved(names: Sequence[str], phi: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Least squares in which what resists its own motion alone takes energy out of it."""
    from scipy.optimize import lsq_linear

    size = np.maximum(np.linalg.norm(phi, axis=0), 1e-300)
    own = np.array([name in DAMPING for name in names])
    bounds = np.full(len(names), -np.inf), np.where(own, 0.0, np.inf)
    return lsq_linear(phi / size, force, bounds, tol=1e-12).x / size


def term(name: str, w: np.ndarray) -> np.ndarray:
    """φ [n] of velocities [n, 3]: xU is u, xUabsU u |u|, xVR v r."""
    found = TERM.match(name)
    assert found is not None, name
    one = w[:, AXES[found[1]]]
    if found[3] is None:
        return one
    other = w[:, AXES[found[3]]]
    return one * (np.abs(other) if found[2] else other)


def physics(job: Job) -> tuple[MMG, np.ndarray]:
    run = job.run
    if run.kind.family is not PHYSICS:
        raise ModelError(
            f"{run.name} is a network: it has accelerations, and no force of the hull.",
            hint="export a physical model, or --to fmu the network.",
        )
    own = run.simulator(run.config.seeds[0])
    model = getattr(own.model, "physics", own.model)
    if not isinstance(model, MMG):
        raise ModelError(
            f"{run.name} has other equations than the MMG's: its hull is not known by itself.",
            hint="--to fmu, cpp, python and mss have its equations.",
        )
    theta = own.theta if run.extension is None else np.asarray(run.extension.coefficients)
    return model, theta[: len(model.names)]


def velocities(job: Job) -> np.ndarray:
    """[n, 3] of the training data, and the same turned to the other side: a hull is symmetric."""
    columns = ("surge", "sway", "yaw_rate")
    assert len(columns) == len(VELOCITY_IN_STATE)
    w = job.sailor.training.select(columns).to_numpy()
    return np.concatenate((w, w * np.array([1.0, -1.0, -1.0])))


def losses(job: Job, more: Sequence[str] = ()) -> tuple[str, ...]:
    held = job.run.extension
    found = ["Propellers, rudders, thrusters and wind: the plugin is the hull's alone.", *more]
    if job.run.kind.residual:
        found.append("Its residual network.")
    if held is not None:
        found.append(f"Its causes: {', '.join(c.label for c in held.causes)}.")
    return tuple(found)


def percent(fitted: Fitted) -> str:
    """How much of each force the terms explain."""
    names = ("surge force", "sway force", "yaw moment")
    parts = [
        f"{100.0 * (1.0 - share):.2g} % of the {name}"
        for name, share in zip(names, fitted.explained, strict=True)
    ]
    return f"all but {', '.join(parts)}"
