"""Rivals answer after the seal, count only as sealed, and know nothing of the simulator."""

import ast
import hashlib
import json
import os
import sys
from pathlib import Path

import pytest

from pipelines.experiments.hidden_effects import plan, run, score, score_tables, suites
from pipelines.experiments.hidden_effects.plan import Planned
from pipelines.experiments.hidden_effects.score import Answer, Sealed

ROOT = Path(__file__).parents[2]
OURS = ("pipelines.", "shiplog.")


# --- the seal -------------------------------------------------------------------------------------


def methods(**named):
    ranking = [{"name": "current", "score": 3.0}]
    return {n: {"answer": named.get(n), "ranking": ranking} for n in score_tables.RIVALS}


def sealed(path: Path, content) -> None:
    path.write_text(json.dumps(content))
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    path.with_suffix(".sha256").write_text(f"{digest}  {path.name}\n")


def test_rivals_count_only_as_they_were_sealed(tmp_path):
    """There is no key here: whoever tried to open it would raise something else."""
    out = tmp_path / "out"
    planned = plan.save(out, suites.plan("nightly", 5, 1)).cases[0]
    folder, key = plan.case_folder(out, planned), plan.key_path(out, planned)
    folder.mkdir(parents=True)
    sealed(folder / "verdict.json", {"verdict": "none", "causes": []})
    (folder / "steps.json").write_text(json.dumps([{"step": "logs", "rc": 0}]))
    sealed(folder / "rivals.json", {"methods": methods(glr="current")})
    (folder / "rivals.json").write_text(json.dumps({"methods": methods(glr="fouling")}))
    with pytest.raises(Sealed, match=r"rivals\.json is not what was sealed: the key .* not opened"):
        score.read(out)
    (folder / "rivals.json").unlink()
    with pytest.raises(Sealed):
        score.read(out)
    key.write_text(json.dumps({"verdict": "none", "causes": [], "structure": None}))
    (folder / "rivals.sha256").unlink()
    (folder / "rivals.json").write_text(json.dumps({"methods": methods(glr="current")}))
    assert score.read(out).answers[0].rivals == {}  # never sealed: never read
    sealed(folder / "rivals.json", {"methods": methods(glr="current")})
    assert score.read(out).answers[0].by("glr").misnamed


# --- the table ------------------------------------------------------------------------------------


def answer(hidden, reported, size=1.0, seconds=7000, rivals=None, steps=()):
    causes = [{"name": hidden, "size": size, "parameters": {}}] if hidden else []
    key = {"verdict": "named" if hidden else "none", "causes": causes, "structure": None}
    verdict = {
        "verdict": "named" if reported else "none",
        "causes": [{"name": n} for n in reported],
    }
    return Answer(Planned("1", 1, None, None, seconds), verdict, key, list(steps), rivals or {})


def test_the_table_counts_by_hand():
    clock = methods(regression="clock_offset:wind", glr="clock_offset:gnss", linear="bank")
    wrong = methods(regression="bank", glr="bank")
    answers = [
        answer("clock_offset", ["clock_offset:gnss"], rivals=clock),
        answer("clock_offset", ["clock_offset", "bank"], rivals=clock),  # one too many
        answer("current", ["current"], size=0.3, rivals=wrong),
        answer("current", ["current"], seconds=500, rivals=methods(linear="current")),
        answer(None, [], rivals=wrong),
        answer(None, [], rivals=methods()),
        answer("current", [], steps=[{"step": "rivals", "rc": 1}]),  # they failed: no part of it
    ]  # fmt: skip
    lines = score_tables.methods(answers).splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[:-1]]
    assert rows[0][0] == "method, 6 cases"
    assert rows[0][1:] == ["size 1", "0.3 to 1", "500 s", "nothing hidden: a cause named"]
    assert [row[1:] for row in rows[2:]] == [
        ["2/2 (100 %)", "0/1 (0 %)", "0/1 (0 %)", "1/2 (50 %)"],
        ["2/2 (100 %)", "0/1 (0 %)", "0/1 (0 %)", "1/2 (50 %)"],
        ["0/2 (0 %)", "0/1 (0 %)", "1/1 (100 %)", "0/2 (0 %)"],
        ["1/2 (50 %)", "1/1 (100 %)", "1/1 (100 %)", "0/2 (0 %)"],
    ]  # fmt: skip
    assert rows[-1][0] == "shiplog diagnose"
    assert lines[-1] == "1 more where the simpler methods failed"
    assert "method, 6 cases" in score_tables.text(score.Score("goals", tuple(answers), (), ()))
    assert "method," not in score_tables.text(score.Score("goals", tuple(answers[-1:]), (), ()))


# --- the step -------------------------------------------------------------------------------------


SIMULATOR = """
import json, pathlib, sys
seed, logs, _, key, *options = sys.argv[1:]
pathlib.Path(logs).mkdir()
pathlib.Path(key).write_text(json.dumps({"verdict": "none", "causes": [], "structure": None}))
"""
SHIPLOG = """
import json, os, pathlib, sys
command, first, *options = sys.argv[1:]
given = {k: v for k, v in zip(options, options[1:])}
made = {"ingest": "--store", "train": "--out"}.get(command)
if made:
    pathlib.Path(given[made]).mkdir()
elif os.environ["BREAK"] == "diagnose":
    sys.exit(1)
else:
    pathlib.Path(given["--json"]).write_text(json.dumps({"verdict": "none", "causes": []}))
"""
RIVAL = """
import json, os, pathlib, sys
base, *options = sys.argv[1:]
given = {k: v for k, v in zip(options, options[1:])}
json_ = pathlib.Path(given["--json"])
assert "keys" not in " ".join(sys.argv) and given["--voyages"] == "trial_*"
assert pathlib.Path(base).is_dir() and pathlib.Path(given["--store"]).is_dir()
assert (json_.parent / "verdict.sha256").exists()  # they come last
json_.write_text("half of" if os.environ["BREAK"] == "rivals" else '{"methods": {}}')
sys.exit(os.environ["BREAK"] == "rivals")
"""


@pytest.fixture
def stubs(tmp_path, monkeypatch):
    monkeypatch.setenv("BREAK", "nothing")
    commands = {}
    programs = (("case", SIMULATOR), ("shiplog", SHIPLOG), ("rival", RIVAL))
    for name, program in programs:
        (tmp_path / f"{name}.py").write_text(program)
        commands[name] = (sys.executable, str(tmp_path / f"{name}.py"))
    return lambda **more: run.Settings(**commands, **more)


def files(out: Path) -> set[str]:
    return {p.name for p in (out / "cases" / "5").iterdir()}


KEPT = {"verdict.json", "verdict.sha256", "steps.json"}
ANSWERED = {"rivals.json", "rivals.sha256"}


def steps(out: Path) -> list[tuple[str, int]]:
    found = json.loads((out / "cases" / "5" / "steps.json").read_text())
    return [(step["step"], step["rc"]) for step in found]


@pytest.mark.parametrize("broken", ["nothing", "diagnose"])
def test_rivals_answer_after_the_verdict_is_sealed(tmp_path, stubs, monkeypatch, broken):
    """Even where the diagnosis broke: its failures count in the comparison."""
    monkeypatch.setenv("BREAK", broken)
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 1)), stubs(rivals=True))
    assert files(out) == KEPT | ANSWERED
    assert steps(out)[-1] == ("rivals", 0)
    assert score.read(out).answers[0].verdict["verdict"] == (
        "failed" if broken == "diagnose" else "none"
    )


def test_rivals_that_break_spoil_nothing_and_a_kept_case_is_asked_again(
    tmp_path, stubs, monkeypatch
):
    monkeypatch.setenv("BREAK", "rivals")
    out = tmp_path / "out"
    planned = plan.save(out, suites.plan("nightly", 5, 1))
    run.run(out, planned, stubs(rivals=True, keep=True))
    assert files(out) == KEPT | {"logs", "store", "base"}
    assert steps(out)[-1] == ("rivals", 1)
    assert score.read(out).answers[0].right
    before = os.stat(out / "cases" / "5" / "verdict.json").st_mtime_ns
    monkeypatch.setenv("BREAK", "nothing")
    run.run(out, planned, stubs(keep=True))
    assert not files(out) & ANSWERED
    run.run(out, planned, stubs(rivals=True))
    assert files(out) == KEPT | ANSWERED | {"logs", "store", "base"}
    assert [name for name, _ in steps(out)] == ["logs", "ingest", "train", "diagnose", "rivals"]
    assert os.stat(out / "cases" / "5" / "verdict.json").st_mtime_ns == before


def imported(source: Path):
    """Modules, and what may be one: `from pipelines import x` too."""
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_rivals_know_nothing_of_the_simulator():
    """Nor does anything of ours that they import, however far down."""
    met, waiting = set(), ["pipelines.experiments.hidden_effects.rivals"]
    while waiting:
        name = waiting.pop()
        path = ROOT / name.replace(".", "/")
        source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        if name in met or not source.exists():
            continue
        met.add(name)
        waiting += [module for module in imported(source) if module.startswith(OURS)]
    assert "shiplog.diagnosis.hypotheses.evidence" in met
    assert not any(name.startswith("pipelines.experiments.simulated_ship") for name in met)
