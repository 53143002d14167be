"""The kinds of files that a run is exported to: a line each, and a module of this package.

A module has CONSUMER, the program that the file is for, and

    version()                  of that program here; empty where it is not here
    write(job, path, record)   the file, whole or not at all; `record` are lines that it keeps
    compare(job, path)         the file loaded again by its consumer: a Difference. Raises NotLoaded
    losses(job)                what of the run is not in it, a sentence each

Each raises ShiplogError for what the target cannot express.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from shiplog.exceptions import UsageError, listed, nearest

MODEL, NUMBERS, PREDICTIONS = "model", "numbers", "predictions"


@dataclass(frozen=True)
class Target:
    """about    what it is, for a list
    ending   of its file
    module   of this package
    kind     MODEL: what sails; NUMBERS: its coefficients; PREDICTIONS: what it predicts of voyages
    exact    whether it is of the model's own form, so that only rounding differs
    """

    about: str
    ending: str
    module: str
    kind: str = MODEL
    exact: bool = True

    @property
    def of_voyages(self) -> bool:
        """Whether it can be what a run predicts of voyages."""
        return self.kind == PREDICTIONS or self.module == "csv_file"

    @property
    def maker(self) -> Any:
        return import_module(f"shiplog.export.{self.module}")


TARGETS = {
    "fmu": Target("FMI 2.0 unit for co-simulation: OSP, Simulink, Dymola", ".fmu", "fmu"),
    "fmu3": Target("the same of FMI 3.0", "_fmi3.fmu", "fmu3"),
    "cpp": Target("one header of C99 and C++11", ".h", "cpp"),
    "python": Target("one file of numpy, without shiplog", ".py", "python_file"),
    "mss": Target("a function of MATLAB and Octave, as MSS has its vessels", ".m", "mss"),
    "shipmmg": Target("parameter objects of shipmmg", "_shipmmg.py", "shipmmg_file", exact=False),
    "pvs": Target("a vehicle of the Python Vehicle Simulator", "_vehicle.py", "pvs", exact=False),
    "gazebo": Target("the hydrodynamics plugin of Gazebo", ".sdf", "gazebo", exact=False),
    "vrx": Target("the hydrodynamics plugin of VRX", "_vrx.sdf", "vrx", exact=False),
    "onnx": Target("a network with its scaling", ".onnx", "onnx_file"),
    "mcap": Target("predictions of voyages as a log", ".mcap", "log_of_predictions", PREDICTIONS),
    "parquet": Target("the same as Parquet", ".parquet", "parquet_of_predictions", PREDICTIONS),
    "csv": Target("the coefficients; predictions with --voyages", ".csv", "csv_file", NUMBERS),
    "toml": Target("the coefficients, for train --parameters", ".toml", "toml_file", NUMBERS),
    "yaml": Target("the coefficients", ".yaml", "yaml_file", NUMBERS),
}


def refuse_voyages(name: str) -> None:
    """Raises UsageError for voyages of a target that predicts nothing."""
    if not of_name(name).of_voyages:
        raise UsageError(
            f"--to {name} is of the model, and no voyage is part of it.",
            hint="leave --voyages out; --to mcap, parquet and csv are of voyages.",
        )


def of_name(name: str) -> Target:
    """Raises UsageError for one that there is not."""
    if name not in TARGETS:
        raise UsageError(
            f"There is no target {name!r}{nearest(name, TARGETS)}.",
            hint=f"give --to one of {listed(TARGETS, most=len(TARGETS))}.",
        )
    return TARGETS[name]
