"""A user's Python function as the file that was written calls it, while the function itself stays
in its child process: what comes back is made of the accelerations that the child gives.

Of the apparent wind (U_A, γ_A) the child wants the wind over ground, W = R(ψ) (a - u, s - v) with
(a, s) = U_A (cos γ_A, sin γ_A): the inverse of what `foreign.rows` makes of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from shiplog.export.given_simulator import asked
from shiplog.export.job import Job
from shiplog.foreign.rows import STATES, VELOCITIES, rate, stacked
from shiplog.nomenclature.frames import in_earth_axes

Called = Callable[[np.ndarray, np.ndarray, Any], np.ndarray]


def of_job(job: Job) -> Called:
    """f(state, inputs, t) of the job's simulator, in its own layout and with what it returns."""
    how, run = job.ship.function, asked(job.run)
    assert how is not None and run is not None
    model = run.simulator(run.config.seeds[0]).model

    def accelerations(state: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        wind = np.zeros((len(state), 2))
        if how.wind:
            inputs, (speed, angle) = inputs[:, :-2], inputs[:, -2:].T
            ahead, starboard = speed * np.cos(angle) - state[:, 1], speed * np.sin(angle)
            turn = np.cos(state[:, 4]), np.sin(state[:, 4])
            wind = np.stack(in_earth_axes(ahead, starboard - state[:, 3], *turn), -1)
        return model.accelerations(state, np.concatenate((inputs, wind), 1))

    def returned(state: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        found = accelerations(state, inputs)
        if how.returns == "acceleration":
            return found
        whole = rate(stacked(state, np.zeros((len(state), 2)), 0.0), found)
        if how.returns == "derivative":
            return whole
        later = state + how.step * whole
        later[:, VELOCITIES] = state[:, VELOCITIES] + how.step * found
        return later

    def f(state: np.ndarray, inputs: np.ndarray, t: Any) -> np.ndarray:
        if how.layout == "rows":
            return returned(state, inputs)
        if how.layout == "columns":
            return returned(state.T, inputs.T).T
        assert state.shape == (STATES,)
        return returned(state[None], inputs[None])[0]

    return f
