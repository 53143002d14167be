"""Many ships in one command: each in its own process and folder, one table of what came out."""

import csv
import json
import os
import shutil
import signal
import sys
from pathlib import Path

import pytest
from commands import call
from short_voyages import answer

from shiplog.commands import fleet
from shiplog.report.fleet.fleet import Fleet, Row

HEAD = "run,store,voyages\n"
REAL = fleet._ship


def killed_or_real(ship, out, cause_files, switches, report):
    """In a child process: a run that is called `killed` is ended from outside."""
    if ship.run_path.name == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    return REAL(ship, out, cause_files, switches, report)


@pytest.fixture
def ships(published, store, tmp_path):
    """A folder with the run twice, and its store; what the list says is relative to it."""
    folder = tmp_path / "ships"
    for name in ("atlas", "borea"):
        shutil.copytree(published[0], folder / name / "mmg")
    shutil.copytree(store, folder / "store")
    return folder


def listed(ships, *lines):
    path = ships / "ships.csv"
    path.write_text(HEAD + "".join(f"{line}\n" for line in lines), encoding="utf-8")
    return path


def rows_of(out) -> list[dict]:
    return answer(out / "verdicts.json")["ships"]


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")
def test_a_ship_that_fails_or_is_killed_costs_its_own_row(ships, tmp_path, monkeypatch):
    monkeypatch.setattr(fleet, "_ship", killed_or_real)
    (ships / "killed").mkdir()
    path = listed(
        ships, "atlas/mmg,store,trip_3", "killed,store,trip_3", "atlas/mmg,store,trip_9",
        "none,store,", "borea/mmg,store,trip_3",
    )  # fmt: skip
    out, to = tmp_path / "out", tmp_path / "answer.json"
    code, text, _ = call("diagnose", "--list", path, "--jobs", 2, "--out", out, "--json", to)
    assert code == 3
    rows = answer(to)["ships"]
    assert rows == rows_of(out)
    assert [row["verdict"] for row in rows] == ["coverage", *["failed"] * 3, "coverage"]
    assert [row["line"] for row in rows] == [2, 3, 4, 5, 6]
    assert "SIGKILL" in rows[1]["error"] and "smaller --jobs" in rows[1]["error"]
    assert "No voyage matches 'trip_9'" in rows[2]["error"] and "patterns" in rows[2]["error"]
    assert "There is no run" in rows[3]["error"] and "train one" in rows[3]["error"]
    assert "5 ships: 2 coverage, 3 failed." in text
    done = [row for row in rows if not row["error"]]
    assert sorted(p.name for p in out.iterdir() if p.is_dir()) == sorted(
        row["folder"] for row in done
    )
    for row in done:
        assert (out / row["page"]).is_file()
    with open(out / "verdicts.csv", newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [row["verdict"] for row in table] == [row["verdict"] for row in rows]
    assert [row["error"] for row in table] == [row["error"] for row in rows]


@pytest.fixture
def in_this_process(monkeypatch):
    """The ships one after the other, here; the names of those that were diagnosed."""
    from shiplog.exceptions import ShiplogError
    from shiplog.training.network.queue import Event

    done = []

    def work(tasks, workers=None):
        for task in tasks:
            try:
                result = task.function(*task.arguments, report=lambda share: None)
            except ShiplogError as error:
                yield Event(task, 0.0, True, failure=str(error))
            else:
                yield Event(task, 1.0, True, result)

    def diagnosed(path, *arguments, **named):
        done.append(path.parent.name)
        return diagnose_run(path, *arguments, **named)

    diagnose_run = fleet.diagnose_run
    monkeypatch.setattr(fleet, "work", work)
    monkeypatch.setattr(fleet, "diagnose_run", diagnosed)
    return done


def test_each_folder_is_what_diagnose_makes(ships, tmp_path, in_this_process):
    path, out = listed(ships, "atlas/mmg,store,trip_3"), tmp_path / "out"
    assert call("diagnose", "--list", path, "--out", out)[0] == 0
    alone = tmp_path / "alone"
    one = ("diagnose", ships / "atlas" / "mmg", "--store", ships / "store", "--voyages", "trip_3")
    assert call(*one, "--out", alone)[0] == 0
    (row,) = rows_of(out)
    assert answer(out / row["folder"] / "verdict.json") == answer(alone / "verdict.json")
    made = {p.name for p in (out / row["folder"]).iterdir()}
    assert made == {p.name for p in alone.iterdir()} | {"inputs.json"}


def test_what_is_done_is_done_again_only_where_its_inputs_changed(ships, tmp_path, in_this_process):
    lines = ["atlas/mmg,store,trip_3", "borea/mmg,store,trip_3"]
    out = tmp_path / "out"
    command = ("diagnose", "--list", listed(ships, *lines), "--out", out)
    assert call(*command)[0] == 0
    assert in_this_process == ["atlas", "borea"]
    before = rows_of(out)

    in_this_process.clear()  # an evaluation leaves files in the run, and the lines have moved
    (ships / "atlas" / "mmg" / "errors.parquet").write_bytes(b"another")
    listed(ships, *reversed(lines))
    assert call(*command)[0] == 0 and in_this_process == []
    after = rows_of(out)
    assert all(row["kept"] for row in after)
    assert {row["folder"] for row in after} == {row["folder"] for row in before}

    provenance = ships / "borea" / "mmg" / "provenance.json"  # a file of the run, on another day
    provenance.write_text(json.dumps(answer(provenance) | {"began": "2026-06-01T00:00:00+00:00"}))
    assert call(*command)[0] == 0 and in_this_process == ["borea"]

    in_this_process.clear()  # its folder was spoilt
    (folder,) = [row["folder"] for row in rows_of(out) if row["run"] == "atlas/mmg"]
    (out / folder / "verdict.json").write_text("{")
    assert call(*command)[0] == 0 and in_this_process == ["atlas"]
    assert [row["verdict"] for row in rows_of(out)] == ["coverage"] * 2


def test_a_ship_that_is_stopped_leaves_no_half_of_it(ships, tmp_path, in_this_process, monkeypatch):
    path, out = listed(ships, "atlas/mmg,store,trip_3", "borea/mmg,store,trip_3"), tmp_path / "out"
    real = fleet.diagnose_run

    def stopped(path, store, names, new, **named):
        if path.parent.name == "borea":
            (new / "verdict.json").write_text("{")
            raise KeyboardInterrupt
        return real(path, store, names, new, **named)

    with monkeypatch.context() as patch:
        patch.setattr(fleet, "diagnose_run", stopped)
        assert call("diagnose", "--list", path, "--out", out)[0] not in (0, 3)
    assert [p.name.split("-")[0] for p in out.iterdir()] == ["mmg"]
    in_this_process.clear()
    assert call("diagnose", "--list", path, "--out", out)[0] == 0
    assert in_this_process == ["borea"]


def test_none_that_has_a_verdict_is_the_inputs_fault(ships, tmp_path, in_this_process):
    path, out = listed(ships, "none,store,", "other,store,"), tmp_path / "out"
    code, _, words = call("diagnose", "--list", path, "--out", out)
    assert code == 1 and "None of 2 ships" in words
    assert [row["verdict"] for row in rows_of(out)] == ["failed"] * 2


def test_pictures_that_fail_are_said_and_made_again(ships, tmp_path, in_this_process, monkeypatch):
    from shiplog.commands import diagnose
    from shiplog.exceptions import ShiplogError

    def full(*_):
        raise ShiplogError("The disk is full.")

    path, out = listed(ships, "atlas/mmg,store,trip_3"), tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(diagnose.html, "write", full)
        assert call("diagnose", "--list", path, "--out", out)[0] == 3
    (row,) = rows_of(out)
    assert (row["verdict"], row["page"]) == ("coverage", "")
    assert "could not be drawn" in row["error"] and row["warnings"] == ["The disk is full."]
    assert call("diagnose", "--list", path, "--out", out)[0] == 0
    assert rows_of(out)[0]["page"] and in_this_process == ["atlas"] * 2


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("--list", "ships.csv", "runs/mmg"), 2, "RUN says nothing to --list"),
        (("--list", "ships.csv", "--voyages", "x"), 2, "--voyages says nothing to --list"),
        (("--list", "ships.csv", "--store", "store"), 2, "--store says nothing to --list"),
        (("--list", "ships.csv", "--extend", "more"), 2, "--extend says nothing to --list"),
        (("--list", "ships.csv", "--ray", "here"), 2, "--ray says nothing to --list"),
        (("runs/mmg", "--jobs", "2"), 2, "--jobs says nothing to one run"),
        ((), 2, "neither a RUN nor a --list"),
        (("--list", "none.csv"), 1, "none.csv does not exist"),
        (("--list", "ships.csv", "--cause", "none.py"), 1, "none.py is no Python file"),
    ],
)
def test_options_at_odds_and_a_list_that_is_not_there(
    arguments, code, words, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    Path("ships.csv").write_text(HEAD + "a,b,\n")
    found, _, said = call("diagnose", *arguments)
    assert (found, words in said) == (code, True)
    assert not Path("diagnosis").exists()


def test_names_of_strangers_are_inert(tmp_path):
    """A spreadsheet works nothing out, a page loads nothing, and a line stays one line."""
    cause = {
        "name": "current", "probability": 0.97,
        "parameters": {
            "speed": {"value": 0.1016, "low": 0.0955, "high": 0.1071, "unit": "m/s"},
            "channel": {"value": "gnss", "low": "gnss", "high": "gnss", "unit": ""},
        },
    }  # fmt: skip
    verdict = {
        "verdict": "named", "sentence": "+1", "causes": [cause], "explained": 0.9,
        "subject": {"ship": "=HYPERLINK(\"x\")"}, "gain": {"reduction": -0.25, "low": -1.0},
    }  # fmt: skip
    rows = (
        Row(2, "@run\nnext", "-store", "<img src=x>", folder="run-1", verdict=verdict),
        Row(3, "![a](b)", "store", "", error="no\x1b[31m"),
    )
    Fleet(rows, tmp_path / "ships.csv", tmp_path).save()
    with open(tmp_path / "verdicts.csv", newline="", encoding="utf-8") as file:
        one, two = csv.DictReader(file)
    assert one["ship"] == '\'=HYPERLINK("x")' and one["run"] == "'@run\\nnext"
    assert one["store"] == "'-store" and one["sentence"] == "'+1"
    assert one["reduction"] == "-0.25" and one["held_out_windows"] == ""
    assert one["causes"] == "current: speed 0.1016 m/s (0.0955 to 0.1071), channel gnss"
    assert two["error"] == "no\\x1b[31m"
    text = (tmp_path / "verdicts.md").read_text(encoding="utf-8")
    assert "<" not in text and "](" not in text and "\x1b" not in text
