"""The work queue: every task once, and a process that dies costs its own task only."""

import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from shiplog.exceptions import RunError
from shiplog.training.network.queue import Task, work


def square(number, report):
    report(0.5)
    return number**2


def fails(number, report):
    raise RunError(f"no {number}", hint="never")


def dies(number, report):
    os.kill(os.getpid(), signal.SIGKILL)


def fills_the_disk(number, report):
    raise OSError(28, "No space left on device", "/full/model.safetensors")


def sleeps(path, report):
    path.write_text(str(os.getpid()), encoding="utf-8")
    time.sleep(600)


def outcomes(tasks, workers):
    return {e.task.name: e for e in work(tasks, workers) if e.ended}


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
@pytest.mark.parametrize("workers", [1, 2])
def test_a_task_that_fails_costs_itself_and_no_other(workers):
    kinds = [square, fails, square, dies, square, fills_the_disk, square]
    tasks = [Task(str(i), kind, (i,)) for i, kind in enumerate(kinds)]
    found = outcomes(tasks, workers)
    assert sorted(found) == sorted(task.name for task in tasks)
    assert {name: e.result for name, e in found.items() if not e.failure} == {
        "0": 0, "2": 4, "4": 16, "6": 36,
    }  # fmt: skip
    assert "no 1" in found["1"].failure
    assert "SIGKILL" in found["3"].failure
    assert found["5"].failure == "/full/model.safetensors: No space left on device"


def test_a_task_says_how_far_it_is():
    shares = [e.share for e in work([Task("a", square, (3,))], 1)]
    assert shares == [0.0, 0.5, 1.0]


def test_closing_the_queue_ends_its_processes(tmp_path):
    path = tmp_path / "pid"
    with closing(work([Task("a", sleeps, (path,))], 1)) as events:
        next(events)
        while not path.exists() or not path.read_text(encoding="utf-8"):
            time.sleep(0.05)
    with pytest.raises(ProcessLookupError):
        os.kill(int(path.read_text(encoding="utf-8")), 0)


SCRIPT = """
import sys
sys.path.insert(0, "FOLDER")
from test_queue import square
from shiplog.training.network.queue import Task, work

print("once")
for event in work([Task("a", square, (3,))], 1):
    if event.ended:
        print(event.result, event.failure)
"""


def test_a_script_that_trains_is_not_run_again_by_each_process(tmp_path):
    """As a reader of the README writes it, without `if __name__ == "__main__"`."""
    path = tmp_path / "script.py"
    path.write_text(SCRIPT.replace("FOLDER", str(Path(__file__).parent)), encoding="utf-8")
    ended = subprocess.run([sys.executable, path], capture_output=True, text=True)
    assert (ended.stdout, ended.stderr) == ("once\n9 \n", "")


INTERRUPTED = """
import multiprocessing.util, signal, sys
from shiplog.training.network.queue import Task, cores, work

began = multiprocessing.util.spawnv_passfds

def interrupted(*arguments):
    child = began(*arguments)
    if "spawn_main" in str(arguments):  # not multiprocessing's own helper
        signal.raise_signal(signal.SIGNAL)
    return child

multiprocessing.util.spawnv_passfds = interrupted
signal.signal(signal.SIGNAL, lambda number, _: sys.exit(128 + number))
list(work([Task("a", cores, ())], 1))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_while_a_process_begins_leaves_no_trace(name):
    """It comes when the process has started and has not received its arguments."""
    script = INTERRUPTED.replace("SIGNAL", name)
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert ended.returncode == 128 + getattr(signal, name)
    assert ended.stderr == ""
