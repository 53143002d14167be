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
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipelines.experiments.hidden_effects import plan as plans
from pipelines.experiments.hidden_effects import program
from pipelines.experiments.hidden_effects.plan import Plan, Planned
from pipelines.experiments.hidden_effects.program import ROOT
from pipelines.experiments.hidden_effects.score import FAILED, attempt
from shiplog.machine import files

log = logging.getLogger(__name__)

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
OUR_SHIPLOG = (sys.executable, "-c", "from shiplog.cli import main; main()")
LARGE = ("logs", "store", "base", "d")


@dataclass(frozen=True, slots=True)
class Settings:
    """How to run; the commands are replaced in tests."""

    jobs: int = 1
    keep: bool = False  # logs, store, base and report of each case
    share: bool = False  # one base model for all cases of a ship: its nominal campaign is the same
    rivals: bool = False  # simpler methods too, once the verdict is sealed
    oracle: bool = False  # and what the truth would gain, once the verdict is sealed
    limit: float = 3600.0  # s for one step
    case: tuple[str, ...] = (sys.executable, "-m", "pipelines.experiments.simulated_ship", "case")
    abroad: tuple[str, ...] = (sys.executable, "-m", "pipelines.experiments.other_families", "case")
    shiplog: tuple[str, ...] = OUR_SHIPLOG
    called: str = ""  # what pages call that program, where it is not this source's
    rival: tuple[str, ...] = (sys.executable, "-m", "pipelines.experiments.hidden_effects.rivals")
    truth: tuple[str, ...] = (sys.executable, "-m", "pipelines.experiments.hidden_effects.oracle")


@dataclass(frozen=True, slots=True)
class Prepared:
    """The folders that a diagnosis stands on: logs, the store of them, and the nominal model."""

    logs: Path
    store: Path
    base: Path


def run(
    out: Path, plan: Plan, settings: Settings, made: Callable[[Planned], Path] | None = None
) -> None:
    """Every case of the plan that has no sealed verdict yet; one that failed is tried again. Where
    rivals are wanted, finished cases whose store and base were kept are asked, too. `made` as
    `run_case` has it, of each case."""
    ships: dict[int, list[Planned]] = {}
    for planned in plan.cases:
        if not finished(plans.case_folder(out, planned)) or _to_ask(out, planned, settings):
            ships.setdefault(planned.seed, []).append(planned)
    log.info("%d of %d cases to run", sum(map(len, ships.values())), len(plan.cases))

    def case(planned: Planned) -> str | None:
        folder = plans.case_folder(out, planned)
        if not finished(folder):
            return run_case(out, planned, settings, made(planned) if made else None)
        folder = folder.resolve()
        return ask_rivals(folder, base_of(out, planned), folder / "store", settings)

    in_turn(list(ships.values()), case, settings.jobs)


def in_turn(
    groups: Sequence[Sequence[Planned]], case: Callable[[Planned], str | None], jobs: int
) -> None:
    """`case` on all: groups next to each other, the cases of one group one after another, since
    they may share a base. Raises KeyboardInterrupt where a case was stopped (`case` gives None)."""
    stop = threading.Event()

    def group(cases: Sequence[Planned]) -> None:
        for planned in cases:
            if stop.is_set():
                return
            reported = case(planned)
            if reported is None:
                stop.set()
            else:
                log.info("%s: %s", planned.label, reported)

    with ThreadPoolExecutor(jobs) as pool:
        try:
            for future in as_completed([pool.submit(group, cases) for cases in groups]):
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


def run_case(
    out: Path, planned: Planned, settings: Settings, made: Path | None = None
) -> str | None:
    """What was reported, for the log; None where somebody stopped it, and nothing is sealed.

    made   logs of an earlier run of this case, to start from; its key is then not written here
    """
    folder = plans.case_folder(out, planned).resolve()
    number = attempts(folder) + 1
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    key = plans.key_path(out, planned).resolve()
    base = base_to_make(out, planned, settings)
    there = Prepared(made or folder / "logs", folder / "store", base)
    steps = prepare(planned, settings, folder, there, None if made else key)
    if steps is None:
        return None
    if not failed(steps[-1]):
        command = diagnosing(settings, base, there.store, folder)
        done = step("diagnose", command, folder, settings)
        if done["rc"] in STOPPED:
            return None
        steps.append(done)
    steps = [done | {"attempt": number} for done in steps]
    reported = seal(folder, steps)
    compared = None
    if steps[-1]["step"] == "diagnose" and settings.rivals:  # where it failed they may not
        compared = ask_rivals(folder, base_of(out, planned), there.store, settings)
        if compared is None:
            return None
    if settings.oracle and steps[-1]["step"] == "diagnose":
        _ask_oracle(folder, base, key, settings)
    if not settings.keep:
        for name in LARGE:
            shutil.rmtree(folder / name, ignore_errors=True)
    reported = f"{reported} after {sum(done['wall_s'] for done in steps):.0f} s"
    return f"{reported}; {compared}" if compared else reported


def prepare(
    planned: Planned, settings: Settings, folder: Path, prepared: Prepared, key: Path | None
) -> list[dict[str, Any]] | None:
    """The steps that lead to these folders, up to the first one that fails; None where somebody
    stopped one. A shared model of the same nominal logs is not identified again.

    key   where the simulator writes it; None where the logs are there already
    """
    simulator = settings.abroad if planned.family else settings.case
    profile = str(prepared.logs / "ship.toml") if planned.family else "esso-vectwin"
    logs, store = str(prepared.logs), str(prepared.store)
    commands = {
        "logs": [*simulator, str(planned.seed), logs, "--key", str(key), *planned.options],
        "ingest": [*settings.shiplog, "ingest", logs, "--profile", profile, "--store", store],
        "train": [
            *settings.shiplog, "train", *_training(planned.model),
            "--store", store, "--out", str(prepared.base),
        ],
    }  # fmt: skip
    if key is None:
        del commands["logs"]
    steps: list[dict[str, Any]] = []
    for name, command in commands.items():
        if name == "train" and not _to_train(prepared.base, prepared.logs):
            continue
        done = step(name, command, folder, settings)
        if done["rc"] in STOPPED:
            return None
        steps.append(done)
        if failed(done):
            break
        if name == "train" and settings.share:
            _mark(prepared.base, prepared.logs)
    return steps


def failed(done: Mapping[str, Any]) -> bool:
    """Whether a step did not do what it was for."""
    return done["rc"] not in (DONE, LOST)


def attempts(folder: Path) -> int:
    """How often this case came to a verdict, or failed, until now: one that failed is run again,
    and each of its steps has the number of the attempt."""
    try:
        steps = json.loads((folder / "steps.json").read_text(encoding="utf-8"))
    except FileNotFoundError:
        return 0
    return attempt(steps)


def diagnosing(settings: Settings, base: Path, store: Path, folder: Path) -> list[str]:
    """The command that writes the verdict of a case into its folder."""
    return [
        *settings.shiplog, "diagnose", str(base), "--voyages", "trial_*",
        "--store", str(store), "--out", str(folder / "d"), "--json", str(folder / "verdict.json"),
    ]  # fmt: skip


def _training(model: str) -> list[str]:
    """Physics know the ship as it was; the paper's network has learned what is hidden, too."""
    if model == "mmg":
        return ["--model", model, "--voyages", "nominal_*", "--folds", "0"]
    return ["--model", model, "--voyages", "trial_*"]


def ask_rivals(folder: Path, base: Path, store: Path, settings: Settings) -> str | None:
    """`rivals.json`, sealed as the verdict is; None where somebody stopped it.

    Rivals that fail leave nothing: the case stays what it is.
    """
    answers = folder / "rivals.json"
    answers.unlink(missing_ok=True)
    done = step("rivals", [
        *settings.rival, str(base), "--voyages", "trial_*", "--store", str(store),
        "--json", str(answers),
    ], folder, settings)  # fmt: skip
    if done["rc"] in STOPPED:
        return None
    steps = json.loads((folder / "steps.json").read_text(encoding="utf-8"))
    _write_steps(folder, [*(one for one in steps if one["step"] != "rivals"), done])
    if failed(done) or _object(answers, "methods") is None:
        answers.unlink(missing_ok=True)
        return f"not compared: rivals ended with {done['rc']}"
    _seal_file(answers)
    return f"rivals after {done['wall_s']:.0f} s"


def _ask_oracle(folder: Path, base: Path, key: Path, settings: Settings) -> None:
    """`oracle.json`, where there is one; where it fails, the case stays what it is."""
    answer = folder / "oracle.json"
    done = step("oracle", [
        *settings.truth, str(base), "--case", str(folder), "--key", str(key),
        "--store", str(folder / "store"), "--json", str(answer),
    ], folder, settings)  # fmt: skip
    if done["rc"] != DONE:
        log.info("no oracle: %s", done["stderr"])
        answer.unlink(missing_ok=True)


def base_to_make(out: Path, planned: Planned, settings: Settings) -> Path:
    """One for each case, or one for each ship."""
    if settings.share:
        return out.resolve() / "bases" / str(planned.seed)
    return plans.case_folder(out, planned).resolve() / "base"


def base_of(out: Path, planned: Planned) -> Path:
    """The case's own model, or the one that it shared."""
    own = plans.case_folder(out, planned).resolve() / "base"
    return own if own.exists() else out.resolve() / "bases" / str(planned.seed)


def kept(out: Path, planned: Planned) -> bool:
    """Store and base are there: the case can be asked again."""
    store = plans.case_folder(out, planned) / "store"
    return store.exists() and base_of(out, planned).exists()


def _to_ask(out: Path, planned: Planned, settings: Settings) -> bool:
    """Rivals are wanted, and could answer, but have not."""
    if not settings.rivals or not kept(out, planned):
        return False
    return not (plans.case_folder(out, planned) / "rivals.sha256").exists()


def step(name: str, command: Sequence[str], folder: Path, settings: Settings) -> dict[str, Any]:
    """One process: which program it was, its wall and CPU time and its peak memory."""
    foreign = settings.shiplog != OUR_SHIPLOG and list(command[: len(settings.shiplog)]) == list(
        settings.shiplog
    )
    known = program.other(settings.shiplog, settings.called) if foreign else program.identity()
    # in this checkout, another program written in Python would find this source and not its own
    place = folder if foreign else ROOT
    return _process(name, command, folder, place, settings.limit) | known


def _process(
    name: str, command: Sequence[str], folder: Path, place: Path, limit: float
) -> dict[str, Any]:
    """Wall and CPU time and peak memory of one process, which runs in `place`, and those that it
    waited for."""
    path = folder / f"{name}.stderr"
    began = time.perf_counter()
    with path.open("wb") as stderr:
        child = subprocess.Popen(
            command, cwd=place, env=os.environ | ONE_CORE, stderr=stderr,
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
    reported = path.read_text(encoding="utf-8", errors="replace")
    path.unlink()
    unit = 1 if sys.platform == "darwin" else 1024  # bytes there, kB elsewhere
    return {
        "step": name,
        "rc": child.returncode,
        "wall_s": round(time.perf_counter() - began, 3),
        "cpu_s": round(used.ru_utime + used.ru_stime, 3),
        "peak_mb": round(used.ru_maxrss * unit / 1e6, 1),  # not below this process's own
        "stderr": reported[-TAIL:],
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
    """Which nominal logs a shared base was identified from."""
    _trained_on(base).write_text(json.dumps(_nominal(logs), indent=1), encoding="utf-8")


def _trained_on(base: Path) -> Path:
    return base.with_name(
        f"{base.name}.trained_on.json"
    )  # next to the run folder, which is shiplog's


def _nominal(logs: Path) -> dict[str, str]:
    return {p.name: _sha256(p.read_bytes()) for p in sorted(logs.glob("nominal_*.mcap"))}


def seal(folder: Path, steps: list[dict[str, Any]]) -> str:
    """Keep the steps, and the verdict's SHA-256 last: once that stands, all else does."""
    verdict, last = folder / "verdict.json", steps[-1]
    _write_steps(folder, steps)
    content = _object(verdict)
    if failed(last) or content is None:
        content = {"contract": 1, "verdict": FAILED, "step": last["step"], "rc": last["rc"]}
        verdict.write_text(json.dumps(content), encoding="utf-8")
    _seal_file(verdict)
    return str(content["verdict"])


def _write_steps(folder: Path, steps: list[dict[str, Any]]) -> None:
    files.write_text(folder / "steps.json", json.dumps(steps, indent=1) + "\n")


def _seal_file(path: Path) -> None:
    """NAME.sha256 next to NAME.json, whole or not at all."""
    files.write_text(path.with_suffix(".sha256"), f"{_sha256(path.read_bytes())}  {path.name}\n")


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _object(path: Path, must_have: str = "verdict") -> dict[str, Any] | None:
    """A JSON file with this name in it; None where there is no such file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return None
    return content if isinstance(content, dict) and must_have in content else None
