"""Run folders: resumable after a kill, never half-written, no pickle."""

import polars as pl
import pytest
import sailing
import torch
from small_networks import network, windows

from shiplog.exceptions import RunError
from shiplog.models.feedforward import Shape
from shiplog.training import load_model, network_gradient, run_folder, seed_files
from shiplog.training.network_training import paper
from shiplog.training.run_config import Config, NetworkSettings, Paper
from shiplog.voyages.split_settings import Split

PROFILE = sailing.profile()
SPLIT = Split(training=("a",), validation=("b",))
CONFIG = Config(recipe="paper", seeds=(0, 1), split=SPLIT, network=NetworkSettings(
    width=8, depth=2, wind_input="angle"))  # fmt: skip
SHAPE = Shape(2, width=8, depth=2)
ROWS = pl.DataFrame({"voyage": ["a"] * 3, "surge": [0.1, 0.2, 0.3]})


@pytest.fixture
def begun(tmp_path):
    data = windows(5, 12, actuators=2)
    model = network(SHAPE, data).float()
    run = run_folder.create(tmp_path / "run", CONFIG, PROFILE, model.scaling, ROWS, ROWS, ROWS)
    batches = [network_gradient.batch(data, model.scaling, SHAPE, torch.float32)] * 2
    return run, model, batches


def test_a_run_comes_back_as_it_was(begun):
    run, model, batches = begun
    progress = paper(model, *batches, Paper(most_epochs=3), seed=0)
    for seed in CONFIG.seeds:
        seed_files.save_network(run.seed(seed), progress)
    done = run.finish({"shiplog": "test"})
    opened = load_model.load(done.path)
    assert opened.config == CONFIG
    assert opened.label == "feedforward ref (paper recipe, wind angle)"
    assert opened.profile.model_dump() == PROFILE.model_dump()
    for weight, best in zip(opened.simulator(1).weights, progress.best_weights, strict=True):
        assert torch.equal(weight, best.double())
    assert opened.history(0)["validation"].to_list() == [row[2] for row in progress.history]
    assert not (run.path).exists()
    suffixes = {p.suffix for p in done.path.rglob("*") if p.is_file()}
    assert suffixes == {".toml", ".json", ".parquet", ".safetensors"}


def test_a_checkpoint_on_disk_resumes_bit_by_bit(begun):
    run, model, batches = begun
    settings = Paper(most_epochs=9)
    whole = paper(model, *batches, settings, seed=0)
    paper(model, *batches, Paper(most_epochs=4), seed=0, every=4,
                checkpoint=lambda p: seed_files.save_checkpoint(run.seed(0), p))  # fmt: skip
    resumed = paper(
        model, *batches, settings, seed=0, resume=seed_files.load_checkpoint(run.seed(0))
    )
    assert resumed.history[1:] == whole.history[1:]
    assert all(torch.equal(a, b) for a, b in zip(resumed.weights, whole.weights, strict=True))
    seed_files.save_network(run.seed(0), resumed)
    assert (
        seed_files.load_checkpoint(run.seed(0)) is None and run.finished(0) and not run.finished(1)
    )


def test_the_same_command_goes_on_and_another_is_refused(begun):
    run, model, batches = begun
    seed_files.save_network(run.seed(0), paper(model, *batches, Paper(most_epochs=1), seed=0))
    out = run.path.with_name("run")
    again = run_folder.create(out, CONFIG, PROFILE, model.scaling, ROWS, ROWS, ROWS)
    assert again.finished(0)
    other = CONFIG.model_copy(update={"window": 50})
    with pytest.raises(RunError, match="other settings"):
        run_folder.create(out, other, PROFILE, model.scaling, ROWS, ROWS, ROWS)
    moved = ROWS.with_columns(surge=pl.col("surge") + 0.1)
    with pytest.raises(RunError, match="other settings or data"):
        run_folder.create(out, CONFIG, PROFILE, model.scaling, ROWS, moved, ROWS)


def test_an_unfinished_a_missing_and_a_taken_run_say_what_to_do(begun, tmp_path):
    run, model, _ = begun
    with pytest.raises(RunError, match="not finished"):
        load_model.load(tmp_path / "run")
    with pytest.raises(RunError, match="no run"):
        load_model.load(tmp_path / "nothing")
    run.path.rename(tmp_path / "run")
    with pytest.raises(RunError, match="exists already"):
        run_folder.create(tmp_path / "run", CONFIG, PROFILE, model.scaling, ROWS, ROWS, ROWS)


def test_a_torn_weight_file_is_named(begun):
    run, model, batches = begun
    seed_files.save_network(run.seed(0), paper(model, *batches, Paper(most_epochs=1), seed=0))
    path = run.path / "seed0" / "model.safetensors"
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(RunError, match=r"model\.safetensors cannot be read"):
        load_model.network(run).simulator(0)
