"""The benchmark beside another build: its table, what counts as equal, stores for older builds."""

import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
import sailing

from pipelines.experiments.benchmarks.diagnosis_cost import builds, commands, kernels, served
from pipelines.experiments.benchmarks.diagnosis_cost.builds import Build, Failed, Used, Worker
from pipelines.experiments.benchmarks.diagnosis_cost.cases import Case
from pipelines.experiments.benchmarks.diagnosis_cost.table import Row, lines
from shiplog.voyages.store.store import Store


def test_a_ratio_is_the_median_of_the_rounds_with_its_spread():
    row = Row("rollout", "s", [1.0, 2.0, 4.0], [10.0, 16.0, 48.0], least=9.0, apart=0.0, alike=1e-6)
    assert row.ratios == [10.0, 8.0, 12.0] and row.ratio == 10.0 and row.holds is True
    assert "| 10.00 (8.00 to 12.00) | ≥ 9 | yes |" in lines([row])[2]


def test_what_is_not_equal_has_no_ratio_and_does_not_hold():
    row = Row("rollout", "s", [1.0], [10.0], least=5.0, apart=1e-3, alike=1e-6)
    assert row.ratio is None and row.holds is False
    assert "NOT EQUAL" in lines([row])[2]


def test_the_worst_case_and_a_limit_are_of_the_largest_values():
    """6 s became 3 s in the worst cases, although the worst cases are two different ones."""
    worst = Row("worst", "s", [1.0, 3.0], [6.0, 5.0], least=3.0, worst=True)
    assert worst.ratio == 2.0 and worst.holds is False
    peak = Row("memory", "GB", [0.7, 0.9], [2.0, 2.1], most=0.8, worst=True)
    assert peak.value == 0.9 and peak.holds is False
    assert Row("memory", "GB", [0.7], most=0.8).holds is True


def test_a_row_without_a_measurement_says_why_below_the_table():
    text = lines([Row("CasADi", "s", reason="there is no gcc")])
    assert text[-1] == "not measured: CasADi: there is no gcc"
    assert Row("CasADi", "s", reason="there is no gcc").holds is None


def test_differences_are_of_the_largest_of_a_column():
    one = np.array([[1e6, 1e-3], [0.0, 0.0]])
    other = one + np.array([[1.0, 1e-9], [0.0, 0.0]])
    assert kernels.difference(one, other) == pytest.approx(1e-6, rel=1e-2)
    assert kernels.difference(one, one[:1]) == np.inf
    assert kernels.difference(one, np.where(one > 1.0, np.nan, one)) == np.inf
    both = np.where(one > 1.0, np.nan, one)
    assert kernels.difference(both, both) == 0.0


def test_a_straight_line_and_how_far_off_it_the_values_are():
    at_none, rise, off = commands.straight([10, 20, 40], [12.0, 22.0, 42.0])
    assert (at_none, rise, off) == pytest.approx((2.0, 1.0, 0.0), abs=1e-9)
    assert commands.straight([10, 20, 40], [100.0, 400.0, 1600.0])[2] > 0.05
    rows = list(commands.of_many(2.0, [(n, Used(2.0 + n, 1024.0, {})) for n in (10, 30)], 1000))
    assert rows[0].facts["at_1000"] == pytest.approx(1002.0)
    assert rows[1].most == 16.0 and rows[1].value == pytest.approx(1.0)


def test_first_and_later_cases_of_each_ship_and_verdicts_that_differ(tmp_path, monkeypatch):
    ours, older = (Build(name, tmp_path, tmp_path / name) for name in ("this", "older"))
    cases = [
        Case(label, ship, tmp_path / label / "ours", tmp_path / label / "theirs")
        for label, ship in (("a-1", "a"), ("a-2", "a"), ("b-1", "b"))
    ]
    emptied, asked = [], []

    def diagnosed(build, place, voyages, scratch):
        label = place.parent.name
        first = all(one != (build.name, label[0]) for one in asked)
        asked.append((build.name, label[0]))
        name = "named" if build is ours or label != "a-2" else "none"
        cost = (4.0 if first else 1.0) * (1.0 if build is ours else 5.0)
        return Used(cost, 1024.0, {"verdict": name, "causes": [], "ranking": []})

    monkeypatch.setattr(commands, "diagnosed", diagnosed)
    monkeypatch.setattr(commands, "fresh", lambda build: emptied.append(build.name))
    later, worst, first, peak = commands.trials(ours, older, cases, tmp_path, 1, 1.0)
    assert emptied == ["this", "older"] * 2
    assert (list(first.ours), list(first.theirs)) == ([4.0, 4.0], [20.0, 20.0])
    assert list(later.ours) == [1.0] * 3 and later.ratio == worst.ratio == 5.0
    assert later.facts["verdicts_that_differ"] == ["a-2: none () became named ()"]
    assert later.facts["numbers_apart"] == {"a-1": 0.0, "b-1": 0.0}
    assert peak.value == 1.0


def test_numbers_of_the_same_verdict_are_compared_in_their_intervals():
    def answer(value, reduction=0.5, channel="gnss"):
        speed = {"value": value, "low": value - 0.05, "high": value + 0.05, "unit": "m/s"}
        word = {"value": channel, "low": channel, "high": channel, "unit": ""}
        cause = {
            "name": "current", "evidence_nats": 12.34,
            "parameters": {"speed": speed, "channel": word},
        }  # fmt: skip
        ranking = [{"name": "current", "probability": 0.99}]
        return {"verdict": "named", "causes": [cause], "ranking": ranking,
                "gain": {"reduction": reduction}}  # fmt: skip

    assert commands.apart(answer(1.0), answer(1.0)) == 0.0
    assert commands.apart(answer(1.001), answer(1.0)) == pytest.approx(0.01)
    assert commands.apart(answer(1.0, 0.6), answer(1.0)) == pytest.approx(0.2)
    assert commands.apart(answer(1.0), answer(1.0, channel="wind")) == np.inf
    assert commands.weighed(answer(1.0)) == "named current (current 12.3 nats, current 0.990)"


def test_a_store_and_a_run_become_readable_for_a_build_that_knows_less(tmp_path, monkeypatch):
    """Keys that another build wrote are taken out; tables keep their bytes."""
    store = sailing.store_of(tmp_path, ["a"], seconds=20.0)
    (folder,) = store.path.glob("voyage=*")
    path = folder / "voyage.json"
    facts = json.loads(path.read_text(encoding="utf-8"))
    profile = json.loads(json.dumps(facts["profile"]))
    facts["profile"]["ship"]["colour"] = "red"
    for one in facts["report"]["instruments"]:
        one["smell"] = 1.0
    path.write_text(json.dumps(facts), encoding="utf-8")
    run = tmp_path / "run"
    run.mkdir()
    (run / "profile.json").write_text(json.dumps(facts["profile"]), encoding="utf-8")
    (run / "config.toml").write_text("model = 'mmg'\n", encoding="utf-8")
    left = served.readable(store.path, run, tmp_path / "new")["left_out"]
    assert left == ["instruments.smell", "profile.colour"]
    new = Store(tmp_path / "new" / "store")
    assert new.profile(["a"]).ship.name == store_name(profile)
    assert (new.path / folder.name / "table.parquet").read_bytes() == (
        folder / "table.parquet"
    ).read_bytes()
    assert json.loads((tmp_path / "new" / "run" / "profile.json").read_text()) == profile


def store_name(profile):
    return profile["ship"]["name"]


def test_names_of_this_build_are_there():
    for name in served.NAMES:
        assert served.of(name) is not None
    with pytest.raises(LookupError, match="no nothing"):
        served.NAMES["nothing"] = ("nowhere.at_all",)
        try:
            served.of("nothing")
        finally:
            del served.NAMES["nothing"]


def test_a_child_process_answers_and_says_what_failed(tmp_path):
    worker = Worker(Build("this build", builds.ROOT, tmp_path / "cache"), tmp_path)
    try:
        assert worker.ask("facts") == {}
        with pytest.raises(Failed, match=r"this build, windows: FileNotFoundError"):
            worker.ask("windows", path=tmp_path / "none.npz")
        assert worker.ask("facts") == {}
    finally:
        worker.close()


def test_a_missing_peer_is_a_row_with_its_reason(tmp_path, monkeypatch):
    monkeypatch.setattr(kernels, "find_spec", lambda name: None)
    build = SimpleNamespace(name="this build")
    row = kernels.casadi(build, None, tmp_path, tmp_path, 1, 1.0, "")
    assert "pip install casadi" in row.reason
    monkeypatch.setattr(kernels, "find_spec", lambda name: object())
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert "no gcc" in kernels.casadi(build, None, tmp_path, tmp_path, 1, 1.0, "").reason
