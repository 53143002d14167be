"""Names that somebody else gave, written so that TOML reads the same again."""

from __future__ import annotations

import tomli_w


def quoted(name: str) -> str:
    """A name as a string of TOML: with quotation marks, backslashes or line ends in it, too."""
    return tomli_w.dumps({"_": name}).removeprefix("_ = ").removesuffix("\n")


def in_comment(name: str) -> str:
    """A name in a comment, which ends with its line: what no line can show becomes a space."""
    return "".join(letter if letter.isprintable() else " " for letter in name)
