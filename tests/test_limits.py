"""What a process may take: of memory, and of processor time."""

import subprocess
import sys
from pathlib import Path

import pytest

from shiplog.machine import child

ROOT = Path(__file__).parents[1]
linux = pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")


@linux
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "limits.set_limits(memory=limits.reserved() + (1 << 26)); bytearray(1 << 28)",
            "MemoryError",
        ),
        ("limits.set_limits(memory=limits.reserved() + (1 << 28)); bytearray(1 << 26)", ""),
        ("limits.set_limits(seconds=0.0)\nwhile True: pass", "SIGXCPU"),
        ("limits.set_limits(memory=0)\nwith limits.lifted(): bytearray(1 << 26)", ""),
    ],
    ids=["memory", "enough memory", "time", "lifted"],
)
def test_a_limit_ends_what_passes_it(text, expected):
    command = [sys.executable, "-c", "from shiplog.machine import limits\n" + text]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    last = done.stderr.strip().rpartition("\n")[2]
    assert (child.ending_signal(done.returncode) or last) == expected


@linux
def test_a_limit_stays_below_that_of_the_system():
    program = (
        "import resource; from shiplog.machine import limits\n"
        "resource.setrlimit(resource.RLIMIT_DATA, (1 << 30, 1 << 30))\n"
        "limits.set_limits(memory=1 << 40)\nprint(resource.getrlimit(resource.RLIMIT_DATA)[0])"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == f"{1 << 30}\n"
