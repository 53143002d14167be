"""The keys of a profile whose line still says CHECK.

A comment is lost when TOML is parsed, so the lines themselves are read: a draft writes one key a
line, and what it is not sure of in a comment after it.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator

from shiplog.exceptions import ProfileError

CHECK = re.compile(r"\bCHECK\b")
_TEXT = r'"(?:[^"\\]|\\.)*"|\'[^\']*\''
_COMMENT = re.compile(rf"^((?:[^#\"']|{_TEXT})*)(#.*)$")  # no # within quotation marks
_PART = rf"(?:{_TEXT}|[A-Za-z0-9_-]+)"
_KEY = re.compile(rf"^\s*({_PART}(?:\s*\.\s*{_PART})*)\s*=")
_SECTION = re.compile(rf"^\s*\[\[?\s*({_PART}(?:\s*\.\s*{_PART})*)\s*\]\]?\s*$")
_NAME = re.compile(rf"^\s*name\s*=\s*({_TEXT})")


def unchecked_lines(text: str) -> tuple[str, ...]:
    """Dotted names, such as `ship.length_m`, `actuators.rudder.position_m` and `table.COLUMN`.

    text  valid TOML. A key of an actuator goes by the actuator's name, where it has one. A line
    that is a comment throughout gives no value, and is none.
    """
    found: dict[str, None] = {}
    for section, names in _sections(text.splitlines()):
        for name in names:
            found.setdefault(".".join(filter(None, (section, name))))
    return tuple(found)


def _sections(lines: list[str]) -> Iterator[tuple[str, list[str]]]:
    """(name of a section, its keys whose line says CHECK; "" where its own line does)."""
    section, of_array, names, key = "", "", [], ""
    for line in lines:
        code, comment = _parted(line)
        says = bool(CHECK.search(comment))
        if header := _SECTION.match(code):
            yield section, names
            section = ".".join(_path(header[1]))
            of_array, names, key = section if code.lstrip().startswith("[[") else "", [], ""
            if says:
                names.append("")
            continue
        if named := _KEY.match(code):
            key = ".".join(_path(named[1]))
        if of_array and (called := _NAME.match(code)):
            section = f"{of_array}.{tomllib.loads(f'_ = {called[1]}')['_']}"
        if says and code.strip():
            names.append(key)
    yield section, names


def _parted(line: str) -> tuple[str, str]:
    """What a line says, and its comment."""
    found = _COMMENT.match(line)
    return (found[1], found[2]) if found else (line, "")


def _path(key: str) -> list[str]:
    """The parts of a dotted key."""
    part, parts = tomllib.loads(f"{key} = 0"), []
    while isinstance(part, dict):
        ((name, part),) = part.items()
        parts.append(name)
    return parts


def refuse_key(content: dict, source: str) -> None:
    """Raises ProfileError where `unchecked` stands as a key: it is worked out of the comments."""
    if "unchecked" in content:
        raise ProfileError(
            f"The profile {source} cannot be used: unchecked is not a known key.",
            hint="leave it out: a line that is not looked over yet says CHECK in a comment.",
        )
