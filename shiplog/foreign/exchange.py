"""In the child: an FMU for model exchange, of FMI 2.0. It gives ẋ of its own continuous states z,

    ż = F(z, w),   z (the ship's and others), w its inputs

so an acceleration takes no step, and its derivatives may be the FMU's own: with the directional
derivatives of fmi2GetDirectionalDerivative and the columns of a row p = (x, u, ω),

    ∂ν̇/∂p = F_z ∂z/∂p + F_w ∂w/∂p

A window is integrated here, by Heun's rule (`integrate`), with all of its states.
"""

from __future__ import annotations

import contextlib
import ctypes
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.foreign.callables import Refused
from shiplog.foreign.fmu import CHANNELS, Fmu, Stopped
from shiplog.foreign.integrate import SUBSTEPS
from shiplog.foreign.progress import NOW
from shiplog.foreign.rows import VELOCITIES, Trouble

STEP = 1e-6  # of differences of the mapping's own units and of the apparent wind, which are exact
MOST_EVENTS = 100  # iterations at a start, beyond which an FMU never settles


class ExchangeFmu(Fmu):
    """As `Fmu`, asked for its derivatives."""

    def __init__(self, path: Path, mapping: Mapping[str, Any]) -> None:
        super().__init__(path, mapping)
        states = [one.variable.derivative for one in self.model_description.derivatives]
        names = [one.name for one in states]
        self.derivatives = [
            one.variable.valueReference for one in self.model_description.derivatives
        ]
        self.references = [one.valueReference for one in states]
        self.count = len(states)
        outputs = {c: mapping["state"][c]["output"] for c in self.given}
        lacking = [f"{c} ({name})" for c, name in outputs.items() if name not in names]
        if lacking:
            raise Refused(
                f"of an FMU for model exchange, {', '.join(lacking)} has to be a continuous state"
            )
        self.places = [names.index(outputs[c]) for c in self.given]
        self.columns = [CHANNELS.index(c) for c in self.given]
        moving = [CHANNELS[i] for i in VELOCITIES]
        self.moving = [names.index(outputs[c]) for c in moving]
        self.z, self.f = ((ctypes.c_double * self.count)() for _ in range(2))
        self.provides = bool(self.model_description.modelExchange.providesDirectionalDerivative)
        self.first: np.ndarray | None = None

    # --- what the bridge asks ---

    def probe(self, rows: np.ndarray) -> dict[str, Any]:
        facts = super().probe(rows)
        exact = self.exact(rows[:2])
        return facts | {"returns": "derivative", "differentiated": exact is not None}

    def rates(self, rows: np.ndarray) -> tuple[np.ndarray, list[Trouble]]:
        found, troubles = np.full((len(rows), 3), np.nan), []
        z, w = self._states_of(rows), self._values(rows)
        for i in np.flatnonzero(np.isfinite(rows).all(1)):
            try:
                found[i] = self._derivatives(z[i], w[i])[self.moving]
                if not np.isfinite(found[i]).all():
                    raise Stopped("gave what is no finite number")
            except Stopped as error:
                self._note(troubles, int(i), rows[i, -1], error)
        return found * self.velocity_factors, troubles

    def exact(self, rows: np.ndarray) -> np.ndarray | None:
        """∂ν̇/∂(x, u, ω) [n, 3, D - 1] by directional derivatives; None of an FMU without."""
        if not self.provides:
            return None
        width = rows.shape[1] - 1
        z, w = self._states_of(rows), self._values(rows)
        z_by, w_by = self._by(rows, self._states_of), self._by(rows, self._values)
        found = np.zeros((len(rows), 3, width))
        known = [*self.references, *self.inputs.references]
        for i in np.flatnonzero(np.isfinite(rows).all(1)):
            try:
                self._derivatives(z[i], w[i])
                for column in range(width):
                    direction = np.concatenate((z_by[i, :, column], w_by[i, :, column]))
                    if direction.any():
                        found[i, :, column] = self._along(known, direction)
            except Stopped:
                return None
        return found * self.velocity_factors[:, None]

    def _turns(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """ψ̇ of its states, and r."""
        if "heading" not in self.given:
            return np.zeros(0), np.zeros(0)
        at = self.given.index("heading")
        z, w, found = self._states_of(rows), self._values(rows), []
        for i in range(len(rows)):
            with contextlib.suppress(Stopped):
                turned = self._derivatives(z[i], w[i])[self.places[at]] * self.output_factors[at]
                found.append((turned, rows[i, VELOCITIES[2]]))
        turned, yawed = np.array(found).reshape(-1, 2).T
        return turned, yawed

    def roll(
        self, start: np.ndarray, driven: np.ndarray, dt: np.ndarray, begin: np.ndarray
    ) -> tuple[np.ndarray, list[Trouble]]:
        states, troubles = np.full((*driven.shape[:2], 6), np.nan), []
        for n in range(len(start)):
            states[n, 0], clock = start[n], float(begin[n])
            try:
                row = np.concatenate((start[n], driven[n, 0], (clock,)))
                z = self._states_of(row[None])[0]
                for i in range(dt.shape[1]):
                    h = float(dt[n, i]) / SUBSTEPS
                    change = (driven[n, i + 1] - driven[n, i]) / SUBSTEPS
                    for k in range(SUBSTEPS):
                        NOW.at(clock)
                        now = driven[n, i] + k * change
                        first = self._driven(z, now, clock)
                        second = self._driven(z + h * first, now + change, clock + h)
                        z, clock = z + 0.5 * h * (first + second), clock + h
                        if not np.isfinite(z).all():
                            raise Stopped("gave what is no finite number")
                    states[n, i + 1] = self._ship(z, start[n])
            except Stopped as error:
                self._note(troubles, n, clock, error)
        return states, troubles

    # --- parts ---

    def _ship(self, z: np.ndarray, other: np.ndarray) -> np.ndarray:
        """The ship's state [6], SI."""
        found = other.copy()
        found[self.columns] = z[self.places] * self.output_factors
        return found

    def _states_of(self, rows: np.ndarray) -> np.ndarray:
        """z [n, Z]: the ship's of rows, the others as they are at a start."""
        if self.first is None:
            self._begin_at(rows[0])
            self.instance.dll.fmi2GetContinuousStates(self.component, self.z, self.count)
            self.first = np.array(self.z)
        found = np.tile(self.first, (len(rows), 1))
        found[:, self.places] = rows[:, self.columns] / self.output_factors
        return found

    def _driven(self, z: np.ndarray, driven: np.ndarray, clock: float) -> np.ndarray:
        """ż with what drives, and the apparent wind of the ship's own motion."""
        row = np.concatenate((self._ship(z, np.zeros(6)), driven, (clock,)))
        return self._derivatives(z, self._values(row[None])[0])

    def _derivatives(self, z: np.ndarray, w: np.ndarray) -> np.ndarray:
        """F(z, w) [Z]. Raises Stopped."""
        dll = self.instance.dll
        self.inputs.set(self, w)
        self.z[:] = z.tolist()
        if dll.fmi2SetContinuousStates(self.component, self.z, self.count) > 1:
            raise Stopped("refused its states")
        if dll.fmi2GetDerivatives(self.component, self.f, self.count) > 1:
            raise Stopped("refused to give its derivatives")
        return np.array(self.f)

    def _along(self, known: list[int], direction: np.ndarray) -> np.ndarray:
        """Directional derivative of ν̇ [3] at the state that was set last. Raises Stopped."""
        wanted = [self.derivatives[i] for i in self.moving]
        unknown = (ctypes.c_uint * 3)(*wanted)
        of, by = (ctypes.c_uint * len(known))(*known), (ctypes.c_double * len(known))(*direction)
        found = (ctypes.c_double * 3)()
        status = self.instance.dll.fmi2GetDirectionalDerivative(
            self.component, unknown, 3, of, len(known), by, found
        )
        if status > 1:
            raise Stopped("refused its directional derivative")
        return np.array(found)

    @staticmethod
    def _by(rows: np.ndarray, of: Any) -> np.ndarray:
        """Of a smooth function of rows, its derivatives by their columns but the time
        [n, m, D - 1]."""
        moved = []
        for column in range(rows.shape[1] - 1):
            up, down = rows.copy(), rows.copy()
            up[:, column] += STEP
            down[:, column] -= STEP
            moved.append((of(up) - of(down)) / (2.0 * STEP))
        return np.stack(moved, -1)

    def _kind(self) -> Any:
        from fmpy.fmi2 import FMU2Model

        return FMU2Model, self.model_description.modelExchange.modelIdentifier

    def _initialise(self) -> None:
        super()._initialise()
        for _ in range(MOST_EVENTS):
            more, ended, *_ = self.instance.newDiscreteStates()
            if ended:
                raise Stopped("ended at its start")
            if not more:
                break
        self.instance.enterContinuousTimeMode()
