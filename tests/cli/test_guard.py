"""Whatever a file does to the process that reads it: one sentence, and the other files are read."""

import json
import os
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
from shiplog.machine import reading_limits as limits

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


STARTER = "import subprocess, sys; sys.exit(subprocess.call(sys.argv[1:], process_group=0))"


def test_ctrl_z_stops_the_child_as_well_and_it_goes_on_with_its_command(logs, tmp_path):
    """A shell, which can let it go on, starts the command in a group of its own."""
    asleep = command("print('now', flush=True); time.sleep(60)", *ingest(logs, tmp_path))
    shell = subprocess.Popen([sys.executable, "-c", STARTER, *asleep], cwd=ROOT, text=True,
                             stdout=subprocess.PIPE, start_new_session=True)  # fmt: skip
    with shell:
        assert shell.stdout and shell.stdout.readline() == "now\n"
        (parent,) = psutil.Process(shell.pid).children()
        both = [parent, *parent.children()]
        parent.send_signal(signal.SIGTSTP)
        stopped = [become(one, True) for one in both]
        parent.send_signal(signal.SIGCONT)
        going_on = [become(one, False) for one in both]
        parent.terminate()
        assert shell.wait(30) == 128 + signal.SIGTERM
    assert stopped == going_on == [True, True]


def become(process, stopped) -> bool:
    """Whether it is stopped, or goes on, within ten seconds."""
    for _ in range(100):
        if (process.status() == psutil.STATUS_STOPPED) == stopped:
            return True
        time.sleep(0.1)
    return False


def test_a_terminal_that_stops_background_writers_does_not_stop_the_child(tmp_path):
    """`stty tostop`."""
    import pty
    import termios

    ours, theirs = pty.openpty()
    mode = termios.tcgetattr(theirs)
    mode[3] |= termios.TOSTOP
    termios.tcsetattr(theirs, termios.TCSANOW, mode)
    takes_the_terminal = (
        "import fcntl, os, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
        "os.execv(sys.argv[1], sys.argv[1:])"
    )
    done = subprocess.run(
        [sys.executable, "-c", takes_the_terminal,
         *map(str, command("pass", "profile", tmp_path / "none.mcap"))],
        cwd=ROOT, timeout=60, check=False,
        stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
    )  # fmt: skip
    assert done.returncode == 1 and b"none.mcap does not exist" in os.read(ours, 1 << 16)
