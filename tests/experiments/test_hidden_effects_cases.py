"""Cases of hidden effects: planned, run once, sealed before their key is opened."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import pytest
from hidden_keys import NONE, hidden, named

from pipelines.experiments.hidden_effects import (
    parameters,
    plan,
    run,
    score,
    score_tables,
    suites,
)
from pipelines.experiments.hidden_effects.__main__ import main
from pipelines.experiments.hidden_effects.plan import Plan, Planned
from pipelines.experiments.hidden_effects.score import Sealed, open_key
from pipelines.experiments.simulated_ship.cases import CATALOGUE, DEVICES, OUTSIDE, draw

ROOT = Path(__file__).parents[2]


# --- the seal -------------------------------------------------------------------------------------


def test_no_key_is_opened_before_the_verdict_is_sealed(tmp_path):
    """There is no key here at all: whoever tried to open it would raise something else."""
    verdict, key = tmp_path / "verdict.json", tmp_path / "key.json"
    with pytest.raises(Sealed, match="is not opened"):
        open_key(tmp_path, key)
    verdict.write_text(json.dumps(NONE))
    with pytest.raises(Sealed, match="is not opened"):
        open_key(tmp_path, key)
    seal = hashlib.sha256(verdict.read_bytes()).hexdigest()
    (tmp_path / "verdict.sha256").write_text(f"{seal}  verdict.json\n")
    verdict.write_text(json.dumps(named("current")))
    with pytest.raises(Sealed, match="not what was sealed"):
        open_key(tmp_path, key)
    (tmp_path / "verdict.sha256").write_text("")
    with pytest.raises(Sealed, match="not what was sealed"):
        open_key(tmp_path, key)
    verdict.write_text(json.dumps(NONE))
    (tmp_path / "verdict.sha256").write_text(f"{seal}  verdict.json\n")
    key.write_text(json.dumps(hidden()))
    assert open_key(tmp_path, key) == (NONE, hidden())


def test_the_scorer_knows_nothing_of_the_simulator():
    program = (
        "import sys; from pipelines.experiments.hidden_effects import score, score_tables; "
        "simulator = 'pipelines.experiments.simulated_ship'; "
        "sys.exit(any(name.startswith(simulator) for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=False).returncode == 0


# --- suites ---------------------------------------------------------------------------------------


def test_every_cause_is_met_equally_often_and_rows_share_their_ships():
    goals = suites.plan("goals", 20000, 42)
    rows = [[p for p in goals.cases if p.label.endswith(f"-{row}")] for row in range(1, 7)]
    ones = [p.cause for p in rows[0]]
    assert sorted(ones[:21]) == sorted(ones[21:]) == sorted(CATALOGUE)
    assert [p.cause for p in rows[1]] == ones == [p.cause for p in rows[2]]
    assert [p.cause for p in rows[4]] == [*OUTSIDE] * 10 + [*OUTSIDE][:2]
    assert {p.cause for p in rows[3]} == {"none"}
    assert [{p.size for p in row} for row in rows] == [{1.0}, {0.3}, {1.0}, {None}, {1.0}, {1.0}]
    assert [{p.seconds for p in row} for row in rows] == [{7000}] * 2 + [{500}] + [{7000}] * 3
    assert all([p.seed for p in row] == [*range(20000, 20042)] for row in rows)
    pairs = [draw(p.seed, cause=p.cause, size=1.0).causes for p in rows[5]]
    assert all(len({cause.name for cause in pair}) == 2 for pair in pairs)
    assert len({p.cause for p in rows[5]}) > 30
    assert suites.plan("goals", 20000, 21).cases == goals.cases[: 21 * 6]


def test_a_third_of_the_block_with_devices_is_actuators_lines_and_tows():
    planned = suites.plan("devices").cases
    assert len(planned) == 120
    rows = {row: [p.cause for p in planned if p.label.endswith(f"-{row}")] for row in range(1, 7)}
    assert {*rows[2], *rows[3]} == set(DEVICES) and len(rows[2] + rows[3]) == 40
    assert not any(a == b for a, b in zip(rows[2], rows[3], strict=True))
    assert set(rows[5]) == {"propeller_side_force", "turbulence"}
    assert all({c.partition("+")[0] in CATALOGUE, c.partition("+")[2] in DEVICES} == {True}
               for c in rows[6])  # fmt: skip
    for p in planned:
        draw(p.seed, cause=p.cause, size=p.size)


def test_the_fixed_suite_hides_something_of_every_kind():
    fixed = suites.plan("fixed")
    drawn = [draw(p.seed) for p in fixed.cases]
    assert len(drawn) == 12
    assert {case.verdict for case in drawn} == {"none", "named", "unknown"}
    assert {len(case.causes) for case in drawn} == {0, 1, 2}
    assert [p.seed for p in suites.plan("brief").cases] == [p.seed for p in fixed.cases]
    assert {(p.seconds, p.size) for p in suites.plan("brief").cases} == {(3000, 1.0)}
    assert len(suites.plan("nightly", 7).cases) == 200
    network = suites.plan("network")
    assert {p.cause for p in network.cases} == {*parameters.SURVIVE, *parameters.ABSORBED}
    assert {p.model for p in network.cases} == {"feedforward"}


def test_a_plan_may_grow_but_not_change(tmp_path):
    small, large = suites.plan("nightly", 5, 2), suites.plan("nightly", 5, 3)
    assert plan.save(tmp_path, small) == small
    assert plan.save(tmp_path, large) == plan.load(tmp_path) == large
    assert plan.save(tmp_path, small) == large
    with pytest.raises(plan.ShiplogError, match="holds nightly from seed 5"):
        plan.save(tmp_path, suites.plan("nightly", 6, 3))
    other = Plan("nightly", 5, (Planned("5", 5, "current", 1.0, 7000),))
    with pytest.raises(plan.ShiplogError, match="Case 5 "):
        plan.save(tmp_path, other)
    with pytest.raises(plan.ShiplogError, match="no test"):
        plan.load(tmp_path / "elsewhere")


# --- the runner, with a simulator and a shiplog that do nothing -----------------------------------


SIMULATOR = """
import json, pathlib, sys
seed, logs, _, key, *options = sys.argv[1:]
logs, key = pathlib.Path(logs), pathlib.Path(key)
logs.mkdir(); key.parent.mkdir(exist_ok=True)
for name in ("nominal_1", "trial_1"):
    (logs / f"{name}.mcap").write_text(name + seed)
cause = {"name": "current", "size": 1.0, "parameters": {}}
key.write_text(json.dumps({"verdict": "named", "causes": [cause], "structure": None}))
"""
SHIPLOG = """
import json, os, pathlib, sys
command, first, *options = sys.argv[1:]
given = {k: v for k, v in zip(options, options[1:])}
assert os.environ["OMP_NUM_THREADS"] == "1"
with open(os.environ["STEPS"], "a") as reported:
    print(command, "keys" in " ".join(sys.argv), file=reported)
print("words on stderr", file=sys.stderr)
if command == "ingest":
    found = sorted(p.name for p in pathlib.Path(first).iterdir())
    assert found == ["nominal_1.mcap", "trial_1.mcap"]
    pathlib.Path(given["--store"]).mkdir()
elif command == "train":
    pathlib.Path(given["--out"]).mkdir()
else:
    assert pathlib.Path(first).is_dir()
    if os.environ.get("BREAK") in first:
        sys.exit(1)
    cause = {"name": "current", "probability": 0.9, "parameters": {}}
    pathlib.Path(given["--json"]).write_text(json.dumps({"verdict": "named", "causes": [cause]}))
"""


@pytest.fixture
def stubs(tmp_path, monkeypatch):
    monkeypatch.setenv("STEPS", str(tmp_path / "steps"))
    monkeypatch.setenv("BREAK", "nothing")
    for name, program in (("simulator", SIMULATOR), ("shiplog", SHIPLOG)):
        (tmp_path / f"{name}.py").write_text(program)
    commands = {
        "case": (sys.executable, str(tmp_path / "simulator.py")),
        "shiplog": (sys.executable, str(tmp_path / "shiplog.py")),
    }
    return lambda **more: run.Settings(**commands, **more)


def commands_given(tmp_path):
    lines = (tmp_path / "steps").read_text().splitlines()
    assert not any(line.endswith("True") for line in lines)  # no step of shiplog is given the keys
    return [line.split()[0] for line in lines]


def test_a_case_goes_the_whole_way_once(tmp_path, stubs):
    out = tmp_path / "out"
    planned = plan.save(out, suites.plan("nightly", 5, 2))
    run.run(out, planned, stubs(jobs=2))
    folder = out / "cases" / "5"
    kept = {"verdict.json", "verdict.sha256", "steps.json"}
    assert {p.name for p in folder.iterdir()} == kept
    steps = json.loads((folder / "steps.json").read_text())
    assert [step["step"] for step in steps] == ["logs", "ingest", "train", "diagnose"]
    assert all(step["wall_s"] > 0 and step["cpu_s"] > 0 for step in steps)
    # no upper bound: a forked child's peak begins at its parent's, here the whole test session's
    assert steps[-1]["peak_mb"] > 1.0
    assert steps[-1]["stderr"] == "words on stderr\n"

    run.run(out, planned, stubs())
    assert sorted(commands_given(tmp_path)) == ["diagnose"] * 2 + ["ingest"] * 2 + ["train"] * 2
    found = score.read(out)
    assert [one.right for one in found.answers] == [True, True] and not found.pending
    assert "2/2" in score_tables.text(found)
    (folder / "verdict.json").write_text(json.dumps(NONE))
    with pytest.raises(Sealed):
        score.read(out)


def test_a_diagnosis_that_breaks_is_a_wrong_answer_and_is_tried_again(
    tmp_path, stubs, monkeypatch, capsys
):
    out = tmp_path / "out"
    planned = plan.save(out, suites.plan("nightly", 5, 2))
    monkeypatch.setenv("BREAK", "cases/6")
    run.run(out, planned, stubs())
    assert main(["score", str(out)]) == 3
    assert "failed: diagnose ended with 1" in capsys.readouterr().out
    assert [one.word for one in score.read(out).answers] == ["named", "failed"]
    monkeypatch.setenv("BREAK", "nothing")
    run.run(out, planned, stubs())
    assert commands_given(tmp_path).count("diagnose") == 3
    attempts = [score.attempt(one.steps) for one in score.read(out).answers]
    assert attempts == [1, 2]  # the one that had failed was asked once more
    assert main(["score", str(out)]) == 0
    assert main(["score", str(out), "--least", "2"]) == 0
    assert main(["score", str(out), "--least", "3"]) == 4
    assert "2 right and 0 misnamed" in capsys.readouterr().out


def test_one_wrong_name_is_too_many(tmp_path, stubs, capsys):
    """However many are right next to it."""
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 2)), stubs())
    key = out / "keys" / "6.json"
    key.write_text(key.read_text().replace("current", "bank"))
    assert main(["score", str(out), "--least", "1"]) == 4
    assert "1 right and 1 misnamed" in capsys.readouterr().out


def test_a_ship_is_trained_once_where_that_is_asked_for(tmp_path, stubs):
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("goals", 5, 1)), stubs(share=True, keep=True))
    reported = commands_given(tmp_path)
    assert (reported.count("train"), reported.count("diagnose")) == (1, 6)
    assert (out / "cases" / "5-1" / "logs" / "trial_1.mcap").exists()


def test_what_has_not_run_is_pending_and_what_could_not_be_made_is_reported(tmp_path, stubs):
    out = tmp_path / "out"
    plan.save(out, suites.plan("nightly", 5, 2))
    assert len(score.read(out).pending) == 2
    assert score_tables.text(score.read(out)) == "nightly: 0 of 2 cases scored; 2 not run yet."
    (tmp_path / "simulator.py").write_text("raise SystemExit(1)")
    run.run(out, plan.load(out), stubs())
    found = score.read(out)
    assert len(found.unmade) == 2 and not found.answers
    assert json.loads((out / "cases" / "5" / "verdict.json").read_text())["step"] == "logs"
