"""In the child: a Python function `f(state, inputs, t)`.

state    [6]  x₀, u, y₀, v, ψ, r at midship: m, m/s, rad, rad/s
inputs   [A]  actuators in the profile's order, rad, rev/s or 1; then, where the ship has an
              anemometer, apparent wind speed [m/s] and angle [rad]
t        s    into the voyage
returns  [6]  ẋ, or the next state, a STEP later; or [3] ν̇ alone

Its file may state `STEP`, in s, of one that returns the next state. Whether it takes many rows at a
time, as rows [n, 6] or as columns [6, n], and whether it wants arrays of numpy, torch or JAX, is
found out by calling it: what it gives of many rows has to be what it gives of each.
"""

from __future__ import annotations

import contextlib
import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.foreign.confinement import CALL_S, TooLong, time_limit
from shiplog.foreign.rows import PLACE, STATES, VELOCITIES, Trouble, apparent

FUNCTION = "f"
SAME = 1e-6  # relative difference of one row alone and among others: single precision
ROWS, COLUMNS, SINGLE = "rows", "columns", "row by row"
FAR = 1e4  # m: a next state is still there, a derivative is not
MOST_TROUBLES = 50  # that are kept of one request: the first ones say it


class Refused(Exception):
    """A simulator that cannot be used at all, in a sentence."""


class PythonFunction:
    """The function, and how it wants to be called.

    returns   "derivative", "acceleration" or "next state"
    step      s to the next state
    layout    ROWS, COLUMNS or SINGLE
    library   of the arrays that it takes
    """

    def __init__(self, path: Path, function: str, actuators: int, wind: bool) -> None:
        self.name, self.wind, self.actuators = path.name, wind, actuators
        module = _loaded(path)
        found = getattr(module, function or FUNCTION, None)
        if not callable(found):
            raise Refused(
                f"it has no function {function or FUNCTION!r}; write f(state, inputs, t), or name "
                "another one as FILE.py:NAME"
            )
        self.function: Callable[..., Any] = found
        self.step = float(getattr(module, "STEP", 0.0))
        self.library, self.layout, self.returns = "numpy", SINGLE, ""
        self.changes = False  # its arguments
        self.gave_jax = False

    # --- one call ---

    def _given(self, values: np.ndarray) -> Any:
        if self.library == "torch":
            return sys.modules["torch"].from_numpy(values.copy())
        if self.library == "jax":
            import jax.numpy as jnp

            return jnp.asarray(values)
        return values.copy()

    def _call(self, state: np.ndarray, inputs: np.ndarray, time: Any) -> np.ndarray:
        one, other = self._given(state), self._given(inputs)
        with time_limit(CALL_S):
            found = self.function(one, other, time)
        if self.library != "jax" and not (_same(one, state) and _same(other, inputs)):
            self.changes = True
        self.gave_jax = type(found).__module__.startswith("jax")
        return _array(found)

    def _inputs(self, rows: np.ndarray) -> np.ndarray:
        acts = rows[:, STATES:-3]
        return np.concatenate((acts, apparent(rows)), 1) if self.wind else acts

    def _many(self, rows: np.ndarray) -> np.ndarray:
        """What it returns of rows at once, [n, 6 or 3]."""
        state, inputs, time = rows[:, :STATES], self._inputs(rows), rows[:, -1]
        if self.layout == COLUMNS:
            return self._call(state.T, inputs.T, time).T
        return self._call(state, inputs, time)

    def _single(self, rows: np.ndarray) -> tuple[np.ndarray, list[Trouble]]:
        inputs, found = self._inputs(rows), np.full((len(rows), self.width), np.nan)
        troubles: list[Trouble] = []
        for i, row in enumerate(rows):
            if not np.isfinite(row).all():
                continue  # diverged before
            try:
                values = self._call(row[:STATES], inputs[i], float(row[-1]))
                if values.shape != (self.width,):
                    raise ValueError(f"it returned an array of shape {values.shape}")
                found[i] = values
            except Exception as error:
                _note(troubles, i, row, _said(error))
        return found, troubles

    def returned(self, rows: np.ndarray) -> tuple[np.ndarray, list[Trouble]]:
        """What it returns of each row [n, 6 or 3], not a number where it raised."""
        if self.layout == SINGLE:
            found, troubles = self._single(rows)
        else:
            try:
                with np.errstate(all="ignore"):
                    found, troubles = np.array(self._many(rows), dtype=float), []
                if found.shape != (len(rows), self.width):
                    raise ValueError(f"it returned an array of shape {found.shape}")
            except Exception:  # of a user's function, anything: each row is then asked by itself
                many, self.layout = self.layout, SINGLE
                try:
                    found, troubles = self._alone(rows, many)
                finally:
                    self.layout = many
        known = {one.row for one in troubles}
        bad = ~np.isfinite(found).all(1) & np.isfinite(rows).all(1)
        for i in np.flatnonzero(bad):
            if int(i) not in known:
                _note(troubles, int(i), rows[i], "gave what is no finite number")
        found[bad] = np.nan
        return found, troubles

    def _alone(self, rows: np.ndarray, layout: str) -> tuple[np.ndarray, list[Trouble]]:
        """Row by row, in the layout of many."""
        found, troubles = np.full((len(rows), self.width), np.nan), []
        self.layout = layout
        for i in range(len(rows)):
            if not np.isfinite(rows[i]).all():
                continue
            try:
                found[i] = self._many(rows[i : i + 1])[0]
            except Exception as error:
                _note(troubles, i, rows[i], _said(error))
        return found, troubles

    @property
    def width(self) -> int:
        return 3 if self.returns == "acceleration" else STATES

    # --- what the bridge asks ---

    def rates(self, rows: np.ndarray) -> tuple[np.ndarray, list[Trouble]]:
        """ν̇ [n, 3]; of one that returns the next state, (ν' - ν)/h."""
        found, troubles = self.returned(rows)
        if self.returns == "acceleration":
            return found, troubles
        velocities = found[:, VELOCITIES]
        if self.returns == "derivative":
            return velocities, troubles
        return (velocities - rows[:, VELOCITIES]) / self.step, troubles

    def probe(self, rows: np.ndarray) -> None:
        """Find out how it wants to be called, at some rows of the ship's. Raises Refused."""
        self.library, first = self._library(rows[0])
        if first.shape == (3,):
            self.returns = "acceleration"
        elif first.shape == (STATES,):
            self.returns = self._returns(rows)
        else:
            raise Refused(
                f"f(state, inputs, t) returns an array of shape {first.shape}; expected the "
                "derivative [6], the next state [6] or the acceleration [3]"
            )
        if self.returns == "next state" and not self.step > 0.0:
            raise Refused(
                "it returns the next state and does not say how much later; write STEP = 0.1, in "
                "s, into its file"
            )
        alone, _ = self._single(rows)
        sound = np.isfinite(alone).all(1)
        for layout in (ROWS, COLUMNS):
            self.layout = layout
            with contextlib.suppress(Exception), np.errstate(all="ignore"):
                many = np.asarray(self._many(rows[sound]), dtype=float)
                if many.shape == alone[sound].shape and _close(many, alone[sound]):
                    return
        self.layout = SINGLE

    def exact(self, rows: np.ndarray) -> np.ndarray | None:
        """∂ν̇/∂(x, u, ω) [n, 3, 6 + A + 2] of one that JAX can differentiate; None of others."""
        if self.library != "jax":
            return None
        import jax
        import jax.numpy as jnp

        def one(row: Any) -> Any:
            state, inputs = row[:STATES], row[STATES:-3]
            if self.wind:
                c, s = jnp.cos(state[4]), jnp.sin(state[4])
                ahead = c * row[-3] + s * row[-2] + state[1]
                starboard = c * row[-2] - s * row[-3] + state[3]
                blowing = jnp.stack((jnp.hypot(ahead, starboard), jnp.arctan2(starboard, ahead)))
                inputs = jnp.concatenate((inputs, blowing))
            found = jnp.stack(jnp.asarray(self.function(state, inputs, row[-1])))
            if self.returns == "acceleration":
                return found
            velocities = found[jnp.array(VELOCITIES)]
            if self.returns == "derivative":
                return velocities
            return (velocities - state[jnp.array(VELOCITIES)]) / self.step

        try:
            with time_limit(10.0 * CALL_S):
                return np.asarray(jax.jit(jax.vmap(jax.jacfwd(one)))(rows))[..., :-1]
        except Exception:  # of a user's function, anything: then it has no derivatives of JAX's
            return None

    def _library(self, row: np.ndarray) -> tuple[str, np.ndarray]:
        """Of which arrays it takes, and what it gives."""
        tried: list[BaseException] = []
        for library in ("numpy", "torch", "jax"):
            if library != "numpy" and library not in sys.modules:
                continue
            self.library = library
            try:
                inputs = self._inputs(row[None])[0]
                found = self._call(row[:STATES], inputs, float(row[-1]))
                return "jax" if self.gave_jax else library, found
            except Exception as error:
                tried.append(error)
        raise Refused(f"f(state, inputs, t) {_said(tried[0])}")

    def _returns(self, rows: np.ndarray) -> str:
        """A next state is where the ship is; a derivative knows no place."""
        there = rows[0].copy()
        there[list(PLACE)] = FAR
        found = self._call(there[:STATES], self._inputs(there[None])[0], float(there[-1]))
        near = np.abs(found[list(PLACE)] - FAR) < 0.5 * FAR
        return "next state" if near.all() else "derivative"


def _loaded(path: Path) -> Any:
    """Its module, with its own folder to import from. Raises Refused."""
    spec = importlib.util.spec_from_file_location("given_simulator", path)
    if spec is None or spec.loader is None:
        raise Refused("it is no file of Python")
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent))
    sys.modules["given_simulator"] = module
    try:
        with time_limit(10.0 * CALL_S):
            spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise Refused(f"it cannot be imported: {_said(error)}") from error
    return module


def _array(found: Any) -> np.ndarray:
    if hasattr(found, "detach"):
        found = found.detach().cpu().numpy()
    if isinstance(found, list | tuple):
        found = np.stack([_array(one) for one in found])
    return np.asarray(found, dtype=float)


def _same(one: Any, before: np.ndarray) -> bool:
    return bool(np.array_equal(np.asarray(one), before, equal_nan=True))


def _close(one: np.ndarray, other: np.ndarray) -> bool:
    scale = np.abs(other).max(0, initial=0.0) + 1e-12
    return bool((np.abs(one - other) <= SAME * scale).all())


def _said(error: BaseException) -> str:
    if isinstance(error, TooLong):
        return f"took longer than {CALL_S:g} s"
    words = str(error).strip().splitlines()
    return f"raised {type(error).__name__}" + (f": {words[0][:200]}" if words else "")


def _note(troubles: list[Trouble], row: int, values: np.ndarray, words: str) -> None:
    if len(troubles) < MOST_TROUBLES:
        troubles.append(Trouble(row, float(values[-1]), words))
