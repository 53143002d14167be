"""The program without a part of its decision."""

import subprocess
import sys
from contextlib import ExitStack
from dataclasses import asdict, fields
from pathlib import Path
from types import SimpleNamespace

import pytest
from hidden_stubs import programs

from pipelines.experiments.hidden_effects import (
    ablation,
    one_search,
    plan,
    run,
    score,
    suites,
    without,
)
from shiplog.diagnosis.decision_parts import ALL, Parts
from shiplog.diagnosis.hypotheses.hypothesis import Priors
from shiplog.diagnosis.hypotheses.table import Scale
from shiplog.diagnosis.noise import discrepancy
from shiplog.diagnosis.noise.remainder import NOMINAL
from shiplog.diagnosis.nominal import campaign_characteristics, nominal_cache, nominal_fit
from shiplog.diagnosis.trial import setup
from shiplog.diagnosis.verdict import trial_decision
from shiplog.models.causes import CATALOGUE


@pytest.fixture
def stubs(tmp_path, monkeypatch):
    return programs(tmp_path, monkeypatch)


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

    def settings(jobs, shiplog, called):
        assert called.endswith("placebo") == (shiplog[-1] == "placebo")
        asked.append(shiplog[-1])
        found.append(found_from(tmp_path, shiplog[-2]))
        monkeypatch.setenv("SAYS", "coverage" if shiplog[-1] == "placebo" else "none")
        return stubs(jobs=jobs)

    monkeypatch.setattr(without, "Settings", settings)
    without.without_each(out, ("nothing", "placebo"), 1)
    displayed = ablation.page([ablation.answers_in(tmp_path / "out-without")])
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]]
        for line in displayed.splitlines() if line.startswith(("| nothing", "| placebo"))
    ]  # fmt: skip
    assert [[row[0], *row[2:]] for row in rows[:2]] == [
        ["nothing", "2", "2", "0", "0"], ["placebo", "2", "0", "0", "2"],
    ]  # fmt: skip
    assert [(*row[:1], *row[2:]) for row in rows[2:]] == [
        ("placebo", "nothing", "none", "coverage (not right)")
    ] * 2
    assert asked == ["nothing", "placebo"]
    assert found == [Path(without.__file__)] * 2
    assert {folder.name for folder in (tmp_path / "out-without").iterdir()} == set(asked)


def test_every_part_is_taken_out_by_a_switch_of_its_own():
    """Or else of the nominal fit: what is replaced there exists, and is itself again afterwards."""
    switches = {field.name.replace("_", "-") for field in fields(Parts)}
    assert set(without.PARTS) == {without.WHOLE, *switches, *without.ESTIMATES}
    assert set(without.PARTS) == {*ablation.MEANING}
    for part, given in without.PARTS.items():
        off = {name.replace("_", "-") for name, acts in asdict(given).items() if not acts}
        assert off == {
            "share-of-causes": {part, "imitation"}, without.WHOLE: set(),
            **{key: set() for key in without.ESTIMATES},
        }.get(part, {part})  # fmt: skip


PAGE = Path(__file__).parents[2] / "docs" / "evidence" / "ablation.md"


def test_a_part_that_changes_no_answer_has_a_test_that_needs_it():
    """The page lists those of which both of its tables have no other answer."""
    page = PAGE.read_text(encoding="utf-8")
    other: dict[str, int] = {}
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 6 and cells[0] in without.PARTS and cells[5].isdecimal():
            other[cells[0]] = other.get(cells[0], 0) + int(cells[5])
    idle = [part for part in other if part != without.WHOLE and not other[part]]
    assert set(other) == set(without.PARTS) and set(idle) == set(ablation.CASES)
    assert page.endswith("\n\n".join(ablation.needed(idle)) + "\n")
    for _, file, test in ablation.CASES.values():
        text = (PAGE.parents[2] / file).read_text(encoding="utf-8")
        assert f"\ndef {test}(" in text, test


@pytest.mark.parametrize("part", list(without.ESTIMATES))
def test_what_is_replaced_in_the_nominal_fit_comes_back(part):
    watched = {
        "discrepancy": (discrepancy, "MODELLED"),
        "robust-weights": (campaign_characteristics, "robust_weights"),
    }  # fmt: skip
    before = getattr(*watched[part])
    with ExitStack() as stack:
        without.ESTIMATES[part](stack)
        assert getattr(*watched[part]) is not before
    assert getattr(*watched[part]) is before


def test_a_fit_without_the_discrepancy_is_not_that_of_the_cache(monkeypatch):
    """Nor is it kept there, where the whole program would take it for its own."""
    monkeypatch.setattr(nominal_fit, "converged", lambda *given, seen: (given, seen))
    monkeypatch.setattr(nominal_cache, "_key", None)  # whoever wants to read or keep it needs that
    with ExitStack() as stack:
        without.ESTIMATES["discrepancy"](stack)
        assert nominal_cache.converged("model", "record") == (("model", "record"), ())


@pytest.mark.parametrize("acts", [True, False])
def test_without_form_errors_no_cause_has_one(acts):
    """An allowance of a fifth squared of 5000 nats, or none."""
    coarse = [cause for cause in CATALOGUE if cause.form_error]
    assert {cause.name: cause.form_error for cause in coarse} == {
        "bank": 0.2, "shallow_water": 0.2, "contact": 0.2, "line": 0.1, "tow": 0.1,
        **dict.fromkeys((c.name for c in coarse if c.name.startswith("actuator")), 0.1),
    }  # fmt: skip
    by, alone = {cause.label: cause for cause in coarse}, {"bank": 5000.0}
    scale = Scale(Priors(coarse, ()), {}, by, alone, 0.0, form_errors=acts)
    labels = ("bank", "shallow_water")
    score = scale.score(0.0, labels, NOMINAL) - scale.priors.hypothesis(labels, NOMINAL)
    assert score == pytest.approx(-200.0 if acts else 0.0)


def test_of_one_search_a_verdict_is_made_again_only_without_a_part_that_matters(
    tmp_path, monkeypatch
):
    """The first part changes what is decided, the second one does not. The search is made once."""
    searched, asked = [], []
    found = SimpleNamespace(search=SimpleNamespace(table=SimpleNamespace(banned=set())))
    monkeypatch.setattr(setup, "trial_of", lambda numbers: searched.append("set up"))
    monkeypatch.setattr(
        trial_decision, "_searched", lambda numbers: searched.append("searched") or found
    )
    monkeypatch.setattr(one_search, "_decided", lambda kept: kept.parts.slight)

    def run_shiplog(arguments, parts=ALL):
        setup.trial_of(None)
        trial_decision._searched(None)
        asked.append(dict(zip(arguments[1::2], arguments[2::2], strict=True)))
        Path(asked[-1]["--json"]).write_text(
            f"slight {found.search.table.parts.slight}", encoding="utf-8"
        )
        return 3

    monkeypatch.setattr(one_search.process, "run", run_shiplog)
    verdict, folder = tmp_path / "verdict.json", tmp_path / "d"
    given = ["diagnose", "--out", str(folder), "--json", str(verdict)]
    parts = {part: without.PARTS[part] for part in ("slight", "imitation")}
    with pytest.raises(SystemExit) as done:
        one_search.diagnose(given, parts)
    assert done.value.code == 3
    assert searched == ["set up", "searched"]
    assert [Path(one["--out"]).name for one in asked] == ["d", "d-slight"]
    left = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.glob("*.json")}
    assert left == {
        "verdict.json": "slight True", "verdict-without-slight.json": "slight False",
        "verdict-without-imitation.json": "slight True",
    }  # fmt: skip


def test_verdicts_of_one_search_become_sealed_answers_of_each_part(tmp_path, stubs):
    out, part = tmp_path / "out", tmp_path / "without-slight"
    planned = plan.save(out, suites.plan("nightly", 5, 2))
    run.run(out, planned, stubs(keep=True))
    other = plan.case_folder(out, planned.cases[0]) / "verdict-without-slight.json"
    other.write_text('{"verdict": "coverage"}', encoding="utf-8")
    one_search.distribute(out, {"slight": part})
    (answer,) = score.read(part).answers
    assert (answer.planned, answer.word) == (planned.cases[0], "coverage")
    assert [one["step"] for one in answer.steps][-1] == "diagnose"
