"""What the blind test runs: other families, rivals, replays, one commit a table;
with a simulator and a program that do nothing."""

import hashlib
import json
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import pytest
from hidden_stubs import SHIPLOG, names_in, programs

from pipelines.experiments.hidden_effects import (
    methods,
    plan,
    program,
    replay,
    run,
    score,
    suites,
)
from pipelines.experiments.hidden_effects.__main__ import main
from pipelines.experiments.hidden_effects.plan import Plan, Planned
from shiplog.exceptions import ShiplogError

ROOT = Path(__file__).parents[2]

# --- ships of other families ----------------------------------------------------------------------

SIMULATED = SimpleNamespace(
    OUTSIDE={"tether": 0, "tow": 0, "rudder_limit": 0},
    offered=lambda family, seed=0: (
        ("current", "fouling", "thrust_loss", "thrust_loss:unit", "tether", "tow")
        if family == "catamaran" else ("current", "fouling", "bank", "payload")
    ),
)  # fmt: skip


@pytest.fixture
def simulator(monkeypatch):
    monkeypatch.setitem(sys.modules, "pipelines.experiments", SimpleNamespace(__path__=[]))
    monkeypatch.setitem(sys.modules, "pipelines.experiments.other_families", SIMULATED)


def test_what_a_ship_lacks_is_not_hidden_in_it(simulator, monkeypatch):
    """Every other ship of each family here has no load to shift; the next cause takes its turn."""
    every = SIMULATED.offered

    def offered(family, seed=0):
        return tuple(n for n in every(family) if n != "payload" or seed % 2 == 0)

    monkeypatch.setattr(SIMULATED, "offered", offered)
    cases = suites.plan("abroad", 70000, 100).cases
    assert any("payload" in case.cause for case in cases)
    assert not [case for case in cases if case.seed % 2 and "payload" in case.cause]


def test_every_family_meets_every_row_in_its_share(simulator):
    cases = suites.plan("abroad", 70000, 100).cases
    for family in suites.FAMILIES:
        mine = [p for p in cases if p.family == family]
        kinds = [
            "none" if p.cause == "none" else "two" if "+" in str(p.cause)
            else "outside" if p.cause in SIMULATED.OUTSIDE else p.size
            for p in mine
        ]  # fmt: skip
        counts = {kind: kinds.count(kind) for kind in kinds}
        assert counts == {1.0: 6, "none": 5, "outside": 5, 0.3: 2, "two": 2}
    for first in range(0, 100, 20):
        assert sum(p.cause == "none" for p in cases[first : first + 20]) == 5
    outside = {p.cause for p in cases if p.family == "catamaran"} & set(SIMULATED.OUTSIDE)
    assert outside == {"tether", "tow"}  # it says that it has no rudder
    assert not any(p.cause == "thrust_loss+thrust_loss:unit" for p in cases)
    assert all(p.label == str(p.seed) for p in cases) and len({p.seed for p in cases}) == 100
    assert suites.plan("abroad", 70000, 33).cases == cases[:33]
    assert [p.cause for p in suites.plan("abroad", 70100, 100).cases] != [p.cause for p in cases]
    assert cases[0].options[:2] == ["--family", "abkowitz"]


def test_without_that_simulator_it_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "pipelines.experiments.other_families", None)
    with pytest.raises(ShiplogError, match="other_families, is not here"):
        suites.plan("abroad")


def test_a_plan_from_before_there_were_families_still_loads(tmp_path):
    cases = [Planned("5", 5, "none", None, 7000)]
    old = [{k: v for k, v in asdict(p).items() if k != "family"} for p in cases]
    (tmp_path / "keys").mkdir()
    content = {"contract": 1, "suite": "nightly", "first_seed": 5, "cases": old}
    (tmp_path / "keys" / "plan.json").write_text(json.dumps(content))
    assert plan.load(tmp_path) == Plan("nightly", 5, tuple(cases))


# --- the runner, with programs that do nothing ----------------------------------------------------


@pytest.fixture
def stubs(tmp_path, monkeypatch):
    return programs(tmp_path, monkeypatch)


def test_rivals_answer_once_the_verdict_is_sealed(tmp_path, stubs, monkeypatch):
    out = tmp_path / "out"
    planned = plan.save(out, suites.plan("nightly", 5, 1))
    run.run(out, planned, stubs(keep=True))
    run.run(out, planned, stubs(rivals=True))  # a kept case can be asked later
    assert {"rivals.json", "rivals.sha256", "store"} <= names_in(out)
    steps = json.loads((out / "cases" / "5" / "steps.json").read_text())
    assert [s["step"] for s in steps] == ["logs", "ingest", "train", "diagnose", "rivals"]
    assert {s.get("commit") for s in steps if s["step"] == "rivals"} == {
        program.identity()["commit"]
    }
    assert program.name(steps[3]).startswith(sys.executable)  # not this source's shiplog
    (one,) = score.read(out).answers
    assert one.rivals == {"glr": {"answer": None, "ranking": []}}
    assert methods.answers([one])["likelihood ratio"][0].right
    run.run(out, planned, stubs(rivals=True))  # nothing is left to ask
    assert len(json.loads((out / "cases" / "5" / "steps.json").read_text())) == 5


def test_a_kept_case_is_asked_again_into_another_folder(tmp_path, stubs, monkeypatch):
    out, new = tmp_path / "out", tmp_path / "new"
    planned = plan.save(out, suites.plan("nightly", 5, 2))
    run.run(out, planned, stubs(keep=True))
    for name in ("store", "base"):  # case 6 was not kept
        (out / "cases" / "6" / name).rmdir()
    before = hashlib.sha256((out / "cases" / "5" / "verdict.json").read_bytes()).hexdigest()
    monkeypatch.setenv("SAYS", "coverage")
    again = replay.replay(out, new, stubs(rivals=True))
    assert [p.label for p in again.cases] == ["5"]
    assert names_in(new) == {
        "verdict.json", "verdict.sha256", "steps.json", "rivals.json", "rivals.sha256"
    }  # fmt: skip
    (one,) = score.read(new).answers
    assert one.word == "coverage" and [s["step"] for s in one.steps] == [
        "logs", "ingest", "train", "diagnose", "rivals",
    ]  # fmt: skip
    assert hashlib.sha256((out / "cases" / "5" / "verdict.json").read_bytes()).hexdigest() == before
    monkeypatch.setenv("SAYS", "none")
    replay.replay(out, new, stubs(rivals=True))  # nothing is left to do
    assert score.read(new).answers[0].word == "coverage"
    with pytest.raises(ShiplogError, match="cannot hold its own replay"):
        replay.replay(out, out, stubs())
    with pytest.raises(ShiplogError, match="no case with store and base"):
        replay.replay(new, tmp_path / "third", stubs())


def test_another_program_makes_its_own_store_and_model_from_the_kept_logs(tmp_path, stubs):
    out, new = tmp_path / "out", tmp_path / "new"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 3)), stubs(keep=True))
    command = tmp_path / "shiplog.py"  # it would find this source, and not its own, from here
    command.write_text(f"import os\nassert os.getcwd() != {str(ROOT)!r}\n{SHIPLOG}")
    again = replay.replay(out, new, stubs(share=True), first=2, whole=True)
    assert [p.label for p in again.cases] == ["5", "6"]
    found = score.read(new).answers
    assert [a.word for a in found] == ["none", "none"] and all(a.right for a in found)
    assert [s["step"] for s in found[0].steps] == ["ingest", "train", "diagnose"]
    assert (out / "cases" / "5" / "logs").is_dir() and not (new / "cases" / "5" / "logs").exists()
    assert (new / "bases" / "5").is_dir()
    replay.replay(out, new, stubs(share=True), whole=True)  # it grows by the third
    assert len(score.read(new).answers) == 3


def test_a_replay_that_is_stopped_can_be_scored(tmp_path, stubs):
    """While simpler methods are asked: the verdict is sealed by then."""
    out, new = tmp_path / "out", tmp_path / "new"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 1)), stubs(keep=True))
    settings = stubs(rivals=True)
    (tmp_path / "rival.py").write_text("raise SystemExit(130)")
    with pytest.raises(KeyboardInterrupt):
        replay.replay(out, new, settings)
    assert [one.word for one in score.read(new).answers] == ["none"]
    (new / "keys" / "5.json").unlink()  # killed between seal and key
    replay.replay(out, new, stubs())
    assert [one.word for one in score.read(new).answers] == ["none"]


@pytest.mark.parametrize(("code", "word"), [(1, "failed"), (3, "none")])
def test_logs_that_a_program_refuses_or_damages_are_its_own_answer(tmp_path, stubs, code, word):
    """They are there, whatever it does with them: the case counts."""
    out, new = tmp_path / "out", tmp_path / "new"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 1)), stubs(keep=True))
    settings = stubs()
    end = f'if command == "ingest":\n    sys.exit({code})\n'
    (tmp_path / "shiplog.py").write_text(SHIPLOG + end)
    replay.replay(out, new, settings, whole=True)
    found = score.read(new)
    assert [one.word for one in found.answers] == [word] and not found.unmade


def test_some_cases_of_several_are_asked_again_and_then_others_in_addition(tmp_path, stubs):
    out, new = tmp_path / "out", tmp_path / "new"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 5)), stubs(keep=True))
    for every, asked in ((2, ["5", "7", "9"]), (3, ["5", "7", "8", "9"])):
        again = replay.replay(out, new, stubs(), every=every)
        assert [p.label for p in again.cases] == asked
        assert [answer.planned.label for answer in score.read(new).answers] == asked


def test_logs_of_another_family_come_with_their_own_profile(tmp_path, stubs, simulator):
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("abroad", 70000, 1)), stubs())
    (one,) = score.read(out).answers
    assert one.abroad and one.word == "none"


def test_the_page_is_written_with_its_picture_or_refused(tmp_path, stubs, capsys):
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 2)), stubs())
    page = tmp_path / "docs" / "validation.md"
    assert main(["scores", str(out), "--markdown", str(page)]) == 0
    text = page.read_text()
    assert "![Share true over the reported probability](validation-reliability.svg)" in text
    assert ElementTree.parse(page.with_name("validation-reliability.svg")).getroot() is not None
    assert main(["scores", str(out)]) == 0 and "# Validation" in capsys.readouterr().out
    steps = out / "cases" / "6" / "steps.json"
    content = json.loads(steps.read_text())
    content[-1] |= {"program": None, "commit": "c" * 40}
    steps.write_text(json.dumps(content))
    assert main(["scores", str(out)]) == 2
    assert "several programs" in capsys.readouterr().err


# --- the commit


def test_a_checkout_says_its_commit_and_whether_the_source_was_changed(tmp_path):
    def git(*arguments):
        who = ("-c", "user.name=a", "-c", "user.email=a@b")
        done = subprocess.run(
            ["git", "-C", str(tmp_path), *who, *arguments], check=True, capture_output=True
        )
        return done.stdout.decode().strip()

    assert program.identity(tmp_path) == {"commit": None, "dirty": None}
    git("init", "-q")
    (tmp_path / "shiplog").mkdir()
    (tmp_path / "shiplog" / "a.py").write_text("1\n")
    git("add", "-A")
    git("commit", "-qm", "first")
    head = git("rev-parse", "HEAD")
    (tmp_path / "notes.md").write_text("no source")
    assert program.identity(tmp_path) == {"commit": head, "dirty": False}
    (tmp_path / "shiplog" / "a.py").write_text("2\n")
    assert program.identity(tmp_path) == {"commit": head, "dirty": True}
    assert program.name({"commit": head, "dirty": True}) == f"{head[:12]}+changes"
    assert program.name(program.other(("shiplog", "--x"))) == "shiplog --x"


def test_the_source_is_the_one_that_these_tests_stand_in():
    assert program.ROOT == ROOT
    assert (program.ROOT / "pyproject.toml").is_file()
