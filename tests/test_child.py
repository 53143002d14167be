"""Child processes end with their parent, whatever ends it, and say how they ended."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import psutil
import pytest

from shiplog.machine import child

ROOT = Path(__file__).parents[1]
linux = pytest.mark.skipif(sys.platform != "linux", reason="limits and signals of Linux")
posix = pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
SLEEPER = "import time; print('asleep', flush=True); time.sleep(600)"
STUBBORN = "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); " + SLEEPER

# Parents: each starts a child, prints the child's number, and waits.
PARENTS = {
    "fork": """
forked = child.fork()
if isinstance(forked, int):
    os.write(forked, b"x")
    time.sleep(600)
print(forked.pid, flush=True)
forked.wait()
""",
    "spawn": """
import queue_of_sleepers
process, pipe = child.spawn(queue_of_sleepers.serve, {})
print(process.pid, flush=True)
time.sleep(600)
""",
    "script": """
process = child.script("FOLDER/busy.py")
process.stdin.write("work\\n")
process.stdin.flush()
assert process.stdout.readline() == "at work\\n"
print(process.pid, flush=True)
time.sleep(600)
""",
    "program": """
with open("FOLDER/output", "wb") as output:
    process = child.program([sys.executable, "-c", SLEEPER], output, os.environ, supervised=True)
print(process.pid, flush=True)
time.sleep(600)
""",
}
HEAD = f"""
import os, sys, time
sys.path.insert(0, "FOLDER")
from shiplog.machine import child
SLEEPER = {SLEEPER!r}
"""
BUSY = """
import sys, time
from shiplog.machine import child
for line in child.requests():
    print("at work", flush=True)
    time.sleep(600)
"""


@posix
@pytest.mark.parametrize("kind", [pytest.param("fork", marks=linux), "spawn", "script", "program"])
def test_a_parent_that_is_killed_takes_its_child_along(tmp_path, kind):
    (tmp_path / "queue_of_sleepers.py").write_text("def serve(pipe):\n    pipe.recv()\n")
    (tmp_path / "busy.py").write_text(BUSY)
    text = (HEAD + PARENTS[kind]).replace("FOLDER", str(tmp_path))
    command = [sys.executable, "-c", text]
    parent = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    with parent:
        assert parent.stdout
        started = psutil.Process(int(parent.stdout.readline()))
        assert started in psutil.Process(parent.pid).children()
        family = [started, *started.children(recursive=True)]
        parent.kill()
    _, alive = psutil.wait_procs(family, timeout=30)
    assert [one for one in alive if one.status() != psutil.STATUS_ZOMBIE] == []


def supervised(text):
    """A Python program under its supervisor, once it has said its first word, and its process."""
    output = tempfile.TemporaryFile()  # noqa: SIM115  the test closes it
    process = child.program([sys.executable, "-c", text], output, os.environ, supervised=True)
    while not os.fstat(output.fileno()).st_size:
        assert process.poll() is None
    (inner,) = psutil.Process(process.pid).children()
    return process, inner, output


@posix
@pytest.mark.parametrize("name", ["SIGTERM", "SIGKILL", "SIGABRT"])
def test_a_supervisor_ends_by_the_signal_that_ended_its_program(name):
    process, inner, output = supervised(SLEEPER)
    with output:
        inner.send_signal(getattr(signal, name))
        assert child.ending_signal(process.wait(30)) == name
        child.stop(process)


@posix
def test_a_supervisor_passes_sigterm_on():
    process, inner, output = supervised(SLEEPER)
    with output:
        process.terminate()
        assert child.ending_signal(process.wait(30)) == "SIGTERM"
        assert not inner.is_running()
        child.stop(process)


@linux
def test_a_supervisor_that_is_killed_takes_its_program_along():
    process, inner, output = supervised(SLEEPER)
    with output:
        process.kill()
        _, alive = psutil.wait_procs([inner], timeout=30)
        assert [one for one in alive if one.status() != psutil.STATUS_ZOMBIE] == []
        child.stop(process)


def test_a_supervisor_gives_the_exit_code_and_the_words_of_its_program():
    text = "import sys; print('  '); print('first'); print(' no display '); print(); sys.exit(7)"
    with tempfile.TemporaryFile() as output:
        process = child.program([sys.executable, "-c", text], output, os.environ, supervised=True)
        assert process.wait(30) == 7
        assert child.last_words(output) == "no display"
        child.stop(process)


@pytest.mark.parametrize("said", [b"", b" \n\n"])
def test_a_program_without_words_gave_no_message(said):
    with tempfile.TemporaryFile() as output:
        output.write(said)
        assert child.last_words(output) == "it gave no message."


@posix
def test_what_does_not_end_politely_is_ended_by_force(monkeypatch):
    with tempfile.TemporaryFile() as output:
        process = child.program([sys.executable, "-c", STUBBORN], output, os.environ)
        while not os.fstat(output.fileno()).st_size:
            assert process.poll() is None
        child.stop(process, patience_s=0.1)
        assert child.ending_signal(process.returncode) == "SIGKILL"


@posix
def test_patience_ends_a_script_that_does_not_answer(tmp_path):
    path = tmp_path / "busy.py"
    path.write_text(BUSY)
    process = child.script(path)
    assert process.stdin and process.stdout
    with child.patience(process, 0.0):
        assert process.stdout.readline() == ""
    child.stop(process, patience_s=0.0)
    assert child.ending_signal(process.returncode) == "SIGKILL"
    assert process.stdin.closed and process.stdout.closed


def test_a_script_answers_line_by_line(tmp_path):
    path = tmp_path / "twice.py"
    path.write_text(
        "from shiplog.machine import child\n"
        "for line in child.requests():\n    print(2 * int(line), flush=True)\n"
    )
    process = child.script(path)
    assert process.stdin and process.stdout
    for number in (3, 21):
        process.stdin.write(f"{number}\n")
        process.stdin.flush()
        assert process.stdout.readline() == f"{2 * number}\n"
    process.stdin.close()
    assert process.wait(30) == child.FAULT
    child.stop(process)


def tells(pipe):
    """In a child: its environment, and what Ctrl-C does to it."""
    signal.raise_signal(signal.SIGINT)
    pipe.send((os.environ.get("ONLY_THERE"), os.environ.get("BOTH")))


def test_a_spawned_function_has_its_own_variables_and_no_ctrl_c(monkeypatch):
    monkeypatch.delenv("ONLY_THERE", raising=False)
    monkeypatch.setenv("BOTH", "before")
    process, pipe = child.spawn(tells, {"ONLY_THERE": "1", "BOTH": "2"})
    assert pipe.recv() == ("1", "2")
    with pytest.raises(EOFError):  # its end is the end of the pipe
        pipe.recv()
    process.join()
    assert process.exitcode == 0
    assert (os.environ.get("ONLY_THERE"), os.environ["BOTH"]) == (None, "before")


def outcome(text):
    """What `Forked.wait` gives when the fork does `text`, where `pipe` leads to the parent."""
    program = (
        "import json, os, signal, sys, time\nfrom shiplog.machine import child\n"
        "pipe = child.fork()\n"
        f"if isinstance(pipe, int):\n    {text}\n    os._exit(9)\n"
        "code, said = pipe.wait()\nprint(json.dumps([code, len(said), said[-4:].decode()]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout)


@linux
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("pass", [9, 0, ""]),
        ("os.write(pipe, b'a\\0bc\\0'); os.abort()", [-signal.SIGABRT, 5, "\0bc\0"]),
        # of many words, the last
        ("[os.write(pipe, b'x' * 4096) for _ in range(40)]; os.write(pipe, b'last')",
         [9, child.LAST_BYTES, "last"]),
        # once the parent waits: a signal before that ends it, and the child with it
        ("time.sleep(1.0); os.kill(os.getppid(), signal.SIGTERM); time.sleep(600)",
         [-signal.SIGTERM, 0, ""]),
    ],
    ids=["nothing", "abort", "many words", "a signal to the parent"],
)  # fmt: skip
def test_a_fork_says_how_it_ended_and_what_it_wrote(text, expected):
    assert outcome(text) == expected


def test_no_signal_ended_what_ended_by_itself():
    assert [child.ending_signal(code) for code in (None, 0, 3)] == ["", "", ""]


def test_only_the_standard_library_is_loaded():
    """A command forks before it has loaded anything else, and the supervisor is this file alone."""
    program = (
        "import sys\nbefore = set(sys.modules)\nfrom shiplog.machine import child\n"
        "for name in sys.modules.keys() - before:\n"
        "    if name.split('.')[0] not in sys.stdlib_module_names: print(name)\n"
        "    if name in ('subprocess', 'multiprocessing', 'ctypes', 'resource'): print(name)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert sorted(done.stdout.split()) == ["shiplog", "shiplog.machine", "shiplog.machine.child"]
