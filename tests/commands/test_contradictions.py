"""While sensors contradict each other: what train, evaluate and diagnose say of these voyages."""

import json
import shutil

import pytest
from commands import call
from short_voyages import BOTH, HULL, train

from shiplog.diagnosis.verdict import contradicted_causes
from shiplog.voyages.store import contradicted
from shiplog.voyages.store.store import Store

KNOTS = {
    "kind": "contradiction", "channel": "velocity", "start_s": 0.0, "end_s": 80.0,
    "sentence": "The velocity is 1.94 times what the position travels. Knots that are called m/s? "
    "Look at sensors.velocity.units.",
    "value": 1.944, "low": None, "high": None, "unit": "1", "reason": "unit",
}  # fmt: skip


def planted(store, folder, *names, **changes):
    """The same store, in which the reports of these voyages have a contradiction."""
    copy = folder / "planted"
    shutil.copytree(store, copy)
    for name in names:
        path = copy / f"voyage={name}" / "voyage.json"
        facts = json.loads(path.read_text("utf-8"))
        facts["report"]["findings"].append(KNOTS | changes)
        path.write_text(json.dumps(facts), encoding="utf-8")
    return copy


def test_train_refuses_by_name_with_the_key_to_change(store, tmp_path):
    there = planted(store, tmp_path, "trip_1")
    code, _, said = train(there, tmp_path / "run", "--model", "mmg", "--no-fit", *BOTH, *HULL)
    assert code == 1
    for words in ("trip_1", "1.94 times", "sensors.velocity.units", "--unchecked"):
        assert words in said
    assert not list(tmp_path.glob("run*"))


def test_train_unchecked_begins_with_the_warning(store, tmp_path):
    there, to = planted(store, tmp_path, "trip_1"), tmp_path / "a.json"
    code, text, _ = train(
        there, tmp_path / "run", "--model", "mmg", "--no-fit", "--unchecked", "--json", to, *BOTH,
        *HULL,
    )  # fmt: skip
    assert code == 0
    assert text.startswith("Trained although sensors contradict each other.")
    assert "trip_1" in text.splitlines()[0] and "1.94 times" in text.splitlines()[0]
    (one,) = json.loads(to.read_text())["contradictions"]
    assert (one["voyage"], one["channel"], one["reason"]) == ("trip_1", "velocity", "unit")


def test_train_without_contradictions_warns_of_nothing(published):
    assert "contradict" not in published[1]


def test_a_voyage_that_is_not_used_is_not_asked(store, tmp_path):
    there = planted(store, tmp_path, "trip_3")
    assert train(there, tmp_path / "run", "--model", "mmg", "--no-fit", *BOTH, *HULL)[0] == 0


def test_evaluate_begins_with_the_warning(store, published, tmp_path):
    there, to = planted(store, tmp_path, "trip_3"), tmp_path / "a.json"
    code, text, _ = call(
        "evaluate", published[0], "--store", there, "--voyages", "trip_3", "--json", to
    )
    content = json.loads(to.read_text())
    assert code == 0
    for said in (text, content["sentence"]):
        assert said.startswith("What was recorded contradicts itself: in trip_3, the velocity is")
    assert len(content["contradictions"]) == 1


@pytest.mark.parametrize("which", ["trip_1", "trip_3"])  # of the nominal voyages, or of the trial
def test_diagnose_says_it_first_and_names_no_cause(store, published, tmp_path, which):
    there, to = planted(store, tmp_path, which), tmp_path / "a.json"
    code, text, _ = call(
        "diagnose", published[0], "--store", there, "--voyages", "trip_3", "--out",
        tmp_path / "out", "--json", to,
    )  # fmt: skip
    content = json.loads(to.read_text())
    assert (code, content["verdict"], content["causes"]) == (0, "undecided", [])
    assert content["sentence"].startswith(
        f"What was recorded contradicts itself: in {which}, the velocity is 1.94 times"
    )
    assert content["sentence"] in text
    for never in ("record data there first", "Outside the catalogue", "Too little"):
        assert never not in content["sentence"]
    why = {one["name"]: one["reason"] for one in content["unavailable"]}
    assert why["current"] == why["rudder_offset"] == "velocity contradicts other channels"
    assert {"heading_offset", "wind_force", "fouling"} <= set(why)
    assert content["contradictions"][0]["voyage"] == which


def test_a_contradiction_of_a_short_stretch_bars_the_causes_of_its_channel_alone(store, tmp_path):
    """4 of 80 s: a twentieth."""
    there = Store(planted(store, tmp_path, "trip_3", start_s=10.0, end_s=14.0))
    (one,) = contradicted.list_contradicted(there, ["trip_3"])
    assert one.share == pytest.approx(0.05, rel=0.05)
    assert contradicted.everywhere([one]) == ()
    (half,) = contradicted.list_contradicted(there, ["trip_3[0:40]"])
    assert half.share == pytest.approx(0.1, rel=0.05)
    assert contradicted.list_contradicted(there, ["trip_3[40:80]"]) == ()
    profile = there.profile(["trip_3"])
    barred = contradicted_causes.barred_causes(["wind"], profile)
    assert set(barred) == {
        "wind_force", "wind_direction_offset", "wind_speed_scale", "clock_offset"
    }  # fmt: skip
    assert {"rudder_offset", "rudder_lag"} <= set(
        contradicted_causes.barred_causes(["rudder_port"], profile)
    )
    assert {"current", "fouling"} <= set(contradicted_causes.barred_causes(["surge"], profile))
    assert (
        len(contradicted_causes.barred_causes(["ship"], profile)) > 15
    )  # of no channel: every cause


def test_diagnose_does_not_judge_voyages_of_another_profile(store, published, tmp_path):
    """A run holds its profile: 3 m, and an antenna 0.3 m ahead."""
    there = tmp_path / "moved"
    shutil.copytree(store, there)
    path = there / "voyage=trip_3" / "voyage.json"
    facts = json.loads(path.read_text("utf-8"))
    facts["profile"]["sensors"]["position"]["lever_arm_m"] = [1.3, 0.0]
    facts["profile"]["ship"]["length_m"] = 3.3
    path.write_text(json.dumps(facts), encoding="utf-8")
    for command in ("evaluate", "compare", "diagnose"):
        out = ("--out", tmp_path / "out") if command == "diagnose" else ()
        code, _, said = call(command, published[0], "--store", there, "--voyages", "trip_3", *out)
        assert code == 1, command
        assert "ship.length_m (3 and 3.3)" in said and "lever_arm_m ([0.3, 0] and [1.3, 0])" in said
    code, _, said = train(there, tmp_path / "run", "--model", "mmg", "--no-fit", "--voyages",
                          "trip_1", "--voyages", "trip_3", *HULL)  # fmt: skip
    assert code == 1 and "trip_1 and trip_3" in said
