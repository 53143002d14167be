"""Two Ray nodes on this machine: a head, and a worker that a test may kill."""

import os
import re
import secrets
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import psutil

RAY = Path(sys.executable).with_name("ray")
STARTS_S = 90.0


@contextmanager
def two_nodes(tmp_path):
    """A head and a worker with a core each: (address, the worker's process)."""
    token = tmp_path / "token"
    token.write_text(secrets.token_hex(32), encoding="utf-8")
    os.environ |= {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN_PATH": str(token)}
    port = 20_000 + os.getpid() % 20_000
    store = ["--num-cpus", "1", "--object-store-memory", str(100_000_000), "--block"]
    started = [_start(tmp_path / "head", "--head", "--port", str(port), "--include-dashboard",
                      "false", *store)]  # fmt: skip
    try:
        address = wait(lambda: _address(tmp_path / "head"), STARTS_S)
        started.append(_start(tmp_path / "worker", "--address", address, *store))
        wait(lambda: "Ray runtime started" in text(tmp_path / "worker"), STARTS_S)
        yield address, started[1]
    finally:
        for process in reversed(started):
            kill(process)
        for name in ("RAY_AUTH_MODE", "RAY_AUTH_TOKEN_PATH"):
            os.environ.pop(name)


def _start(output, *arguments):
    with open(output, "w", encoding="utf-8") as out:
        return subprocess.Popen(
            [RAY, "start", "--disable-usage-stats", *arguments],
            stdout=out,
            stderr=subprocess.STDOUT,
        )


def text(path):
    return path.read_text(encoding="utf-8") if path.exists() else ""


def _address(path):
    """As `ray start --head` prints it for the others."""
    said = text(path)
    found = re.search(r"--address='([^']+)'", said)
    return found[1] if found and "Ray runtime started" in said else None


def wait(condition, seconds):
    until = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < until, "Ray did not start in time"
        time.sleep(0.5)
    return found


def kill(process):
    """With all that it started, as a machine that loses its power."""
    end(process.pid)
    process.wait()


def end(pid):
    """The same of a process that another one started, which waits for it."""
    try:
        process = psutil.Process(pid)
        family = [*process.children(recursive=True), process]
    except psutil.NoSuchProcess:
        family = []
    for one in family:
        try:
            one.kill()
        except psutil.NoSuchProcess:
            continue
