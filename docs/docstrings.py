"""Of the site: equations and tables of arguments in docstrings keep their lines.

A docstring is text. In Markdown a paragraph of equations, or of names each followed by what it is,
would flow into one line: such paragraphs become code.
"""

from __future__ import annotations

import re

import griffe

BESIDE = re.compile(r"\S {3,}\S")  # a column next to another one
EQUATION = re.compile(r"^[^.]{0,60}? = .*[^.:]$")


def kept(paragraph: str) -> bool:
    """Whether a paragraph's lines are to stay as they are."""
    lines = paragraph.splitlines()
    if lines[0].startswith(("- ", "1. ", "|", "    ")):
        return False
    return any(map(BESIDE.search, lines)) or EQUATION.match(lines[0]) is not None


def as_markdown(docstring: str) -> str:
    """With four spaces before each line of such a paragraph."""
    first, *rest = docstring.split("\n\n")
    indented = ("\n".join(f"    {line}" for line in part.splitlines()) if kept(part) else part
                for part in rest if part.strip())  # fmt: skip
    return "\n\n".join((first, *indented))


class Lines(griffe.Extension):
    """Every docstring that the site shows."""

    def on_instance(self, *, obj: griffe.Object, **_: object) -> None:
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)
