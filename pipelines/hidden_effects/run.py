"""A case the whole way: logs, store, base model, diagnosis, seal; where asked for, what simpler
methods say of it. Each step is a process.

No step is told what is hidden but the one that writes the logs, and nothing here opens a key.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipelines.hidden_effects import plan as plans
from pipelines.hidden_effects.plan import Plan, Planned

log = logging.getLogger(__name__)

ROOT = Path(__file__).parents[2]  # `python -m pipelines...` finds this source and no other
ONE_CORE = {  # so that "seconds, one core" is what it says
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "POLARS_MAX_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
}
DONE, LOST = 0, 3  # 3: done, but something in the logs was lost, and stderr says what
STOPPED = (130, -signal.SIGINT)
TAIL = 2000  # characters kept of what a step says on stderr
LARGE = ("logs", "store", "base", "d")
FAILED = "failed"  # the verdict that stands for "no verdict came"; it is sealed like any other


@dataclass(frozen=True, slots=True)
class Settings:
    """How to run; the commands are replaced in tests."""

    jobs: int = 1
    keep: bool = False  # logs, store, base and report of each case
    share: bool = False  # one base model for all cases of a ship: her nominal campaign is the same
    rivals: bool = False  # simpler methods too, once the verdict is sealed
    oracle: bool = False  # and what the truth would gain, once the verdict is sealed
    limit: float = 3600.0  # s for one step
    case: tuple[str, ...] = (sys.executable, "-m", "pipelines.known_ship", "case")
    shiplog: tuple[str, ...] = (sys.executable, "-c", "from shiplog.cli import main; main()")
    rival: tuple[str, ...] = (sys.executable, "-m", "pipelines.hidden_effects.rivals")
    truth: tuple[str, ...] = (sys.executable, "-m", "pipelines.hidden_effects.oracle")


def run(out: Path, plan: Plan, settings: Settings) -> None:
    """Every case of the plan that has no sealed verdict yet; one that failed is tried again. Where
    rivals are wanted, they are also asked of finished cases whose store and base were kept."""
    ships: dict[int, list[Planned]] = {}
    for planned in plan.cases:
        if not finished(plans.case_folder(out, planned)) or _to_compare(out, planned, settings):
            ships.setdefault(planned.seed, []).append(planned)
    todo = sum(map(len, ships.values()))
    log.info("%d of %d cases to run", todo, len(plan.cases))
    stop = threading.Event()

    def ship(cases: list[Planned]) -> None:  # one after another: they may share a base
        for planned in cases:
            if stop.is_set():
                return
            compare = finished(plans.case_folder(out, planned))
            said = (compare_case if compare else run_case)(out, planned, settings)
            if said is None:
                stop.set()
            else:
                log.info("%s: %s", planned.label, said)

    with ThreadPoolExecutor(settings.jobs) as pool:
        try:
            for future in as_completed([pool.submit(ship, cases) for cases in ships.values()]):
                future.result()
        except BaseException:
            stop.set()  # the steps under way end; no other begins
            raise
    if stop.is_set():
        raise KeyboardInterrupt


def finished(folder: Path) -> bool:
    """A verdict and its seal, whether they match or not: that is for the scorer to say."""
    verdict = folder / "verdict.json"
    if not (folder / "verdict.sha256").exists() or not verdict.exists():
        return False
    content = _object(verdict)
    return content is None or content["verdict"] != FAILED


def run_case(out: Path, planned: Planned, settings: Settings) -> str | None:
    """What was said, for the log; None where somebody stopped it, and nothing is sealed."""
    folder = plans.case_folder(out, planned).resolve()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    key = plans.key_path(out, planned).resolve()
    logs, store, verdict = folder / "logs", folder / "store", folder / "verdict.json"
    base = out.resolve() / "bases" / str(planned.seed) if settings.share else folder / "base"
    commands: dict[str, list[str]] = {
        "logs": [
            *settings.case, str(planned.seed), str(logs), "--key", str(key), *planned.options
        ],
        "ingest": [
            *settings.shiplog, "ingest", str(logs), "--profile", "esso-vectwin",
            "--store", str(store),
        ],
        "train": [
            *settings.shiplog, "train", *_training(planned.model),
            "--store", str(store), "--out", str(base),
        ],
        "diagnose": [
            *settings.shiplog, "diagnose", str(base), "--voyages", "trial_*",
            "--store", str(store), "--out", str(folder / "d"), "--json", str(verdict),
        ],
    }  # fmt: skip
    steps: list[dict[str, Any]] = []
    for name, command in commands.items():
        if name == "train" and not _to_train(base, logs):
            continue
        done = _step(name, command, folder, settings.limit)
        if done["rc"] in STOPPED:
            return None
        steps.append(done)
        if done["rc"] not in (DONE, LOST):
            break
        if name == "train" and settings.share:
            _mark(base, logs)
    said = _seal(folder, steps)
    compared = None
    if settings.rivals and steps[-1]["step"] == "diagnose":  # where it failed they may not
        compared = compare_case(out, planned, settings)
        if compared is None:
            return None
    if settings.oracle and steps[-1]["step"] == "diagnose":
        _ask_oracle(folder, base, key, settings)
    if not settings.keep:
        for name in LARGE:
            shutil.rmtree(folder / name, ignore_errors=True)
    said = f"{said} after {sum(done['wall_s'] for done in steps):.0f} s"
    return f"{said}; {compared}" if compared else said


def _training(model: str) -> list[str]:
    """Physics know the ship as she was; the paper's network has learned what is hidden, too."""
    if model == "mmg":
        return ["--model", model, "--voyages", "nominal_*", "--folds", "2"]
    return ["--model", model, "--voyages", "trial_*"]


def compare_case(out: Path, planned: Planned, settings: Settings) -> str | None:
    """What simpler methods say of a case whose verdict is sealed: `rivals.json`, sealed likewise.
    Where they fail, the case stays what it is. None where somebody stopped it."""
    folder = plans.case_folder(out, planned).resolve()
    answers = folder / "rivals.json"
    done = _step("rivals", [
        *settings.rival, str(_base_of(out, planned)), "--voyages", "trial_*",
        "--store", str(folder / "store"), "--json", str(answers),
    ], folder, settings.limit)  # fmt: skip
    if done["rc"] in STOPPED:
        return None
    steps = json.loads((folder / "steps.json").read_text(encoding="utf-8"))
    _write_steps(folder, [*(step for step in steps if step["step"] != "rivals"), done])
    if done["rc"] != DONE or _object(answers, "methods") is None:
        answers.unlink(missing_ok=True)
        return f"not compared: rivals ended with {done['rc']}"
    _seal_file(answers)
    return f"compared after {done['wall_s']:.0f} s"


def _ask_oracle(folder: Path, base: Path, key: Path, settings: Settings) -> None:
    """`oracle.json`, where there is one; where it fails, the case stays what it is."""
    answer = folder / "oracle.json"
    done = _step("oracle", [
        *settings.truth, str(base), "--case", str(folder), "--key", str(key),
        "--store", str(folder / "store"), "--json", str(answer),
    ], folder, settings.limit)  # fmt: skip
    if done["rc"] != DONE:
        log.info("no oracle: %s", done["stderr"])
        answer.unlink(missing_ok=True)


def _base_of(out: Path, planned: Planned) -> Path:
    """The case's own model, or the one that it shared."""
    own = plans.case_folder(out, planned).resolve() / "base"
    return own if own.exists() else out.resolve() / "bases" / str(planned.seed)


def _to_compare(out: Path, planned: Planned, settings: Settings) -> bool:
    folder = plans.case_folder(out, planned)
    there = (folder / "store").exists() and _base_of(out, planned).exists()
    return settings.rivals and there and not (folder / "rivals.sha256").exists()


def _step(name: str, command: Sequence[str], folder: Path, limit: float) -> dict[str, Any]:
    """Wall and CPU time and peak memory of one process and those that it waited for."""
    path = folder / f"{name}.stderr"
    began = time.perf_counter()
    with path.open("wb") as stderr:
        child = subprocess.Popen(
            command, cwd=ROOT, env=os.environ | ONE_CORE, stderr=stderr,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
        )  # fmt: skip
        # not child.kill(): that polls, and would take the exit status away from wait4
        timer = threading.Timer(limit, os.kill, (child.pid, signal.SIGKILL))
        timer.start()
        try:
            _, status, used = os.wait4(child.pid, 0)
        finally:
            timer.cancel()
    child.returncode = os.waitstatus_to_exitcode(status)
    said = path.read_text(encoding="utf-8", errors="replace")
    path.unlink()
    unit = 1 if sys.platform == "darwin" else 1024  # bytes there, kB elsewhere
    return {
        "step": name,
        "rc": child.returncode,
        "wall_s": round(time.perf_counter() - began, 3),
        "cpu_s": round(used.ru_utime + used.ru_stime, 3),
        "peak_mb": round(used.ru_maxrss * unit / 1e6, 1),  # not below this process's own
        "stderr": said[-TAIL:],
    }


def _to_train(base: Path, logs: Path) -> bool:
    """Unless there is a whole base of exactly these nominal logs; a part of one is removed."""
    marked = _object(_trained_on(base), "nominal_1.mcap")
    if marked is not None and marked == _nominal(logs):
        return False
    shutil.rmtree(base, ignore_errors=True)
    base.parent.mkdir(parents=True, exist_ok=True)
    return True


def _mark(base: Path, logs: Path) -> None:
    _trained_on(base).write_text(json.dumps(_nominal(logs), indent=1), encoding="utf-8")


def _trained_on(base: Path) -> Path:
    return base.with_name(f"{base.name}.trained_on.json")  # beside: the run folder is shiplog's


def _nominal(logs: Path) -> dict[str, str]:
    return {p.name: _sha256(p.read_bytes()) for p in sorted(logs.glob("nominal_*.mcap"))}


def _seal(folder: Path, steps: list[dict[str, Any]]) -> str:
    """Keep the steps, and the verdict's SHA-256 last: once that stands, all else does."""
    verdict, last = folder / "verdict.json", steps[-1]
    _write_steps(folder, steps)
    content = _object(verdict)
    if last["rc"] not in (DONE, LOST) or content is None:
        content = {"contract": 1, "verdict": FAILED, "step": last["step"], "rc": last["rc"]}
        verdict.write_text(json.dumps(content), encoding="utf-8")
    _seal_file(verdict)
    return str(content["verdict"])


def _write_steps(folder: Path, steps: list[dict[str, Any]]) -> None:
    partial = folder / "steps.json.partial"
    partial.write_text(json.dumps(steps, indent=1) + "\n", encoding="utf-8")
    partial.replace(folder / "steps.json")


def _seal_file(path: Path) -> None:
    """NAME.sha256 beside NAME.json, whole or not at all."""
    partial = path.with_suffix(".sha256.partial")
    partial.write_text(f"{_sha256(path.read_bytes())}  {path.name}\n", encoding="utf-8")
    partial.replace(path.with_suffix(".sha256"))


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _object(path: Path, must_have: str = "verdict") -> dict[str, Any] | None:
    """A JSON file with this name in it; None where there is no such file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return None
    return content if isinstance(content, dict) and must_have in content else None
