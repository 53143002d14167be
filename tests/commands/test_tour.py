"""The notebook of the documentation, executed as a user does, on fewer and shorter logs."""

import ast
import runpy
from pathlib import Path

import polars as pl
import pytest

import shiplog
from shiplog.diagnosis.hypotheses import search
from shiplog.exceptions import ShiplogError

pytestmark = pytest.mark.nightly

ROOT = Path(__file__).parents[2]
# Name in the notebook → sample log. A diagnosis takes as long as its nominal campaign is: 500 s of
# the same season stand for the 1800 s of voyage_2.
LOGS = {
    "voyage_1": "voyage_1", "voyage_2": "voyage_3", "voyage_6": "voyage_6",
    "season2_1": "season2_1",
}  # fmt: skip


@pytest.fixture(scope="module")
def tour(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tour")
    (folder / "sample_logs").mkdir()
    for name, log in LOGS.items():
        (folder / "sample_logs" / f"{name}.mcap").symlink_to(ROOT / "sample_logs" / f"{log}.mcap")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(search, "MOST_SETS", 3)  # what a verdict says is tested elsewhere
        yield folder, runpy.run_path(str(ROOT / "docs" / "start" / "tour.py"))


def test_its_results_are_frames_and_files(tour):
    folder, cells = tour
    assert cells["store"].voyages()["name"].to_list() == sorted(LOGS)
    assert set(cells["scored"].errors["voyage"]) == {"voyage_6"}
    assert (folder / cells["pictures"].recording).read_bytes()[:4] == b"RRF2"
    found = cells["found"]
    assert isinstance(found.ranking, pl.DataFrame)
    # several causes may act; of what remains there is one kind, or nothing has changed
    rest = found.ranking.filter(pl.col("name").str.contains("^(unknown|none)"))
    assert 0.0 < rest["probability"].sum() <= 1.0 + 1e-9
    assert set(found.causes["name"]) == set(found.ranking["name"][: len(found.causes)])
    assert found.verdict.sentence in str(found) and str(found) == found._repr_markdown_()
    assert (folder / found.markdown).read_text(encoding="utf-8").startswith("# Diagnosis")


def test_the_ten_lines_of_the_readme_are_calls_of_the_notebook():
    """With the same arguments; the notebook may give further ones."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = calls(readme.split("```python\n")[1].split("```")[0])
    notebook = calls((ROOT / "docs" / "start" / "tour.py").read_text(encoding="utf-8"))
    assert list(lines) == ["ingest", "train", "evaluate", "compare", "diagnose"]
    for name, arguments in lines.items():
        assert arguments <= notebook[name], name


def calls(code: str) -> dict[str, set[str]]:
    """Function of shiplog → its arguments, of every call in the order of the lines."""
    found = [
        node
        for node in ast.walk(ast.parse(code))
        if isinstance(node, ast.Call) and ast.unparse(node.func).startswith("shiplog.")
    ]
    return {
        ast.unparse(node.func).removeprefix("shiplog."): {
            *(ast.unparse(one) for one in node.args),
            *(f"{one.arg}={ast.unparse(one.value)}" for one in node.keywords),
        }
        for node in sorted(found, key=lambda node: node.lineno)
    }


def test_what_was_made_opens_again(tour):
    folder, cells = tour
    again = shiplog.load(folder / "tour" / "mmg")
    assert again.name == cells["run"].name
    assert shiplog.open_store(folder / "tour" / "store").select() == sorted(LOGS)
    if cells["found"].causes.height:
        assert shiplog.load(folder / "tour" / "mmg2").name == "mmg2"


def test_what_is_not_there_is_reported(tmp_path):
    with pytest.raises(ShiplogError, match="no voyage in the store"):
        shiplog.open_store(tmp_path / "none")
    with pytest.raises(AttributeError, match="has no attribute 'fit'"):
        _ = shiplog.fit
    assert {"ingest", "diagnose"} <= set(dir(shiplog))
