"""How fast a long log becomes a voyage, compared with another build of shiplog, and its memory.

    python -m pipelines.experiments.benchmarks.ingest_log [--hours 8] [--baseline OTHER/bin/python]

The sample voyage over and over. The builds take turns, each round in a process of its own with the
start of Python included; the figures are medians of processor time, the ratio that of the rounds.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from pipelines.experiments.benchmarks.check_log import of_sensors

ROUNDS = 5
PROGRAM = """
import sys
from pathlib import Path
try:
    from shiplog.ship_profile import file
    from shiplog.voyages.ingest.ingest import ingest
except ImportError:  # a build without rooms
    from shiplog import profile_file as file
    from shiplog.voyages.ingest import ingest
voyage = ingest(Path(sys.argv[1]), file.load("esso-vectwin"))
print(voyage.report.messages_read)
"""
LEAST_RATIO = 0.9  # of the baseline's messages a second


def ingested(python: Path, path: Path) -> tuple[int, float, float]:
    """Messages read, processor seconds, and MB at most, of one process and its children."""
    free = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    command = [python, "-P", "-c", PROGRAM, path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=free) as process:
        assert process.stdout is not None
        read = process.stdout.read()
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{python} ended with {process.returncode}")
    return int(read), used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--baseline", type=Path, help="Python of an environment of another build")
    given = parser.parse_args()
    pythons = {"this build": Path(sys.executable)}
    if given.baseline is not None:
        pythons["the baseline"] = given.baseline.absolute()
    times: dict[str, list[float]] = {name: [] for name in pythons}
    memory: dict[str, float] = dict.fromkeys(pythons, 0.0)
    count = 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.mcap"
        context = multiprocessing.get_context("spawn")  # the children inherit this process's peak
        with context.Pool(1) as pool:
            pool.apply(of_sensors, (path, given.hours))
        for turn in range(given.rounds + 1):
            for name, python in pythons.items():
                count, busy, most = ingested(python, path)
                memory[name] = max(memory[name], most)
                if turn:  # the first has the file in memory
                    times[name].append(busy)
    for name, found in times.items():
        middle = statistics.median(found)
        range_ = f"{min(found):.2f} to {max(found):.2f}"
        print(
            f"{name}: {count} messages in {middle:.2f} s of processor time ({range_}), "
            f"{count / middle / 1e3:.0f}k messages/s, at most {memory[name]:.0f} MB"
        )
    if given.baseline is not None:
        pairs = zip(times["the baseline"], times["this build"], strict=True)
        ratios = sorted(other / own for other, own in pairs)
        print(f"messages a second over the baseline's: {statistics.median(ratios):.2f} "
              f"({ratios[0]:.2f} to {ratios[-1]:.2f}); goal {LEAST_RATIO}")  # fmt: skip


if __name__ == "__main__":
    main()
