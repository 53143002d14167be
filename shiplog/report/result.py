"""What a command says: text for a person, JSON for a machine; some results hold frames, too.

Each command has one frozen result. The command line prints it, and `import shiplog` returns it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from shiplog.report.evaluation.text_table import inert


class Result(Protocol):
    """`text` as the command prints it, in `lines`, some of which are tables; `json` as --json
    writes it."""

    @property
    def lines(self) -> Sequence[str]: ...

    @property
    def text(self) -> str: ...

    @property
    def json(self) -> dict: ...


class Printed:
    """A result that prints as its text; a notebook shows that as Markdown."""

    @property
    def text(self) -> str:
        return "\n".join(self.lines)  # type: ignore[attr-defined]  # of a Result

    def __str__(self) -> str:
        return self.text

    def _repr_markdown_(self) -> str:
        return inert(str(self))


@dataclass(frozen=True, repr=False)
class Answer(Printed):
    """A result without frames.

    complete   whether nothing of what it was to write was lost
    """

    lines: Sequence[str]
    json: dict
    complete: bool = True

    def after(self, warning: str, **facts: object) -> Answer:
        """The same after a warning, with facts for a machine; as it is without a warning."""
        if not warning:
            return self
        return replace(self, lines=(warning, *self.lines), json=self.json | facts)
