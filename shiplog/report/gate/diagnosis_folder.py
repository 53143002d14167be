"""A folder that `shiplog diagnose` wrote: is it of this run, as it is now, and of these voyages?"""

from __future__ import annotations

import datetime
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from shiplog.exceptions import RunError, listed
from shiplog.nomenclature.contract import CONTRACT
from shiplog.report.evaluation.text_table import one_line
from shiplog.report.gate import diagnosed
from shiplog.report.gate.diagnosed import Diagnosed
from shiplog.training.runs.run_folder import RunFolder
from shiplog.training.settings import run_files

AGAIN = "diagnose it again, or let the gate do it: leave --diagnosis out"


@dataclass(frozen=True)
class DiagnosisFolder:
    """What a folder of a diagnosis says of itself.

    logs    voyage → SHA-256 of its log
    began   when the diagnosis began (UTC); None where it does not say
    """

    path: Path
    verdict: Diagnosed
    logs: Mapping[str, str | None]
    began: str | None

    @property
    def voyages(self) -> list[str]:
        return list(self.logs)


def load(path: Path) -> DiagnosisFolder:
    """Raises RunError for what is no folder of a diagnosis, or of another contract."""
    content = _json(path, "verdict.json")
    contract = content.get("contract")
    if contract != CONTRACT:
        raise RunError(
            f"{path} is a diagnosis of contract {contract!r}, and this shiplog reads contract "
            f"{CONTRACT}.",
            hint=AGAIN + ".",
        )
    try:
        verdict = diagnosed.of(content)
    except ValidationError as error:
        place = one_line(".".join(map(str, error.errors()[0]["loc"])))
        raise RunError(
            f"{path / 'verdict.json'} is no answer of `shiplog diagnose`: see its {place}.",
            hint=AGAIN + ".",
        ) from error
    origin = _json(path, "provenance.json")
    logs, began = origin.get("logs_sha256"), origin.get("began")
    if not isinstance(logs, dict) or not logs:
        raise RunError(
            f"{path / 'provenance.json'} does not say of which voyages the diagnosis is.",
            hint=AGAIN + ".",
        )
    return DiagnosisFolder(path, verdict, logs, began if isinstance(began, str) else None)


def check(folder: DiagnosisFolder, run: RunFolder, names: Sequence[str],
          hashes: Mapping[str, str | None]) -> None:  # fmt: skip
    """Raises RunError for a diagnosis of another run, of this run before it was trained anew, of
    other voyages, or of other logs of these names.

    hashes   voyage → SHA-256 of its log, as the store has them
    """
    path = folder.path
    if folder.verdict.base.run != run.name:
        raise RunError(
            f"{path} is a diagnosis of the run {folder.verdict.base.run!r}, and not of "
            f"{run.name!r}.",
            hint=AGAIN + ".",
        )
    if set(folder.logs) != set(names):
        raise RunError(
            f"{path} is a diagnosis of {one_line(listed(folder.logs))}, and the gate is to judge "
            f"{listed(names)}.",
            hint="choose the same voyages with --voyages, or leave it out: the gate then judges "
            "those of the diagnosis.",
        )
    if other := [name for name in names if folder.logs[name] != hashes.get(name)]:
        raise RunError(
            f"{path} is a diagnosis of another log {listed(other)} than the one in the store.",
            hint=AGAIN + ".",
        )
    ended = _time(run_files.json_of(run.path / "provenance.json").get("ended"))
    began = _time(folder.began)
    if ended and began and began < ended:
        raise RunError(
            f"{path} is a diagnosis of {began:%Y-%m-%d %H:%M}, and {run.name} was trained after "
            f"it, at {ended:%Y-%m-%d %H:%M} (UTC).",
            hint=AGAIN + ".",
        )


def _json(path: Path, name: str) -> dict[str, Any]:
    file = path / name
    if not file.is_file():
        raise RunError(
            f"{path} is no folder of a diagnosis: there is no {name} in it.",
            hint="give the folder that `shiplog diagnose --out FOLDER` made, or one that is not "
            "there yet: the gate then diagnoses, and writes it.",
        )
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise RunError(f"{file} cannot be read: {error}.", hint=AGAIN + ".") from error
    if not isinstance(content, dict):
        raise RunError(f"{file} is no answer of `shiplog diagnose`.", hint=AGAIN + ".")
    return content


def _time(text: object) -> datetime.datetime | None:
    try:
        found = datetime.datetime.fromisoformat(text) if isinstance(text, str) else None
    except ValueError:
        return None
    return found if found is None or found.tzinfo else found.replace(tzinfo=datetime.UTC)
