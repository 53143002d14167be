"""Two Ray nodes on this machine, one killed half-way: nothing lost, not one number different."""

import subprocess
import sys

import polars as pl
import pytest
import sailing
from commands import call
from ray_nodes import kill, text, two_nodes, wait
from safetensors.numpy import load_file

pytest.importorskip("ray", reason="needs Ray: pip install '.[ray]'")

FEW = ("--window", 20, "--width", 8, "--seeds", 3, "--recipe", "paper", "--epochs", 1200,
       "--data", "ref", "--data", "jit2")  # fmt: skip
WAITS_S = 300.0


@pytest.fixture
def nodes(tmp_path):
    with two_nodes(tmp_path) as made:
        yield made


def test_a_node_that_dies_costs_no_training_and_changes_no_number(nodes, tmp_path):
    address, worker = nodes
    store = sailing.store_of(tmp_path, [f"v{i}" for i in range(4)], seconds=62.0)
    out = tmp_path / "cluster"
    command = ["paper", "--store", store.path, "--out", out, "--ray", address, *FEW]
    with open(tmp_path / "output", "w", encoding="utf-8") as output:
        training = subprocess.Popen(
            [sys.executable, "-m", "shiplog.cli", *map(str, command)],
            stdout=output, stderr=subprocess.STDOUT,
        )  # fmt: skip
    runs = out / "runs"
    try:
        wait(lambda: training.poll() is not None or [*runs.glob("*/seed*/checkpoint*")], WAITS_S)
        assert training.poll() is None, text(tmp_path / "output")
        kill(worker)  # with the piece that it is at
        code = training.wait(timeout=WAITS_S)
    finally:
        training.kill()
    assert code == 0, text(tmp_path / "output")

    assert call("paper", "--store", store.path, "--out", tmp_path / "local", *FEW)[0] == 0
    local = tmp_path / "local" / "runs"
    seeds = sorted(path.relative_to(local) for path in local.glob("*/seed*"))
    assert len(seeds) == 6
    for seed in seeds:
        here, there = (pl.read_parquet(of / seed / "training.parquet") for of in (local, runs))
        assert here.equals(there)
        ours, theirs = (load_file(of / seed / "model.safetensors") for of in (local, runs))
        assert ours.keys() == theirs.keys()
        assert all((ours[name] == theirs[name]).all() for name in ours)
