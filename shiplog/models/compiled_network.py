"""The paper's network compiled together with the physics, with what a diagnosis may bend it by.

ν̇ = f_NN(ν, u, ω) + Σ w_k φ_k(ν, u, ω): smooth functions of the network's own inputs, random
Fourier features (Rahimi & Recht 2007), stand for all that another training could have learned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from shiplog.machine import trees
from shiplog.machine.arrays import Array, jnp
from shiplog.models.azimuths import within_a_turn
from shiplog.models.mmg.wind import apparent

if TYPE_CHECKING:
    from shiplog.models.feedforward import FeedForward

FEATURES = 300
KERNEL_WIDTH = 2.0  # no voyage covers all combinations of many inputs: data of few serve best so


@trees.tree(
    data=["weights", "mean", "std", "out_mean", "out_std", "frequency", "phase", "bent"],
    fixed=["wind", "components", "input_tanh", "turning"],
)
@dataclass(frozen=True)
class Network:
    """It has no coefficients: θ is empty.

    weights     (W₁, b₁, W₂, b₂, ...), each W [out, in], in the precision it was trained in
    frequency   [inputs, F] and phase [F] of φ on the standardised inputs
    bent        [F, 3] weights w of φ in m/s² and rad/s²; None for the network as it was trained
    turning     columns of the actuators that are azimuths
    """

    weights: tuple
    mean: np.ndarray | Array
    std: np.ndarray | Array
    out_mean: np.ndarray | Array
    out_std: np.ndarray | Array
    frequency: np.ndarray | Array
    phase: np.ndarray | Array
    wind: bool
    components: bool
    input_tanh: bool
    bent: np.ndarray | Array | None = None
    turning: tuple[int, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return ()

    def bend(self, weights: np.ndarray) -> Network:
        """With weights [F, 3] more; zeros change nothing. Raises ValueError for those of other
        features."""
        if not np.any(weights):
            return self
        if weights.shape != (len(self.phase), 3):
            raise ValueError(f"weights {weights.shape} are not of {len(self.phase)} features")
        return replace(self, bent=weights if self.bent is None else self.bent + weights)

    @property
    def substeps(self) -> int:
        return 1

    @property
    def smooth(self) -> float:
        return 1.0  # it was trained to steps of a second

    def acceleration(self, theta: Array, state: Array, actuator: Array, true_wind: Array) -> Array:
        """ν̇ [..., 3]; arguments as for MMG.acceleration."""
        plain = self._inputs(state, actuator, true_wind, self.components)
        z = (plain - self.mean) / self.std
        hidden = jnp.tanh(z) if self.input_tanh else z
        pairs = list(zip(self.weights[::2], self.weights[1::2], strict=True))
        hidden = hidden.astype(pairs[0][0].dtype)
        for w, b in pairs[:-1]:
            hidden = jnp.tanh(hidden @ w.T + b)
        w, b = pairs[-1]
        output = (hidden @ w.T + b) * self.out_std + self.out_mean
        if self.bent is None:
            return output
        return output + self.features(state, actuator, true_wind) @ self.bent

    def features(self, state: Array, actuator: Array, true_wind: Array) -> Array:
        """φ [..., F], of unit size together; of the wind's components always: an angle jumps."""
        smooth = self._inputs(state, actuator, true_wind, True)
        z = (smooth - self.smooth_mean) / self.smooth_std
        return math.sqrt(2.0 / len(self.phase)) * jnp.cos(z @ self.frequency + self.phase)

    def _inputs(self, state, actuator, true_wind, components: bool) -> Array:
        u, v, heading, r = state[..., 1], state[..., 3], state[..., 4], state[..., 5]
        parts = [u[..., None], v[..., None], r[..., None], within_a_turn(actuator, self.turning)]
        if self.wind:
            ahead, starboard = apparent(true_wind, heading, u, v)
            if components:
                parts += [ahead[..., None], starboard[..., None]]
            else:
                speed = jnp.sqrt(ahead**2 + starboard**2 + 1e-12)
                angle = jnp.mod(jnp.arctan2(starboard, ahead), 2.0 * math.pi)
                parts += [speed[..., None], angle[..., None]]
        return jnp.concatenate(parts, -1)

    @property
    def smooth_mean(self) -> Array | np.ndarray:
        return self.mean if self.components or not self.wind else self._apart(self.mean, 0.0)

    @property
    def smooth_std(self) -> Array | np.ndarray:
        if self.components or not self.wind:
            return self.std
        # components are about as wide as the mean speed
        return self._apart(self.std, jnp.hypot(self.mean[-2], self.std[-2]))

    def _apart(self, values, wind):
        return jnp.concatenate((values[:-2], jnp.full(2, wind)))


def compiled(model: FeedForward, turning: tuple[int, ...] = (), seed: int = 0) -> Network:
    """A trained network; `turning` are the columns of the actuators that are azimuths."""
    shape, scale = model.shape, model.scaling
    rng = np.random.default_rng([seed, 77])
    inputs = shape.inputs
    width = KERNEL_WIDTH * math.sqrt(0.5 * inputs)
    return Network(
        weights=tuple(w.detach().numpy() for w in model.weights),
        mean=scale.input_mean.double().numpy(),
        std=scale.input_std.double().numpy(),
        out_mean=scale.output_mean.double().numpy(),
        out_std=scale.output_std.double().numpy(),
        frequency=rng.standard_normal((inputs, FEATURES)) / width,
        phase=rng.uniform(0.0, 2.0 * math.pi, FEATURES),
        wind=shape.wind,
        components=shape.wind_input == "components",
        input_tanh=shape.input_tanh,
        turning=turning,
    )
