"""What the blind test runs: other families, rivals, replays, one commit a table;
with a simulator and a program that do nothing."""

import hashlib
import json
import subprocess
import sys
import tarfile
import xml.etree.ElementTree as ElementTree
from contextlib import ExitStack
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from pipelines.experiments.hidden_effects import (
    archive,
    methods,
    plan,
    program,
    remake,
    replay,
    run,
    score,
    suites,
    without,
)
from pipelines.experiments.hidden_effects.__main__ import main
from pipelines.experiments.hidden_effects.plan import Plan, Planned
from shiplog.diagnosis import (
    baseline_check,
    campaign_characteristics,
    discrepancy,
    nominal_cache,
    nominal_fit,
    placebo,
    posterior,
    refutation,
    thresholds,
    trial_voyages,
)
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

SIMULATOR = """
import json, pathlib, sys
seed, logs, _, key, *options = sys.argv[1:]
pathlib.Path(logs).mkdir()
if "--family" in options:
    (pathlib.Path(logs) / "ship.toml").write_text("")
pathlib.Path(key).write_text(json.dumps({"verdict": "none", "causes": [], "structure": None}))
"""
SHIPLOG = """
import json, os, pathlib, sys
command, first, *options = sys.argv[1:]
given = {k: v for k, v in zip(options, options[1:])}
made = {"ingest": "--store", "train": "--out"}.get(command)
if command == "ingest":
    own = pathlib.Path(first, "ship.toml").exists()
    assert given["--profile"] == (str(pathlib.Path(first, "ship.toml")) if own else "esso-vectwin")
if made:
    pathlib.Path(given[made]).mkdir()
else:
    assert pathlib.Path(first).is_dir() and pathlib.Path(given["--store"]).is_dir()
    pathlib.Path(given["--json"]).write_text(json.dumps({"verdict": os.environ["SAYS"]}))
"""
RIVALS = """
import json, pathlib, sys
base, *options = sys.argv[1:]
given = {k: v for k, v in zip(options, options[1:])}
json_ = pathlib.Path(given["--json"])
assert "keys" not in " ".join(sys.argv) and given["--voyages"] == "trial_*"
assert pathlib.Path(base).is_dir() and pathlib.Path(given["--store"]).is_dir()
assert (json_.parent / "verdict.sha256").exists()  # it comes last
json_.write_text(json.dumps({"methods": {"glr": {"answer": None, "ranking": []}}}))
"""


@pytest.fixture
def stubs(tmp_path, monkeypatch):
    monkeypatch.setenv("SAYS", "none")
    commands = {}
    for name, source in (("case", SIMULATOR), ("shiplog", SHIPLOG), ("rival", RIVALS)):
        (tmp_path / f"{name}.py").write_text(source)
        commands[name] = (sys.executable, str(tmp_path / f"{name}.py"))
    return lambda **more: run.Settings(**commands, abroad=commands["case"], **more)


def names_in(out, label="5"):
    return {p.name for p in (out / "cases" / label).iterdir()}


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


def test_one_case_of_several_is_asked_again(tmp_path, stubs):
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 3)), stubs(keep=True))
    again = replay.replay(out, tmp_path / "new", stubs(), every=2)
    assert [p.label for p in again.cases] == ["5", "7"]
    assert len(score.read(tmp_path / "new").answers) == 2


def found_from(folder, module):
    """The file that `python -m` would run there."""
    where = f"import importlib.util; print(importlib.util.find_spec({module!r}).origin)"
    done = subprocess.run(
        [sys.executable, "-c", where], cwd=folder, capture_output=True, text=True, check=False
    )
    return Path(done.stdout.strip() or "nowhere")


def test_an_ablation_counts_the_answers_that_a_part_changes(tmp_path, stubs, monkeypatch):
    """Two kept cases in which nothing was hidden; without the placebo a name would be reported."""
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 2)), stubs(keep=True))
    asked, found = [], []
    monkeypatch.delenv("PYTHONPATH", raising=False)

    def settings(jobs, shiplog):
        asked.append(shiplog[-1])
        found.append(found_from(tmp_path, shiplog[-2]))
        monkeypatch.setenv("SAYS", "coverage" if shiplog[-1] == "placebo" else "none")
        return stubs(jobs=jobs)

    monkeypatch.setattr(without, "Settings", settings)
    displayed = without.table(out, ("nothing", "placebo"), 1)
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]] for line in displayed.splitlines()[-2:]
    ]
    assert rows == [["nothing", "2", "2", "0", "0"], ["placebo", "2", "0", "0", "2"]]
    assert asked == ["nothing", "placebo"]
    assert found == [Path(without.__file__)] * 2
    assert {folder.name for folder in (tmp_path / "out-without").iterdir()} == set(asked)


@pytest.mark.parametrize("part", list(without.PARTS))
def test_every_part_that_can_be_taken_out_is_there_and_comes_back(part):
    """What a part replaces exists under that name, and is itself again afterwards."""
    watched = {
        "placebo": (placebo, "placebos"), "form-error": (thresholds, "FORM_ERROR"),
        "discrepancy": (discrepancy, "SEEN"), "voyage-effects": (nominal_cache, "characteristics"),
        "share-of-trial": (nominal_cache, "characteristics"),
        "robust-weights": (campaign_characteristics, "robust_weights"),
        "refutation": (refutation, "judged"), "baseline": (baseline_check, "lacking"),
        "practical-size": (posterior, "practical"), "share-of-causes": (thresholds, "MOST"),
        "time-scale": (trial_voyages, "in_ship_time"), "imitation": (without.fits, "imitated"),
    }  # fmt: skip
    assert set(without.PARTS) == {without.WHOLE, *watched}
    before = {name: getattr(*where) for name, where in watched.items()}
    with ExitStack() as stack:
        without.PARTS[part](stack)
        if part in watched:
            assert getattr(*watched[part]) is not before[part]
    assert all(getattr(*where) is before[name] for name, where in watched.items())


def test_a_fit_without_the_discrepancy_is_not_that_of_the_cache(monkeypatch):
    """Nor is it kept there, where the whole program would take it for its own."""
    monkeypatch.setattr(nominal_fit, "converged", lambda *given, seen: (given, seen))
    monkeypatch.setattr(nominal_cache, "_key", None)  # whoever wants to read or keep it needs that
    with ExitStack() as stack:
        without.PARTS["discrepancy"](stack)
        assert nominal_cache.converged("model", "record") == (("model", "record"), ())


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


def test_packed_answers_make_the_same_page_and_a_test_goes_on_from_them(tmp_path, stubs, capsys):
    out, packed = tmp_path / "out", tmp_path / "answers.tar.xz"
    planned = plan.save(out, suites.plan("nightly", 5, 2))
    run.run(out, replace(planned, cases=planned.cases[:1]), stubs())
    assert main(["pack", str(out), "--into", str(packed)]) == 0
    before = packed.read_bytes()
    with tarfile.open(packed) as content:
        assert not [name for name in content.getnames() if "store" in name or "logs" in name]
        content.extractall(tmp_path / "elsewhere", filter="data")
    archive.pack([out], packed)
    assert packed.read_bytes() == before
    pages = []
    for given in (out, packed):
        capsys.readouterr()
        assert main(["scores", str(given)]) == 0
        pages.append(capsys.readouterr().out)
    assert pages[0] == pages[1] and "1 of 2 cases; 1 not run" in pages[0]
    run.run(tmp_path / "elsewhere" / "out", planned, stubs())
    answers = score.read(tmp_path / "elsewhere" / "out").answers
    assert [one.planned.label for one in answers] == ["5", "6"]
    assert (out / "cases" / "5" / "verdict.json").read_bytes() == (
        tmp_path / "elsewhere" / "out" / "cases" / "5" / "verdict.json"
    ).read_bytes()


def test_a_case_that_could_not_be_made_is_packed_without_a_key(tmp_path, stubs):
    out, packed = tmp_path / "out", tmp_path / "answers.tar.xz"
    planned = plan.save(out, suites.plan("nightly", 5, 2))
    run.run(out, replace(planned, cases=planned.cases[:1]), stubs())
    settings = stubs()
    (tmp_path / "case.py").write_text("raise SystemExit(1)")
    run.run(out, planned, settings)
    archive.pack([out], packed)
    with archive.opened([packed]) as folders:
        found = score.read(folders[0])
    assert [one.label for one in found.unmade] == ["6"]
    assert [one.planned.label for one in found.answers] == ["5"]


def test_packed_answers_hold_no_path_of_the_machine(tmp_path, stubs):
    out, packed = tmp_path / "out", tmp_path / "answers.tar.xz"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 2)), stubs(called="another program"))
    folder = out / "cases" / "5"
    recording = str(folder / "d" / "diagnosis.rrd")
    (folder / "verdict.json").write_text(json.dumps({"verdict": "none", "recording": recording}))
    run._seal_file(folder / "verdict.json")
    steps = json.loads((folder / "steps.json").read_text())
    steps[-1] |= {"stderr": f"Recording: {recording}"}
    (folder / "steps.json").write_text(json.dumps(steps))
    (out / "cases" / "6" / "verdict.sha256").write_text("0  verdict.json")  # its answer was changed
    archive.pack([out], packed)
    with tarfile.open(packed) as content:
        content.extractall(tmp_path / "elsewhere", filter="data")
    there = tmp_path / "elsewhere" / "out"
    verdict = (there / "cases" / "5" / "verdict.json").read_text()
    assert json.loads(verdict)["recording"] == "out/cases/5/d/diagnosis.rrd"
    assert str(tmp_path) not in verdict + (there / "cases" / "5" / "steps.json").read_text()
    with pytest.raises(score.Sealed, match="is not what was sealed"):
        score.read(there)
    (there / "cases" / "6" / "verdict.sha256").unlink()
    (one,) = score.read(there).answers
    assert one.word == "none" and program.of_answers(one.steps) == ("another program",)


def test_unpacked_answers_become_a_test_that_can_be_asked_again(tmp_path, stubs):
    out, packed = tmp_path / "out", tmp_path / "answers.tar.xz"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 2)), stubs())
    archive.pack([out], packed)
    with tarfile.open(packed) as content:
        content.extractall(tmp_path / "elsewhere", filter="data")
    there = tmp_path / "elsewhere" / "out"
    answer = (there / "cases" / "5" / "verdict.json").read_bytes()
    planned = remake.remake(there, stubs())
    assert {"logs", "store", "base"} <= names_in(there) and run.kept(there, planned.cases[1])
    assert (there / "cases" / "5" / "verdict.json").read_bytes() == answer
    run.run(there, planned, stubs(rivals=True))
    assert all(one.rivals for one in score.read(there).answers)
    (there / "cases" / "5" / "store" / "mark").write_text("")
    remake.remake(there, stubs())  # it is there already
    assert (there / "cases" / "5" / "store" / "mark").exists()


@pytest.mark.parametrize(
    ("what", "reported"), [("key", "hides something else"), ("ingest", "ingest ended with 1")]
)
def test_a_case_that_is_not_the_same_again_is_not_kept(tmp_path, stubs, what, reported):
    out = tmp_path / "out"
    run.run(out, plan.save(out, suites.plan("nightly", 5, 1)), stubs())
    if what == "key":
        key = out / "keys" / "5.json"
        key.write_text(key.read_text().replace("none", "named"))
        settings = stubs()
    else:
        broken = tmp_path / "broken.py"
        broken.write_text("import sys\nsys.exit(1)")
        settings = replace(stubs(), shiplog=(sys.executable, str(broken)))
    with pytest.raises(ShiplogError, match=reported):
        remake.remake(out, settings)
    assert not names_in(out) & set(run.LARGE)
    assert "verdict.json" in names_in(out)


def test_what_cannot_be_packed_or_unpacked_is_reported(tmp_path, capsys):
    (tmp_path / "a").mkdir()
    assert main(["pack", str(tmp_path / "a"), "--into", str(tmp_path / "b")]) == 1
    assert "holds no test" in capsys.readouterr().err and not (tmp_path / "b").exists()
    assert main(["pack", *[str(tmp_path / "a")] * 2, "--into", str(tmp_path / "b")]) == 1
    assert "Two of the folders" in capsys.readouterr().err
    (tmp_path / "b").write_text("words")
    assert main(["scores", str(tmp_path / "b")]) == 1
    assert "no archive of tests" in capsys.readouterr().err


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
