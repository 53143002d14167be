"""Two Ray nodes on this machine, one killed half-way: nothing lost, not one number different."""

import os
import re
import secrets
import subprocess
import sys
import time
from pathlib import Path

import polars as pl
import psutil
import pytest
import sailing
from commands import call
from safetensors.numpy import load_file

pytest.importorskip("ray", reason="needs Ray: pip install '.[ray]'")

RAY = Path(sys.executable).with_name("ray")
FEW = ("--window", 20, "--width", 8, "--seeds", 3, "--recipe", "paper", "--epochs", 1200,
       "--data", "ref", "--data", "jit2")  # fmt: skip
STARTS_S, WAITS_S = 90.0, 300.0


@pytest.fixture
def nodes(tmp_path):
    """A head and a worker with a core each: (address, the worker's process)."""
    token = tmp_path / "token"
    token.write_text(secrets.token_hex(32), encoding="utf-8")
    os.environ |= {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN_PATH": str(token)}
    port = 20_000 + os.getpid() % 20_000
    store = ["--num-cpus", "1", "--object-store-memory", str(100_000_000), "--block"]
    started = [_start(tmp_path / "head", "--head", "--port", str(port), "--include-dashboard",
                      "false", *store)]  # fmt: skip
    try:
        address = _wait(lambda: _address(tmp_path / "head"), STARTS_S)
        started.append(_start(tmp_path / "worker", "--address", address, *store))
        _wait(lambda: "Ray runtime started" in _text(tmp_path / "worker"), STARTS_S)
        yield address, started[1]
    finally:
        for process in reversed(started):
            _kill(process)
        for name in ("RAY_AUTH_MODE", "RAY_AUTH_TOKEN_PATH"):
            os.environ.pop(name)


def _start(output, *arguments):
    with open(output, "w", encoding="utf-8") as out:
        return subprocess.Popen(
            [RAY, "start", "--disable-usage-stats", *arguments],
            stdout=out,
            stderr=subprocess.STDOUT,
        )


def _text(path):
    return path.read_text(encoding="utf-8") if path.exists() else ""


def _address(path):
    """As `ray start --head` prints it for the others."""
    text = _text(path)
    found = re.search(r"--address='([^']+)'", text)
    return found[1] if found and "Ray runtime started" in text else None


def _wait(condition, seconds):
    until = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < until, "Ray did not start in time"
        time.sleep(0.5)
    return found


def _kill(process):
    """With all that it started, as a machine that loses its power."""
    try:
        children = psutil.Process(process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        children = []
    for child in (*children, process):
        try:
            child.kill()
        except (psutil.NoSuchProcess, ProcessLookupError):
            continue
    process.wait()


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
        _wait(lambda: training.poll() is not None or [*runs.glob("*/seed*/checkpoint*")], WAITS_S)
        assert training.poll() is None, _text(tmp_path / "output")
        _kill(worker)  # with the piece that it is at
        code = training.wait(timeout=WAITS_S)
    finally:
        training.kill()
    assert code == 0, _text(tmp_path / "output")

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
