"""Runs to export: a ship as published, and one with causes in its steering and its water."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from commands import call

from shiplog.models.causes import CATALOGUE
from shiplog.training.runs import extension_file, foreign_run, load_model

FOREIGN = Path(__file__).parents[1] / "foreign"
sys.path.insert(0, str(FOREIGN))  # its simulators are wrapped here, too


@pytest.fixture(scope="session")
def sailed(tmp_path_factory):
    """A store of one voyage, and a run of the published model of its ship."""
    folder = tmp_path_factory.mktemp("export")
    log = Path(__file__).parents[2] / "sample_logs" / "voyage_1.mcap"
    assert call("ingest", log, "--store", folder / "store")[0] == 0
    code, _, said = call("train", "--store", folder / "store", "--out", folder / "whole",
                         "--window", 25, "--model", "mmg", "--no-fit",
                         "--voyages", "voyage_1")  # fmt: skip
    assert code == 0, said
    return folder


@pytest.fixture(scope="session")
def whole(sailed):
    return sailed / "whole"


@pytest.fixture(scope="session")
def steered(whole):
    """Extended by a current, a load, and an offset, a lag and a delay of the rudders."""
    run = load_model.load(whole)
    numbers = {
        "current": [0.05, -0.03], "payload": [40.0, 10.0], "rudder_offset": [0.02, -0.01],
        "rudder_lag": [1.3], "rudder_delay": [1.7],
    }  # fmt: skip
    causes = [one for one in CATALOGUE if one.label in numbers]
    assert {one.label for one in causes} == set(numbers)
    after = run.extended(0).with_causes(
        causes,
        {label: np.array(p) for label, p in numbers.items()},
        {label: 1e-6 * np.eye(len(p)) for label, p in numbers.items()},
    )
    return extension_file.extend(run, whole.parent / "steered", after, [])


@pytest.fixture(scope="session")
def wrapped(sailed):
    """Runs of the tanker's FMU and function, by name: path of the run and the simulator's file."""
    fmus = pytest.importorskip("fmus")
    from shiplog.commands.train_foreign import Given, foreign_command

    made = {}

    def run(kind):
        if kind not in made:
            folder = sailed / kind
            folder.mkdir()
            if kind == "function":
                file = folder / "given.py"
                shutil.copy(FOREIGN / "tanker.py", file)
            else:
                version, exchange = (3 if kind == "fmu3" else 2), kind == "exchange"
                file = fmus.build(folder / "given.fmu", version=version, exchange=exchange)
            out = folder / "run"
            foreign_command(Given(str(file)), sailed / "store", out, ("voyage_1",), (), 25)
            made[kind] = out, file
        return made[kind]

    yield run
    foreign_run.close()


@pytest.fixture(scope="session")
def caused(wrapped):
    """The same extended by causes with these numbers."""
    made = {}

    def run(kind, **numbers):
        key = (kind, *numbers)
        if key not in made:
            path, file = wrapped(kind)
            of = load_model.load(path, simulators=[str(file)])
            causes = [one for one in CATALOGUE if one.label in numbers]
            after = of.extended(0).with_causes(
                causes,
                {label: np.array(p) for label, p in numbers.items()},
                {label: 1e-6 * np.eye(len(p)) for label, p in numbers.items()},
            )
            out = path.parent / "-".join(("with", *numbers))
            made[key] = extension_file.extend(of, out, after, []), file
        return made[key]

    return run
