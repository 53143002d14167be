"""Pictures and pages of a result in Python and in a notebook."""

import page_content
import pytest
from matplotlib.figure import Figure

from shiplog.exceptions import ShiplogError
from shiplog.report.figures.content import Content
from shiplog.report.figures.pictures import PICTURES
from shiplog.report.figures.plots import Plots
from shiplog.report.result import Shown, Shows

CONTENT = Content(page_content.verdict(), page_content.pictures())


class Result(Shows):
    lines = ("text",)

    def __init__(self, shown):
        self.shown = shown


def test_all_pictures_in_one_figure():
    made = Plots(CONTENT)()
    titles = {axes.get_title(loc="left") for axes in made.axes}
    assert {p.title for p in PICTURES.values() if not p.voyage} <= titles


@pytest.mark.parametrize("name", PICTURES)
def test_each_picture_is_a_figure_and_takes_axes(name):
    plots = Plots(CONTENT)
    assert isinstance(getattr(plots, name)(), Figure)
    own = Figure()
    axes = own.add_subplot(projection="polar" if PICTURES[name].polar else None)
    assert getattr(plots, name)(ax=axes) is own
    assert name in dir(plots)


def test_what_is_not_there_is_named():
    with pytest.raises(AttributeError, match="there is no picture 'closup'; there are channels"):
        _ = Plots(CONTENT).closup
    with pytest.raises(KeyError, match="is not among"):
        Plots(CONTENT).track(voyage="other")


def test_a_page_and_a_notebook(tmp_path):
    result = Result(Shown(lambda: Plots(CONTENT), lambda: '<p title="&">a "page"</p>'))
    assert result.report(tmp_path / "x.html").read_text() == '<p title="&">a "page"</p>'
    frame = result._repr_html_()
    assert "&lt;p title=&quot;&amp;&quot;&gt;" in frame and 'sandbox=""' in frame
    with pytest.raises(ShiplogError, match="there is no folder"):
        result.report(tmp_path / "none" / "x.html")


def test_a_result_without_pictures():
    result = Result(None)
    assert result._repr_html_() is None and result._repr_markdown_() == "text"
    with pytest.raises(AttributeError, match="neither pictures nor a page"):
        _ = result.plot
