"""The six diffs of docs/develop: applied to a copy of the tree, and what they add is used."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs" / "develop"
PAGES = ("extending_logs.md", "extending_models.md", "extending_commands.md")
USED = """
import math, pathlib, sys

import jax.numpy as jnp
import numpy as np
import polars as pl
from mcap.records import Channel, Schema
from typer.testing import CliRunner

import shiplog
from shiplog.cli.app import app
from shiplog.commands.convert import convert
from shiplog.logs.decoding.decoders import decoder
from shiplog.logs.reading.read import read
from shiplog.models import MODELS
from shiplog.models.causes import CATALOGUE
from shiplog.report.viewer import recording

work = pathlib.Path(sys.argv[1])
assert pathlib.Path(*shiplog.__path__).parent == work / "tree", shiplog.__path__

# a log format: two points of a track, one without a time
point = '<trkpt lat="{}" lon="5.5">{}</trkpt>'
track = point.format(60.25, "<time>2026-06-03T06:00:01Z</time>") + point.format(60.5, "")
track += point.format(60.75, "<time>2026-06-03T06:00:02Z</time>")
space = 'xmlns="http://www.topografix.com/GPX/1/1"'
(work / "trip.gpx").write_text(f"<gpx {space}><trk><trkseg>{track}</trkseg></trk></gpx>")
done = convert([work / "trip.gpx"], None, work / "logs")
assert not done.refused, done.refused
frames = read(done.logs[0], {"/gnss/fix": ["latitude", "longitude"]}).frames
assert frames["/gnss/fix"]["latitude"].to_list() == [60.25, 60.75]

# a message encoding: a message that has a number too few is marked
schema = Schema(1, b"speed,angle", "names", "wind")
reader = decoder(Channel(1, "/wind", "text", {}, 1), schema)
table, bad = reader.columns([b"1.5,20", b"2", b"2.5,-30"], None)
assert table.to_dict(as_series=False) == {"speed": [1.5, 2.5], "angle": [20.0, -30.0]}
assert bad.tolist() == [False, True, False]

# a cause: 3 m south and 4 m west of the bollard, heading north, it pulls 2 N ahead and to starboard
(line,) = [cause for cause in CATALOGUE if cause.name == "mooring_line"]
state = jnp.array([12.0, 0.0, -24.0, 0.0, 0.0, 0.0])
force = np.asarray(line.force(jnp.array([2.0]), state, None))
assert np.allclose(force, [2 * 3 / math.sqrt(26), 2 * 4 / math.sqrt(26), 0.0], atol=1e-6)

# a model
assert MODELS["kt"].equations.lacks

# a view: two voyages, 3 and 5 m/s
class Told:
    def log(self, place, document, static):
        self.place, self.text = place, document.text.as_arrow_array()[0].as_py()

class Drawn:
    measured = pl.DataFrame({"voyage": ["a", "b"], "surge": [3.0, 3.0], "sway": [0.0, -4.0]})

told = Told()
recording.VIEWS["speeds"].send(told, Drawn())
assert told.text == "a: up to 3.00 m/s\\nb: up to 5.00 m/s"
assert recording.VIEWS["speeds"].blueprint(Drawn(), None).origin == told.place
assert recording.VIEWS["speeds"].blueprint(Drawn(), "a") is None

# a command
given = CliRunner().invoke(app, ["hours", "--store", sys.argv[2]], catch_exceptions=False)
assert given.exit_code == 0 and given.output == "known ship, VecTwin: 0.25 h\\n", given.output
print("all six")
"""


def diffs(page):
    """Path and hunks, each of the lines before and after, of every file of a page's diffs."""
    for block in re.findall(r"^```diff\n(.*?)^```$", page, re.MULTILINE | re.DOTALL):
        for part in re.split(r"^--- .*\n", block, flags=re.MULTILINE)[1:]:
            name, *hunks = re.split(r"^@@.*\n", part, flags=re.MULTILINE)
            lines = [hunk.splitlines() for hunk in hunks]
            yield name.strip().removeprefix("+++ b/"), [
                ([one[1:] for one in hunk if one[:1] != "+"],
                 [one[1:] for one in hunk if one[:1] != "-"]) for hunk in lines
            ]  # fmt: skip


@pytest.fixture
def tree(tmp_path):
    """A copy of the package with all diffs applied."""
    left_out = shutil.ignore_patterns("__pycache__", "examples")
    shutil.copytree(ROOT / "shiplog", tmp_path / "tree" / "shiplog", ignore=left_out)
    shutil.copy(DOCS / "examples" / "kt.py", tmp_path / "tree" / "shiplog" / "models")
    for page in PAGES:
        for name, hunks in diffs((DOCS / page).read_text(encoding="utf-8")):
            path = tmp_path / "tree" / name
            lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
            for before, after in hunks:
                size = len(before)
                at = [i for i in range(len(lines) + 1) if lines[i : i + size] == before]
                assert not before or len(at) == 1, (name, before)
                lines[at[0] : at[0] + size] = after
            path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return tmp_path / "tree"


def test_the_diffs_are_six():
    names = [name for page in PAGES for name, _ in diffs((DOCS / page).read_text("utf-8"))]
    assert [name.split("/")[1] for name in names] == [
        "logs", "logs", "logs", "logs", "models", "models", "models", "report", "report",
        "commands", "cli", "cli",
    ]  # fmt: skip


@pytest.mark.long
def test_what_they_add_works(tree, tmp_path):
    store = tmp_path / "store"
    for arguments in (
        ("-m", "shiplog.cli", "ingest", ROOT / "sample_logs/season3_1.mcap", "--store", store),
        ("-c", USED, tmp_path, store),
    ):
        done = subprocess.run(
            [sys.executable, *map(str, arguments)], cwd=tmp_path / "tree", capture_output=True,
            text=True, env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)},
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout == "all six\n"
