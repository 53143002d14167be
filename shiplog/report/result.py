"""What a command says: text for a person, JSON for a machine; some results hold frames, too.

Each command has one frozen result. The command line prints it, and `import shiplog` returns it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

from shiplog.report.evaluation.text_table import inert


class Result(Protocol):
    """`text` as the command prints it, `json` as --json writes it."""

    @property
    def text(self) -> str: ...

    @property
    def json(self) -> dict: ...


class Printed:
    """A result that prints as its text; a notebook shows that as Markdown."""

    def __str__(self: Result) -> str:
        return self.text

    def _repr_markdown_(self) -> str:
        return inert(str(self))


@dataclass(frozen=True, repr=False)
class Answer(Printed):
    """A result without frames.

    complete   whether nothing of what it was to write was lost
    """

    text: str
    json: dict
    complete: bool = True

    def after(self, warning: str, **facts: object) -> Answer:
        """The same after a warning, with facts for a machine; as it is without a warning."""
        if not warning:
            return self
        return replace(self, text=f"{warning}\n{self.text}", json=self.json | facts)
