"""The whole experiment, short: five voyages of a minute, four sets, two seeds, two iterations."""

import json
import shutil

import numpy as np
import polars as pl
import pytest
import sailing
import torch
from commands import call

from shiplog.commands import demo
from shiplog.commands import gpu as on_gpu
from shiplog.commands.paper import _halved, choose_voyages
from shiplog.exceptions import RunError, StoreError
from shiplog.report.paper import figures, sets
from shiplog.report.paper.style import COLOURS
from shiplog.training.network import gpu, network_files
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.augmentation import AUGMENTATIONS

pytestmark = pytest.mark.nightly
FEW = ("--window", 20, "--width", 8, "--seeds", 2, "--epochs", 2)
DATA = ("ref", "sli2", "jit2", "d-ref")


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sea")
    return sailing.store_of(folder, [f"v{i}" for i in range(5)], seconds=62.0)


@pytest.fixture(scope="module")
def experiment(store, tmp_path_factory):
    out = tmp_path_factory.mktemp("paper") / "out"
    options = [word for name in DATA for word in ("--data", name)]
    code, text, _ = call("paper", "--store", store.path, "--out", out, *FEW, *options,
                         "--json", out.parent / "answer.json")  # fmt: skip
    assert code == 0
    return out, text, json.loads((out.parent / "answer.json").read_text(encoding="utf-8"))


@pytest.fixture
def undrawn(experiment, monkeypatch):
    """The figures of `experiment` in place of further ones: they take the longest."""
    drawn = experiment[0] / "figures"

    def copied(*given):
        to = given[-1]
        if to.parent != drawn:
            shutil.copyfile(drawn / f"{to.name}.png", to.with_suffix(".png"))

    for name in ("histograms", "wind", "validation", "test", "inputs", "states"):
        monkeypatch.setattr(figures, name, copied)


def test_every_table_and_figure_is_there(experiment):
    out, _, answer = experiment
    losses = pl.read_parquet(out / "tables" / "test_losses.parquet")
    assert losses.select("set", "seed").rows() == [(n, s) for n in DATA for s in (0, 1)]
    assert (losses["loss"] > 0.0).all()
    drawn = {path.name for path in (out / "figures").iterdir()}
    names = ["histograms", "wind", "validation_loss", "test_loss", "inputs", "ref_and_sli2",
             "ref_and_jit2", "ref_and_d-ref"]  # fmt: skip
    assert drawn == {f"{name}.{kind}" for name in names for kind in ("svg", "png")}
    assert all((out / "figures" / name).stat().st_size > 3000 for name in drawn)
    assert (out / "paper.rrd").read_bytes()[:4] == b"RRF2"
    assert [s["left"] for s in answer["statements"]] == ["sli2", "jit2", "d-ref"]
    assert answer["failures"] == {}


def test_sizes_are_of_slicing_and_jittering(experiment):
    """61 s in a row have 3 windows of 20 s; 5 when they begin every 10 s (Eq. 14)."""
    out, _, answer = experiment
    table = pl.read_parquet(out / "tables" / "sizes.parquet")
    voyages = len(answer["reference"])
    windows = dict(table.select("set", "windows").iter_rows())
    assert windows["ref"] == 3 * voyages
    assert windows["sli2"] == 5 * voyages
    assert windows["jit2"] == 2 * windows["ref"]
    assert windows["d-ref"] == 3 * len(answer["split"]["training"])
    assert set(answer["reference"]) < set(answer["split"]["training"])


def test_seeds_begin_alike_in_every_set_and_are_scaled_by_the_reference_set(experiment):
    out, _, _ = experiment
    first = pl.read_parquet(out / "tables" / "validation_losses.parquet").filter(
        pl.col("epoch") == 0
    )
    for _, own in first.group_by("seed"):
        assert own["validation"].n_unique() == 1  # the same weights and scales, before any update


def test_given_again_it_trains_nothing_and_says_the_same(experiment, store, undrawn):
    out, text, _ = experiment
    weights = out / "runs" / "ref" / "seed0" / "model.safetensors"
    before = weights.stat().st_mtime_ns
    options = [word for name in DATA for word in ("--data", name)]
    code, again, _ = call("paper", "--store", store.path, "--out", out, *FEW, *options)
    assert (code, again) == (0, text)
    assert weights.stat().st_mtime_ns == before


def by_paper(store, out, *options):
    return call("paper", "--store", store.path, "--out", out, "--recipe", "paper", *FEW,
                "--data", "ref", "--data", "jit2", *options)  # fmt: skip


def test_a_gpu_trains_the_same_networks(store, tmp_path, monkeypatch, undrawn):
    """The processor in its place: all but the CUDA graph, which has a test where there is a GPU.
    In 32 bits Adam's first steps, which are as long for any slope, differ by rounding."""
    monkeypatch.setattr(gpu, "find", lambda: torch.device("cpu"))
    monkeypatch.setattr(on_gpu, "CHECKPOINT_EPOCHS", 1)
    assert by_paper(store, tmp_path / "there", "--device", "cuda")[0] == 0
    assert by_paper(store, tmp_path / "here")[0] == 0
    there, here = (
        pl.read_parquet(tmp_path / out / "tables" / "test_losses.parquet")
        for out in ("there", "here")
    )
    assert there.drop("loss").equals(here.drop("loss"))
    assert there["loss"].to_list() == pytest.approx(here["loss"].to_list(), rel=5e-3)
    assert not list((tmp_path / "there").rglob("checkpoint*"))


def test_a_gpu_goes_on_from_checkpoints(store, tmp_path, monkeypatch, undrawn):
    monkeypatch.setattr(gpu, "find", lambda: torch.device("cpu"))
    monkeypatch.setattr(on_gpu, "CHECKPOINT_EPOCHS", 1)
    save, after = network_files.save_checkpoint, []

    def interrupt(folder, progress):
        save(folder, progress)
        after.append(progress.epoch)
        if len(after) == 3:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(network_files, "save_checkpoint", interrupt)
        by_paper(store, tmp_path, "--device", "cuda", "--epochs", 5)
    code, _, _ = by_paper(store, tmp_path, "--device", "cuda", "--epochs", 5)
    assert code == 0
    losses = pl.read_parquet(tmp_path / "tables" / "validation_losses.parquet")
    counts = losses.group_by("set", "seed").len()["len"].to_list()
    assert counts == [6] * 4  # the initial weights and five epochs, none twice


def test_a_seed_that_diverges_on_a_gpu_is_reported_and_costs_no_other(store, tmp_path, monkeypatch):
    monkeypatch.setattr(gpu, "find", lambda: torch.device("cpu"))
    begin = on_gpu.training_of

    def broken(run, seed):
        training = begin(run, seed)
        if seed == 1:
            with torch.no_grad():
                training.model.weights[-1].fill_(float("inf"))
        return training

    monkeypatch.setattr(on_gpu, "training_of", broken)
    code, _, text = by_paper(store, tmp_path, "--device", "cuda")
    assert code == 1 and "Every rollout of seed 1 diverged" in text
    assert (tmp_path / "runs" / "ref.partial" / "seed0" / "model.safetensors").exists()


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_a_gpu_that_is_absent_is_reported_before_the_work(store, tmp_path):
    code, _, text = by_paper(store, tmp_path / "out", "--device", "cuda")
    assert code == 1 and "needs an NVIDIA GPU" in text and "leave --device out" in text
    code, _, text = call("train", "--store", store.path, "--out", tmp_path / "run", "--recipe",
                         "paper", "--device", "cuda", "--window", 20)  # fmt: skip
    assert code == 1 and "needs an NVIDIA GPU" in text
    assert not list(tmp_path.iterdir())


def test_a_folder_of_other_settings_is_reported_and_not_touched(experiment, store):
    out, _, _ = experiment
    code, _, output = call("paper", "--store", store.path, "--out", out, "--window", 20,
                           "--width", 9, "--seeds", 2, "--epochs", 2, "--data", "ref")  # fmt: skip
    assert code == 1
    assert "is a finished run of other settings" in output


def test_a_folder_of_other_data_is_reported_and_not_touched(experiment, store, tmp_path):
    """The log of a training voyage was ingested anew, and differs."""
    out, _, answer = experiment
    name = answer["reference"][0]
    again = Store(shutil.copytree(store.path, tmp_path / "store"))
    shutil.rmtree(again.path / f"voyage={name}")
    path = sailing.write(tmp_path / f"{name}.mcap", sailing.series(62.0))
    again.add(ingest(path, sailing.profile()))
    code, _, output = call("paper", "--store", again.path, "--out", out, *FEW, "--data", "ref")
    assert code == 1
    assert "is a finished run of other data" in output and "choose another --out" in output
    assert demo._trained_already(out / "runs" / "ref", store)
    with pytest.raises(RunError, match="of other data"):
        demo._trained_already(out / "runs" / "ref", again)


def test_without_a_test_voyage_there_is_no_experiment(tmp_path):
    store = sailing.store_of(tmp_path, ["a", "b"], seconds=62.0)
    with pytest.raises(StoreError, match="no voyage left to test on"):
        choose_voyages(store, (), (), 20)


def test_with_voyages_to_validate_on_the_unused_ones_test(store):
    """v0 to v4: what trains is halved as ever; without --voyages nothing is left."""
    chosen = choose_voyages(store, ("v0", "v1"), ("v3",), 20)
    assert (chosen.reference, chosen.d_ref) == (("v0",), ("v0", "v1"))
    assert (chosen.validation, chosen.test) == (("v3",), ("v2", "v4"))
    assert chosen.of("ref").training == ("v0",)
    with pytest.raises(StoreError, match="no voyage left to test on") as caught:
        choose_voyages(store, (), ("v3",), 20)
    assert "fewer with --voyages" in caught.value.hint


def test_one_long_voyage_is_halved_for_the_reference_set(tmp_path):
    store = sailing.store_of(tmp_path, ["a"], seconds=300.0)
    chosen = choose_voyages(store, (), (), 20)
    (whole,), (half,) = chosen.d_ref, chosen.reference
    assert whole == "a[0:209]"
    assert half == "a[0:104]"


def test_the_first_half_is_half_of_what_can_be_used():
    """Alongside without a fix for 2000 s, then 1000 s under way."""
    elapsed = pl.Series(np.arange(2000.0, 3000.0))
    assert _halved("a", elapsed) == "a[0:2500]"
    assert _halved("a[600:3600]", elapsed) == "a[600:3100]"


def test_one_long_voyage_is_an_experiment_of_its_own(tmp_path, monkeypatch, undrawn):
    """Its parts train, validate and test; the reference set is half of the training part. Trained
    here and not in a pool of processes, which need longer to start."""
    monkeypatch.setattr(gpu, "find", lambda: torch.device("cpu"))
    store = sailing.store_of(tmp_path, ["a"], seconds=300.0)
    code, _, output = call("paper", "--store", store.path, "--out", tmp_path / "out", *FEW,
                           "--data", "ref", "--data", "d-ref", "--recipe", "paper",
                           "--device", "cuda")  # fmt: skip
    assert code == 0, output
    losses = pl.read_parquet(tmp_path / "out" / "tables" / "test_losses.parquet")
    assert losses.select("set", "seed").rows() == [
        ("ref", 0), ("ref", 1), ("d-ref", 0), ("d-ref", 1),
    ]  # fmt: skip
    assert losses["loss"].is_finite().all()


def test_histograms_count_every_second_once_in_bins_that_all_sets_share():
    rows = {"ref": pl.DataFrame({"surge": [0.0, 0.5, 1.0], "rudder": [0.0, 0.1, -0.1]}),
            "test": pl.DataFrame({"surge": [2.0, 2.0], "rudder": [0.0, 0.0]})}  # fmt: skip
    table = sets.histograms(rows, ["surge", "rudder"], {"rudder"})
    counts = table.group_by("set", "channel").agg(pl.col("seconds").sum())
    assert sorted(counts.rows()) == [
        ("ref", "rudder", 3), ("ref", "surge", 3), ("test", "rudder", 2), ("test", "surge", 2),
    ]  # fmt: skip
    rudder = table.filter(pl.col("channel") == "rudder")
    assert rudder["high"].max() == pytest.approx(5.7296, abs=1e-3)  # 0.1 rad in degrees


def test_wind_bins_are_the_papers():
    """0.25 m/s by 20 deg; 359 deg from the bow is the last bin, as -1 deg is."""
    rows = {"ref": pl.DataFrame({"wind_speed": [1.1, 1.1, 1.3], "wind_angle": [-0.01, 6.27, 0.0]})}
    assert sets.wind(rows).rows() == [
        ("ref", 1.0, 340.0, 2, 0.25), ("ref", 1.25, 0.0, 1, 0.25),
    ]  # fmt: skip


def test_every_window_set_has_a_colour_of_its_own():
    """A set without one would end the experiment in its figures, after all trainings."""
    assert set(AUGMENTATIONS) <= set(COLOURS)
    assert len({COLOURS[name] for name in AUGMENTATIONS}) == len(AUGMENTATIONS)
