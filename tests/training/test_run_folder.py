"""Run folders: resumable after a kill, never half-written, no pickle."""

import polars as pl
import pytest
import sailing
import torch
from small_networks import network, windows

from shiplog.exceptions import RunError
from shiplog.machine import files
from shiplog.models.network_shape import Shape
from shiplog.training.network import network_files, network_gradient
from shiplog.training.network.network_training import paper
from shiplog.training.runs import load_model, run_folder
from shiplog.training.settings.run_config import Config, NetworkSettings, Paper
from shiplog.voyages.windows.split_settings import Split

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
        network_files.save(run.seed(seed), progress)
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
                checkpoint=lambda p: network_files.save_checkpoint(run.seed(0), p))  # fmt: skip
    resumed = paper(
        model, *batches, settings, seed=0, resume=network_files.load_checkpoint(run.seed(0))
    )
    assert resumed.history[1:] == whole.history[1:]
    assert all(torch.equal(a, b) for a, b in zip(resumed.weights, whole.weights, strict=True))
    network_files.save(run.seed(0), resumed)
    assert (
        network_files.load_checkpoint(run.seed(0)) is None
        and run.finished(0)
        and not run.finished(1)
    )


def test_the_same_command_goes_on_and_another_is_refused(begun):
    run, model, batches = begun
    network_files.save(run.seed(0), paper(model, *batches, Paper(most_epochs=1), seed=0))
    out = run.path.with_name("run")
    again = run_folder.create(out, CONFIG, PROFILE, model.scaling, ROWS, ROWS, ROWS)
    assert again.finished(0)
    other = CONFIG.model_copy(update={"window": 50})
    with pytest.raises(RunError, match="other settings"):
        run_folder.create(out, other, PROFILE, model.scaling, ROWS, ROWS, ROWS)
    longer = PROFILE.ship.model_copy(update={"length_m": 2.0 * PROFILE.ship.length_m})
    with pytest.raises(RunError, match="another profile"):
        run_folder.create(
            out, CONFIG, PROFILE.model_copy(update={"ship": longer}), model.scaling,
            ROWS, ROWS, ROWS,
        )  # fmt: skip
    moved = ROWS.with_columns(surge=pl.col("surge") + 1e-15)
    for rows in ((ROWS, moved, ROWS), (ROWS, ROWS, moved)):
        with pytest.raises(RunError, match="other data"):
            run_folder.create(out, CONFIG, PROFILE, model.scaling, *rows)


def test_an_unfinished_a_missing_and_a_taken_run_say_what_to_do(begun, tmp_path):
    run, model, _ = begun
    with pytest.raises(RunError, match="not finished"):
        load_model.load(tmp_path / "run")
    with pytest.raises(RunError, match="no run"):
        load_model.load(tmp_path / "nothing")
    run.path.rename(tmp_path / "run")
    with pytest.raises(RunError, match="exists already"):
        run_folder.create(tmp_path / "run", CONFIG, PROFILE, model.scaling, ROWS, ROWS, ROWS)


@pytest.mark.parametrize("raw", [b"", b"\xff\xfe", b"[[[", None])
def test_a_begun_run_that_cannot_be_read_is_begun_anew(begun, caplog, raw):
    """As a power cut or a full disk may leave it."""
    run, model, batches = begun
    network_files.save(run.seed(0), paper(model, *batches, Paper(most_epochs=1), seed=0))
    file = run.path / ("windows.parquet" if raw is None else "config.toml")
    spoilt = run.path / ("training.parquet" if raw is None else "config.toml")
    spoilt.write_bytes(b"x" if raw is None else raw)
    again = run_folder.create(
        run.path.with_name("run"), CONFIG, PROFILE, model.scaling, ROWS, ROWS, ROWS
    )
    assert not again.finished(0) and file.is_file()
    assert run_folder.open_folder(again.path).config == CONFIG
    assert again.training().equals(ROWS)
    assert f"{run.path} is begun anew." in caplog.messages


def test_a_folder_that_no_training_began_is_not_removed(begun, tmp_path):
    _run, model, _ = begun
    (tmp_path / "other.partial").mkdir()
    diary = tmp_path / "other.partial" / "diary.txt"
    diary.write_text("at sea")
    with pytest.raises(RunError) as raised:
        run_folder.create(tmp_path / "other", CONFIG, PROFILE, model.scaling, ROWS, ROWS, ROWS)
    assert str(raised.value) == (
        f"{diary.parent} is there, and is no run that was begun: there is no config.toml in it.\n"
        f"  choose another --out, or move {diary.parent} away."
    )
    assert diary.read_text() == "at sea"


def test_nothing_of_a_run_appears_before_all_of_it(begun, tmp_path, monkeypatch):
    """Whoever is killed, or runs out of disk, while a run is begun leaves no part of it."""
    _run, model, _ = begun
    write = pl.DataFrame.write_parquet
    count = 0

    def fills_up(frame, path, *args, **kwargs):
        nonlocal count
        count += 1
        assert not (tmp_path / "other.partial").exists()
        if count == 3:
            raise pl.exceptions.ComputeError(f"No space left on device (os error 28): {path}")
        return write(frame, path, *args, **kwargs)

    monkeypatch.setattr(pl.DataFrame, "write_parquet", fills_up)
    with pytest.raises(OSError, match="No space left on device") as raised:
        run_folder.create(tmp_path / "other", CONFIG, PROFILE, model.scaling, ROWS, ROWS, ROWS)
    assert raised.value.filename == str(tmp_path / "other.partial")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run.partial"]


def test_a_resumed_run_holds_no_leavings_of_the_killed_one(begun):
    run, model, _ = begun
    run.seed(0).mkdir()
    of_nobody = f"{files.MACHINE}-{2**22 + 1}.partial"  # more than Linux numbers processes
    leavings = [run.path / f".provenance.json.{of_nobody}",
                run.seed(0) / f".checkpoint.safetensors.{of_nobody}"]  # fmt: skip
    for path in leavings:
        path.touch()
    run_folder.create(run.path.with_name("run"), CONFIG, PROFILE, model.scaling, ROWS, ROWS, ROWS)
    assert not any(path.exists() for path in leavings)


def test_a_torn_checkpoint_begins_its_seed_anew(begun, caplog):
    run, model, batches = begun
    paper(model, *batches, Paper(most_epochs=4), seed=0, every=4,
          checkpoint=lambda p: network_files.save_checkpoint(run.seed(0), p))  # fmt: skip
    path = run.seed(0) / "checkpoint.safetensors"
    for raw in (b"", path.read_bytes()[:200], path.read_bytes().replace(b"history", b"mystery")):
        path.write_bytes(raw)
        caplog.clear()
        assert network_files.load_checkpoint(run.seed(0)) is None
        (message,) = caplog.messages
        assert message.startswith(f"{path} cannot be read, its training begins anew: ")


def test_a_torn_weight_file_is_named(begun):
    run, model, batches = begun
    network_files.save(run.seed(0), paper(model, *batches, Paper(most_epochs=1), seed=0))
    path = run.path / "seed0" / "model.safetensors"
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(RunError, match=r"model\.safetensors cannot be read"):
        load_model.network(run).simulator(0)
