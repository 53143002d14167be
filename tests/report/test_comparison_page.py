"""Results next to each other: what may be compared, and what changed."""

import page_content
import polars as pl
import pytest
from test_page import read

from shiplog.commands.report import report_results
from shiplog.exceptions import ShiplogError
from shiplog.report.figures import changes
from shiplog.report.page import html
from shiplog.report.page.comparison import alike
from shiplog.report.page.comparison import page as comparison
from shiplog.report.page.results import item_of


def season(tmp_path, name, voyages=(page_content.HOSTILE,), word="named", **changed):
    content = page_content.verdict(word, voyages)
    subject = {k: changed.pop(k) for k in ("ship", "run", "window_s") if k in changed}
    content = content | changed | {"subject": content["subject"] | subject}
    data = page_content.pictures(voyages)
    return page_content.folder(tmp_path / name, content, data)


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"ship": "another"}, "is of the ship 'ship by hand', and b of 'another'"),
        ({"window_s": 50}, "windows of 100 s, and b of 50 s"),
        ({"voyages": ("v",), "run": "other"}, "different runs .mmg, other. on different voyages"),
        ({"voyages": ("v",)}, None),  # one run in two seasons
        ({"run": "other"}, None),  # two runs in one season
    ],
)
def test_what_may_be_compared(changed, why, tmp_path):
    folders = [season(tmp_path, "a"), season(tmp_path, "b", **changed)]
    out = tmp_path / "page.html"
    if why is None:
        report_results(folders, out, None)
        assert "unlike" not in out.read_text(encoding="utf-8")
        return
    with pytest.raises(ShiplogError, match=why):
        report_results(folders, out, None)
    assert not out.exists()
    report_results(folders, out, None, anyway=True)
    assert "Compared although they are unlike" in out.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("value", "low", "high", "said"),
    [
        (0.2, 0.15, 0.25, "yes: the intervals are apart"),
        (0.12, 0.10, 0.14, "no: the intervals meet"),
    ],
)
def test_a_size_has_changed_where_the_intervals_are_apart(value, low, high, said, tmp_path):
    causes = [page_content.cause(value, low, high)]
    folders = [season(tmp_path, "a"), season(tmp_path, "b", voyages=("v",), causes=causes)]
    items = [item_of(folder) for folder in folders]
    page = comparison.of_items(items)
    text = " ".join(read(html.render(page)).text)
    assert said in text
    table = comparison.sizes(items)
    assert table.select("value", "low", "high").rows() == [(0.1, 0.09, 0.11), (value, low, high)]


def test_a_cause_that_only_one_names(tmp_path):
    folders = [season(tmp_path, "a"), season(tmp_path, "b", voyages=("v",), word="none")]
    page = comparison.of_items([item_of(folder) for folder in folders])
    assert page.claim == "The verdicts differ: a: current; b: no change found."
    text = " ".join(read(html.render(page)).text)
    assert "not named" in text and "named in some only" in text


def test_the_ratio_of_two_models_on_the_same_windows():
    index = {"voyage": ["v"] * 8, "window": list(range(8))}
    base = pl.DataFrame(index | {"loss": [100.0] * 8})
    other = pl.DataFrame(index | {"loss": [250.0] * 8})
    assert comparison._change(base, other) == ["2.5 (2.5 to 2.5)"]
    assert comparison._change(base, base) == ["1"]
    assert comparison._change(base, other.with_columns(window=pl.col("window") + 99)) == [
        "no window in common"
    ]


def test_two_results_of_one_name(tmp_path):
    folders = [season(tmp_path / "x", "a"), season(tmp_path / "y", "a")]
    with pytest.raises(ShiplogError, match="Two of the results are called a"):
        report_results(folders, tmp_path / "page.html", None)


def test_pictures_are_of_one_result(tmp_path):
    folders = [season(tmp_path, "a"), season(tmp_path, "b")]
    with pytest.raises(ShiplogError, match="--figures draws the pictures of one"):
        report_results(folders, tmp_path / "page.html", tmp_path / "figures")
    assert not (tmp_path / "page.html").exists()


def test_a_dot_and_an_interval_a_result():
    rows = pl.DataFrame(
        [("a", "current", "speed", "m/s", 0.1, 0.09, 0.11),
         ("b", "current", "speed", "m/s", 0.2, 0.18, 0.22)], changes.SCHEMA, orient="row",
    )  # fmt: skip
    axes = changes.figure(rows).axes[0]
    assert [t.get_text() for t in axes.get_yticklabels()] == ["a", "b"]
    assert axes.get_xlabel() == "speed [m/s]"
    assert changes.words(rows) == "a 0.1 (0.09 to 0.11) m/s; b 0.2 (0.18 to 0.22) m/s."


def test_what_is_no_result(tmp_path):
    for path, says in (
        (tmp_path, "no verdict and no evaluation"),
        (tmp_path / "none", "no verdict"),
    ):
        with pytest.raises(ShiplogError, match=says):
            item_of(path)
    assert alike.differences([item_of(season(tmp_path, "a"))]) == []
