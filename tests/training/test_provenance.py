"""A run says which source made it."""

import subprocess
from pathlib import Path

from shiplog.training.runs import provenance

ROOT = Path(__file__).parents[2]


def test_the_commit_is_that_of_the_checkout_the_source_lies_in(monkeypatch):
    """Installed somewhere else, there is none: git would name whose repository that is."""
    source = Path(provenance.__file__).parents[2]
    found = provenance.commit_of_source()
    if source == ROOT and (ROOT / ".git").exists():
        done = subprocess.run(
            ["git", "-C", ROOT, "rev-parse", "HEAD"], capture_output=True, text=True, check=True
        )
        assert found == done.stdout.strip()
    monkeypatch.setattr(provenance, "__file__", "/nowhere/at/all/provenance.py")
    assert provenance.commit_of_source() is None


def test_a_git_that_takes_too_long_costs_no_finished_run(monkeypatch, tmp_path):
    """The commit is asked for when hours of training are over."""

    def waits(command, timeout, **others):
        raise subprocess.TimeoutExpired(command, timeout)

    (tmp_path / ".git").mkdir()
    monkeypatch.setattr(provenance, "__file__", str(tmp_path / "a" / "b" / "provenance.py"))
    monkeypatch.setattr(subprocess, "run", waits)
    assert provenance.commit_of_source() is None


def test_a_command_line_is_kept_without_the_folders_of_its_machine():
    given = ["/opt/venv/bin/shiplog", "train", "--out=/home/someone/runs/a", "--store", "/data/sea",
             "--voyages", "trial_*", "--out", "../runs/b", "--width", "8"]  # fmt: skip
    assert provenance.portable(given) == [
        "shiplog", "train", "--out=a", "--store", "sea", "--voyages", "trial_*", "--out",
        "../runs/b", "--width", "8",
    ]  # fmt: skip
