"""In the child: an FMU for co-simulation, of FMI 2.0 or 3.0, by FMPy.

A window begins with a reset: start values are set, the FMU is initialised, and then it goes on in
communication steps, with what drives straight in between. An acceleration is asked for in the same
way, of two short steps h:

    ν̇ = (-3 ν(0) + 4 ν(h) - ν(2h)) / 2h + O(h²)

What it refuses, or gives as no number, ends the window there.
"""

from __future__ import annotations

import contextlib
import ctypes
import math
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.foreign.callables import MOST_TROUBLES, Refused
from shiplog.foreign.fmu_file import first_line, library
from shiplog.foreign.progress import NOW
from shiplog.foreign.rows import HEADING, STATES, VELOCITIES, Trouble, apparent
from shiplog.foreign.trying import checked
from shiplog.nomenclature.frames import wrap

SHORT = 0.02  # s, of an acceleration's steps; an FMU of a fixed inner step takes that one
STATUS = {1: "warning", 2: "discard", 3: "error", 4: "fatal", 5: "pending"}
CHANNELS = ("x0", "surge", "y0", "sway", "heading", "yaw_rate")
STILL = 1e-9  # m/s²: what rounding leaves of an acceleration that is zero
TURNS = 9  # rows at which its heading is compared with its yaw rate
TURNED = 0.2  # of the turn by which they may differ: steps of 0.1 s leave a hundredth
LEAST_TURN = 1e-3  # rad in a second, which is no turn: rounding, a filter, a display
CLOCK = 0.5  # of a step, by which an FMU's own time may differ


class Stopped(Exception):
    """The FMU did not go on, in words."""


class Fmu:
    """One instance, which is reset again and again."""

    def __init__(self, path: Path, mapping: Mapping[str, Any]) -> None:
        fmpy = library()
        self.folder = tempfile.mkdtemp(prefix="shiplog-fmu-")
        try:
            self.model_description = fmpy.read_model_description(str(path), validate=False)
            fmpy.extract(str(path), unzipdir=self.folder)
        except Exception as error:
            raise Refused(f"it cannot be opened: {first_line(error)}") from error
        self.step, self.hold = float(mapping["step"]), bool(mapping["hold"])
        inner = getattr(self.model_description.coSimulation, "fixedInternalStepSize", None)
        self.short = float(inner) if inner else min(SHORT, self.step)
        by_name = {v.name: v for v in self.model_description.modelVariables}
        self.names = list(mapping["actuators"])
        state = mapping["state"]
        self.given = [c for c in CHANNELS if c in state]
        self.outputs = _References([by_name[state[c]["output"]] for c in self.given])
        self.output_factors = np.array([state[c]["factor"] for c in self.given])
        moving = [CHANNELS[i] for i in VELOCITIES]
        self.velocities = _References([by_name[state[c]["output"]] for c in moving])
        self.velocity_factors = np.array([state[c]["factor"] for c in moving])
        self.inputs = _References([by_name[i["variable"]] for i in mapping["inputs"]])
        self.input_factors = np.array([i["factor"] for i in mapping["inputs"]])
        self.channels = [i["channel"] for i in mapping["inputs"]]
        # what a start is set from: a state by its channel, or a column of the inputs
        begun = [
            (c, state[c]["start"], state[c]["factor"]) for c in self.given if state[c]["start"]
        ]
        begun += [(i["channel"], i["start"], i["factor"]) for i in mapping["inputs"] if i["start"]]
        self.begun = [(channel, factor) for channel, _, factor in begun]
        self.starts = _References([by_name[name] for _, name, _ in begun])
        self.parameters = [(by_name[name], value) for name, value in mapping["parameters"].items()]
        self.clock = next(
            (v for v in self.model_description.modelVariables
             if v.causality == "output" and v.name.lower() == "time"), None,
        )  # fmt: skip
        self.own_time = _References([] if self.clock is None else [self.clock])
        self.version = int(self.model_description.fmiVersion.split(".")[0])
        self.flags = [ctypes.byref(of()) for of in (*[ctypes.c_bool] * 3, ctypes.c_double)]
        self.instance: Any = None
        self.used = False

    def __del__(self) -> None:
        with contextlib.suppress(Exception):
            shutil.rmtree(self.folder)

    # --- what the bridge asks ---

    def probe(self, rows: np.ndarray) -> dict[str, Any]:
        """What is known of it, once it has been tried at these rows. Raises Refused."""
        try:
            self._begin_at(rows[0])
        except Stopped as error:
            raise Refused(f"it cannot be started: it {error}") from error
        facts = checked(self, rows)
        if facts["sound"] == 0.0:
            _, _, words = facts["troubles"][0] if facts["troubles"] else (0, 0.0, "gave no number")
            raise Refused(f"it gave no acceleration of this ship: it {words}")
        moved = self._moved(rows)
        if not moved:
            raise Refused(
                "its velocities do not change with state or inputs: it is no ship, or the mapping "
                "is of other variables"
            )
        self._refuse_other_yaw_rate(rows)
        return {
            "returns": "next state", "step": self.step, "layout": "row by row",
            "library": f"FMI {self.model_description.fmiVersion}", "changes": False,
            "differentiated": False,
        } | facts  # fmt: skip

    def _moved(self, rows: np.ndarray) -> bool:
        found, _ = self.rates(rows[: min(len(rows), 12)])
        return bool(np.nanmax(np.nanstd(found, axis=0), initial=0.0) > STILL)

    def _refuse_other_yaw_rate(self, rows: np.ndarray) -> None:
        """Raises Refused where the median of some rows has a heading that does not turn with the
        yaw rate."""
        turned, yawed = self._turns(rows[:TURNS])
        apart = np.abs(turned - yawed)
        if len(apart) and np.median(apart) > TURNED * np.median(np.abs(yawed)) + LEAST_TURN:
            k = int(np.argsort(apart)[len(apart) // 2])
            raise Refused(
                f"its heading does not turn with its yaw rate (by {math.degrees(turned[k]):.2g} "
                f"deg in a second, of which the yaw rate makes {math.degrees(yawed[k]):.2g} deg): "
                "it is no ship, or the mapping has another unit or sign"
            )

    def _turns(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Δψ and ∫ r dt [n] of its own outputs, over a second from each row, rad."""
        found, h = [], self.step
        for row in rows:
            with contextlib.suppress(Stopped):
                self._begin_at(row)
                states = [self._states(row)]
                for k in range(max(1, math.ceil(1.0 / h - 1e-9))):
                    self._advance(k * h, h)
                    states.append(self._states(row))
                heading, r = np.array(states)[:, [HEADING, VELOCITIES[2]]].T
                found.append((np.sum(wrap(np.diff(heading))), 0.5 * h * np.sum(r[1:] + r[:-1])))
        turned, yawed = np.array(found).reshape(-1, 2).T
        return turned, yawed

    def exact(self, rows: np.ndarray) -> None:
        return None

    def rates(self, rows: np.ndarray) -> tuple[np.ndarray, list[Trouble]]:
        """ν̇ [n, 3], by two short steps from each row."""
        found, troubles = np.full((len(rows), 3), np.nan), []
        inputs, starts, h = self._values(rows), self._begun(rows), self.short
        before = rows[:, list(VELOCITIES)]
        after = np.empty((2, len(rows), 3))
        for i in np.flatnonzero(np.isfinite(rows).all(1)):
            try:
                self._begin(starts[i], inputs[i])
                for k in range(2):
                    self._advance(k * h, h)
                    after[k, i] = self.velocities.get(self)
                found[i] = 1.0
            except Stopped as error:
                self._note(troubles, int(i), rows[i, -1], error)
        after *= self.velocity_factors
        found *= (-3.0 * before + 4.0 * after[0] - after[1]) / (2.0 * h)
        bad = np.isfinite(rows).all(1) & ~np.isfinite(found).all(1)
        for i in set(np.flatnonzero(bad).tolist()) - {one.row for one in troubles}:
            error = Stopped("gave what is no finite number")
            self._note(troubles, i, rows[i, -1], error)
        return found, troubles

    def roll(
        self, start: np.ndarray, driven: np.ndarray, dt: np.ndarray, begin: np.ndarray
    ) -> tuple[np.ndarray, list[Trouble]]:
        """States [N, I, 6], each window from its first state."""
        states, troubles = np.full((*driven.shape[:2], STATES), np.nan), []
        for n in range(len(start)):
            states[n, 0] = start[n]
            clock = float(begin[n])
            try:
                time, x = 0.0, start[n]
                self._begin_at(_row(x, driven[n, 0], clock))
                for i in range(dt.shape[1]):
                    count = max(1, math.ceil(float(dt[n, i]) / self.step - 1e-9))
                    h = float(dt[n, i]) / count
                    for k in range(count):
                        part = 0.0 if self.hold else (k + 0.5) / count
                        now = driven[n, i] + part * (driven[n, i + 1] - driven[n, i])
                        row = _row(x, now, clock)
                        NOW.at(clock)
                        self.inputs.set(self, self._values(row[None])[0])
                        self._advance(time, h)
                        time, clock = time + h, clock + h
                        x = self._states(row)
                        if not np.isfinite(x).all():
                            raise Stopped("gave what is no finite number")
                    states[n, i + 1] = x
            except Stopped as error:
                self._note(troubles, n, clock, error)
        finite = np.isfinite(states[..., HEADING])
        turned = np.unwrap(np.where(finite, states[..., HEADING], 0.0), axis=1)
        states[..., HEADING] = np.where(finite, turned, np.nan)
        return states, troubles

    def _note(self, troubles: list[Trouble], row: int, second: float, error: Exception) -> None:
        self.used = True
        if len(troubles) < MOST_TROUBLES:
            troubles.append(Trouble(row, float(second), str(error)))

    # --- values ---

    def _channels(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """What may drive it, SI, by channel."""
        blowing = apparent(rows)
        north, east = rows[:, -3], rows[:, -2]
        return {
            "wind_speed": blowing[:, 0], "wind_angle": blowing[:, 1], "wind_x0": north,
            "wind_y0": east, "true_wind_speed": np.hypot(north, east),
            "true_wind_direction": np.arctan2(east, north),
        } | {name: rows[:, STATES + i] for i, name in enumerate(self.names)}  # fmt: skip

    def _values(self, rows: np.ndarray) -> np.ndarray:
        """Of the FMU's inputs [n, inputs], in its units."""
        found, of = np.zeros((len(rows), len(self.channels))), self._channels(rows)
        for i, channel in enumerate(self.channels):
            found[:, i] = of[channel] / self.input_factors[i]
        return found

    def _states(self, row: np.ndarray) -> np.ndarray:
        """Its state [6], SI; of the place what the row has where the FMU gives none."""
        values = self.outputs.get(self) * self.output_factors
        found = row[:STATES].copy()
        for channel, value in zip(self.given, values, strict=True):
            found[CHANNELS.index(channel)] = value
        return found

    # --- steps ---

    def _begun(self, rows: np.ndarray) -> np.ndarray:
        """What is set before a start [n, starts], in the FMU's units."""
        columns = {c: rows[:, i] for i, c in enumerate(CHANNELS)}
        columns |= self._channels(rows)
        found = np.zeros((len(rows), len(self.begun)))
        for i, (channel, factor) in enumerate(self.begun):
            found[:, i] = columns[channel] / factor
        return found

    def _begin(self, starts: np.ndarray, inputs: np.ndarray) -> None:
        """A start. Raises Stopped."""
        self._reset()
        for variable, value in self.parameters:
            self._parameter(variable, value)
        self.starts.set(self, starts)
        self.inputs.set(self, inputs)
        self._initialise()
        self.inputs.set(self, inputs)

    def _begin_at(self, row: np.ndarray) -> None:
        self._begin(self._begun(row[None])[0], self._values(row[None])[0])

    def _reset(self) -> None:
        if self.instance is not None and not self.used:
            if self.version == 2:
                good = self.instance.dll.fmi2Reset(self.component) <= 1
            else:
                good = self.instance.dll.fmi3Reset(self.component) <= 1
            if good:
                return
        self._new()

    @property
    def component(self) -> Any:
        return self.instance.component

    def _new(self) -> None:
        """Another instance: the first, or after a failure."""
        if self.instance is not None:
            with contextlib.suppress(Exception):
                self.instance.fmi2FreeInstance(self.component) if self.version == 2 else (
                    self.instance.fmi3FreeInstance(self.component)
                )
        try:
            if self.instance is None:
                kind, identifier = self._kind()
                self.instance = kind(
                    guid=self.model_description.guid, unzipDirectory=self.folder,
                    instanceName="shiplog", modelIdentifier=identifier,
                )  # fmt: skip
            self.instance.instantiate()
        except Exception as error:
            raise Stopped(f"cannot be made an instance of: {first_line(error)}") from error
        self.used = False

    def _kind(self) -> Any:
        """FMPy's class, and the library's name."""
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        identifier = self.model_description.coSimulation.modelIdentifier
        return (FMU2Slave if self.version == 2 else FMU3Slave), identifier

    def _initialise(self) -> None:
        dll = self.instance.dll
        if self.version == 2:
            set_up = (0, 0.0, 0.0, 0, 0.0)  # no tolerance, from 0 s on, without an end
            calls = (
                lambda: dll.fmi2SetupExperiment(self.component, *set_up),
                lambda: dll.fmi2EnterInitializationMode(self.component),
                lambda: dll.fmi2ExitInitializationMode(self.component),
            )
        else:
            calls = (
                lambda: dll.fmi3EnterInitializationMode(
                    self.component, False, 0.0, 0.0, False, 0.0
                ),
                lambda: dll.fmi3ExitInitializationMode(self.component),
            )
        for call in calls:
            if (status := call()) > 1:
                raise Stopped(f"refused its start ({STATUS.get(status, status)})")

    def _advance(self, time: float, step: float) -> None:
        dll = self.instance.dll
        if self.version == 2:
            status = dll.fmi2DoStep(self.component, time, step, 1)
        else:
            status = dll.fmi3DoStep(self.component, time, step, True, *self.flags)
        if status > 1:
            words = STATUS.get(status, str(status))
            raise Stopped(f"refused the step of {step:g} s ({words})")
        if self.clock is not None:
            own = float(self.own_time.get(self)[0])
            if abs(own - (time + step)) > CLOCK * step + 1e-9:
                raise Stopped(f"has the time {own:g} s after a step to {time + step:g} s")

    def _parameter(self, variable: Any, value: Any) -> None:
        of = self.instance
        if isinstance(value, bool):
            of.setBoolean([variable.valueReference], [value])
        elif str(variable.type) in ("Integer", "Int32"):
            (of.setInteger if self.version == 2 else of.setInt32)(
                [variable.valueReference], [int(value)]
            )
        else:
            _References([variable]).set(self, [float(value)])


class _References:
    """Real variables that are set or got together, without a list being made each time."""

    def __init__(self, variables: Sequence[Any]) -> None:
        self.count = len(variables)
        self.names = [v.name for v in variables]
        self.references = (ctypes.c_uint * self.count)(*(v.valueReference for v in variables))
        self.values = (ctypes.c_double * self.count)()

    def set(self, fmu: Fmu, values: Sequence[float] | np.ndarray) -> None:
        if not self.count:
            return
        self.values[:] = [float(v) for v in values]
        dll = fmu.instance.dll
        if fmu.version == 2:
            status = dll.fmi2SetReal(fmu.component, self.references, self.count, self.values)
        else:
            status = dll.fmi3SetFloat64(
                fmu.component, self.references, self.count, self.values, self.count
            )
        if status > 1:
            raise Stopped(f"refused a value of {', '.join(self.names)}")

    def get(self, fmu: Fmu) -> np.ndarray:
        dll = fmu.instance.dll
        if fmu.version == 2:
            status = dll.fmi2GetReal(fmu.component, self.references, self.count, self.values)
        else:
            status = dll.fmi3GetFloat64(
                fmu.component, self.references, self.count, self.values, self.count
            )
        if status > 1:
            raise Stopped(f"refused to give {', '.join(self.names)}")
        return np.array(self.values)


def _row(state: np.ndarray, driven: np.ndarray, time: float) -> np.ndarray:
    return np.concatenate((state, driven, (time,)))
