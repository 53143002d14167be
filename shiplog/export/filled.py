"""Templates filled in: text of this package, with what is known of a ship at each @WORD@."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib import resources

WORD = re.compile(r"@([A-Z_0-9]+)@")
_UNSAFE = re.compile(r"[^\w .,:;()+\-=/%']", re.ASCII)


def filled(template: str, words: Mapping[str, str]) -> str:
    """The text of a file of `templates`. Raises KeyError for a word that is not given."""
    text = resources.files("shiplog.export").joinpath("templates", template).read_text("utf-8")
    return replaced(text, words)


def replaced(text: str, words: Mapping[str, str]) -> str:
    """Words may contain words, such as an expression the ship's name."""
    while WORD.search(text):
        text = WORD.sub(lambda found: words[found[1]], text)
    return text


def inert(text: str) -> str:
    """A stranger's text as a comment of any language, on one line: it can end none."""
    return _UNSAFE.sub("?", text).replace("*/", "* /").replace("/*", "/ *")[:200]
