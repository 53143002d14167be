"""What `diagnose` says first of season 3, in which nothing is hidden, read through wrong profiles
with a model of the right one."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from typer.testing import CliRunner

from pipelines.experiments.wrong_profiles.profiles import Wrong, text_of
from pipelines.experiments.wrong_profiles.seen import LOGS, TRIAL
from shiplog.cli.app import app

NOMINAL = tuple(f"voyage_{number}" for number in range(1, 5))


@dataclass(frozen=True)
class Diagnosed:
    """exit and verdict ("refused" where there is none); causes with their probabilities."""

    exit: int
    verdict: str
    causes: tuple[str, ...]
    sentence: str
    notes: tuple[str, ...] = ()


def every(chosen: Sequence[Wrong], out: Path, reach: Callable[[str], None]) -> dict[str, Diagnosed]:
    """Name → what is said."""
    out.mkdir(parents=True, exist_ok=True)
    store, run = out / "store", out / "run"
    _call("ingest", *(LOGS / f"{name}.mcap" for name in NOMINAL), "--store", store)
    if not run.exists():
        code, text = _call("train", "--model", "mmg", "--store", store, "--out", run)
        if code:
            raise SystemExit(text)
    found = {}
    for wrong in chosen:
        reach(wrong.name)
        found[wrong.name] = _diagnosed(wrong, store, run, out)
    return found


def _diagnosed(wrong: Wrong, store: Path, run: Path, out: Path) -> Diagnosed:
    profile, verdict = out / "wrong.toml", out / "verdict.json"
    profile.write_text(text_of(wrong), encoding="utf-8")
    verdict.unlink(missing_ok=True)
    code, text = _call("ingest", *(LOGS / f"{name}.mcap" for name in TRIAL), "--profile", profile,
                       "--store", store)  # fmt: skip
    if code == 1:
        return Diagnosed(code, "refused", (), f"(ingest) {_first(text)}")
    code, text = _call("diagnose", run, "--store", store, "--voyages", "season3_*", "--out",
                       out / "diagnosis", "--json", verdict)  # fmt: skip
    if not verdict.exists():
        return Diagnosed(code, "refused", (), _first(text))
    content = json.loads(verdict.read_text("utf-8"))
    causes = tuple(f"{c['name']} {c['probability']:.2f}" for c in content["causes"])
    return Diagnosed(
        code, content["verdict"], causes, content["sentence"], tuple(content.get("notes", ()))
    )


def _first(text: str) -> str:
    """The line in which a refusal begins."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return next((line for line in lines if "refus" in line or line.endswith(".")), "".join(lines))


def _call(*words: object) -> tuple[int, str]:
    done = CliRunner().invoke(app, [str(word) for word in words])
    failed = "" if done.exception is None else str(done.exception)
    return done.exit_code, f"{done.output}{failed}"
