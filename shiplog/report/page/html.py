"""A page as HTML: jinja2 with everything escaped but our own drawings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from importlib.resources import files as resources
from pathlib import Path

from shiplog.exceptions import ShiplogError
from shiplog.machine import files
from shiplog.report.evaluation.text_table import one_line
from shiplog.report.page.blocks import Number, Page

TEMPLATE, STYLE = "page.html.j2", "page.css"


def render(page: Page) -> str:
    """The whole document."""
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    folder = resources("shiplog.report.page").joinpath("templates")
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["line"] = _line
    environment.tests["of_kind"] = lambda block, kind: type(block).__name__ == kind
    template = environment.from_string(folder.joinpath(TEMPLATE).read_text(encoding="utf-8"))
    style = Markup(folder.joinpath(STYLE).read_text(encoding="utf-8"))  # ours: nothing is filled in
    return template.render(page=page, style=style, svg=Markup) + "\n"


def _line(parts: Sequence[str | Number] | str) -> str:
    """A line of text; of a number its value stands in the attribute of `<data>`, and what stands
    between backticks is code."""
    from markupsafe import Markup, escape

    found = Markup()
    for part in [parts] if isinstance(parts, str) else parts:
        if isinstance(part, str):
            pieces = one_line(part).split("`")
            paired = len(pieces) % 2 == 1
            for i, piece in enumerate(pieces):
                if paired and i % 2:
                    found += Markup("<code>{}</code>").format(piece)
                else:
                    found += escape(piece if paired or i == 0 else f"`{piece}")
        else:
            found += Markup('<data value="{}">{}</data>').format(repr(float(part.value)), part.text)
    return found


def write(page: Page, path: Path) -> Path:
    """The page as a file, whole or not at all. Raises ShiplogError where it cannot be written."""
    text = render(page)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        files.write_text(path, text)
    except OSError as error:
        raise ShiplogError(
            f"The page {path} could not be written: {error.strerror}.",
            hint="give a file in a folder that can be written.",
        ) from error
    return path


def facts(page: Page) -> dict:
    """The page's blocks as plain values: what a test compares with a result's JSON."""
    return asdict(page)
