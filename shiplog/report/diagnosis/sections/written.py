"""A section as JSON: its fields in their order, those left out that are None."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass
from typing import Any


def as_json(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        every = ((one.name, getattr(value, one.name)) for one in fields(value))
        return {name: as_json(part) for name, part in every if part is not None}
    if isinstance(value, Mapping):
        return {name: as_json(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(part) for part in value]
    return value


def bullets(title: str, lines: Collection[str]) -> list[str]:
    """Lines of a page: a heading and a list under it; nothing without one."""
    return [f"## {title}", "", *(f"- {line}" for line in lines), ""] if lines else []
