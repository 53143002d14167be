"""The program without a part of its decision."""

import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest
from hidden_stubs import programs

from pipelines.experiments.hidden_effects import (
    ablation,
    plan,
    run,
    suites,
    without,
)
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
from shiplog.diagnosis.hypothesis import form_error, form_error_of
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
    assert set(without.PARTS) == {without.WHOLE, *watched} == {*ablation.MEANING}
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


def test_without_form_errors_no_cause_has_one():
    coarse = [cause for cause in CATALOGUE if cause.form_error]
    assert {cause.name for cause in coarse} == {"bank", "shallow_water"}
    with ExitStack() as stack:
        without.PARTS["form-error"](stack)
        assert {form_error_of(cause) for cause in CATALOGUE} == {0.0}
        assert form_error({}, ("bank",), {"bank": coarse[0]}, 5000.0) == 0.0
    assert {form_error_of(cause) for cause in coarse} == {0.2}
