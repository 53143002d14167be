"""Where answers go: into pipes and devices as they are, through links, and into whole files."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from command_desk import judge

from shiplog.cli.terminal_tables import drawn
from shiplog.exceptions import ShiplogError
from shiplog.machine import files
from shiplog.machine.paths import check_file
from shiplog.report.evaluation.text_table import table

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


@posix
@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_a_command_goes_on_without_standard_streams(desk, closed):
    to = desk.path("a.json")
    words = [sys.executable, "-m", "shiplog.cli", "voyages", "--store", desk.store, "--json", to]
    shell = ["sh", "-c", f'exec "$@" {closed}', "sh", *map(str, words)]
    done = subprocess.run(shell, cwd=Path(__file__).parents[2], check=False)
    assert done.returncode == 0 and len(json.loads(to.read_text())["voyages"]) == 2


def test_a_voyage_that_cannot_be_read_is_lost_from_the_list(desk, capsys, caplog):
    store = shutil.copytree(desk.store, desk.path("spoilt"))
    (store / "voyage=one" / "voyage.json").write_text("{}")
    output = judge(["voyages", "--store", store], 3, ["two"], capsys)
    assert "voyage=one cannot be read and is left out" in caplog.text and "| one" not in output
    judge(["voyages", "--store", store, "--voyages", "two"], 0, ["two"], capsys)


def test_blank_cells_and_bars_in_cells_are_drawn_in_their_columns():
    (block,) = drawn(table(("a", "L of x | y"), [("", 1.5), ("p|q", 2.0)]), 80)
    assert [column.header.plain for column in block.columns] == ["a", "L of x | y"]
    cells = [[cell.plain for cell in column.cells] for column in block.columns]
    assert cells == [["", "p|q"], ["1.5", "2"]]
    assert [column.justify for column in block.columns] == ["left", "right"]
