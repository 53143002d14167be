"""Of the site: on each page the first use of a word of the glossary leads there, and shows its
meaning where a pointer rests on it."""

from __future__ import annotations

import posixpath
import re
import typing
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

GLOSSARY = "science/glossary.md"
# Words that pages use in their everyday sense, too: a link would mislead.
EVERYDAY = {
    "part", "mark", "usable", "stretch", "state", "l", "run", "spread", "band", "interval", "gain",
    "explained", "external", "family", "significant", "trace", "converges", "diverges", "finding",
    "conditional on",
}  # fmt: skip
NO_LINK = {"a", "code", "pre", "h1", "h2", "h3", "h4", "h5", "h6", "th", "strong", "img"}
ROW = re.compile(r"^\| (?!word \||---)([^|]+) \| (.+) \|$", re.MULTILINE)
LINK = re.compile(r"\[([^]]*)\]\([^)]*\)")  # text of a link in Markdown
LONGEST = 300  # letters of a meaning


class Links:
    """Where a page's first uses lead. `linked` are the words that have their link."""

    def __init__(self, meanings: Mapping[str, str]) -> None:
        self.meanings = {w: m for w, m in meanings.items() if w.lower() not in EVERYDAY}
        # the longest first: "process noise" is not "noise"
        words = "|".join(re.escape(w) for w in sorted(self.meanings, key=len, reverse=True))
        self._any = re.compile(rf"(?<![\w-])({words})(e?s)?(?![\w-])", re.IGNORECASE)
        self._word = {word.lower(): word for word in self.meanings}
        self.page = ""
        self.linked: set[str] = set()

    def begin(self, page: str) -> None:
        """Another page."""
        self.page, self.linked = page, set()

    def pieces(self, text: str) -> Iterator[tuple[str, str]]:
        """The text in pieces, each with the word that it is the first use of, or without any."""
        end = 0
        for found in self._any.finditer(text):
            word = self._word[found[1].lower()]
            if word in self.linked:
                continue
            self.linked.add(word)
            yield text[end : found.start()], ""
            yield found[0], word
            end = found.end()
        yield text[end:], ""

    def link(self, element: Element) -> None:
        """Put the links into an element and all in it."""
        if element.tag in NO_LINK:
            return
        inside = list(element)
        self._put(element, 0, element.text or "")
        for child in inside:
            self.link(child)
            tail, child.tail = child.tail or "", ""
            self._put(element, list(element).index(child) + 1, tail)

    def _put(self, element: Element, place: int, text: str) -> None:
        """Text and links before an element's child number `place`."""
        last = element[place - 1] if place else None
        for piece, word in self.pieces(text):
            if word:
                here = posixpath.relpath(GLOSSARY, posixpath.dirname(self.page) or ".")
                last = Element("a", href=f"{here}#{slug(word)}", title=self.meanings[word])
                last.set("class", "glossary")
                last.text = piece
                element.insert(place, last)
                place += 1
            elif last is None:
                element.text = piece
            else:
                last.tail = piece


def slug(word: str) -> str:
    """Anchor of a word."""
    return re.sub(r"\W+", "-", word.lower()).strip("-")


def meanings(glossary: str) -> dict[str, str]:
    """Word → its meaning, from the glossary's tables; words of one row are apart by commas."""
    found = {}
    for words, meaning in ROW.findall(glossary):
        text = re.sub(r"[*`]", "", LINK.sub(r"\1", meaning)).replace("\\|", "|")
        text = text if len(text) <= LONGEST else text[:LONGEST].rsplit(" ", 1)[0] + " ..."
        found |= {word.strip(): text for word in words.split(",")}
    return found


def add_anchors(root: Element) -> None:
    """On the glossary's own page, an anchor for each word."""
    for row in root.iter("tr"):
        cell = row[0]
        if cell.tag == "td":
            first, *more = "".join(cell.itertext()).split(",")
            cell.set("id", slug(first))
            for word in more:
                cell.append(Element("span", id=slug(word)))


LINKS = Links(meanings((Path(__file__).parent / GLOSSARY).read_text(encoding="utf-8")))


def on_config(config: typing.Any) -> None:
    """mkdocs calls it first."""
    from markdown.extensions import Extension
    from markdown.treeprocessors import Treeprocessor

    class Words(Treeprocessor):
        def run(self, root: Element) -> None:
            add_anchors(root) if LINKS.page == GLOSSARY else LINKS.link(root)

    class Glossary(Extension):
        def extendMarkdown(self, md: typing.Any) -> None:
            # after Markdown within lines (20), before mkdocs makes addresses of files (0)
            md.treeprocessors.register(Words(md), "glossary", 5)

    config["markdown_extensions"].append(Glossary())


def on_page_markdown(_markdown: str, page: typing.Any, **_: object) -> None:
    """mkdocs calls it with every page, before its Markdown is read."""
    LINKS.begin(page.file.src_uri)
