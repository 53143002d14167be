"""The stages from folder to folder give what the commands give, to the last bit."""

import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest
import sailing

from pipelines.downsample import downsample, rows, ship
from pipelines.train import train
from pipelines.windows import planned, windows
from shiplog.commands.train_networks import train_run
from shiplog.exceptions import ShiplogError
from shiplog.training.settings.options import TrainOptions
from shiplog.voyages.windows.augmentation import AUGMENTATIONS
from shiplog.voyages.windows.split_settings import Split

ROOT = Path(__file__).parents[2]
NAMES = ["a", "b"]
OPTIONS = TrainOptions(
    voyages=("a",), validation=("b",), data="sli10", window=20, width=4, epochs=2
)  # fmt: skip


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stages")
    store = sailing.store_of(folder, NAMES, seconds=90.0)
    downsample(store.path, folder / "seconds")
    windows(folder / "seconds", folder / "windows", size=20)
    return folder, store


def test_the_seconds_are_those_of_the_store(folders):
    folder, store = folders
    profile = store.profile(NAMES)
    assert ship(folder / "seconds").model_dump() == profile.model_dump()
    expected = store.seconds(NAMES, profile)
    assert rows(folder / "seconds").select(expected.columns).equals(expected)


def test_each_of_the_eight_sets_has_the_windows_of_table_3(folders):
    """Of n seconds without a gap (n - I) // S + 1 windows begin every S seconds, each M times."""
    folder, _ = folders
    table = rows(folder / "seconds")
    lengths = table.group_by("voyage", "segment").len()["len"].to_list()
    assert len(AUGMENTATIONS) == 8
    for name, one in AUGMENTATIONS.items():
        step = one.step * 20 // 100
        expected = sum((n - 20) // step + 1 for n in lengths) * max(one.copies, 1)
        assert pl.read_parquet(folder / "windows" / f"{name}.parquet").height == expected, name
    assert set(planned(folder / "windows", "ref", ("b",))["voyage"]) == {"b"}


def test_the_run_is_that_of_the_command(folders, trained_here):
    folder, store = folders
    mine = train(folder / "seconds", folder / "windows", folder / "mine", OPTIONS)
    split = Split(training=("a",), validation=("b",), chosen_by="the user")
    theirs = train_run(OPTIONS.config(split), store, folder / "theirs")
    for name in ("windows.parquet", "training.parquet", "seed0/training.parquet"):
        assert pl.read_parquet(mine.path / name).equals(pl.read_parquet(theirs.path / name)), name
    assert mine.logs_sha256() == theirs.logs_sha256()


def test_what_is_missing_or_taken_is_one_sentence(folders, tmp_path):
    folder, store = folders
    with pytest.raises(ShiplogError, match="does not exist"):
        windows(tmp_path / "none", tmp_path / "windows")
    with pytest.raises(ShiplogError, match="exists already"):
        downsample(store.path, folder / "seconds")
    done = subprocess.run(
        [sys.executable, "-m", "pipelines.windows", tmp_path / "none", tmp_path / "windows"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert not (tmp_path / "windows").exists()


def test_a_voyage_that_is_not_there_is_named(folders, tmp_path):
    folder, _ = folders
    options = TrainOptions(voyages=("a",), validation=("c",), window=20)
    with pytest.raises(ShiplogError, match=r"has no row of c\.\n  It has a, b\."):
        train(folder / "seconds", folder / "windows", tmp_path / "run", options)
    assert list(tmp_path.iterdir()) == []


def test_a_stage_is_read_on_one_screen():
    for name in ("downsample", "windows", "train"):
        assert len((ROOT / "pipelines" / f"{name}.py").read_text().splitlines()) < 80
