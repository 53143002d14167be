"""Pages in a real browser: wide, as on a phone, and printed; and what they ask for."""

import base64

import page_content
import pytest
from browser import chromium, hosts_asked

from shiplog.report.page import html
from shiplog.report.page.diagnosis import page

WIDTHS = (1280, 390)
SMALLEST = 7.0  # px of a letter in a picture on a phone: what is smaller cannot be read


@pytest.fixture(scope="module")
def tab(tmp_path_factory):
    """A browser with the page of a verdict open, and what it reported."""
    folder = tmp_path_factory.mktemp("browser")
    voyages = ("a voyage with quite a long name_2026-04-14_02_00", page_content.HOSTILE)
    diagnosis = page_content.folder(
        folder / "d", page_content.verdict(voyages=voyages), page_content.pictures(voyages, 3)
    )
    path = html.write(page.of_folder(diagnosis), folder / "report.html")
    with chromium(folder) as browser:
        browser.open(path.as_uri())
        browser.wait("return document.readyState == 'complete'")
        yield browser
        errors = [text for text in browser.console() if "SEVERE" in text or "Refused" in text]
    assert errors == []
    assert all(not hosts for hosts in hosts_asked(folder).values())


@pytest.mark.parametrize("width", WIDTHS)
def test_nothing_is_wider_than_the_screen(tab, width, tmp_path):
    tab.devtools(
        "Emulation.setDeviceMetricsOverride",
        width=width, height=900, deviceScaleFactor=1, mobile=width < 500,
    )  # fmt: skip
    assert tab.run("return document.documentElement.scrollWidth") <= width
    beyond = tab.run(
        "return Array.from(document.querySelectorAll('h1, p, dd, td, figure, pre, summary'))"
        ".filter(e => e.getBoundingClientRect().right > innerWidth + 0.5).map(e => e.outerHTML)"
    )
    assert beyond == []
    tab.picture(tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 20_000


def test_letters_of_pictures_can_be_read_on_a_phone(tab):
    tab.devtools(
        "Emulation.setDeviceMetricsOverride", width=390, height=900, deviceScaleFactor=1,
        mobile=True,
    )  # fmt: skip
    sizes = tab.run(
        "return Array.from(document.querySelectorAll('figure svg text')).map(e =>"
        " parseFloat(getComputedStyle(e).fontSize) * e.getScreenCTM().a)"
        ".filter(size => size > 0)"
    )
    assert len(sizes) > 100
    assert min(abs(size) for size in sizes if abs(size) > 0.1) >= SMALLEST


def test_in_print_what_is_folded_is_open(tab, tmp_path):
    hidden = (
        "return Array.from(document.querySelectorAll('details > *:not(summary)'))"
        ".filter(e => !e.checkVisibility({contentVisibilityAuto: true})"
        " || e.getBoundingClientRect().height == 0).length"
    )
    assert tab.run(hidden) > 0
    tab.devtools("Emulation.setEmulatedMedia", media="print")
    assert tab.run(hidden) == 0
    tab.devtools("Emulation.setEmulatedMedia", media="")
    printed = base64.b64decode(tab.devtools("Page.printToPDF", preferCSSPageSize=True)["data"])
    assert printed.startswith(b"%PDF")
    assert b"/MediaBox [0 0 594.95" in printed or b"/MediaBox [0 0 595" in printed  # A4, points
