"""The documentation keeps its form: pages of a screenful or two, and links that lead somewhere."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
DEVELOP = ROOT / "docs" / "develop"
PAGES = sorted((ROOT / "docs").rglob("*.md"))
LINK = re.compile(r"\]\(([^)\s:#]+)(?:#[^)]*)?\)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_page_has_200_lines_at_most(page):
    assert len(page.read_text(encoding="utf-8").splitlines()) <= 200


def test_the_front_door_has_150_and_a_test_command():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 150
    assert text.count("<!-- tests -->\n```bash\n") == 1


@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES],
                         ids=lambda page: str(page.relative_to(ROOT)))  # fmt: skip
def test_links_lead_to_files(page):
    """The site's links are checked when it is built; these are as a reader of the files has them,
    and as tests without the site's packages see them."""
    text = page.read_text(encoding="utf-8")
    text = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    for target in LINK.findall(text):
        assert (page.parent / target).exists(), target


def test_no_page_of_the_navigation_is_missing():
    listed = set(re.findall(r"([a-z0-9_/]+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE))
    assert listed == {str(page.relative_to(ROOT / "docs")) for page in PAGES}


ADDED = "shiplog/models/kt.py"  # what the page on models tells its reader to write
BASES = (ROOT, DEVELOP, ROOT / "shiplog", ROOT / "shiplog" / "diagnosis")
FILE = re.compile(r"`([a-z0-9_]+(?:/[a-z0-9_]+)*/[a-z0-9_]+\.py)`")
PLACE = re.compile(r"`([a-z0-9_/]+\.py)`(?:,\s`|\s\(`)([A-Za-z_]+)`")


def file_of(name):
    return next((path for base in BASES if (path := base / name).exists()), None)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_code_that_a_page_names_is_there(page):
    """A reader who looks for a term of a verdict in the code must find the file."""
    text = page.read_text(encoding="utf-8")
    text = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    assert [name for name in FILE.findall(text) if file_of(name) is None and name != ADDED] == []


def test_every_function_of_the_worked_case_is_in_its_file():
    text = (ROOT / "docs" / "science" / "season2.md").read_text(encoding="utf-8")
    places = PLACE.findall(text)
    assert len(places) >= 8
    for name, function in places:
        path = file_of(name)
        assert path is not None, name
        assert re.search(rf"(def|class) {function}\b", path.read_text("utf-8")), (name, function)
