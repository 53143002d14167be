"""Two builds of shiplog, each in processes of its own with its own sources and its own cache."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[4]  # this build's sources
SERVED = Path(__file__).with_name("served.py")
ONE_THREAD = {
    "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NPROC": "1",
    "POLARS_MAX_THREADS": "1", "NUMBA_NUM_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
}  # fmt: skip
# Which instructions a compiled kernel may use, as for that of networks: portable, avx2 or avx512.
LEVEL = "SHIPLOG_KERNEL"
COMMAND = "from shiplog.cli import main; main()"
KEPT = 800  # last letters of what a child said on stderr, for a message


@dataclass(frozen=True)
class Build:
    """Sources of shiplog, and a folder for what its processes keep."""

    name: str
    sources: Path
    cache: Path
    more: dict[str, str] = field(default_factory=dict)

    def environment(self) -> dict[str, str]:
        """Its sources before all others: also before those that the interpreter has installed."""
        there = os.environ.get("PYTHONPATH", "")
        path = os.pathsep.join(filter(None, (str(self.sources), there)))
        own = {
            "PYTHONPATH": path,
            "XDG_CACHE_HOME": str(self.cache),
            "TMPDIR": tempfile.gettempdir(),
        }
        return {**os.environ, **ONE_THREAD, **own, **self.more}

    @property
    def commit(self) -> str:
        """Short, with + where the sources have changes; empty where there is no checkout."""

        def git(*words: str) -> str:
            done = subprocess.run(
                ["git", "-C", str(self.sources), *words],
                capture_output=True,
                text=True,
                check=False,
            )
            return done.stdout.strip() if done.returncode == 0 else ""

        found = git("rev-parse", "--short", "HEAD") if (self.sources / ".git").exists() else ""
        return found + ("+" if found and git("status", "--porcelain", "--", "shiplog") else "")


class Failed(Exception):
    """What a child process could not do."""


class Worker:
    """A child process that stays, with what it has loaded and compiled."""

    def __init__(self, build: Build, scratch: Path) -> None:
        self.name = build.name
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  as long as the process
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(SERVED)], cwd=scratch, env=build.environment(),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, text=True,
        )  # fmt: skip

    def ask(self, do: str, **asked: Any) -> Any:
        """What was found. Raises Failed."""
        return self._ask(do, **asked)["found"]

    def seconds(self, job: str) -> float:
        """Processor seconds of one call. Raises Failed."""
        return self._ask("time", job=job)["seconds"]

    def _ask(self, do: str, **asked: Any) -> dict[str, Any]:
        assert self._process.stdin is not None and self._process.stdout is not None
        try:
            self._process.stdin.write(json.dumps({"do": do, **asked}, default=str) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except OSError:
            line = ""
        if not line:
            self._said.seek(0)
            words = self._said.read().decode(errors="replace")[-KEPT:]
            raise Failed(f"{self.name} ended while it was at {do}: {words}")
        answer = json.loads(line)
        if "error" in answer:
            raise Failed(f"{self.name}, {do}: {answer['error']}")
        return answer

    def close(self) -> None:
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:  # the end of its stdin ends it
                pipe.close()
        self._process.wait()
        self._said.close()


@dataclass(frozen=True)
class Used:
    """Of one command: processor seconds of it and its children, peak memory [MB], its answer."""

    cpu_s: float
    peak_mb: float
    answer: dict[str, Any]


def command(build: Build, arguments: list[str], scratch: Path) -> Used:
    """Run a command of a build with --json. Raises Failed.

    The kernel gives a child's peak as at least that of the process that started it: this one loads
    nothing heavy.
    """
    answer = scratch / "answer.json"
    answer.unlink(missing_ok=True)
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", COMMAND, *arguments, "--json", str(answer)],
            cwd=scratch, env=build.environment(), stdin=subprocess.DEVNULL, stdout=said,
            stderr=said,
        )  # fmt: skip
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode not in (0, 3):
            said.seek(0)
            words = said.read().decode(errors="replace")[-KEPT:]
            raise Failed(
                f"{build.name}: {' '.join(arguments)} ended with {process.returncode}: {words}"
            )
    content = json.loads(answer.read_text(encoding="utf-8"))
    return Used(used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0, content)


def fresh(build: Build) -> None:
    """Nothing compiled, nothing kept."""
    shutil.rmtree(build.cache, ignore_errors=True)
