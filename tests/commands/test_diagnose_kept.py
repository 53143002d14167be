"""What a diagnosis has found stays found, whatever happens to its pictures."""

import json
from types import SimpleNamespace

import pytest
from commands import call

from shiplog.commands import diagnose as pipeline
from shiplog.exceptions import ShiplogError
from shiplog.report.diagnosis import answer
from shiplog.report.diagnosis.diagnosis import Diagnosis
from shiplog.report.diagnosis.verdict import Verdict


@pytest.fixture
def pictures(monkeypatch, tmp_path):
    """A diagnosis that is decided at once, and what it does then; `fault` ends the pictures."""
    done: list[str] = []

    def decided(of, out, _causes) -> Diagnosis:
        found: Verdict = answer.too_little(of.run, of.recorded, of.before_effect)
        return Diagnosis(found, out, decision=found, after=found)  # type: ignore[arg-type]  # stand-ins

    def extended(_run, _after, out, *_):
        done.append("extended run")
        return SimpleNamespace(path=out)

    def broken_by(fault):
        def drawn(*_):
            done.append("pictures")
            raise fault

        monkeypatch.setattr(pipeline.diagnosis_pictures, "exhibit", drawn)
        return done

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(answer, "enough", lambda _: True)
    monkeypatch.setattr(pipeline, "_decided", decided)
    monkeypatch.setattr(pipeline, "_extended", extended)
    return broken_by


@pytest.mark.parametrize("fault", [ShiplogError("The disk is full."), ZeroDivisionError("of ours")])
def test_pictures_that_fail_cost_neither_the_answer_nor_the_extended_run(
    published, store, tmp_path, caplog, pictures, fault
):
    """The verdict is written before them, the extended run after them."""
    done = pictures(fault)
    out, to = tmp_path / "out", tmp_path / "a.json"
    code, text, _ = call(
        "diagnose", published[0], "--store", store, "--voyages", "trip_3", "--out", out,
        "--extend", tmp_path / "extended", "--json", to,
    )  # fmt: skip
    assert (code, done) == (3, ["pictures", "extended run"])
    assert str(fault.args[0]) in caplog.text
    assert "Too little" in text and "Recording: none" in text and "Extended model" in text
    assert "Too little" in json.loads(to.read_text())["sentence"]
    assert sorted(p.name for p in out.iterdir()) == ["provenance.json", "report.md", "verdict.json"]


def test_a_diagnosis_that_is_stopped_in_its_pictures_can_be_given_again(
    published, store, tmp_path, pictures
):
    """With the extended run there, the same command would be refused, and have no pictures."""
    done = pictures(KeyboardInterrupt())
    command = (
        "diagnose", published[0], "--store", store, "--voyages", "trip_3", "--out",
        tmp_path / "out", "--extend", tmp_path / "extended",
    )  # fmt: skip
    for number in (1, 2):
        assert call(*command)[0] not in (0, 3)
        assert done == ["pictures"] * number
