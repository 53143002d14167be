"""Templates filled in: text of this package, with what is known of a ship at each @WORD@."""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib import resources

WORD = re.compile(r"@([A-Z_0-9]+)@")
_UNSAFE = re.compile(r"[^\w .,:;()+\-=/%']", re.ASCII)


def filled(template: str, words: Mapping[str, str], given: bool = False) -> str:
    """The text of a file of `templates`, `around_given`. Raises KeyError for a word that is not
    given."""
    text = resources.files("shiplog.export").joinpath("templates", template).read_text("utf-8")
    return replaced(around_given(text, given), words)


_GIVEN = re.compile(r"^#ifdef GIVEN\n(.*?)^#endif\n", re.MULTILINE | re.DOTALL)


def around_given(text: str, given: bool) -> str:
    """C with the lines between `#ifdef GIVEN` and `#endif`, which are of an FMU with another one
    in it, or without them: nothing that a ship does not need stands in its source."""
    return _GIVEN.sub(r"\1" if given else "", text)


def replaced(text: str, words: Mapping[str, str]) -> str:
    """Words may contain words, such as an expression the ship's name."""
    while WORD.search(text):
        text = WORD.sub(lambda found: words[found[1]], text)
    return text


def inert(text: str) -> str:
    """A stranger's text as a comment of any language, on one line: it can end none."""
    return _UNSAFE.sub("?", text).replace("*/", "* /").replace("/*", "/ *")[:200]
