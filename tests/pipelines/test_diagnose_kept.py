"""What a diagnosis has found stays found, whatever happens to its pictures."""

import json

import pytest
from commands import call

from pipelines import diagnose as pipeline
from shiplog.exceptions import ShiplogError
from shiplog.report import answer
from shiplog.report.answer import DiagnosedTrial
from shiplog.report.verdict import Verdict


@pytest.mark.parametrize("fault", [ShiplogError("The disk is full."), ZeroDivisionError("of ours")])
def test_pictures_that_fail_cost_neither_the_answer_nor_the_extended_run(
    published, store, tmp_path, monkeypatch, caplog, fault
):
    """They are drawn last."""
    done = []

    def decided(of, out, _causes) -> DiagnosedTrial:
        found: Verdict = answer.too_little(of.run, of.recorded, of.before_effect)
        return DiagnosedTrial(found, out, decision=found, after=found)  # type: ignore[arg-type]  # stand-ins

    def drawn(*_):
        done.append("pictures")
        raise fault

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(answer, "enough", lambda _: True)
    monkeypatch.setattr(pipeline, "_decided", decided)
    monkeypatch.setattr(pipeline.extension_file, "extend", lambda *_: done.append("extended run"))
    monkeypatch.setattr(pipeline.diagnosis_pictures, "save", drawn)
    out, to = tmp_path / "out", tmp_path / "a.json"
    code, text, _ = call(
        "diagnose", published[0], "--store", store, "--voyages", "trip_3", "--out", out,
        "--extend", tmp_path / "extended", "--json", to,
    )  # fmt: skip
    assert (code, done) == (3, ["extended run", "pictures"])
    assert str(fault.args[0]) in caplog.text
    assert "Too little" in text and "Recording: none" in text and "Extended model" in text
    assert "Too little" in json.loads(to.read_text())["sentence"]
    assert sorted(p.name for p in out.iterdir()) == ["provenance.json", "report.md", "verdict.json"]
