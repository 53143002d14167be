"""`shiplog gate` as a user types it, on short voyages of the simulated ship."""

import json
import shutil

import pytest
from commands import call
from gate_answers import CURRENT, folder
from junitparser import JUnitXml

from shiplog.commands import gate as gating
from shiplog.report.gate import diagnosed
from shiplog.voyages.store.store import Store

WIDE = "window_s = 25\n[simulation]\nloss = 1e12\n"
NARROW = "window_s = 25\n[simulation]\nloss = 1e-9\ncovered = 0.0001\n"
VERDICT = "[diagnosis]\nallowed = ['none']\n"


@pytest.fixture
def desk(published, store, tmp_path):
    class Desk:
        run = published[0]
        path = tmp_path

        def gate(self, text, *more, voyages=("trip_3",)):
            (tmp_path / "limits.toml").write_text(text, encoding="utf-8")
            return self.call(*more, voyages=voyages)

        def call(self, *more, voyages=("trip_3",)):
            chosen = [word for name in voyages for word in ("--voyages", name)]
            return call(
                "gate",
                self.run,
                "--store",
                store,
                "--limits",
                tmp_path / "limits.toml",
                *chosen,
                *more,
            )

        def diagnosis(self, verdict="none", voyages=("trip_3",), **keys):
            return folder(tmp_path / "d", Store(store).hashes(voyages), verdict, **keys)

    return Desk()


def test_it_exits_with_0_where_all_limits_hold(desk):
    code, text, _ = desk.gate(WIDE, "--json", desk.path / "g.json")
    assert code == 0 and "3 windows of 25 s: the limit holds." in text
    content = json.loads((desk.path / "g.json").read_text("utf-8"))
    assert content["holds"] is True and content["contract"] == 1 and content["windows"] == 3
    (one,) = content["limits"]
    assert one["outcome"] == "holds" and one["key"] == "loss" and one["measured"] > 0.0


def test_it_exits_with_4_where_one_is_broken_and_says_which(desk):
    code, text, _ = desk.gate(NARROW, "--junit", desk.path / "g.xml")
    assert code == 4
    assert [line.split()[0] for line in text.splitlines()[2:]] == ["broken", "holds"]
    (suite,) = JUnitXml.fromfile(str(desk.path / "g.xml"))
    assert (suite.tests, suite.failures, suite.errors) == (2, 1, 0)


def test_what_was_not_assessed_is_broken(desk):
    """Windows of 25 s: trip_2[0:20] has none."""
    code, text, _ = desk.gate(WIDE, "--junit", desk.path / "g.xml", voyages=("trip_3[0:20]",))
    assert code == 4
    assert "not assessed L, at most 1e+12: published has windows of 25 s, and there are no" in text
    (suite,) = JUnitXml.fromfile(str(desk.path / "g.xml"))
    assert (suite.failures, suite.errors) == (0, 1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "holds no limit"),
        ("[simulation]\nloss = 3", "windows of 100 s, and published has windows of 25 s"),
        (WIDE + "[voyages.trip_9]\nloss = 3", "[voyages] of trip_9, and the tested voyages are"),
        (WIDE + "[diagnosis]\ncauses_not_allowed = ['tide']", "no cause 'tide'"),
        (WIDE + "[sizes]\n'thrust_loss:keel'.factor = 1", "has no 'keel'"),
    ],
)
def test_it_exits_with_1_where_the_limits_name_nothing(desk, text, words):
    code, output, error = desk.gate(text, "--junit", desk.path / "g.xml")
    assert (code, output) == (1, "") and words in error and "limits.toml" in error
    (suite,) = JUnitXml.fromfile(str(desk.path / "g.xml"))
    assert (suite.failures, suite.errors) == (0, 1)


def test_what_is_not_there(desk, store, tmp_path):
    assert "does not exist" in desk.call()[2]
    (tmp_path / "limits.toml").write_text(WIDE)
    assert "no voyage" in desk.call(voyages=("trip_9",))[2].lower()
    assert (
        "There is no run"
        in call("gate", tmp_path / "no", "--store", store, "--limits", tmp_path / "limits.toml")[2]
    )
    assert "There is no voyage in the store" in call(
        "gate", desk.run, "--store", tmp_path / "no", "--limits", tmp_path / "limits.toml"
    )[2]  # fmt: skip
    code, _, error = desk.call("--junit", tmp_path / "no" / "g.xml")
    assert code == 1 and "--junit" in error and "there is no folder" in error
    assert call("gate", desk.run, "--store", store)[0] == 2  # without limits


def test_no_output_replaces_the_limits(desk, tmp_path):
    for option in ("--junit", "--json"):
        code, _, error = desk.gate(WIDE, option, tmp_path / "limits.toml")
        assert code == 1 and "would replace the limits" in error
        assert (tmp_path / "limits.toml").read_text("utf-8") == WIDE
    assert desk.gate(WIDE, "--json", "-")[0] == 0


# ---------------------------------------------------------------- diagnoses


def test_the_verdict_of_a_folder(desk):
    kept = desk.diagnosis()
    code, text, _ = desk.gate(VERDICT, "--diagnosis", kept)
    assert code == 0 and "holds  verdict: none, allowed none" in text
    assert f"Report: {kept}/report.md" in text and "windows" not in text


def test_a_cause_in_a_folder_breaks_its_own_lines(desk):
    text = VERDICT + "causes_not_allowed = ['current', 'fouling']\n[sizes]\ncurrent.speed = 0.05"
    code, output, _ = desk.gate(text, "--diagnosis", desk.diagnosis("named", causes=[CURRENT]))
    assert code == 4
    assert [line.split(",")[0].split(":")[0] for line in output.splitlines()[4:]] == [
        "broken verdict", "broken current", "holds  fouling", "broken current.speed"
    ]  # fmt: skip


def test_without_voyages_those_of_the_diagnosis_are_judged(desk):
    kept = desk.diagnosis(voyages=("trip_2", "trip_3"))
    code, text, _ = desk.gate(WIDE + VERDICT, "--diagnosis", kept, voyages=())
    assert code == 0 and "published on trip_2, trip_3, 6 windows of 25 s" in text


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"run": "other"}, "is a diagnosis of the run 'other', and not of 'published'"),
        ({"contract": 0}, "is a diagnosis of contract 0, and this shiplog reads contract 1"),
        ({"contract": None}, "is a diagnosis of contract None"),
        ({"causes": "none"}, "is no answer of `shiplog diagnose`: see its causes"),
        ({"voyages": ("trip_2",)}, "is a diagnosis of trip_2, and the gate is to judge trip_3"),
        ({"began": "2001-01-01T00:00:00+00:00"}, "was trained after it"),
    ],
    ids=["run", "contract", "no contract", "shape", "voyages", "older"],
)
def test_a_diagnosis_of_something_else_is_refused(desk, keys, words):
    code, output, error = desk.gate(VERDICT, "--diagnosis", desk.diagnosis(**keys))
    assert (code, output) == (1, "") and words in error
    assert len(error.splitlines()) == 2  # what was found and expected; what to do next


def test_a_diagnosis_of_another_log_of_that_name(desk):
    kept = desk.diagnosis()
    origin = {"logs_sha256": {"trip_3": "0" * 64}}
    (kept / "provenance.json").write_text(json.dumps(origin))
    code, _, error = desk.gate(VERDICT, "--diagnosis", kept)
    assert code == 1 and "of another log trip_3 than the one in the store" in error


def test_names_in_a_stranger_s_folder_are_inert(desk):
    kept = desk.diagnosis(run="\x1b[2J<b>")
    code, _, error = desk.gate(VERDICT, "--diagnosis", kept, "--junit", desk.path / "g.xml")
    assert code == 1 and error.replace("\n", "").isprintable() and "<b>" in error
    JUnitXml.fromfile(str(desk.path / "g.xml"))
    (kept / "provenance.json").write_text(json.dumps({"logs_sha256": {"\x1b[2J\n": "0"}}))
    content = json.loads((kept / "verdict.json").read_text())
    content["base"]["run"] = "published"
    (kept / "verdict.json").write_text(json.dumps(content))
    code, _, error = desk.gate(VERDICT, "--diagnosis", kept)
    assert code == 1 and error.replace("\n", "").isprintable() and len(error.splitlines()) == 2


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [("verdict.json", None, "there is no verdict.json in it"),
     ("verdict.json", "{", "cannot be read"), ("verdict.json", "[]", "is no answer of"),
     ("provenance.json", None, "there is no provenance.json in it"),
     ("provenance.json", "{}", "does not say of which voyages")],
)  # fmt: skip
def test_half_a_folder_is_no_diagnosis(desk, name, content, words):
    kept = desk.diagnosis()
    (kept / name).unlink()
    if content is not None:
        (kept / name).write_text(content)
    code, _, error = desk.gate(VERDICT, "--diagnosis", kept)
    assert code == 1 and words in error


def test_without_a_folder_it_diagnoses_and_says_so_before(desk, monkeypatch, caplog):
    """What a diagnosis answers is tested elsewhere; here, that it is made, and where."""
    made = []

    def diagnose(_run, _store, names, out, **_):
        assert "need a diagnosis of trip_3: up to 1 min" in caplog.text
        made.append(out)
        shutil.copytree(desk.diagnosis(), out)
        shutil.rmtree(desk.path / "d")
        content = json.loads((out / "verdict.json").read_text())
        return type("Done", (), {"verdict": type("V", (), {"as_json": lambda _: content})()})()

    monkeypatch.setattr(gating, "diagnose_run", diagnose)
    with caplog.at_level("INFO", logger="shiplog"):
        assert desk.gate(VERDICT)[0] == 0
        assert not made[0].exists()
        code, text, _ = desk.gate(VERDICT, "--diagnosis", desk.path / "kept")
        assert code == 0 and f"Report: {desk.path / 'kept'}/report.md" in text
        assert made[1] == desk.path / "kept" and (made[1] / "verdict.json").is_file()
        monkeypatch.setattr(gating, "diagnose_run", None)  # the folder is read now
        shutil.copy(made[1] / "verdict.json", desk.path)
        content = json.loads((desk.path / "verdict.json").read_text())
        assert diagnosed.of(content).verdict == "none"
        assert desk.gate(VERDICT, "--diagnosis", desk.path / "kept")[0] == 0
        assert desk.gate(WIDE)[0] == 0  # no limit is on a verdict


# ---------------------------------------------------------------- --write


def test_what_write_makes_holds_today(desk):
    kept = desk.diagnosis("named", causes=[CURRENT])
    code, text, _ = desk.call("--write", "--diagnosis", kept)
    assert code == 0 and "limits from published on trip_3." in text
    content = (desk.path / "limits.toml").read_text("utf-8")
    assert "current.speed = 0.13" in content and "window_s = 25" in content
    assert desk.call("--diagnosis", kept)[0] == 0
    code, _, error = desk.call("--write", "--diagnosis", kept)
    assert code == 1 and "exists already" in error
    assert (desk.path / "limits.toml").read_text("utf-8") == content


def test_write_without_a_diagnosis_sets_none_on_a_verdict(desk):
    code, text, _ = desk.call("--write", "--json", desk.path / "w.json")
    assert code == 0 and "None is on a verdict" in text
    assert json.loads((desk.path / "w.json").read_text())["written"].endswith("limits.toml")
    assert "[diagnosis]" not in (desk.path / "limits.toml").read_text("utf-8")
    assert desk.call()[0] == 0
