"""Answers and keys of tests in one file, small enough for the repository.

A test may be unpacked from it, on any machine, and goes on where it was.
"""

from __future__ import annotations

import hashlib
import io
import json
import tarfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pipelines.experiments.hidden_effects.score import made
from shiplog.exceptions import ShiplogError
from shiplog.machine import files

KEPT = ("verdict.json", "verdict.sha256", "rivals.json", "rivals.sha256", "oracle.json",
        "steps.json")  # fmt: skip


def pack(tests: Sequence[Path], path: Path) -> Path:
    """The sealed answers of these tests' folders, and their keys; the same bytes each time.

    Raises ShiplogError where a folder holds no test, or two have one name.
    """
    if twice := {test.name for test in tests if sum(t.name == test.name for t in tests) > 1}:
        raise ShiplogError(
            f"Two of the folders are called {twice.pop()}.", hint="rename one of them."
        )
    with files.whole(path) as partial, tarfile.open(partial, "w:xz", preset=9) as packed:
        for test in tests:
            if not (test / "keys" / "plan.json").exists():
                raise ShiplogError(
                    f"{test} holds no test of hidden effects.", hint="give the --out of a suite."
                )
            for file in _contents(test):
                content = _elsewhere(test, file)
                about = tarfile.TarInfo(f"{test.name}/{file.relative_to(test).as_posix()}")
                about.size = len(content)
                packed.addfile(about, io.BytesIO(content))
    return path


def _elsewhere(test: Path, file: Path) -> bytes:
    """A file without the paths of the machine that made it: what steps wrote to stderr is left out,
    and the path of a recording is shortened. The seal of a verdict is then of what is packed; one
    that did not match is left as it is."""
    content = file.read_bytes()
    if file.name == "steps.json":
        steps = [one | {"stderr": ""} for one in json.loads(content)]
        return (json.dumps(steps, indent=1) + "\n").encode()
    if file.name not in ("verdict.json", "verdict.sha256"):
        return content
    answer = file.with_name("verdict.json").read_bytes()
    recording = json.loads(answer).get("recording")
    if not recording:
        return content
    here = str(Path(recording).parents[1]).encode()  # the folder of the case, as it was called
    there = f"{test.name}/cases/{file.parent.name}".encode()
    if file.name == "verdict.json":
        return content.replace(here, there)
    was, now = (hashlib.sha256(one).hexdigest() for one in (answer, answer.replace(here, there)))
    return content.replace(was.encode(), now.encode())


def _contents(test: Path) -> list[Path]:
    """The plan, and of each sealed case its key and answers; a case whose logs could not be written
    has no key."""
    sealed = sorted(seal.parent for seal in (test / "cases").glob("*/verdict.sha256"))
    keys = [test / "keys" / f"{case.name}.json" for case in sealed if made(_steps(case))]
    return [
        test / "keys" / "plan.json", *keys,
        *(case / name for case in sealed for name in KEPT if (case / name).exists()),
    ]  # fmt: skip


def _steps(case: Path) -> list[dict[str, Any]]:
    return json.loads((case / "steps.json").read_text(encoding="utf-8"))


@contextmanager
def opened(given: Sequence[Path]) -> Iterator[list[Path]]:
    """The folders of tests; of a file that was packed those in it, for as long as this lasts.

    Raises ShiplogError where a file is no such archive.
    """
    with TemporaryDirectory() as temporary:
        folders: list[Path] = []
        for number, path in enumerate(given):
            if not path.is_file():
                folders.append(path)
                continue
            into = Path(temporary) / str(number)
            try:
                with tarfile.open(path) as packed:
                    packed.extractall(into, filter="data")
            except tarfile.TarError as error:
                raise ShiplogError(
                    f"{path} is no archive of tests ({error}).",
                    hint="give a file that `pack` wrote, or the --out of a suite.",
                ) from error
            folders += sorted(into.iterdir())
        yield folders
