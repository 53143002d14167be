"""What a command says: text for a person, JSON for a machine; some results hold frames, too.

Each command has one frozen result. The command line prints it, and `import shiplog` returns it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import Any, Protocol

from shiplog.exceptions import ShiplogError
from shiplog.machine import files
from shiplog.machine.paths import check_page
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


@dataclass(frozen=True)
class Shown:
    """How a result is shown; nothing is drawn before it is asked for.

    plots   its pictures, as `figures.plots.Plots`
    page    its page, as HTML
    """

    plots: Callable[[], Any]
    page: Callable[[], str]


NOT_SHOWN = "this result has neither pictures nor a page"
FRAME = '<iframe srcdoc="{}" style="width:100%;height:44rem;border:0" sandbox=""></iframe>'


class Shows(Printed):
    """A result with pictures and a page; a notebook shows the page."""

    shown: Shown | None

    @property
    def plot(self) -> Any:
        """`result.plot()` draws all pictures, `result.plot.<name>(ax=…)` one. Raises
        AttributeError where nothing was compared."""
        return self._shown.plots()

    def report(self, path: str | Path) -> Path:
        """The page as a file, which needs nothing else. Raises ShiplogError where it cannot be
        written."""
        to = check_page(Path(path), "the page")
        try:
            files.write_text(to, self._shown.page())
        except OSError as error:
            raise ShiplogError(
                f"the page {to} could not be written: {error.strerror}.",
                hint="give a file in a folder that can be written.",
            ) from error
        return to

    def _repr_html_(self) -> str | None:
        """In a frame of its own, where nothing of it can run."""
        return None if self.shown is None else FRAME.format(escape(self.shown.page()))

    @property
    def _shown(self) -> Shown:
        if self.shown is None:
            raise AttributeError(NOT_SHOWN)
        return self.shown


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
