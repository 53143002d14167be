"""What a command started ends with it, however it is ended itself."""

import signal
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

import psutil
import pytest
from commands import call

from pipelines.experiments import simulated_ship

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sea")
    for number in (1, 2):
        voyage = simulated_ship.sail(60.0, seed=number, wind=simulated_ship.Wind(2.0, number))
        start = datetime(2026, 5, number, 12, 0, tzinfo=UTC)
        simulated_ship.write_voyage(
            folder / f"trip_{number}.mcap", voyage, seed=number, start=start
        )
    assert call("ingest", folder, "--store", folder / "store")[0] == 0
    return folder / "store"


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGKILL"])
def test_a_training_ends_with_its_command(store, tmp_path, name):
    """In the paper's recipe, so that it would go on for hours."""
    number = getattr(signal, name)
    out = tmp_path / "run"
    arguments = ["train", "--store", store, "--out", out, "--recipe", "paper", "--window", 20,
                 "--width", 8, "--seeds", 2]  # fmt: skip
    command = subprocess.Popen(
        [sys.executable, "-m", "shiplog.cli", *map(str, arguments)],
        cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    with command:
        me = psutil.Process(command.pid)
        started = []
        while command.poll() is None and len(started) < 2:  # a training and the pool's own helper
            time.sleep(0.1)
            started = me.children(recursive=True)
        command.send_signal(number)
        _, reported = command.communicate()
    assert len(started) >= 2
    _, alive = psutil.wait_procs(started, timeout=30)
    assert alive == []
    if number == signal.SIGTERM:
        assert command.returncode == 128 + number
        assert reported.rstrip().endswith("stopped; what was finished is kept")
        assert "Traceback" not in reported
