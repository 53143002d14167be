"""Whatever a file does to the process that reads it: one sentence, and the other files are read."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
import sailing

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits and signals of Linux")

# The program, but for one file, on which it does what a native library might do.
PROGRAM = """
import os, sys, time
from pathlib import Path
from shiplog.logs import reading_limits as limits

begin = limits.begin

def then(path):
    begin(path)
    if path.stem == "bad":
        {fault}

limits.begin = then
from shiplog.cli import main
main()
"""
FAULTS = {
    "memory of Python's": ("bytearray(limits.LEAST_BYTES + (1 << 30))", "more memory was needed"),
    "a panic, which is no Exception": ("raise type('Panic', (BaseException,), {})('at the disco')",
                                       "an unexpected fault of the program: Panic"),
    "an abort": ("os.abort()", "it needed more memory than a file of its size may"),
    "a segmentation fault": ("os.kill(os.getpid(), 11)", "ended the process that read it (SIG"),
    "no end": ("limits.LEAST_S = 0.0; begin(path)\n        while True: pass",
               "it took more processor time than a file of its size may"),
}  # fmt: skip


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("guard")
    (folder / "circle.toml").write_text(sailing.PROFILE)
    for name in ("a", "bad", "c"):
        sailing.write(folder / f"{name}.mcap", sailing.series(30.0))
    return folder


def command(fault, *arguments):
    program = PROGRAM.format(fault=fault)
    return [sys.executable, "-W", "ignore", "-c", program, *map(str, arguments)]


def shiplog(fault, *arguments):
    return subprocess.run(command(fault, *arguments), cwd=ROOT, capture_output=True, text=True,
                          check=False)  # fmt: skip


def ingest(logs, store):
    return ["ingest", *sorted(logs.glob("*.mcap")), "--profile", logs / "circle.toml", "--store",
            store, "--json", store / "said.json"]  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_a_file_that_ends_its_reader_is_named_and_the_others_are_ingested(logs, tmp_path, fault):
    code, words = FAULTS[fault]
    done = shiplog(code, *ingest(logs, tmp_path))
    assert done.returncode == 3, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if "bad.mcap refused" in line]
    assert words in line
    assert "Traceback" not in done.stderr
    said = json.loads((tmp_path / "said.json").read_text())
    assert [voyage["name"] for voyage in said["voyages"]] == ["a", "c"]
    assert {path.name for path in tmp_path.glob("voyage=*")} == {"voyage=a", "voyage=c"}


def test_a_draft_that_ends_its_process_is_one_sentence(logs):
    done = shiplog("os.abort()", "profile", logs / "bad.mcap")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-2].endswith(
        "bad.mcap was given up: it needed more memory than a file of its size may."
    )


def waiting(logs, tmp_path):
    """A command whose child waits on a file, and the child."""
    arguments = command("print('now', flush=True); time.sleep(60)", *ingest(logs, tmp_path))
    started = subprocess.Popen(arguments, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               text=True)  # fmt: skip
    assert started.stdout and started.stdout.readline() == "now\n"
    (child,) = psutil.Process(started.pid).children()
    return started, child


@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), ("SIGINT", 130)])
def test_a_signal_to_the_command_reaches_its_child(logs, tmp_path, name, code):
    started, child = waiting(logs, tmp_path)
    with started:
        started.send_signal(getattr(signal, name))
        _, said = started.communicate(timeout=30)
    assert started.returncode == code
    assert said.rstrip().endswith("stopped; what was finished is kept")
    psutil.wait_procs([child], timeout=10)
    assert not child.is_running()


def test_a_killed_command_takes_its_child_along(logs, tmp_path):
    started, child = waiting(logs, tmp_path)
    with started:
        started.kill()
        started.communicate(timeout=30)
    for _ in range(100):
        if not child.is_running() or child.status() == psutil.STATUS_ZOMBIE:
            return
        time.sleep(0.1)
    raise AssertionError("the child lives")


def test_a_child_that_the_system_kills_is_reported_and_kills_its_command(logs, tmp_path):
    started, child = waiting(logs, tmp_path)
    with started:
        child.kill()
        _, said = started.communicate(timeout=30)
    assert started.returncode == -signal.SIGKILL
    assert "bad.mcap was given up: the process was ended from outside" in said
