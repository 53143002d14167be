"""What rollouts of physical models take and give: equations, arrays of windows, sums of squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from shiplog.nomenclature.channels import VELOCITY_IN_STATE
from shiplog.nomenclature.frames import in_body_axes, in_earth_axes
from shiplog.simulation.scoring import trapezoid
from shiplog.voyages.windows.windows import Windows

if TYPE_CHECKING:
    from jax import Array

VELOCITY_COLUMNS = np.array(VELOCITY_IN_STATE)


class Physical(Protocol):
    """Equations of motion that can be compiled, their numbers in a vector of their own. Those that
    a run is made of also have `fixed`, arrays to keep with the numbers, and `forces` by part.

    A JAX pytree: `jax.tree_util.register_static` for what is hashable and is compiled anew for
    every ship.
    """

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def substeps(self) -> int:
        """Euler steps within each measured one."""
        ...

    @property
    def smooth(self) -> float:
        """s between which its derivatives change little."""
        ...

    def acceleration(
        self, theta: Array, state: Array, actuator: Array, true_wind: Array
    ) -> Array: ...


class WindowSeries(NamedTuple):
    """What drives N rollouts, and what was measured. The wind is the true one.

    A simulation of a ship that moves otherwise than the measured one feels another apparent
    wind, so the measured apparent wind and motion are turned into the wind over ground first.

    measured   [N, I, 6]  channels.STATE; its first row is where a rollout begins
    actuator   [N, I, A]  held over each step
    wind       [N, I, 2]  where it comes from, along x₀ and y₀ [m/s]; zero without a sensor
    dt         [N, I - 1]
    weight     [N]        of each window in sums; 0 leaves it out
    """

    measured: np.ndarray
    actuator: np.ndarray
    wind: np.ndarray
    dt: np.ndarray
    weight: np.ndarray

    @property
    def steps(self) -> np.ndarray:
        """Trapezoidal weights of the samples [N, I] in s, as in Eq. 8."""
        return trapezoid(self.dt)


@dataclass(frozen=True)
class Normal:
    """Least squares of the rollout error around one θ, summed over windows.

    loss   [N]     L of each window (Eq. 8)
    pull   [N, P]  half its gradient
    gram   [P, P]  weighted sum of JᵀJ
    """

    loss: np.ndarray
    pull: np.ndarray
    gram: np.ndarray


def series(windows: Windows) -> WindowSeries:
    """Windows as physical models take them."""
    measured, wind = windows.state, windows.wind
    return WindowSeries(
        measured,
        windows.actuator,
        true_wind(measured, wind) if wind.shape[-1] else np.zeros((*measured.shape[:2], 2)),
        windows.dt,
        np.ones(len(measured)),
    )


def true_wind(state: np.ndarray, wind: np.ndarray) -> np.ndarray:
    """The wind over ground [..., 2], where it comes FROM along x₀ and y₀, of the apparent one.

    state   [..., 6]  channels.STATE
    wind    [..., 2]  apparent wind speed [m/s] and angle [rad]
    """
    ahead = wind[..., 0] * np.cos(wind[..., 1]) - state[..., 1]
    starboard = wind[..., 0] * np.sin(wind[..., 1]) - state[..., 3]
    c, s = np.cos(state[..., 4]), np.sin(state[..., 4])
    return np.stack(in_earth_axes(ahead, starboard, c, s), -1)


def apparent_wind(state: np.ndarray, true: np.ndarray) -> np.ndarray:
    """The inverse of `true_wind`: speed and angle in (-π, π] [..., 2]."""
    c, s = np.cos(state[..., 4]), np.sin(state[..., 4])
    ahead, starboard = in_body_axes(true[..., 0], true[..., 1], c, s)
    ahead, starboard = ahead + state[..., 1], starboard + state[..., 3]
    return np.stack((np.hypot(ahead, starboard), np.arctan2(starboard, ahead)), -1)


def pick(data: WindowSeries, rows: Sequence[int] | np.ndarray | slice) -> WindowSeries:
    """Some of the windows."""
    return WindowSeries(*(values[rows] for values in data))
