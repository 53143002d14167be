"""What a diagnosis was made from, kept in its folder: with the same inputs it is not made again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from shiplog.machine import disk_cache, files
from shiplog.report.page.diagnosis.source import VERDICT
from shiplog.training.runs.run_folder import RunFolder
from shiplog.voyages.store.store import Store

INPUTS = "inputs.json"  # in the folder of a diagnosis, written last
OF_A_RUN = (".toml", ".json", ".parquet", ".safetensors")
OF_AN_EVALUATION = ("errors.parquet", "rollouts.parquet")  # the latest one's, in the run's folder


def inputs_of(
    run: RunFolder, store: Store, names: Sequence[str], cause_files: Sequence[Path]
) -> dict[str, Any]:
    """Digests of the run's files, of the voyages' tables, of own causes and of the program.

    names   the voyages to diagnose, as they were found
    """
    tables = {entry.name: entry.fingerprint for entry in store.entries()}
    return {
        "program": disk_cache.source().hex(),
        "run": _digest(_files_of(run.path), run.path),
        "voyages": {name: tables[_whole(store, name)] for name in names},
        "nominal": {n: tables[_whole(store, n)] for n in store.there(run.trained_on)},
        "causes": [_digest([path], path.parent) for path in cause_files],
    }


def kept(folder: Path, inputs: dict[str, Any]) -> bool:
    """Whether the folder holds the whole diagnosis of these inputs."""
    try:
        was = json.loads((folder / INPUTS).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return was == inputs and verdict_of(folder) is not None


def keep(folder: Path, inputs: dict[str, Any]) -> None:
    files.write_json(folder / INPUTS, inputs)


def verdict_of(folder: Path) -> dict[str, Any] | None:
    """The verdict of a diagnosis' folder, as --json writes it; None where none can be read."""
    try:
        found = json.loads((folder / VERDICT).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) and isinstance(found.get("verdict"), str) else None


def _whole(store: Store, name: str) -> str:
    part = store.part_of(name)
    return part.whole if part else name


def _files_of(run: Path) -> list[Path]:
    """What a model is made from: what evaluations and diagnoses leave in its folder is not."""
    folders = [run, *sorted(run.glob("seed*"))]
    every = [path for one in folders for path in sorted(one.glob("*")) if path.is_file()]
    return [p for p in every if p.suffix in OF_A_RUN and p.name not in OF_AN_EVALUATION]


def _digest(paths: Iterable[Path], beside: Path) -> str:
    """SHA-256 over names and contents."""
    digest = hashlib.sha256()
    for path in paths:
        content = path.read_bytes()
        name = path.relative_to(beside).as_posix()
        digest.update(f"{name}\0{len(content)}\0".encode("utf-8", "surrogatepass") + content)
    return digest.hexdigest()
