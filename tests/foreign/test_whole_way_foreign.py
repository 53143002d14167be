"""The sample ship's simulator, as a function and as an FMU without anything of shiplog, through a
diagnosis."""

import json
from pathlib import Path

import fmus
import pytest

from shiplog.commands.diagnose import diagnose_run
from shiplog.commands.plan import plan_run
from shiplog.commands.train_foreign import Given, foreign_command
from shiplog.ship_profile import file as profiles
from shiplog.training.runs import foreign_run, load_model
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store.store import Store

ROOT = Path(__file__).parents[2]
LOGS = ROOT / "sample_logs"
TANKER = Path(__file__).parent / "tanker.py"
KEY = json.loads((LOGS / "answers" / "key.json").read_text("utf-8"))

pytestmark = [pytest.mark.long, pytest.mark.nightly]


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """All logs of the first season: two voyages do not show how much a wind differs from day to
    day."""
    store = Store(tmp_path_factory.mktemp("wrapped") / "store")
    seasons = ("season2_1", "season2_2", "season3_1", "season3_2")
    for log in (*sorted(LOGS.glob("voyage_*.mcap")), *(LOGS / f"{one}.mcap" for one in seasons)):
        store.add(ingest(log, profiles.load("esso-vectwin")))
    return store


@pytest.fixture(scope="module", params=["function", "fmu"])
def run(request, store):
    """A run of it, and the simulator's file."""
    folder = store.path.parent / request.param
    folder.mkdir()
    file = TANKER
    if request.param == "fmu":
        pytest.importorskip("fmpy", reason="FMPy is not installed")
        file = fmus.build(folder / "tanker.fmu")
    foreign_command(Given(str(file)), store.path, folder / "run", ("voyage_*",), (), 100)
    yield folder / "run", store, file
    foreign_run.close()


def diagnosed(run, season, **more):
    path, store, file = run
    voyages = [f"season{season}_1", f"season{season}_2"]
    out = path.parent / f"diagnosis{season}"
    return diagnose_run(path, store, voyages, out, simulators=[str(file)], **more)


def test_season_2_has_its_causes_with_their_sizes(run):
    path, _, file = run
    out = path.parent / "extended"
    found = diagnosed(run, 2, extend=out).verdict.as_json()
    assert found["verdict"] == "named"
    named = {one["name"]: one["parameters"] for one in found["causes"]}
    hidden = KEY["season2_1"]
    for cause in hidden:
        for name, value in cause["parameters"].items():
            estimate = named[cause["name"]][name]
            if isinstance(value["value"], str):
                assert estimate["value"] == value["value"]
            else:
                assert estimate["low"] <= value["value"] <= estimate["high"], (cause, estimate)
    assert set(named) == {cause["name"] for cause in hidden}
    assert any("central differences" in note for note in found["notes"])
    extended = load_model.load(out, simulators=[str(file)])
    assert set(extended.extension_numbers()) >= {"current"}


def test_season_3_has_none(run):
    assert diagnosed(run, 3).verdict.as_json()["verdict"] == "none"


def test_plan_tells_its_causes_apart(run, tmp_path):
    """A standard zigzag of the simulator itself shows a current, and tells it from an antenna."""
    path, store, file = run
    found = plan_run(path, store, tmp_path / "plan", causes_only=True, simulators=[str(file)])
    zigzag = found.apart["zigzag 20/20"]
    alike = {frozenset((one.a, one.b)) for one in zigzag.twins}
    assert "current" not in zigzag.unseen
    assert frozenset(("current", "antenna_offset")) not in alike
