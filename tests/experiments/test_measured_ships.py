"""The way of a data set, with commands that do nothing."""

import json
from pathlib import Path

import pytest

from pipelines.experiments.measured_ships import page, way
from pipelines.experiments.measured_ships.ships import DataSet


def test_an_interrupted_way_goes_on_from_the_logs_that_it_made(tmp_path, monkeypatch):
    """Stopped while it ingests; then `ingest` is the first step that is done again."""
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "run.csv").write_text("t")
    one = DataSet("a ship", "data", tables=("*.csv",), profile="kvlcc2")
    done, stopped = [], True

    def step(what, command, folder, settings):
        if what == "convert":
            assert not (folder / "logs").exists()
            (folder / "logs").mkdir()
            (folder / "logs" / "run.mcap").write_text("log")
        if what == "ingest":
            assert [p.name for p in Path(command[-5]).iterdir()] == ["run.mcap"]
            if stopped:
                raise KeyboardInterrupt
        if "--json" in command:
            Path(command[-1]).write_text(json.dumps({}))
        done.append(what)
        return {"step": what, "rc": 0, "cpu_s": 1.0, "stderr": ""}

    monkeypatch.setattr(way, "step", step)
    with pytest.raises(KeyboardInterrupt):
        way.go("a ship", one, tmp_path, tmp_path / "out")
    stopped = False
    found = way.go("a ship", one, tmp_path, tmp_path / "out")
    assert done == ["convert", "ingest", "voyages", "train", "evaluate", "diagnose"]
    assert found.stopped == "" and found.cpu_s == 6.0


def test_a_way_may_be_given_relative_folders(tmp_path, monkeypatch):
    """Its steps run in another folder than the one that the paths are given from."""
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "run.mcap").write_text("log")
    asked = []

    def step(what, command, folder, settings):
        asked.extend(command)
        return {"step": what, "rc": 1, "cpu_s": 1.0, "stderr": "refused"}

    monkeypatch.setattr(way, "step", step)
    monkeypatch.chdir(tmp_path)
    way.go(
        "a ship", DataSet("a ship", "data", logs=("*.mcap",), profile="kvlcc2"), Path(), Path("o")
    )
    assert {str(tmp_path / "data" / "run.mcap"), str(tmp_path / "o" / "a-ship" / "store")} < {
        *asked
    }


def test_a_model_that_diverged_is_not_one_that_was_not_evaluated():
    floors = {"hold": 90.0, "least_squares": None}
    evaluated = {"evaluate": {"loss": None, "floors": floors}}
    lines = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for answers in (evaluated, {})
        for line in page.text([way.Way("kvlcc2", "stopped.", answers, 1.0, False)]).splitlines()
        if line.startswith("| KVLCC2")
    ]
    assert [cells[4:8] for cells in lines] == [["50", "diverged", "90", "diverged"], ["-"] * 4]


def test_a_ships_page_keeps_what_is_not_an_answer(tmp_path):
    table, ship = tmp_path / "measured_ships.md", tmp_path / "kvlcc2.md"
    one = way.Way("kvlcc2", "stopped.", {}, 1.0, False)
    page.write(table, [one])
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["kvlcc2.md", "measured_ships.md"]
    by_hand = ship.read_text("utf-8") + "\n## By hand\n\nKept.\n"
    ship.write_text(by_hand.replace("stopped.", "something else."), "utf-8")
    page.write(table, [one])
    assert ship.read_text("utf-8") == by_hand and "> stopped." in by_hand


def test_every_data_set_has_a_page():
    named = [name for _, names in page.PAGES.values() for name in names]
    assert sorted(named) == sorted(page.DATA_SETS)


def test_the_pages_of_the_documentation_have_the_judgements():
    folder = Path(__file__).parents[2] / "docs" / "evidence"
    for name, (title, names) in page.PAGES.items():
        text = (folder / f"{name}.md").read_text("utf-8")
        assert text.startswith(f"# {title}\n") and page.MARKED.search(text)
        for one in names:
            assert page._filled(page.JUDGEMENTS[one]) in text


def test_a_step_that_was_killed_is_done_again(tmp_path, monkeypatch):
    """As by its limit of time, on a machine that had other work."""
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "run.mcap").write_text("log")
    done, code = [], -9

    def step(what, command, folder, settings):
        if "--json" in command:
            Path(command[-1]).write_text(json.dumps({}))
        done.append(what)
        return {"step": what, "rc": code if what == "ingest" else 0, "cpu_s": 1.0, "stderr": ""}

    monkeypatch.setattr(way, "step", step)
    one = DataSet("a ship", "data", logs=("*.mcap",), profile="kvlcc2")
    way.go("a ship", one, tmp_path, tmp_path / "out")
    assert done == ["ingest"]
    code = 0
    way.go("a ship", one, tmp_path, tmp_path / "out")
    assert done == ["ingest", "ingest", "voyages", "train", "evaluate", "diagnose"]
