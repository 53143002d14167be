"""Files whole or not at all; half-written ones of killed processes go, of living ones stay."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import polars as pl
import pytest
from safetensors import SafetensorError

from shiplog.machine import files

KILLED = """
import os, signal, sys
from pathlib import Path
from shiplog.machine import files
with files.whole(Path(sys.argv[1])) as partial, files.temporary_folder() as folder:
    partial.write_text("half")
    print(folder, flush=True)
    if sys.argv[2] == "wait":
        sys.stdin.read()
    os.kill(os.getpid(), signal.SIGKILL)
"""
posix = pytest.mark.skipif(sys.platform == "win32", reason="POSIX signals")


def killed(path: Path, wait: bool = False) -> tuple[subprocess.Popen, Path]:
    """A process that writes `path`, and ends, or waits, before it has written it."""
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(path), "wait" if wait else "at once"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[1],
    )  # fmt: skip
    assert process.stdout is not None
    folder = Path(process.stdout.readline().strip())
    if not wait:
        process.communicate()
    return process, folder


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """A temporary folder of this test, for its child processes as well."""
    place = tmp_path / "tmp"
    place.mkdir()
    monkeypatch.setenv("TMPDIR", str(place))
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    return place


@posix
def test_the_next_call_removes_what_a_killed_one_left(tmp_path, temporary):
    path = tmp_path / "a.json"
    _, folder = killed(path)
    assert len(list(tmp_path.glob(".a.json.*.partial"))) == 1 and folder.is_dir()
    files.write_json(tmp_path / "b.json", {})  # another file, whose leavings these are not
    assert len(list(tmp_path.glob(".a.json.*.partial"))) == 1
    files.write_json(path, {})
    with files.temporary_folder() as own:
        assert [p.name for p in temporary.iterdir()] == [own.name]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.json", "b.json", "tmp"]
    assert list(temporary.iterdir()) == []


@posix
def test_what_a_living_process_writes_stays(tmp_path, temporary):
    path = tmp_path / "a.json"
    process, folder = killed(path, wait=True)
    with process:
        files.write_json(path, {})
        files.sweep(tmp_path)
        with files.temporary_folder():
            assert folder.is_dir()
        assert len(list(tmp_path.glob(".a.json.*.partial"))) == 1
        process.kill()
    files.sweep(tmp_path)
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["a.json"]


def test_a_number_that_another_process_has_now_does_not_keep_a_leaving(tmp_path):
    leaving = tmp_path / f".a.json.{files.MACHINE}-{os.getppid()}.partial"
    leaving.touch()
    files.sweep(tmp_path)
    assert leaving.exists()  # its writer may be this process's parent
    yesterday = time.time() - 86_400 * 365
    os.utime(leaving, (yesterday, yesterday))
    files.sweep(tmp_path)
    assert not leaving.exists()


@pytest.mark.parametrize(
    "name", [".a.json.0badf00d-1.partial", ".a.json.partial", "a.partial", ".a.12.partial"]
)
def test_files_of_other_machines_and_of_nobody_known_stay(tmp_path, name):
    (tmp_path / name).touch()
    files.sweep(tmp_path)
    assert (tmp_path / name).exists()


@pytest.mark.parametrize("name", ["[a].json", "*", "a b"])
def test_names_are_not_patterns(tmp_path, name):
    other = tmp_path / f".abc.{files.MACHINE}-{2**22 + 1}.partial"
    own = tmp_path / f".{name}.{files.MACHINE}-{2**22 + 1}.partial"
    other.touch()
    own.touch()
    files.write_text(tmp_path / name, "x")
    assert sorted(tmp_path.iterdir()) == sorted([other, tmp_path / name])


@pytest.mark.parametrize("error", [
    OSError(28, "No space left on device"),
    pl.exceptions.ComputeError("No space left on device (os error 28): /x/.a.partial"),
    SafetensorError("Error while serializing: I/O error: No space left (os error 28)"),
], ids=["system", "polars", "safetensors"])  # fmt: skip
def test_a_full_disk_is_named_with_the_path_that_was_asked_for(tmp_path, error):
    path = tmp_path / "a.parquet"
    path.write_text("as it was")
    with (
        pytest.raises(OSError, match="No space left on device") as raised,
        files.whole(path) as part,
    ):
        part.write_text("half")
        raise error
    assert raised.value.filename == str(path)
    assert raised.value.errno == 28
    assert path.read_text() == "as it was"
    assert list(tmp_path.iterdir()) == [path]


def test_faults_of_other_kinds_and_paths_stay_what_they_are(tmp_path):
    for error in (ValueError("no number"), FileNotFoundError(2, "No such file", "/elsewhere")):
        with pytest.raises(type(error)) as raised, files.whole(tmp_path / "a"):
            raise error
        assert raised.value is error
    assert list(tmp_path.iterdir()) == []


def test_json_has_no_infinity(tmp_path):
    files.write_json(tmp_path / "a.json", {"loss": float("inf"), "seeds": [1.0, float("nan")]})
    assert (tmp_path / "a.json").read_text().count("null") == 2
