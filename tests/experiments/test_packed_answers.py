"""Answers in one file, and the cases that are made from them again."""

import json
import sys
import tarfile
from dataclasses import replace

import pytest
from hidden_stubs import names_in, programs

from pipelines.experiments.hidden_effects import (
    archive,
    plan,
    program,
    remake,
    run,
    score,
    suites,
)
from pipelines.experiments.hidden_effects.__main__ import main
from shiplog.exceptions import ShiplogError


@pytest.fixture
def stubs(tmp_path, monkeypatch):
    return programs(tmp_path, monkeypatch)


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
