"""What a shell completes: commands, voyages of a store, run folders, profiles, words of options."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from shiplog.cli import completion
from shiplog.models import MODELS
from shiplog.ship_profile import file as profiles

PROGRAM = Path(sys.executable).parent / "shiplog"


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A store of four voyages, one with a name that a shell would run, and three folders."""
    for name in ("voyage_1", "voyage_2", "zigzag", "voyage_%24(touch x)", "voyage_3`id`"):
        (tmp_path / "store" / f"voyage={name}").mkdir(parents=True)
    for run in ("runs/mmg", "runs/mmg2", "runs/mmg3.partial", "runs/$(id)", "alone"):
        (tmp_path / run).mkdir(parents=True)
        (tmp_path / run / "config.toml").touch()
    (tmp_path / "runs" / "notes").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def completed(*words, folder):
    """What bash would get for the last of these words."""
    line = " ".join(("shiplog", *words))
    env = {"_SHIPLOG_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(words))}
    done = subprocess.run(
        [PROGRAM], cwd=folder, env=os.environ | env, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.split()


@pytest.mark.skipif(not PROGRAM.exists(), reason="shiplog is not installed as a program")
def test_a_shell_is_answered(desk):
    assert completed("eval", folder=desk) == ["evaluate"]
    assert completed("evaluate", "ru", folder=desk) == ["runs/mmg", "runs/mmg2"]
    assert completed("evaluate", "alone", "--voyages", "v", folder=desk) == ["voyage_1", "voyage_2"]
    other = ("--store", desk / "store", "--voyages", "z")
    assert completed("evaluate", "alone", *map(str, other), folder=desk.parent) == ["zigzag"]
    assert completed("train", "--model", "m", folder=desk) == ["mmg"]


def test_runs_are_whole_folders_of_runs(desk):
    assert completion.runs("") == ["alone", "runs/mmg", "runs/mmg2"]
    assert completion.runs("runs/mmg2") == ["runs/mmg2"]
    assert completion.runs(f"{desk}/runs/m") == [f"{desk}/runs/mmg", f"{desk}/runs/mmg2"]
    assert completion.runs("nowhere/x") == []


def test_a_store_that_is_not_there_completes_nothing(desk):
    context = typer.Context(typer.main.get_command(typer.Typer(callback=lambda: None)))
    context.params["store"] = desk / "none"
    assert completion.voyages(context, "v") == []


def test_names_that_a_shell_would_run_are_left_out(desk):
    context = typer.Context(typer.main.get_command(typer.Typer(callback=lambda: None)))
    assert completion.voyages(context, "") == ["voyage_1", "voyage_2", "zigzag"]


def test_profiles_and_words_are_those_that_there_are():
    assert completion.profiles("") == sorted(profiles.shipped())
    assert completion.of_words(MODELS)("") == list(MODELS)
