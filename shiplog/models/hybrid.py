"""Physics plus a small residual network: bounded, and silent where its training data never were.

ν̇ = f_MMG + fade(z) · b tanh(W₂ tanh(W₁ z + c₁) + c₂), with z the standardised (ν, u, ω)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from shiplog.machine import trees
from shiplog.machine.arrays import Array, jnp
from shiplog.models import mmg
from shiplog.models.azimuths import within_a_turn
from shiplog.models.mmg import body
from shiplog.models.mmg.model import MMG
from shiplog.models.mmg.wind import apparent
from shiplog.models.physical import PhysicalModel, Settings
from shiplog.ship_profile.profile import Profile

ANCHORS = 200  # training samples that stand for all of them in the distance
FADE_LIMITS = 2.0  # limits of the coverage figure beyond the training data, where nothing is left


@trees.tree(
    data=["mean", "std", "bound", "anchors", "radius", "limit"],
    fixed=["width"],
)
@dataclass(frozen=True)
class Residual:
    """What is fixed of a residual network.

    mean, std  [Z]     of z = (ν, u, U_A cos γ_A, U_A sin γ_A) over the training seconds
    bound      [3]     the most it can add to ν̇ [m/s², m/s², rad/s²]
    anchors    [K, Z]  standardised training samples, no other farther than `radius` from one
    limit      distance that all but 5 % of the training seconds have from independent others
    """

    width: int
    mean: np.ndarray | Array
    std: np.ndarray | Array
    bound: np.ndarray | Array
    anchors: np.ndarray | Array
    radius: float | np.ndarray
    limit: float | np.ndarray

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Weights in the order of the parameter vector."""
        inputs = len(self.mean)
        return {
            "w1": (self.width, inputs),
            "c1": (self.width,),
            "w2": (3, self.width),
            "c2": (3,),
        }

    @property
    def fixed(self) -> dict[str, np.ndarray]:
        """All but the width."""
        names = ("mean", "std", "bound", "anchors", "radius", "limit")
        return {name: np.asarray(getattr(self, name)) for name in names}

    @property
    def count(self) -> int:
        return sum(int(np.prod(shape)) for shape in self.shapes.values())


@trees.tree(data=["physics", "residual"])
@dataclass(frozen=True)
class Hybrid:
    """The MMG and a residual network in one rollout; θ is the MMG's, then the weights."""

    physics: MMG
    residual: Residual

    @property
    def substeps(self) -> int:
        return self.physics.substeps

    @property
    def smooth(self) -> float:
        return self.physics.smooth

    @property
    def names(self) -> tuple[str, ...]:
        weights = [
            f"network.{name}_{i}"
            for name, shape in self.residual.shapes.items()
            for i in range(int(np.prod(shape)))
        ]
        return (*self.physics.names, *weights)

    @property
    def fixed(self) -> dict[str, np.ndarray]:
        """Arrays that are no coefficients and belong to a run of it: the network's."""
        return {f"residual.{name}": value for name, value in self.residual.fixed.items()}

    def features(self, state: Array, actuator: Array, true_wind: Array) -> Array:
        """z [..., Z], standardised."""
        u, v, heading, r = state[..., 1], state[..., 3], state[..., 4], state[..., 5]
        turned_by = {unit.turned_by for unit in self.physics.geometry.thrusters}
        actuator = within_a_turn(actuator, sorted(i for i in turned_by if i is not None))
        parts = [u[..., None], v[..., None], r[..., None], actuator]
        if self.physics.geometry.wind:
            wind = apparent(true_wind, heading, u, v)
            parts += [wind[0][..., None], wind[1][..., None]]
        z = jnp.concatenate(parts, axis=-1)
        return (z - self.residual.mean) / self.residual.std

    def fade(self, z: Array) -> Array:
        """1 within the training data, 0 from FADE_LIMITS limits beyond them on; smooth between."""
        net = self.residual
        square = ((z[..., None, :] - net.anchors) ** 2).sum(-1).min(-1)
        beyond = jnp.sqrt(jnp.maximum(square, 1e-12)) - net.radius
        share = jnp.clip(1.0 - beyond / (FADE_LIMITS * net.limit), 0.0, 1.0)
        return share * share * (3.0 - 2.0 * share)

    def network(self, theta: Array, z: Array) -> Array:
        """What the network adds to ν̇ [..., 3] where it is not faded."""
        at, parts = len(self.physics.names), {}
        for name, shape in self.residual.shapes.items():
            size = int(np.prod(shape))
            parts[name] = theta[at : at + size].reshape(shape)
            at += size
        hidden = jnp.tanh(z @ parts["w1"].T + parts["c1"])
        return jnp.asarray(self.residual.bound) * jnp.tanh(hidden @ parts["w2"].T + parts["c2"])

    def added(self, theta: Array, state: Array, actuator: Array, true_wind: Array) -> Array:
        """What the network adds to ν̇ [..., 3], faded."""
        z = self.features(state, actuator, true_wind)
        return self.fade(z)[..., None] * self.network(theta, z)

    def acceleration(self, theta: Array, state: Array, actuator: Array, true_wind: Array) -> Array:
        """ν̇ [..., 3]; arguments as for MMG.acceleration."""
        count = len(self.physics.names)
        physics = self.physics.acceleration(theta[:count], state, actuator, true_wind)
        return physics + self.added(theta, state, actuator, true_wind)

    def forces(
        self, theta: Array, state: Array, actuator: Array, true_wind: Array
    ) -> dict[str, Array]:
        """As MMG.forces. What the network adds is its acceleration times the mass with added
        mass."""
        count = len(self.physics.names)
        parts = dict(self.physics.forces(theta[:count], state, actuator, true_wind))
        p = dict(zip(self.physics.names, theta[:count], strict=True))
        added = self.added(theta, state, actuator, true_wind)
        return parts | {"network": body.forces_of(p, self.physics.geometry, added)}


def opened(profile: Profile, settings: Settings, arrays: Mapping[str, np.ndarray]) -> Hybrid:
    """The equations of a run, with the network's scaling and anchors among its arrays. Raises
    ProfileError, and TypeError where arrays are missing."""
    prefix = "residual."
    fixed = {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}
    physics = mmg.opened(profile, settings, arrays)
    return Hybrid(physics, Residual(width=settings.width, **fixed))  # type: ignore[arg-type]


# Its physics are identified first, as an MMG; the network is fitted on top of them.
MODEL = PhysicalModel(mmg.begin, opened)


def first_weights(residual: Residual, rng: np.random.Generator) -> np.ndarray:
    """Hidden weights drawn N(0, 1/√inputs), the output layer zero: it begins as pure physics."""
    shapes = residual.shapes
    hidden = rng.normal(size=shapes["w1"]) / np.sqrt(len(residual.mean))
    zero = [np.zeros(shapes[name]).ravel() for name in ("w2", "c2")]
    bias = rng.normal(size=shapes["c1"])
    return np.concatenate([hidden.ravel(), bias, *zero])


def weight_spread(residual: Residual, strength: float) -> np.ndarray:
    """Plausible size of each weight's move: the output layer's times `strength`."""
    shapes = residual.shapes
    inputs = len(residual.mean)
    return np.concatenate(
        [
            np.full(int(np.prod(shapes["w1"])), 1.0 / np.sqrt(inputs)),
            np.ones(shapes["c1"]),
            np.full(int(np.prod(shapes["w2"])), strength / np.sqrt(residual.width)),
            np.full(shapes["c2"], strength),
        ]
    )


def anchored(samples: np.ndarray, most: int = ANCHORS) -> tuple[np.ndarray, float]:
    """Some of the samples [n, Z] that cover all of them, and the radius that needs.

    Farthest-point sampling (Gonzalez 1985): within twice of the best possible radius.
    """
    chosen = [int(np.argmin(((samples - samples.mean(0)) ** 2).sum(1)))]
    distance = np.linalg.norm(samples - samples[chosen[0]], axis=1)
    while len(chosen) < min(most, len(samples)) and distance.max() > 0.0:
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(samples - samples[chosen[-1]], axis=1))
    return samples[chosen], float(distance.max())
