"""What nobody foresaw: one sentence, the right exit code, and the trace kept."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from command_desk import judge

from shiplog import cli


def test_any_other_exception_is_one_sentence_and_its_trace_is_kept(desk, capsys, monkeypatch):
    from shiplog.voyages.store import catalogue

    def broken(_store):
        raise ZeroDivisionError("division\nby zero")

    monkeypatch.setattr(catalogue, "entries", broken)
    assert cli.run(["voyages", "--store", str(desk.store)]) == 1
    output = capsys.readouterr().err
    assert "Traceback" not in output
    (trace,) = (desk.folder / "cache" / "shiplog" / "faults").iterdir()
    first, _ = output.split("\n", 1)
    assert "ZeroDivisionError: division by zero" in first and str(trace) in first
    text = trace.read_text()
    assert "in broken" in text and "Traceback" in text


def test_a_trace_is_kept_where_there_is_no_cache(desk, capsys, monkeypatch):
    """In the temporary folder."""
    import tempfile

    from shiplog.voyages.store import catalogue

    monkeypatch.setenv("XDG_CACHE_HOME", str(desk.file("no-folder") / "cache"))
    monkeypatch.setattr(tempfile, "tempdir", str(desk.dir("tmp")))
    monkeypatch.setattr(catalogue, "entries", lambda _store: 1 / 0)
    assert cli.run(["voyages", "--store", str(desk.store)]) == 1
    (trace,) = desk.path("tmp").iterdir()
    assert str(trace) in capsys.readouterr().err


@pytest.mark.parametrize("kind", [PermissionError, FileNotFoundError])
def test_what_the_system_says_of_a_path_is_the_users_to_mend(desk, capsys, monkeypatch, kind):
    import errno

    from shiplog.voyages.store import catalogue

    code = {PermissionError: errno.EACCES, FileNotFoundError: errno.ENOENT}[kind]

    def refused(_store):
        raise OSError(code, os.strerror(code), "/somewhere")

    monkeypatch.setattr(catalogue, "entries", refused)
    judge(["voyages", "--store", desk.store], 1, [f"/somewhere: {os.strerror(code)}"], capsys)


def test_ctrl_c_is_reported_and_has_its_code(desk, capsys, monkeypatch):
    from shiplog.voyages.store import catalogue

    def interrupted(_store):
        raise KeyboardInterrupt

    monkeypatch.setattr(catalogue, "entries", interrupted)
    assert cli.run(["voyages", "--store", str(desk.store)]) == 130
    assert "what was finished is kept" in capsys.readouterr().err


def test_wrong_words_are_answered_before_anything_heavy_is_loaded(desk):
    """torch, JAX and Rerun take seconds; a wrong word is answered without any of them."""
    import subprocess

    program = (
        "import sys, shiplog.cli as c; code = c.run(sys.argv[1:]); "
        "heavy = {'torch', 'jax', 'rerun', 'scipy', 'numba'} & set(sys.modules); "
        "sys.exit(9 if heavy else code)"
    )
    missing = desk.path("nowhere")
    for code, arguments in (
        (2, desk.train("--model", "lstm")), (1, desk.train("--voyages", "x")),
        (1, ["evaluate", missing]), (1, ["compare", missing]), (1, ["diagnose", missing]),
        (1, ["demo", "--logs", missing]), (1, ["ingest", missing]),
        (1, ["ingest", desk.log, "--profile", "x"]),
    ):  # fmt: skip
        done = subprocess.run(
            [sys.executable, "-c", program, *map(str, arguments)], cwd=Path(__file__).parents[2],
            check=False, capture_output=True, text=True,
        )  # fmt: skip
        assert done.returncode == code, (arguments, done.stderr)
