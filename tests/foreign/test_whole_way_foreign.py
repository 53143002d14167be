"""The sample ship's simulator, as a function without anything of shiplog, through a diagnosis."""

import json
from pathlib import Path

import pytest

from shiplog.commands.diagnose import diagnose_run
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
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wrapped")
    store = Store(folder / "store")
    for name in ("voyage_1", "voyage_2", "season2_1", "season2_2", "season3_1", "season3_2"):
        store.add(ingest(LOGS / f"{name}.mcap", profiles.load("esso-vectwin")))
    foreign_command(Given(str(TANKER)), store.path, folder / "run", ("voyage_*",), (), 100)
    yield folder, store
    foreign_run.close()


def diagnosed(run, season, **more):
    folder, store = run
    voyages = [f"season{season}_1", f"season{season}_2"]
    out = folder / f"diagnosis{season}"
    return diagnose_run(folder / "run", store, voyages, out, simulators=[str(TANKER)], **more)


def test_season_2_has_its_causes_with_their_sizes(run):
    folder, _ = run
    found = diagnosed(run, 2, extend=folder / "extended").verdict.as_json()
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
    extended = load_model.load(folder / "extended", simulators=[str(TANKER)])
    assert set(extended.extension_numbers()) >= {"current"}


def test_season_3_has_none(run):
    assert diagnosed(run, 3).verdict.as_json()["verdict"] == "none"
