"""The same logs, settings and seeds give the same numbers to the last bit, whatever the number of
cores, workers and threads; and a run repeats from its folder alone."""

from __future__ import annotations

import json
import os
import shutil
import sys
from datetime import UTC, datetime

import pytest
from commands import call

from pipelines.experiments import simulated_ship
from pipelines.experiments.same_numbers import content, differing, run_on
from shiplog.training.runs import run_folder

pytestmark = [pytest.mark.nightly, pytest.mark.usefixtures("trained_here")]
SMALL = ("--window", "20", "--store", "store")
HULL = ("--without", "propeller", "--without", "rudder")  # it compiles quickly
LEARN = ("--voyages", "trip_1", "--voyages", "trip_2")
COMMANDS = (
    ("ingest", "logs", "--store", "store"),
    ("train", *SMALL, *LEARN, "--validation", "trip_3", "--out", "network", "--data", "sli2",
     "--width", "32", "--epochs", "5", "--seeds", "2"),
    ("train", *SMALL, *LEARN, "--out", "mmg", "--model", "mmg", *HULL),
    ("train", *SMALL, *LEARN, "--out", "hybrid", "--model", "hybrid", *HULL),
    ("evaluate", "network", "--voyages", "trip_3", "--store", "store"),
    ("diagnose", "mmg", "--voyages", "trip_3", "--store", "store", "--out", "found"),
)  # fmt: skip
NOT_REPEATED = ("provenance.json", "errors.parquet", "rollouts.parquet", "evaluation/")


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sea") / "logs"
    folder.mkdir()
    for number, seconds in ((1, 130.0), (2, 130.0), (3, 260.0)):  # long enough for a verdict
        voyage = simulated_ship.sail(seconds, seed=number, wind=simulated_ship.Wind(3.0, number))
        start = datetime(2026, 5, number, 12, 0, tzinfo=UTC)
        simulated_ship.write_voyage(
            folder / f"trip_{number}.mcap", voyage, seed=number, start=start
        )
    return folder


@pytest.fixture(scope="module")
def on_one(logs, tmp_path_factory):
    """All commands on one core."""
    folder = tmp_path_factory.mktemp("one")
    shutil.copytree(logs, folder / "logs")
    run_on([min(os.sched_getaffinity(0))], 1, folder, COMMANDS)
    return folder


@pytest.mark.skipif(sys.platform != "linux", reason="a process is kept to one core as Linux does")
def test_the_number_of_cores_and_threads_changes_no_bit(on_one, logs, tmp_path):
    shutil.copytree(logs, tmp_path / "logs")
    run_on(sorted(os.sched_getaffinity(0)), 3, tmp_path, COMMANDS)
    one, many = content(on_one), content(tmp_path)
    assert json.loads((on_one / "found" / "verdict.json").read_text())["ranking"]
    assert {
        "network/seed1/model.safetensors",
        "mmg/seed0/identified.parquet",
        "found/verdict.json",
        "hybrid/seed0/model.safetensors",
        "store/voyage=trip_3/table.parquet",
    } <= set(one)
    assert differing(one, many) == []


@pytest.mark.skipif(sys.platform != "linux", reason="it takes the runs of the test above")
@pytest.mark.parametrize("name", ["network", "mmg", "hybrid"])
def test_a_run_repeats_from_its_folder_alone(on_one, tmp_path, monkeypatch, name):
    shutil.copytree(on_one / name, tmp_path / "elsewhere")
    monkeypatch.chdir(tmp_path)
    code, _, error = call("train", "--again", "elsewhere", "--out", name)
    assert code == 0, error
    before, after = content(on_one / name), content(tmp_path / name)
    kept = [file for file in before if not file.startswith(NOT_REPEATED)]
    assert sorted(after.keys() - {"provenance.json"}) == kept
    assert [file for file in kept if before[file] != after[file]] == []
    old, new = (run_folder.open_folder(p).logs_sha256() for p in (on_one / name, tmp_path / name))
    assert old == new and len(old) == (3 if name == "network" else 2)
