"""The site leads from the first use of a word to the glossary, and nowhere else."""

import importlib.util
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

DOCS = Path(__file__).parents[1] / "docs"
GLOSSARY = """
| word | meaning |
| --- | --- |
| noise | what [sensors](x.md) add |
| process noise | **random** force |
| slicing, jittering | cutting; copying |
| run | a folder |
"""


@pytest.fixture(scope="module")
def module():
    spec = importlib.util.spec_from_file_location("glossary_links", DOCS / "glossary_links.py")
    assert spec and spec.loader
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def linked(module, page, name="use/train.md"):
    links = module.Links(module.meanings(GLOSSARY))
    links.begin(name)
    root = ElementTree.fromstring(f"<div>{page}</div>")
    links.link(root)
    return root


@pytest.mark.parametrize(
    ("page", "words"),
    [
        ("<p>Noise, process noises and noise.</p>", ["Noise", "process noises"]),
        ("<p>To run it: noisy, anti-noise, noise-free.</p>", []),  # other words
        ("<h2>Noise</h2><p><code>noise</code> <a>noise</a> <em>noise</em>.</p>", ["noise"]),
        ("<ul><li>Jittering</li></ul><p>jittering, slicing</p>", ["Jittering", "slicing"]),
    ],
)
def test_the_first_use_of_a_word_leads_to_it(module, page, words):
    root = linked(module, page)
    found = root.findall(".//a[@class='glossary']")
    assert [one.text for one in found] == words
    text = re.sub(r"<[^>]*>", "", page)
    assert "".join(root.itertext()) == text  # not a letter is moved


@pytest.mark.parametrize(
    ("name", "address"),
    [("index.md", "science/glossary.md"), ("use/train.md", "../science/glossary.md"),
     ("science/method.md", "glossary.md"),
     ("develop/decisions/index.md", "../../science/glossary.md")],
)  # fmt: skip
def test_a_link_is_relative_to_its_page_and_shows_the_meaning(module, name, address):
    (one,) = linked(module, "<p>process noise</p>", name).iter("a")
    assert one.get("href") == f"{address}#process-noise" and one.get("title") == "random force"
    (one,) = linked(module, "<p>noise</p>", name).iter("a")
    assert one.get("title") == "what sensors add"


def test_every_word_of_the_glossary_has_its_anchor_once(module):
    text = (DOCS / "science" / "glossary.md").read_text(encoding="utf-8")
    found = module.meanings(text)
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    assert len(found) >= len(rows) - 2 * text.count("| word |")
    assert len({module.slug(word) for word in found}) == len(found)
    assert {word.lower() for word in found} >= module.EVERYDAY
    page = "".join(
        f"<tr><td>{w}</td><td>{m}</td></tr>" for w, m in (("L_pp/U", "a"), ("a, b", "c"))
    )
    root = ElementTree.fromstring(f"<table><tr><th>word</th></tr>{page}</table>")
    module.add_anchors(root)
    anchors = [one.get("id") for one in root.iter() if one.get("id")]
    assert anchors == ["l_pp-u", "a", "b"]
