"""`shiplog train --model hybrid` as a user types it, on short voyages."""

import math
import shutil
import tomllib

import polars as pl
import pytest
from short_voyages import STATES, scored

from shiplog.commands.identify import identify_run
from shiplog.exceptions import RunError
from shiplog.training.runs import load_model
from shiplog.training.settings.run_config import Config
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split_settings import Split


@pytest.fixture(scope="module")
def hybrid(store):
    """A network of two units, one strength to choose; only one parameter of the physics free."""
    physics = {"without": ("propeller", "rudder", "wind"), "free": ("hull.x_0f",),
               "width": 2, "strengths": (1.0,)}  # fmt: skip
    config = Config.model_validate(
        {
            "model": "hybrid", "window": 25, "physics": physics,
            "split": Split(training=("trip_1", "trip_2"), validation=()),
        }
    )  # fmt: skip
    return identify_run(config, Store(store), store.parent / "hybrid")


def test_a_hybrid_is_judged_on_held_out_voyages_and_says_so(hybrid):
    run, reported = hybrid
    assert run.label == "hybrid identified on ref, without propeller, rudder, wind"
    (sentence,) = [s for s in reported.notes if s.startswith("Seed 0")]
    assert "adds nothing that survives" in sentence or "on 6 held-out windows" in sentence
    assert run.band() is not None


def test_a_hybrid_is_opened_as_it_was_fitted(hybrid, store, tmp_path):
    run, _ = hybrid
    model = run.simulator(0).model
    assert model.residual.width == 2
    assert len(model.names) == 3 + 15 + model.residual.count == len(run.simulator(0).theta)
    assert model.residual.anchors.shape == (150, 6)  # two voyages of three windows of 25 s
    found = run.identified()
    assert found.height == 18 and not any("network" in name for name in found["name"])
    assert found.filter(pl.col("free"))["name"].to_list() == ["hull.x_0f"]
    held = found.filter(~pl.col("free"))
    assert (held["value"] == held["start"]).all()
    toml = tomllib.loads((run.path / "seed0" / "parameters.toml").read_text(encoding="utf-8"))
    assert set(toml) == {"source", "body", "hull"}
    content = scored(run.path, store, tmp_path / "e.json")
    assert math.isfinite(content["loss"]) and sorted(content["band_90"]) == sorted(STATES)


def test_a_damaged_model_is_named(hybrid, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(hybrid[0].path, copy)
    path = copy / "seed0" / "model.safetensors"
    path.write_bytes(path.read_bytes()[:50])
    with pytest.raises(RunError, match=r"model\.safetensors cannot be read"):
        load_model.load(copy).simulator(0)
