"""Child processes: each ends with its parent, whatever ends that, and its end is said.

| started by | what it is | how it learns that its parent has ended |
| --- | --- | --- |
| `fork` | this process again, before anything heavy is loaded (`cli/guard`) | a signal of Linux |
| `spawn` | a function in a new Python (`training/network/queue`) | a thread waits for the parent |
| `script` | a Python file that answers lines (`logs/reading/rerun_route`) | its stdin ends |
| `program` | a program of others (`report/viewer/native`) | a supervisor's stdin ends |

Nobody can catch SIGKILL, but the system closes the pipes of a process that it ends: so the last
three hold on every system. Run as a program, this file is the supervisor: its arguments are the
command. Only the standard library is used, and what takes time to import is imported where it is
needed: a command forks first of all.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    import subprocess
    from multiprocessing.connection import Connection
    from multiprocessing.process import BaseProcess
    from pathlib import Path

    Process = subprocess.Popen[bytes] | subprocess.Popen[str]

FAULT = 1  # exit code
PR_SET_PDEATHSIG = 1  # of Linux's prctl: the signal that a child gets when its parent has ended
PATIENCE_S = 5.0  # s: how long a process that was asked to end may take
SUPERVISOR_PATIENCE_S = 4.0  # s: the same of a program, less than its supervisor's
LAST_BYTES = 1 << 16  # of what a fork has said that its parent keeps
LAST_LETTERS = 300  # of a program's last line


# A fork


@dataclass(frozen=True)
class Forked:
    """A child that is this process again.

    pipe   what it writes to its parent comes out here
    """

    pid: int
    pipe: int

    def wait(self) -> tuple[int, bytes]:
        """Its exit code, or minus the signal that ended it; and the last bytes that it wrote.

        Signals that come meanwhile are the child's.
        """
        import select

        passed_on = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
        if signal.getsignal(signal.SIGTSTP) is signal.SIG_DFL:
            passed_on.append(signal.SIGTSTP)
        before = {number: signal.signal(number, lambda *_: None) for number in passed_on}
        # Their numbers come through a pipe, too: one that arrives just before a read is not late
        # until something can be read (the self-pipe trick of D. J. Bernstein).
        woken, waking = os.pipe()
        os.set_blocking(waking, False)
        others = signal.set_wakeup_fd(waking)
        said = b""
        while True:
            ready = select.select([self.pipe, woken], [], [])[0]
            if woken in ready:
                for number in os.read(woken, 1 << 16):
                    self._pass_on(number)
            if self.pipe in ready:
                if not (some := os.read(self.pipe, 1 << 16)):
                    break
                said = (said + some)[-LAST_BYTES:]
        signal.set_wakeup_fd(others)
        os.close(woken)
        os.close(waking)
        os.close(self.pipe)
        _, status = os.waitpid(self.pid, 0)
        for number, handler in before.items():
            signal.signal(number, handler)
        return os.waitstatus_to_exitcode(status), said

    def _pass_on(self, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            if number != signal.SIGTSTP:
                os.kill(self.pid, number)
                return
            # Ctrl-Z: both stop, and go on together. Where nobody could let this process go on,
            # the system does not stop it.
            os.kill(self.pid, signal.SIGSTOP)
            handler = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGTSTP)
            signal.signal(signal.SIGTSTP, handler)
            os.kill(self.pid, signal.SIGCONT)


def fork() -> Forked | int:
    """In the parent the child; in the child the pipe through which it writes to its parent.

    Linux only, and only in a process of one thread.
    """
    import gc

    gc.freeze()  # a collection would touch every object, and copy the pages that are shared
    reading, writing = os.pipe()
    parent = os.getpid()
    pid = os.fork()
    if pid:
        os.close(writing)
        return Forked(pid, reading)
    os.close(reading)
    os.setpgid(0, 0)  # Ctrl-C reaches the parent alone, which passes it on once
    # The child is in the background for the terminal, which may stop such a one that writes.
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    _killed_with(parent)
    return writing


def _killed_with(parent: int) -> None:
    """In a child on Linux: SIGKILL when the thread that started it, or its process, has ended."""
    import ctypes

    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it ended before
        os._exit(FAULT)


# A function in a new Python


def spawn(
    serve: Callable[[Connection], None], environment: Mapping[str, str]
) -> tuple[BaseProcess, Connection]:
    """A new Python that runs `serve`, and the pipe between the two; its end is the pipe's end.

    environment   variables that are set in it, and in this process only while it starts
    """
    from multiprocessing import get_context

    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_served, args=(serve, theirs), daemon=True)
    with _variables(environment), _signals_deferred(), _script_hidden():
        process.start()
    theirs.close()  # so that the child's death is the end of the pipe
    return process, ours


def _served(serve: Callable[[Connection], None], pipe: Connection) -> None:
    """In the child. Ctrl-C is the parent's to handle."""
    from multiprocessing import parent_process

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if (parent := parent_process()) is not None:
        _end_after(parent.join)
    serve(pipe)


@contextlib.contextmanager
def _variables(changes: Mapping[str, str]) -> Iterator[None]:
    """Variables of the environment, which a child that starts meanwhile inherits."""
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _signals_deferred() -> Iterator[None]:
    """Signals that end this process are handled after a child process has received its arguments.

    A child process that does not receive them ends in a traceback. A terminal sends Ctrl-C to child
    processes, too: this one starts with that signal blocked.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # no signal is handled here
        return
    came: list[int] = []
    numbers = [signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)]
    before = {one: signal.getsignal(one) for one in numbers}
    before = {one: handler for one, handler in before.items() if callable(handler)}
    for one in before:
        signal.signal(one, lambda number, _: came.append(number))
    can_block = hasattr(signal, "pthread_sigmask")  # not on Windows
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if can_block else None
    try:
        yield
    finally:
        if mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for one, handler in before.items():
            signal.signal(one, handler)
        for number in came[:1]:
            signal.raise_signal(number)


@contextlib.contextmanager
def _script_hidden() -> Iterator[None]:
    """A child process does not run the script again that calls shiplog from Python.

    It would import it as its main module. All that a task is made of is in modules of their own.
    """
    from types import ModuleType

    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


# A Python file that answers lines


def script(path: Path) -> subprocess.Popen[str]:
    """Run a Python file that reads its `requests` on stdin, and answers on stdout."""
    import subprocess

    return subprocess.Popen(
        [sys.executable, "-P", str(path)],  # its folder not on the path: no clash
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        encoding="utf-8",
    )


def requests() -> Iterator[str]:
    """In the child, the lines of its stdin. The end of stdin ends the process, also one that is at
    work on a line: its parent has ended, or wants nothing more."""
    from queue import SimpleQueue

    lines: SimpleQueue[str] = SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            lines.put(line)

    _end_after(read)
    while True:
        yield lines.get()


def _end_after(wait: Callable[[], object]) -> None:
    """A thread ends this process at once when `wait` returns."""

    def end() -> None:
        wait()
        os._exit(FAULT)

    threading.Thread(target=end, daemon=True).start()


# A program of others


def program(
    command: Sequence[str],
    output: IO[bytes],
    environment: Mapping[str, str],
    supervised: bool = False,
) -> subprocess.Popen[bytes]:
    """Start a program in a group of its own, so that Ctrl-C here does not end it.

    supervised   it ends when this process ends, however that comes about
    """
    import subprocess

    return subprocess.Popen(
        [sys.executable, "-I", __file__, *command] if supervised else list(command),
        env=environment,
        stdin=subprocess.PIPE if supervised else subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )


def _supervise(command: Sequence[str]) -> int:
    """Run a command until it ends, or stdin does; its exit code. One that a signal ended ends this
    process by the same signal, and SIGTERM is passed on."""
    import subprocess

    own = os.getpid()
    linux = sys.platform == "linux"
    server = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        preexec_fn=(lambda: _killed_with(own)) if linux else None,
    )
    signal.signal(signal.SIGTERM, lambda *_: server.terminate())

    def end() -> None:
        while os.read(0, 1 << 10):  # not sys.stdin, whose lock Python wants when it ends
            pass
        stop(server, SUPERVISOR_PATIENCE_S)

    threading.Thread(target=end, daemon=True).start()
    code = server.wait()
    if code < 0:
        with contextlib.suppress(OSError):  # SIGKILL has no handler
            signal.signal(-code, signal.SIG_DFL)
        os.kill(own, -code)
    return code


# Its end


def stop(process: Process, patience_s: float = PATIENCE_S) -> None:
    """End it: at first politely, and after so many seconds, or at once for 0, by force."""
    import subprocess

    if patience_s and process.stdin is not None:
        process.stdin.close()  # its supervisor ends it
    elif patience_s:
        process.terminate()
    else:
        process.kill()
    try:
        process.wait(patience_s or None)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()


@contextlib.contextmanager
def patience(process: Process, seconds: float) -> Iterator[None]:
    """A block in which the process is ended by force after so many seconds."""
    timer = threading.Timer(seconds, process.kill)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def ending_signal(code: int | None) -> str:
    """Name of the signal that ended a process with this exit code; empty where none did."""
    return signal.Signals(-code).name if code is not None and code < 0 else ""


def last_words(output: IO[bytes]) -> str:
    """A program's last line, for a message."""
    output.seek(0)
    lines = [line for line in output.read().decode(errors="replace").splitlines() if line.strip()]
    return lines[-1].strip()[:LAST_LETTERS] if lines else "it gave no message."


if __name__ == "__main__":
    sys.exit(_supervise(sys.argv[1:]))
