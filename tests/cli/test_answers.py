"""Where answers go: into pipes and devices as they are, through links, and into whole files."""

from __future__ import annotations

import json
import os
import sys
import threading
from pathlib import Path

import pytest
from command_desk import judge

from shiplog import files
from shiplog.exceptions import ShiplogError
from shiplog.paths import check_file

posix = pytest.mark.skipif(sys.platform == "win32", reason="pipes and links of POSIX")


@posix
def test_an_answer_goes_into_a_pipe_and_the_pipe_stays(desk, capsys):
    pipe, read = desk.path("pipe"), []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()), daemon=True)
    reader.start()
    judge(["voyages", "--store", desk.store, "--json", pipe], 0, [], capsys)
    reader.join(10.0)
    assert [v["name"] for v in json.loads(read[0])["voyages"]] == ["one", "two"]
    assert pipe.is_fifo()


@pytest.mark.skipif(sys.platform != "linux", reason="a shell's >(command) as Linux has it")
def test_an_answer_goes_to_a_command_of_the_shell(desk, capsys):
    reading, writing = os.pipe()
    judge(["voyages", "--store", desk.store, "--json", f"/dev/fd/{writing}"], 0, [], capsys)
    os.close(writing)
    with open(reading) as stream:
        assert len(json.load(stream)["voyages"]) == 2


@posix
def test_an_answer_follows_a_link(desk, capsys):
    real, link = desk.file("real.json", "old"), desk.path("link.json")
    link.symlink_to(real)
    judge(["voyages", "--store", desk.store, "--json", link], 0, [], capsys)
    assert link.is_symlink() and len(json.loads(real.read_text())["voyages"]) == 2


@posix
def test_a_device_is_written_to_and_never_replaced(tmp_path, monkeypatch):
    assert check_file(Path("/dev/null"), "--json", streams=True) == Path("/dev/null")
    monkeypatch.setattr(files, "write_text", None)
    files.write_answer(Path("/dev/null"), "{}")
    with pytest.raises(ShiplogError, match="no file that can be replaced"):
        check_file(Path("/dev/null"), "--save")
    link = tmp_path / "a.rrd"
    link.symlink_to(tmp_path / "b.rrd")
    assert check_file(link, "--save") == tmp_path.resolve() / "b.rrd"
