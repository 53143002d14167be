"""One data set the whole way, by the commands alone, or to what it cannot give."""

from __future__ import annotations

import json
import logging
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipelines.experiments.hidden_effects.run import DONE, LOST, OUR_SHIPLOG, Settings, step
from pipelines.experiments.measured_ships.ships import DataSet

log = logging.getLogger(__name__)

SETTINGS = Settings()
READ = (".parquet", ".csv", ".mcap", ".mat", ".xlsx", ".data", ".log")


@dataclass(frozen=True)
class Way:
    """What became of a data set.

    stopped   the message with which a command ended the way, and its hint in a line of its own;
              empty where none did
    answers   of `voyages`, `evaluate` and `diagnose`: their JSON, where they came to one
    cpu_s     of all commands together
    """

    name: str
    stopped: str
    answers: dict[str, Any]
    cpu_s: float
    traceback: bool

    @property
    def voyages(self) -> list[dict[str, Any]]:
        return self.answers.get("voyages", {}).get("voyages", [])


def go(name: str, one: DataSet, data: Path, out: Path) -> Way:
    """From the files to a verdict. Steps that were finished before are not done again."""
    data, out = data.resolve(), out.resolve()  # a step runs in the checkout
    folder = out / name.replace(", ", "-").replace(" ", "-")
    folder.mkdir(parents=True, exist_ok=True)
    done: list[dict[str, Any]] = []
    known = folder / "steps.json"
    before = {s["step"]: s for s in json.loads(known.read_text("utf-8"))} if known.exists() else {}
    for what, arguments in _commands(one, data / one.folder, folder):
        if what in before and before[what]["rc"] >= 0:  # one that was killed did not end
            done.append(before[what])
        else:
            log.info("%s: %s", name, what)
            if what == "convert":  # it does not replace a log that is there
                shutil.rmtree(folder / "logs", ignore_errors=True)
            command = [*OUR_SHIPLOG, what, *arguments, *_json(what, folder)]
            done.append(step(what, command, folder, SETTINGS))
            if what == "profile" and done[-1]["rc"] == DONE:
                _mend(folder / "ship.toml", one)
            known.write_text(json.dumps(done, indent=1), encoding="utf-8")
        if done[-1]["rc"] not in (DONE, LOST):
            break
    last = done[-1]
    reported = "" if last["rc"] in (DONE, LOST) else _sentence(last["stderr"])
    reported = reported.replace(f"{folder}/", "")
    answers = {p.stem: json.loads(p.read_text("utf-8")) for p in folder.glob("*.answer")}
    traced = any("Traceback" in s["stderr"] or "unexpected fault" in s["stderr"] for s in done)
    return Way(name, reported, answers, sum(s["cpu_s"] for s in done), traced)


def _commands(one: DataSet, data: Path, folder: Path):
    """(command, its arguments) one after the other."""
    files = [
        str(path)
        for pattern in one.tables or one.logs
        for path in sorted(data.glob(pattern))
        if path.is_dir() or path.suffix in READ
    ]
    profile = one.profile or "ship.toml"
    given = data / profile
    if given.is_file():
        profile = str(given)
    elif one.profile is None:
        profile = str(folder / "ship.toml")
        which = ["--vessel", one.vessel] if one.vessel else []
        yield "profile", [files[0], *which, "--out", profile]
    logs = files
    if one.tables:
        yield "convert", [*files, "--profile", profile, "--out", str(folder / "logs")]
        logs = [str(folder / "logs")]
    store = ["--store", str(folder / "store")]
    yield "ingest", [*logs, "--profile", profile, *store]
    yield "voyages", store
    run = str(folder / "run")
    yield "train", ["--model", "mmg", *one.train, *store, "--out", run]
    trial = [word for pattern in one.trial for word in ("--voyages", pattern)]
    yield "evaluate", [run, *trial, *store]
    yield "diagnose", [run, *trial, *store, "--out", str(folder / "d")]


def _json(what: str, folder: Path) -> list[str]:
    if what not in ("voyages", "evaluate", "diagnose"):
        return []
    return ["--json", str(folder / f"{what}.answer")]


def _mend(draft: Path, one: DataSet) -> None:
    text = draft.read_text(encoding="utf-8")
    for old, new in one.mended.items():
        if old not in text:
            raise ValueError(f"{draft} has no {old!r} to be mended")
        text = text.replace(old, new, 1)
    draft.write_text(text, encoding="utf-8")


def _sentence(stderr: str) -> str:
    """The last message, and its hint in a line of its own."""
    lines = stderr.rstrip().splitlines()
    first = max((i for i, line in enumerate(lines) if not line.startswith(" ")), default=0)
    return "\n".join(line.strip() for line in lines[first:])
