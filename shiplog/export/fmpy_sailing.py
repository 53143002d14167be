"""An FMU that was written, sailed again by FMPy: here, or in a child process where a user's own FMU
is inside, which is foreign code as everywhere (`foreign.confinement`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.exceptions import ModelError
from shiplog.export.not_loaded import NotLoaded
from shiplog.foreign import worker
from shiplog.foreign.bridge import CALM
from shiplog.foreign.confinement import confine
from shiplog.machine import child as children
from shiplog.machine import files

PATIENCE_S = 600.0  # s: of a simulator that takes a tenth of a second for each acceleration


@dataclass(frozen=True)
class Names:
    """places     folders in `binaries` that are for this machine
    state      of the six channels, as the FMU calls them
    actuators  of the orders
    step       s of a communication step
    """

    places: tuple[str, ...]
    state: tuple[str, ...]
    actuators: tuple[str, ...]
    step: float


def sail(
    path: Path, names: Names, start: np.ndarray, water: Sequence[float], orders: np.ndarray
) -> np.ndarray:
    """States [n, 6] at the end of each communication step, of orders [n, A]; `water`: wind and
    current. Raises NotLoaded without FMPy, or where no binary of this machine is in it."""
    try:
        import fmpy
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave
    except ImportError as error:
        raise NotLoaded("FMPy is not installed (pip install 'shiplog[export]')") from error
    description = fmpy.read_model_description(str(path), validate=True)
    with files.temporary_folder() as folder:
        fmpy.extract(str(path), str(folder))
        if not any((folder / "binaries" / name).is_dir() for name in names.places):
            raise NotLoaded("no C compiler is on this machine, so it holds sources alone")
        assert description.coSimulation is not None
        make = FMU2Slave if str(description.fmiVersion).startswith("2") else FMU3Slave
        fmu = make(
            guid=description.guid, unzipDirectory=str(folder), instanceName="trial",
            modelIdentifier=description.coSimulation.modelIdentifier,
        )  # fmt: skip
        return _sailed(fmu, description, names, start, water, orders)


def _sailed(
    fmu: Any, description: Any, names: Names, start: np.ndarray, water: Sequence[float],
    orders: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Of an FMPy slave of FMI 2 or 3, freed at the end."""
    places = {v.name: v.valueReference for v in description.modelVariables}
    three = str(description.fmiVersion).startswith("3")
    put, get = (fmu.setFloat64, fmu.getFloat64) if three else (fmu.setReal, fmu.getReal)
    fmu.instantiate()
    try:
        put([places[f"start.{n}"] for n in names.state], start.tolist())
        put([places[f"{w}.{a}"] for w in ("wind", "current") for a in ("x0", "y0")], list(water))
        if three:
            fmu.enterInitializationMode(startTime=0.0)
        else:
            fmu.setupExperiment(startTime=0.0)
            fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        ordered = [places[f"order.{name}"] for name in names.actuators]
        state = [places[n] for n in names.state]
        found = np.empty((len(orders), len(state)))
        for k, row in enumerate(orders):
            put(ordered, row.tolist())
            fmu.doStep(currentCommunicationPoint=k * names.step, communicationStepSize=names.step)
            found[k] = get(state)
        fmu.terminate()
        return found
    finally:
        fmu.freeInstance()


def sail_apart(
    path: Path, names: Names, start: np.ndarray, water: Sequence[float], orders: np.ndarray
) -> np.ndarray:
    """`sail` in a child process, with its limits. Raises ModelError where it does not end well."""
    process, pipe = children.spawn(serve, CALM)
    try:
        worker.send(pipe, {"path": str(path), **asdict(names)}, [start, np.array(water), orders])
        if not pipe.poll(PATIENCE_S):
            raise ModelError(
                f"The FMU that was written did not sail {len(orders)} steps in {PATIENCE_S:g} s.",
                hint="look into the given FMU: how long does a reset of it take?",
            )
        answer, arrays = worker.receive(pipe)
    except (EOFError, OSError) as error:
        raise ModelError(
            "The process ended in which the FMU that was written was tried.",
            hint="look into the given FMU: can it be opened from another folder?",
        ) from error
    finally:
        pipe.close()
        process.kill()
        process.join()
    if "lacking" in answer:
        raise NotLoaded(answer["lacking"])
    if "failed" in answer:
        raise ModelError(
            f"The FMU that was written does not sail: {answer['failed']}.",
            hint="look into the given FMU: can it be opened from another folder?",
        )
    return arrays[0]


def serve(pipe: Connection) -> None:
    """In the child: one request."""
    confine()
    head, (start, water, orders) = worker.receive(pipe)
    path = Path(head["path"])
    places, state, actuators = (tuple(head[n]) for n in ("places", "state", "actuators"))
    names = Names(places, state, actuators, float(head["step"]))
    try:
        worker.send(pipe, {}, [sail(path, names, start, water.tolist(), orders)])
    except NotLoaded as error:
        worker.send(pipe, {"lacking": str(error)})
    except Exception as error:  # of a stranger's library, anything: said by the parent
        worker.send(
            pipe, {"failed": "".join(c if c.isprintable() else " " for c in str(error))[:300]}
        )
