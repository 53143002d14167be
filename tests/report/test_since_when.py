"""Since when: its sentences, its section on the page, its picture."""

from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest

from shiplog.diagnosis.onset.drift import Slope
from shiplog.diagnosis.onset.onsets import Course, Moment, Onset
from shiplog.models.causes import ParameterEstimate
from shiplog.report.diagnosis.sections import onset as sections
from shiplog.report.diagnosis.sections.written import as_json
from shiplog.report.figures import onset as pictures
from shiplog.report.figures import picture_data
from shiplog.report.figures.content import Content
from shiplog.report.figures.picture_data import SCHEMAS, PictureData
from shiplog.report.page.blocks import Grid
from shiplog.report.page.diagnosis import since_when

SIZE = {"angle": ParameterEstimate(2.0, 1.8, 2.3, "deg")}


def course(from_start: float, ends: float = 0.0) -> Course:
    begin = Moment(640.0, 610.0, 672.0, "home", 40.0)
    off = Moment(1200.0, 1150.0, 1230.0, "home", 600.0) if ends >= 0.5 else None
    edges = np.array([0.0, 300.0, 600.0, 900.0])
    acting = np.array([from_start, from_start, 1.0])
    return Course(Onset(begin, from_start, off, ends, SIZE, acting, edges, ("out",) * 3))


def test_a_beginning_has_its_voyage_and_its_interval():
    later = sections.lines(sections.of(course(0.02, 0.97)))
    assert later == [
        "Since when: from 40 s of home on; in recorded time 640 s, 90 %: 610 to 672 s (from the "
        "start: probability 0.02); it ends at 600 s of home, in recorded time 1200 s, 90 %: 1150 "
        "to 1230 s.",
        "While it acts: angle 2 (1.8 to 2.3) deg.",
    ]
    first, *_ = sections.lines(sections.of(course(0.97)))
    assert first == "Since when: present from the start (probability 0.97)."


def test_json_has_the_contracts_names():
    found = as_json(sections.of(course(0.02, 0.97)))
    assert found["onset"] == {
        "elapsed_s": 640.0, "low": 610.0, "high": 672.0, "from_start": 0.02, "voyage": "home",
        "start_s": 40.0,
    }  # fmt: skip
    assert found["off"]["probability"] == 0.97
    assert "slope" not in found and "off" not in as_json(sections.of(course(0.02)))


def test_what_grows_has_a_slope_and_no_onset():
    grows = sections.of(Course(slope=Slope("factor", 0.002, 0.001, 0.003, "1/day", 120.0)))
    assert sections.lines(grows) == [
        "Change of its factor: 0.002 a day (90 %: 0.001 to 0.003) over 120 days."
    ]
    assert sections.of(None) == sections.Dated()


def source(*courses: Course):
    causes = [
        {"name": "heading_offset", **as_json(sections.of(one))} for one in courses
    ]  # fmt: skip
    verdict = {"verdict": "named", "causes": causes}
    subject = {"run": "mmg", "voyages": []}
    return SimpleNamespace(
        verdict=verdict, subject=subject, provenance={}, gallery=lambda names: []
    )  # fmt: skip


def grid(blocks):
    return next(block for block in blocks if isinstance(block, Grid))


def text(cell) -> str:
    return "".join(getattr(part, "text", part) for part in cell)


def test_the_page_says_since_when_and_until_when():
    (row,) = grid(since_when.blocks(source(course(0.02, 0.97)))).rows
    cells = [text(cell).replace("\u202f", " ") for cell in row]
    assert cells == [
        "heading offset", "40 s of home", "610 s to 672 s", "0.02", "600 s of home (1150 s to "
        "1230 s)",
    ]  # fmt: skip
    (first,) = grid(since_when.blocks(source(course(0.97)))).rows
    assert [text(cell) for cell in first][1:] == ["the start", "-", "0.97", "the end"]
    slope = Course(slope=Slope("factor", 0.002, 0.001, 0.003, "1/day", 120.0))
    (grows,) = grid(since_when.blocks(source(slope))).rows
    assert text(grows[1]) == "0.002"


@pytest.mark.parametrize(("causes", "words"), [((), "No cause is named."), ((Course(),), "None")])
def test_the_page_says_why_nothing_is_dated(causes, words):
    (block,) = since_when.blocks(source(*causes))
    assert block.line[0].startswith(words)


def content(rows):
    table = pl.DataFrame(rows, SCHEMAS["acting"], orient="row")
    verdict = {"causes": [{"name": "heading_offset", **as_json(sections.of(course(0.02)))}]}
    return Content(verdict, PictureData("a ship", 3.0, 0.5, acting=table))


def test_the_picture_is_as_high_as_the_probability():
    from matplotlib.figure import Figure

    rows = [("heading_offset", "out", 0.0, 60.0, 0.25), ("heading_offset", "home", 60.0, 180.0, 1)]
    shown = content(rows)
    axes = Figure().add_subplot()
    pictures.OF_ONSET.draw(axes, pictures.OF_ONSET.table(shown), shown)
    (step,) = axes.patches
    values, edges, baseline = step.get_data()
    assert edges.tolist() == [0.0, 1.0, 3.0]  # minutes
    assert (baseline - values).tolist() == pytest.approx([0.25 * 0.8, 0.8])
    assert "between 610 and 672 s" in pictures.OF_ONSET.words(shown.data.acting, shown)


def test_a_result_of_an_earlier_version_has_no_such_table(tmp_path):
    picture_data.save(picture_data.typed(content([]).data), tmp_path)
    (tmp_path / "acting.parquet").unlink()
    assert picture_data.load(tmp_path).acting.is_empty()
