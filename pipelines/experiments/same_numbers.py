"""Whether the sample logs give the same numbers to the last bit on one core and on all of them.

    python -m pipelines.experiments.same_numbers [LOGS] --out DIR

For a nightly run: ingest, a network of two seeds, an MMG, a hybrid, an evaluation and a diagnosis,
once on one core with one thread a library, once on all cores with three. Exit code 1 where any
file differs. Times and pictures, which hold times, are not compared. Linux only.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import polars as pl

ROOT = Path(__file__).parents[2]
STORE = ("--store", "store")
LEARN = ("--voyages", "voyage_1", "--voyages", "voyage_2")
COMMANDS = (
    ("ingest", "logs", *STORE),
    ("train", *STORE, *LEARN, "--validation", "voyage_3", "--out", "network", "--data", "sli2",
     "--width", "64", "--epochs", "20", "--seeds", "2"),
    ("train", *STORE, *LEARN, "--out", "mmg", "--model", "mmg"),
    ("train", *STORE, *LEARN, "--out", "hybrid", "--model", "hybrid"),
    ("evaluate", "network", "--voyages", "voyage_6", *STORE),
    ("diagnose", "mmg", "--voyages", "season2_*", *STORE, "--out", "found", "--extend", "mmg2"),
)  # fmt: skip
TIMES = ("began", "ended", "command")  # of a run's provenance; the command is that of SCRIPT
LIBRARIES = ("POLARS_MAX_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NPROC")
# In a process of its own: libraries count the cores when they are loaded.
SCRIPT = """
import json, os, sys
cores, commands = json.loads(sys.argv[1])
os.sched_setaffinity(0, cores)
from shiplog import cli
from shiplog.cli import process
process.one_thread()
sys.exit(max(cli.run(command) for command in commands))
"""


def run_on(
    cores: Sequence[int], threads: int, folder: Path, commands: Sequence[Sequence[str]] = COMMANDS
) -> None:
    """Command lines of shiplog, in a folder, on these cores. Raises RuntimeError with what was
    said where one of them fails."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, json.dumps([list(cores), commands])],
        env={**os.environ, **dict.fromkeys(LIBRARIES, str(threads)), "PYTHONPATH": str(ROOT)},
        cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(done.stderr)


def content(folder: Path) -> dict[str, bytes | str]:
    """What every file under a folder says, by its path there."""
    return {
        str(path.relative_to(folder)): _said(path)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix != ".rrd"
    }


def _said(path: Path) -> bytes | str:
    if path.suffix == ".parquet":
        return pl.read_parquet(path, hive_partitioning=False).write_json()
    if path.name == "provenance.json":
        known = json.loads(path.read_text(encoding="utf-8"))
        return json.dumps({key: value for key, value in known.items() if key not in TIMES})
    if path.name == "report.html":  # its last section has the times of provenance.json
        return path.read_text(encoding="utf-8").partition('<section id="provenance"')[0]
    return path.read_bytes()


def differing(one: dict[str, bytes | str], other: dict[str, bytes | str]) -> list[str]:
    """The files that are not the same in both, or not in both."""
    return [name for name in sorted(one.keys() | other.keys()) if one.get(name) != other.get(name)]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", type=Path, nargs="?", default=ROOT / "sample_logs")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    cores = sorted(os.sched_getaffinity(0))
    found = []
    for name, chosen, threads in (("one", cores[:1], 1), ("all", cores, 3)):
        folder = given.out / name
        shutil.copytree(given.logs, folder / "logs")
        run_on(chosen, threads, folder)
        found.append(content(folder))
    differ = differing(*found)
    print(f"{len(found[0])} files on 1 core and on {len(cores)}: {len(differ)} differ")
    print(*differ, sep="\n")
    return int(bool(differ))


if __name__ == "__main__":
    sys.exit(main())
