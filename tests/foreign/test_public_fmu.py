"""FMUs that a public package ships and that are no ships: mapped, stepped, reset, and refused in
one sentence.

gemseo-fmu has FMUs of OpenModelica: masses and springs, whose velocities change with their state.
"""

import shutil
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from commands import call

from shiplog.commands.train_foreign import Given, foreign_command
from shiplog.ship_profile import file as profiles
from shiplog.training.runs import foreign_run
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store.store import Store

pytest.importorskip("fmpy", reason="FMPy is not installed: pip install 'shiplog[fmu]'")
pytestmark = pytest.mark.long  # with a package that CI installs for them alone

LOG = Path(__file__).parents[2] / "sample_logs" / "voyage_1.mcap"
SPRINGS = {"rudder_port": ("k1", "rad"), "rudder_starboard": ("k2", "rad"),
           "propeller": ("k3", "rev/s")}  # fmt: skip
OSCILLATES = {"surge": "v1", "sway": "v2", "heading": "x1", "yaw_rate": "x2"}
CONSISTENT = {"surge": "v2", "sway": "v2", "heading": "x1", "yaw_rate": "v1"}


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    store = Store(tmp_path_factory.mktemp("public") / "store")
    store.add(ingest(LOG, profiles.load("esso-vectwin")))
    return store


@pytest.fixture
def springs(tmp_path):
    """The FMU, as it lies in the package."""
    if sys.platform != "linux":
        pytest.skip("the package has them for Linux and Windows of 32 bits")
    found = find_spec("gemseo_fmu")
    if found is None or found.origin is None:
        pytest.skip("gemseo-fmu is not there (pip install --no-deps gemseo-fmu), which has FMUs")
    folder = Path(found.origin).parent / "problems" / "fmu_files" / "linux"
    return Path(shutil.copy(folder / "MassSpringSystem.fmu", tmp_path))


def mapped(fmu, outputs):
    """Its TOML, with these outputs as the ship's state."""
    units = {"surge": "m/s", "sway": "m/s", "heading": "rad", "yaw_rate": "rad/s"}
    lines = ["[simulator]", "step_s = 0.1"]
    for channel, name in outputs.items():
        lines += [f"[state.{channel}]", f'output = "{name}"', f'unit = "{units[channel]}"']
        lines += [f'start = "_D_outputAlias_{name}"']
    for actuator, (name, unit) in SPRINGS.items():
        lines += [f"[inputs.{actuator}]", f'variable = "{name}"', f'unit = "{unit}"']
    fmu.with_suffix(".toml").write_text("\n".join(lines))
    return fmu


def test_its_draft_asks_for_every_channel(store, springs, tmp_path):
    said = call("train", "--model", springs, "--store", store.path, "--voyages", "voyage_1",
                "--window", 25, "--out", tmp_path / "run")  # fmt: skip
    assert said[0] == 1 and "of its lines say CHECK" in said[2]
    assert not (tmp_path / "run").exists()


def test_a_heading_that_does_not_turn_with_the_yaw_rate_is_no_ships(store, springs, tmp_path):
    """Of two masses neither place is the other's velocity."""
    said = call("train", "--model", mapped(springs, OSCILLATES), "--store", store.path,
                "--voyages", "voyage_1", "--window", 25, "--out", tmp_path / "run")  # fmt: skip
    assert said[0] == 1 and "its heading does not turn with its yaw rate" in said[2]
    assert not (tmp_path / "run").exists()


@pytest.mark.long
def test_it_runs_to_its_end_and_evaluate_refuses_it(store, springs, tmp_path):
    """Loaded, mapped, reset before each window and stepped: v' = -k x, whatever a ship does."""
    out = tmp_path / "run"
    given = Given(str(mapped(springs, CONSISTENT)))
    found = foreign_command(given, store.path, out, ("voyage_1",), (), 25)
    assert found.complete and found.json["windows"] == 20
    again = call("evaluate", out, "--store", store.path, "--voyages", "voyage_1",
                 "--simulator", springs)  # fmt: skip
    assert again[0] == 1, again
    sentence = again[2].splitlines()[0]
    assert "does not move as known ship" in sentence and "times what they are" in sentence
    assert not list(out.glob("errors.parquet"))
    foreign_run.close()
