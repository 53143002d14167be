"""The page docs/start/tour.md: the notebook docs/start/tour.py, executed, with what its cells show.

python -m pipelines.experiments.site.tour --markdown docs/start/tour.md

It takes some minutes, in the folder of the repository, and leaves its runs in ./tour.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import io
from pathlib import Path

import polars as pl

SOURCE = Path("docs/start/tour.py")
CELL = "# %%"
FIRST, LAST, WIDE = 22, 12, 170  # lines that are kept of an output, and letters of a line
HEAD = """\
This page is the notebook `docs/start/tour.py` with what its cells show, written by `python -m
pipelines.experiments.site.tour`. The numbers are of one machine: trainings round differently on
processors of another kind."""


def cells(text: str) -> list[tuple[bool, str]]:
    """Whether a cell is Markdown, and its text, in their order."""
    found = []
    for piece in text.split(CELL)[1:]:
        first, _, rest = piece.partition("\n")
        markdown = "[markdown]" in first
        lines = [line.removeprefix("#").removeprefix(" ") for line in rest.strip().splitlines()]
        found.append((markdown, "\n".join(lines) if markdown else rest.strip()))
    return found


def shown(code: str, names: dict[str, object]) -> str:
    """Executes a cell: what it prints, and what its last expression is, as a notebook has it."""
    *body, last = ast.parse(code).body
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        if isinstance(last, ast.Expr):
            exec(compile(ast.Module(body, []), str(SOURCE), "exec"), names)
            value = eval(compile(ast.Expression(last.value), str(SOURCE), "eval"), names)
            if value is not None:
                print(value)
        else:
            exec(compile(ast.Module([*body, last], []), str(SOURCE), "exec"), names)
    return printed.getvalue().rstrip()


def shortened(output: str) -> str:
    """A long output without its middle, each line no wider than a page."""
    lines = [one if len(one) <= WIDE else f"{one[: WIDE - 2]} …" for one in output.splitlines()]
    if len(lines) > FIRST + LAST + 2:
        cut = len(lines) - FIRST - LAST
        lines = [*lines[:FIRST], f"  … {cut} lines more …", *lines[-LAST:]]
    return "\n".join(lines)


def page(text: str) -> str:
    """The notebook as Markdown."""
    names: dict[str, object] = {}
    parts = []
    with pl.Config(tbl_rows=6, tbl_cols=8, tbl_width_chars=110, fmt_str_lengths=24):
        for markdown, content in cells(text):
            if markdown:
                parts.append(content)
                continue
            parts.append(f"```python\n{content}\n```")
            if output := shown(content, names):
                parts.append(f"```text\n{shortened(output)}\n```")
    title, *rest = parts
    heading, _, after = title.partition("\n")
    return "\n\n".join((heading, HEAD, after.strip(), *rest)) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--markdown", type=Path, default=Path("docs/start/tour.md"))
    path = parser.parse_args().markdown
    path.write_text(page(SOURCE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
