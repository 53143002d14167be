"""Pages of an evaluation and of voyages' health: asked for by a command, and made again of what it
left."""

import json
import re
import shutil

import html5lib
import polars as pl
import pytest
from commands import call

import shiplog


def data(text):
    """Each number of a page: its value and how it is written."""
    return [(float(v), t) for v, t in re.findall(r'<data value="([^"]+)">([^<]+)</data>', text)]


@pytest.fixture(scope="module")
def evaluated(published, store, tmp_path_factory):
    """A copy of the run, evaluated with a page; folder of the run, page and JSON."""
    folder = tmp_path_factory.mktemp("evaluated")
    run = folder / "published"
    shutil.copytree(published[0], run)
    code, _, _ = call(
        "evaluate", run, "--store", store, "--voyages", "trip_3", "--report", folder / "page.html",
        "--json", folder / "a.json",
    )  # fmt: skip
    assert code == 0
    return run, (folder / "page.html").read_text(), json.loads((folder / "a.json").read_text())


def test_the_page_of_an_evaluation_has_the_numbers_of_its_json(evaluated):
    _, page, answer = evaluated
    html5lib.HTMLParser(strict=True).parse(page)
    values = {value for value, _ in data(page)}
    assert {answer["loss"], answer["end_position_m"], answer["end_heading_deg"]} <= values
    assert set(answer["floors"].values()) <= values
    assert set(answer["rmse"].values()) <= values
    assert answer["sentence"] in page
    assert "trip_3" in page and "2026-05-01" in page


def test_the_page_is_made_again_of_the_run_folder(evaluated, tmp_path):
    run, page, _ = evaluated
    assert call("report", run, "--out", tmp_path / "again.html")[0] == 0
    assert (tmp_path / "again.html").read_text() == page


def test_the_position_error_of_the_page_is_that_of_the_rollouts(evaluated, store):
    """Worked out from the tables that `evaluate` leaves in the run, at the end of a window."""
    run, *_ = evaluated
    errors = pl.read_parquet(run / "errors.parquet")
    tracks = pl.read_parquet(run / "evaluation" / "pictures" / "tracks.parquet")
    keys = ["voyage", "window"]
    last = tracks.group_by("model", *keys).agg(pl.col("x0", "y0").sort_by("time").last())
    ends = last.filter(pl.col("model") == "published").join(
        last.filter(pl.col("model") == "measured"), on=keys, suffix="_measured"
    )
    off = (pl.col("x0") - pl.col("x0_measured")) ** 2 + (pl.col("y0") - pl.col("y0_measured")) ** 2
    found = ends.sort(keys).select(off.sqrt()).to_series().to_list()
    assert found == pytest.approx(errors.sort(keys)["end_position_m"].to_list(), rel=1e-9)


def test_the_health_of_a_store_and_of_one_voyage(logs, store, tmp_path):
    page = tmp_path / "health.html"
    again = ("ingest", logs, "--store", store, "--report", page)
    assert call(*again)[0] == 0
    text = page.read_text()
    html5lib.HTMLParser(strict=True).parse(text)
    rows = {e.name: e for e in shiplog.open_store(store).entries()}
    values = {value for value, _ in data(text)}
    assert {float(e.rows) for e in rows.values()} <= values
    assert call("report", store, "--out", tmp_path / "store.html")[0] == 0
    assert (tmp_path / "store.html").read_text() == text
    one = tmp_path / "one.html"
    assert call("report", store / "voyage=trip_2", "--out", one)[0] == 0
    assert "trip_2" in one.read_text() and "trip_1" not in one.read_text()
    assert not list(store.glob("*.html"))


def test_two_models_on_the_same_windows(evaluated, tmp_path):
    run, *_ = evaluated
    other = tmp_path / "other"
    shutil.copytree(run, other)
    path = other / "evaluation" / "evaluation.json"
    found = json.loads(path.read_text())
    found["subject"]["window_s"] = 99
    path.write_text(json.dumps(found))
    code, _, said = call("report", run, other, "--out", tmp_path / "c.html")
    assert code == 1 and "windows of 25 s, and other of 99 s" in said
    assert not (tmp_path / "c.html").exists()
    assert call("report", run, other, "--anyway", "--out", tmp_path / "c.html")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("nowhere",), 1, "nowhere does not exist"),
        ((".",), 1, "is no result of shiplog"),
        (("RUN",), 1, "published has no evaluation"),
        (("STORE", "--out", "none/x.html"), 1, "there is no folder none"),
        (("STORE", "--figures", "f"), 1, "--figures draws the pictures of one diagnosis"),
    ],
)
def test_what_no_page_can_be_made_of(
    arguments, code, says, published, store, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    run = tmp_path / "published"
    shutil.copytree(published[0], run)
    shutil.rmtree(run / "evaluation", ignore_errors=True)
    places = {"RUN": run, "STORE": store}
    found, _, said = call("report", *(places.get(a, a) for a in arguments))
    assert (found, says in said) == (code, True), said
    assert not list(tmp_path.glob("*.html"))


def test_in_python(evaluated, store, tmp_path):
    run, page, answer = evaluated
    found = shiplog.evaluate(run, store, "trip_3")
    assert found.report(tmp_path / "x.html").read_text() == page
    assert "<iframe srcdoc=" in found._repr_html_()
    axes = found.plot.position_error().axes[0]
    assert axes.get_xlabel() == "time since the start of the window [s]"
    health = shiplog.open_store(store)
    assert "trip_1" in {v.name for v in health}
    assert answer["windows"] == len(found.errors)
