"""One target for some minutes: only the sentences that shiplog says may come out of it.

    python -m pipelines.experiments.fuzzing logs --seconds 600 --corpus DIR

Needs `pip install atheris`. Every other exception ends the run, and what caused it stands in the
corpus's folder as `crash-*`; `--once FILE` runs it again.
"""

from __future__ import annotations

import argparse
import importlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from shiplog.exceptions import ShiplogError

BEGINNINGS = Path(__file__).with_name("corpus")
LARGEST = {"logs": 20_000, "profile": 4_000, "config": 4_000}  # bytes of an input
LONGEST_S = 20  # of one input: more is a hang


def logs(data: bytes) -> None:
    from shiplog.logs.reading.check import check
    from shiplog.logs.reading.read import contents, fields

    with tempfile.NamedTemporaryFile(suffix=".mcap") as file:
        file.write(data)
        file.flush()
        for reader in (contents, fields, check):
            refused(reader, Path(file.name))


def profile(data: bytes) -> None:
    from shiplog.ship_profile import file as profile_file

    with tempfile.NamedTemporaryFile(suffix=".toml") as file:
        file.write(data)
        file.flush()
        refused(profile_file.load, Path(file.name))


def config(data: bytes) -> None:
    from shiplog.training.settings import run_config

    with tempfile.NamedTemporaryFile(suffix=".toml") as file:
        file.write(data)
        file.flush()
        refused(run_config.load, Path(file.name))


TARGETS: dict[str, Callable[[bytes], None]] = {"logs": logs, "profile": profile, "config": config}


def refused(reader: Callable, path: Path) -> bool:
    """Whether an input is refused with a sentence; any other exception goes on."""
    try:
        reader(path)
    except ShiplogError as error:
        assert len(str(error)) > 20, "a refusal without a reason"
        return True
    return False


def main() -> None:
    parser = argparse.ArgumentParser(description="Fuzz one target.")
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--corpus", type=Path, help="kept and extended; the shipped one is added")
    parser.add_argument("--once", type=Path, help="run the target on this file alone")
    asked = parser.parse_args()
    if asked.once:
        TARGETS[asked.target](asked.once.read_bytes())
        return
    atheris: Any = importlib.import_module("atheris")  # no dependency: the nightly script has it
    with atheris.instrument_imports(include=["shiplog"]):
        import shiplog.logs.reading.check
        import shiplog.ship_profile.file
        import shiplog.training.settings.run_config  # noqa: F401  # imported to be instrumented
    corpus = asked.corpus or Path(tempfile.mkdtemp(prefix="shiplog-corpus-"))
    corpus.mkdir(parents=True, exist_ok=True)
    options = [
        "fuzzing", str(corpus), str(BEGINNINGS / asked.target),
        f"-max_total_time={asked.seconds}", f"-max_len={LARGEST[asked.target]}",
        f"-timeout={LONGEST_S}", "-rss_limit_mb=1500", f"-artifact_prefix={corpus}{os.sep}",
        "-print_final_stats=1",
    ]  # fmt: skip
    atheris.Setup(options, TARGETS[asked.target])
    atheris.Fuzz()


if __name__ == "__main__":
    main()
