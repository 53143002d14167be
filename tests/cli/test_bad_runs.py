"""Run folders that are missing, spoilt, or another ship's: a sentence and exit code 1."""

from __future__ import annotations

import json
import os
import shutil
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import sailing
from command_desk import judge
from own_causes import GOOD
from safetensors.numpy import load_file, save_file

from pipelines.experiments import simulated_ship
from shiplog import cli
from shiplog.machine import files

pytestmark = pytest.mark.usefixtures("trained_here")
HULL = ("--model", "mmg", "--no-fit", "--without", "propeller", "--without", "rudder")


@pytest.fixture(scope="module")
def sea(tmp_path_factory):
    """A store of three voyages, a run of physics and one of a network, and another ship's store."""
    sea = tmp_path_factory.mktemp("sea")
    (sea / "logs").mkdir()
    for number in (1, 2, 3):
        voyage = simulated_ship.sail(60.0, seed=number, wind=simulated_ship.Wind(2.0, number))
        start = datetime(2026, 5, number, 12, 0, tzinfo=UTC)
        simulated_ship.write_voyage(
            sea / "logs" / f"trip_{number}.mcap", voyage, seed=number, start=start
        )
    (sea / "circle.toml").write_text(sailing.PROFILE)
    sailing.write(sea / "circle.mcap")
    made = ("--store", sea / "store", "--voyages", "trip_1", "--voyages", "trip_2")
    for arguments in (
        ("ingest", sea / "logs", "--store", sea / "store"),
        ("ingest", sea / "circle.mcap", "--profile", sea / "circle.toml", "--store", sea / "other"),
        ("train", *made, "--out", sea / "mmg", "--window", 20, *HULL),
        ("train", *made, "--out", sea / "short", "--window", 15, *HULL),
        ("train", *made, "--out", sea / "net", "--window", 20, "--width", 6, "--epochs", 2),
    ):
        assert cli.run([str(a) for a in arguments]) == 0
    return sea


@pytest.fixture
def desk(sea, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return Desk(sea, tmp_path)


class Desk:
    def __init__(self, sea: Path, folder: Path) -> None:
        self.sea, self.folder = sea, folder

    def path(self, name: str) -> Path:
        return self.folder / name

    def file(self, name: str, text: str = "") -> Path:
        self.path(name).write_text(text)
        return self.path(name)

    def dir(self, name: str) -> Path:
        self.path(name).mkdir()
        return self.path(name)

    def file_in(self, folder: str, name: str) -> Path:
        (self.dir(folder) / name).touch()
        return self.path(folder)

    def train(self) -> list:
        return ["train", "--store", self.sea / "store", "--voyages", "trip_1", "--voyages",
                "trip_2", "--window", 20, *HULL, "--out"]  # fmt: skip

    def fewer_coefficients(self) -> Path:
        copy = self.spoilt("seed0/identified.parquet")[1]
        known = pl.read_parquet(self.sea / "mmg/seed0/identified.parquet")
        known[1:].write_parquet(copy / "seed0" / "identified.parquet")
        return copy

    def another_ship(self) -> Path:
        """A run of a ship with an actuator of another name."""
        copy = self.spoilt("nothing")[1]
        text = (copy / "profile.json").read_text()
        assert "rudder_port" in text
        (copy / "profile.json").write_text(text.replace("rudder_port", "rudder_left"))
        return copy

    def on(self, command: str, *runs, store: str = "store", voyages: str = "trip_3") -> list:
        return [command, *(r if isinstance(r, Path) else self.sea / r for r in runs),
                "--store", self.sea / store, "--voyages", voyages]  # fmt: skip

    def spoilt(self, file: str, content: bytes | str | None = None, run: str = "mmg") -> list:
        """Evaluate a copy of a run in which one file is another, or gone."""
        copy = self.path("spoilt")
        shutil.copytree(self.sea / run, copy)
        (copy / file).unlink(missing_ok=True)
        if content is not None:
            raw = content if isinstance(content, bytes) else content.encode()
            (copy / file).write_bytes(raw)
        return self.on("evaluate", copy)

    def reworded(self, old: str, new: str, run: str = "mmg") -> list:
        text = (self.sea / run / "config.toml").read_text()
        assert old in text
        return self.spoilt("config.toml", text.replace(old, new), run)

    def weights(self, run: str = "mmg", **changed) -> list:
        path = Path("seed0") / "model.safetensors"
        arrays = {**load_file(self.sea / run / path), **changed}
        save_file(arrays, self.path("weights"))
        return self.spoilt(str(path), self.path("weights").read_bytes(), run)

    def stored(self, file: str, content: bytes | str) -> list:
        """Evaluate on a store in which one file is another."""
        copy = self.path("store")
        shutil.copytree(self.sea / "store", copy)
        raw = content if isinstance(content, bytes) else content.encode()
        (copy / file).write_bytes(raw)
        return ["evaluate", self.sea / "mmg", "--store", copy, "--voyages", "trip_3"]


EXTENDED = {"causes": [{"name": "a", "label": "a", "made": {}, "numbers": [1.0]}], "shares": {},
            "lengths": {}}  # fmt: skip

CASES = {
    "evaluate: no run": ["There is no run"], "compare: no run": ["There is no run"],
    "diagnose: no run": ["There is no run"],
    "a folder that is no run": (["is no run"], lambda d: d.on("evaluate", d.dir("r"))),
    "a file that is no run": (["is no run"], lambda d: d.on("evaluate", d.file("r"))),
    "a run that was not finished": (["is not finished"], lambda d: d.on(
        "evaluate", d.dir("r.partial").with_name("r"))),
    "a begun run by its own name": (["/r is not finished"], lambda d: d.on(
        "evaluate", shutil.copytree(d.sea / "mmg", d.path("r.partial")))),
    "evaluate: unknown voyage": (["did you mean 'trip_"], lambda d: d.on(
        "evaluate", "mmg", voyages="trp_3")),
    "compare: unknown voyage": (["did you mean 'trip_"], lambda d: d.on(
        "compare", "mmg", voyages="trp_3")),
    "diagnose: unknown voyage": (["did you mean 'trip_"], lambda d: d.on(
        "diagnose", "mmg", voyages="trp_3")),
    "evaluate: no store": (["ingest logs first"], lambda d: d.on("evaluate", "mmg", store="none")),
    "evaluate: another ship": (["of a ship with"], lambda d: d.on(
        "evaluate", "mmg", store="other", voyages="circle")),
    "diagnose: another ship": (["the voyages are of 'circle'"], lambda d: [
        *d.on("diagnose", "mmg", store="other", voyages="circle"), "--out", d.path("out")]),
    "compare: two ships": (["mmg is of a ship with rudder_port", "rudder_left"], lambda d: d.on(
        "compare", "mmg", d.another_ship())),
    "compare: two windows": (["windows of 20 s, short of 15 s"], lambda d: d.on(
        "compare", "mmg", "short")),
    "compare: two runs of one name": (["mmg have the same name", "rename one"], lambda d: d.on(
        "compare", "mmg", shutil.copytree(d.sea / "mmg", d.path("mmg")))),
    "compare: one run twice": (["mmg is given twice"], lambda d: d.on("compare", "mmg", "mmg")),
    "compare: --save in no folder": (["there is no folder"], lambda d: [
        *d.on("compare", "mmg"), "--save", d.path("none") / "a.rrd"]),
    "compare: --save a folder": (["it is a folder"], lambda d: [
        *d.on("compare", "mmg"), "--save", d.folder]),
    "compare: --save as another kind": (["ends in '.docx'", ".rrd, .png, .svg"], lambda d: [
        *d.on("compare", "mmg"), "--save", d.path("a.docx")]),
    "compare: --at no moment": (["'trip_3' is no voyage and seconds"], lambda d: [
        *d.on("compare", "mmg"), "--at", "trip_3"]),
    "compare: --at no voyage": (["'trip_9', which is not in the store"], lambda d: [
        *d.on("compare", "mmg"), "--at", "trip_9:3"]),
    "compare: --at a voyage left out": (["'trip_1', which is not among"], lambda d: [
        *d.on("compare", "mmg"), "--at", "trip_1:3"]),
    "compare: --at after the end": (["trip_3:99 is outside", "which is 60 s"], lambda d: [
        *d.on("compare", "mmg"), "--at", "trip_3:99"]),
    "diagnose: --extend is there": (["exists already", "--extend"], lambda d: [
        *d.on("diagnose", "mmg"), "--extend", d.dir("r")]),
    "diagnose: --extend in a file": (["--extend", "is a file"], lambda d: [
        *d.on("diagnose", "mmg"), "--extend", d.file("f") / "r"]),
    "diagnose: --out is a run": (["--out", "is a run", "choose another"], lambda d: [
        *d.on("diagnose", "mmg"), "--out", d.sea / "mmg"]),
    "diagnose: --out is a file": (["--out", "is a file"], lambda d: [
        *d.on("diagnose", "mmg"), "--out", d.file("f")]),
    "train: --out is a run": (["exists already"], lambda d: [
        "train", "--store", d.sea / "store", "--out", d.sea / "mmg"]),
    "train: a folder in the way": (["no run that was begun", "move"], lambda d: [
        *d.train(), d.file_in("r.partial", "diary.txt").with_name("r")]),
    "train --again: no run": (["There is no run"], lambda d: [
        "train", "--again", d.path("none"), "--out", d.path("r")]),
    "train --again: not finished": (["is not finished"], lambda d: [
        "train", "--again", d.dir("r.partial").with_name("r"), "--out", d.path("s")]),
    "train --again: out is there": (["exists already"], lambda d: [
        "train", "--again", d.sea / "mmg", "--out", d.sea / "short"]),
    "train --again: an extended run": (["extended by a diagnosis", "diagnose again"], lambda d: [
        "train", "--again", d.spoilt("extension.json", "{}")[1], "--out", d.path("r")]),
    "train --again: other coefficients": (["other coefficients"], lambda d: [
        "train", "--again", d.fewer_coefficients(), "--out", d.path("r")]),
    "train --again: rows gone": (["training.parquet cannot be read"], lambda d: [
        "train", "--again", d.spoilt("training.parquet")[1], "--out", d.path("r")]),
    "cause: no file": (["is no Python file"], lambda d: [
        *d.on("diagnose", "mmg"), "--cause", d.path("c.py")]),
    "cause: a folder": (["is no Python file"], lambda d: [
        *d.on("evaluate", "mmg"), "--cause", d.folder]),
    "cause: a text": (["is no Python file"], lambda d: [
        *d.on("compare", "mmg"), "--cause", d.file("c.txt", GOOD)]),
    "cause: bad Python": (["SyntaxError"], lambda d: [
        *d.on("evaluate", "mmg"), "--cause", d.file("c.py", "def broken(:")]),
    "cause: raises": (["ZeroDivisionError"], lambda d: [
        *d.on("diagnose", "mmg"), "--cause", d.file("c.py", "1 / 0")]),
    "cause: none in it": (["defines no cause"], lambda d: [
        *d.on("evaluate", "mmg"), "--cause", d.file("c.py", "x = 1")]),
    "cause: a name of the catalogue": (["'current' already"], lambda d: [
        *d.on("evaluate", "mmg"), "--cause", d.file("c.py", GOOD.replace("tide_gate", "current"))]),
    "config empty": (["config.toml", "no configuration"], lambda d: d.spoilt("config.toml", "")),
    "config no text": (["no configuration"], lambda d: d.spoilt("config.toml", b"\xff\xfe")),
    "config no TOML": (["no configuration"], lambda d: d.spoilt("config.toml", "[[[")),
    "config gone": (["is no run"], lambda d: d.spoilt("config.toml")),
    "config: a billion substeps": (["no configuration"], lambda d: d.reworded(
        "substeps = 1\n", "substeps = 1000000000\n")),
    "config: another model": (["cannot be read"], lambda d: d.reworded('"mmg"', '"hybrid"')),
    "config: no model": (["no configuration"], lambda d: d.reworded('"mmg"', '"crystal ball"')),
    "config: a window of years": (["window"], lambda d: d.reworded(
        "window = 20\n", "window = 100000000000\n")),
    "config: seeds elsewhere": (["no configuration"], lambda d: d.reworded(
        "seeds = [\n    0,\n]", 'seeds = ["../.."]')),
    "profile gone": (["profile.json cannot be read"], lambda d: d.spoilt("profile.json")),
    "profile cut": (["profile.json cannot be read"], lambda d: d.spoilt("profile.json", "{")),
    "profile of another kind": (["profile.json cannot be read"], lambda d: d.spoilt(
        "profile.json", '{"ship": 5}')),
    "profile a list": (["profile.json cannot be read"], lambda d: d.spoilt("profile.json", "[1]")),
    "training rows rubbish": (["training.parquet cannot be read"], lambda d: d.spoilt(
        "training.parquet", "x")),
    "training rows gone": (["training.parquet cannot be read"], lambda d: d.spoilt(
        "training.parquet")),
    "names of parameters gone": (["identified.parquet cannot be read"], lambda d: d.spoilt(
        "seed0/identified.parquet")),
    "weights rubbish": (["model.safetensors cannot be read"], lambda d: d.spoilt(
        "seed0/model.safetensors", "x" * 300)),
    "weights with a header of 2^63": (["model.safetensors cannot be read"], lambda d: d.spoilt(
        "seed0/model.safetensors", b"\xff" * 7 + b"\x7f{}")),
    "weights gone": (["model.safetensors cannot be read"], lambda d: d.spoilt(
        "seed0/model.safetensors")),
    "three parameters": (["equations"], lambda d: d.weights(theta=np.zeros(3))),
    "parameters of NaN": (["no finite numbers"], lambda d: d.weights(
        theta=np.full(len(load_file(d.sea / "mmg/seed0/model.safetensors")["theta"]), np.nan))),
    "a covariance of another size": (["model.safetensors cannot be read"], lambda d: d.weights(
        covariance=np.zeros((2, 2)))),
    "network: weights of another size": (["model.safetensors cannot be read"], lambda d: d.weights(
        "net", **{"layer00.bias": np.zeros(2, dtype=np.float32)})),
    "network: scaling gone": (["scaling.safetensors cannot be read"], lambda d: d.spoilt(
        "scaling.safetensors", None, "net")),
    "extension a list": (["extension.json cannot be read"], lambda d: d.spoilt(
        "extension.json", "[1]")),
    "extension rubbish": (["extension.json cannot be read"], lambda d: d.spoilt(
        "extension.json", "{")),
    "extension by nobody's cause": (["--cause FILE"], lambda d: d.spoilt(
        "extension.json", json.dumps(EXTENDED))),
    "extension without numbers": (["extension.safetensors cannot be read"], lambda d: d.spoilt(
        "extension.json", json.dumps({**EXTENDED, "causes": []}))),
    "store: voyage.json rubbish": (["trip_3"], lambda d: d.stored(
        "voyage=trip_3/voyage.json", "{}")),
    "store: table cut": (["table of trip_3", "spoilt"], lambda d: d.stored(
        "voyage=trip_3/table.parquet", b"PAR1" + b"x" * 99)),
}  # fmt: skip


def rows():
    for name, case in CASES.items():
        if isinstance(case, list):
            command = name.split(":")[0]
            case = (case, lambda d, command=command: d.on(command, d.path("none")))
        yield pytest.param(*case, id=name)


@pytest.mark.parametrize(("words", "arguments"), list(rows()))
def test_it_is_one_sentence_and_exit_code_1(desk, capsys, words, arguments):
    judge(arguments(desk), 1, words, capsys)


def test_scores_that_are_gone_are_made_again(desk, capsys):
    judge(desk.spoilt("errors.parquet"), 0, ["Per voyage, spoilt"], capsys)


def test_a_catalogue_of_rubbish_is_made_again(desk, capsys):
    judge(desk.stored("catalogue.parquet", b"x"), 0, ["Per voyage, mmg"], capsys)


def test_again_takes_no_other_setting(desk, capsys):
    for option in (
        ("--window", 30), ("--model", "mmg"), ("--voyages", "trip_1"), ("--seeds", 1),
        ("--recipe", "fast"), ("--window", 100), ("--fit",), ("--no-fit", "--model", "mmg"),
    ):  # fmt: skip
        judge(["train", "--again", desk.sea / "mmg", "--out", desk.path("r"), *option], 2,
              ["--again repeats a run as it was", f"{option[0]} would change it",
               "leave the other options out"], capsys)  # fmt: skip


@pytest.mark.parametrize("content", [b"", b"\xff\xfe"])
def test_a_begun_run_with_spoilt_settings_is_begun_anew(desk, capsys, caplog, content):
    begun = desk.dir("r.partial")
    (begun / "config.toml").write_bytes(content)
    judge([*desk.train(), desk.path("r")], 0, ["Mean L"], capsys)
    assert f"{begun / 'config.toml'} is no configuration of a run" in caplog.text
    assert f"{begun} is begun anew." in caplog.messages
    assert desk.path("r").is_dir() and not begun.exists()


@pytest.mark.parametrize(("number", "words"), [
    (30, "Read-only file system"), (28, "No space left on device"), (13, "Permission denied"),
])  # fmt: skip
def test_a_run_that_cannot_be_written_costs_no_answer(desk, capsys, monkeypatch, number, words):
    """A disk that is full, or a network drive that is read-only now."""
    copy = desk.spoilt("nothing")[1]
    before = {p: p.read_bytes() for p in copy.rglob("*") if p.is_file()}

    def refuse(_path):
        raise OSError(number, words)

    monkeypatch.setattr(files, "flush", refuse)
    evaluate = desk.on("evaluate", copy)
    compare = [*desk.on("compare", copy), "--save", desk.path("a.rrd")]
    for arguments, more in ((evaluate, ()), (compare, ("a.rrd could not be written",))):
        judge(arguments, 3, ["Per voyage, spoilt", f"errors.parquet: {words}",
              "has room on its disk", *more], capsys)  # fmt: skip
        assert {p: p.read_bytes() for p in copy.rglob("*") if p.is_file()} == before


def test_a_run_that_cannot_be_written_needs_another_place_for_its_recording(
    desk, capsys, monkeypatch
):
    """Before the work."""
    copy = desk.spoilt("nothing")[1]
    monkeypatch.setattr(os, "access", lambda path, how: (path, how) != (copy, os.W_OK))
    judge(desk.on("compare", copy), 1, ["spoilt is not writable", "choose another --save"], capsys)


def test_a_voyage_without_a_window_is_lost_where_it_is_named(desk, capsys):
    whole = desk.on("evaluate", "mmg")
    to = desk.path("a.json")
    named = [*desk.on("evaluate", "mmg", voyages="trip_3[0:15]"), "--voyages", "trip_3[20:60]"]
    judge([*named, "--json", to], 3, ["Without a window of that length: trip_3[0:15]"], capsys)
    assert json.loads(to.read_text())["too_short"] == ["trip_3[0:15]"]
    judge([*whole, "--json", to], 0, ["Per voyage"], capsys)
    assert json.loads(to.read_text())["too_short"] == []


def test_a_refused_diagnosis_leaves_nothing(desk, capsys):
    judge([*desk.on("diagnose", "mmg"), "--out", desk.path("out"), "--extend", desk.dir("r")],
          1, ["exists already"], capsys)  # fmt: skip
    assert not desk.path("out").exists()


def test_a_diagnosis_of_too_little_replaces_an_earlier_one_and_extends_nothing(
    desk, capsys, caplog
):
    caplog.set_level("INFO")
    out = desk.file_in("out", "diagnosis.rrd")
    judge([*desk.on("diagnose", "mmg"), "--out", out, "--extend", desk.path("r")], 0,
          ["Too little"], capsys)  # fmt: skip
    assert sorted(p.name for p in out.iterdir()) == [
        "pictures", "provenance.json", "report.html", "report.md", "verdict.json",
    ]  # fmt: skip
    assert f"{desk.path('r')} is not written" in caplog.text and not desk.path("r").exists()
