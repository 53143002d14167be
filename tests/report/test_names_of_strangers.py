"""Names of voyages and ships that were chosen to be run, loaded or to break a table."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
import sailing

from shiplog.commands import prepare
from shiplog.diagnosis.residual.interval import Interval
from shiplog.exceptions import StoreError
from shiplog.logs.health.health_report import VoyageReport
from shiplog.report.diagnosis import page
from shiplog.report.diagnosis.verdict import Verdict
from shiplog.report.evaluation.text_table import inert, table
from shiplog.report.viewer import album, diagnosis, report
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store import catalogue
from shiplog.voyages.store.store import Store

HTML = "<img src=x onerror=alert(1)>"
PICTURE = "![x](http://example.org/x.png)"
LINK = "[x](javascript:alert(1))"


def harmless(text: str) -> bool:
    return "<" not in text and "](" not in text


class Recording:
    """What is sent to the viewer as text."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def log(self, _path, what, **_how) -> None:
        self.texts.append(what.text.as_arrow_array()[0].as_py())


def test_a_name_stays_in_its_cell():
    text = table(
        ("voyage", "s"), [("a | b", 1), ("new\nline", 2), ("\x1b[31mred", 3), ("\u2028", 4)]
    )
    cells = [[c.strip() for c in line[1:-1].split(" | ")] for line in text.splitlines()[2:]]
    assert cells == [[r"a \| b", "1"], [r"new\nline", "2"], [r"\x1b[31mred", "3"], [r"\u2028", "4"]]


@pytest.mark.parametrize("name", [HTML, PICTURE, LINK, f"a {HTML} b"])
def test_markdown_of_a_name_is_displayed_and_not_done(name):
    assert harmless(inert(name))
    assert (
        inert("L 12 of season2_1 (90 % band), *d* > 3") == "L 12 of season2_1 (90 % band), *d* > 3"
    )


def test_the_report_of_a_diagnosis():
    intervals = (Interval(HTML, 100.0, 200.0, "external", f"pushed by {LINK}"),)
    verdict = Verdict("none", f"Nothing in {PICTURE}.", HTML, False, "", intervals=intervals)
    text = page.written(verdict).replace(page.TERMS_FOLD, "")
    assert "onerror" in text and "javascript" in text and harmless(text)


def test_a_notebook():
    found = VoyageReport(HTML, 1, 0, 10, 1.0)
    output = prepare.Ingested([found], store=Store("store"))._repr_markdown_()
    assert "onerror" in output and harmless(output)


def test_the_viewers_pages(monkeypatch, tmp_path):
    sent = Recording()
    monkeypatch.setattr(report.display, "drawn_seeds", lambda _drawn: {HTML: 0})
    models = SimpleNamespace(unique=lambda: SimpleNamespace(to_list=lambda: [LINK]))
    monkeypatch.setattr(report.forces, "of_first_model", lambda _drawn: {"model": models})
    report.send(sent, SimpleNamespace(title=HTML, summary=PICTURE))  # type: ignore[arg-type]

    monkeypatch.setattr(diagnosis.trajectory, "send", lambda *_: None)
    exhibit = SimpleNamespace(report=f"{HTML} {LINK}")
    picture = SimpleNamespace(tracks=None, voyages=(), exhibit=exhibit)
    diagnosis.send(sent, picture)  # type: ignore[arg-type]

    class Whole:
        def __init__(self, *_):
            pass

        def __enter__(self):
            return sent

        def __exit__(self, *_):
            pass

    monkeypatch.setattr(album, "whole", Whole)
    album.write("t", f"{HTML} {PICTURE}", {}, tmp_path / "a.rrd")
    assert len(sent.texts) == 3
    for text in sent.texts:
        assert "onerror" in text and harmless(text)


@pytest.mark.parametrize("name", ["new\nline", "\x1b[2Jgone", "a\u2028b"])
def test_a_log_whose_name_breaks_a_line_is_refused(tmp_path, name):
    taken = ingest(sailing.write(tmp_path / "one.mcap"), sailing.profile())
    store = Store(tmp_path / "store")
    with pytest.raises(StoreError) as raised:
        store.add(replace(taken, name=name))
    assert str(raised.value) == (
        f"The name {name!r} of the log holds a line end or a control character.\n"
        "  rename the log file."
    )
    assert store.entries() == []


def test_a_strangers_store_lists_no_such_name(tmp_path, caplog):
    store = Store(tmp_path / "store")
    store.add(ingest(sailing.write(tmp_path / "one.mcap"), sailing.profile()))
    place = store.path / "voyage=one"
    text = (place / "voyage.json").read_text(encoding="utf-8")
    other = store.path / "voyage=one%0A%23%20two"
    other.mkdir()
    (other / "voyage.json").write_text(text.replace('"one"', r'"one\n# two"'), encoding="utf-8")
    assert catalogue.facts(other)["report"]["name"] == "one\n# two"
    assert [e.name for e in store.entries()] == ["one"]
    assert "is left out" in caplog.text
