"""A table drawn as wide as the terminal is: no name and no digit is cut.

Where it does not fit, texts break between words; where that does not do either, the columns stand
in several blocks, each with the first column, as pandas and R print wide frames; and where these
would be many, each row stands for itself, a line a cell.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table as RichTable

    from shiplog.report.evaluation.text_table import Table

GAP = 2  # letters between two columns
MOST_BLOCKS = 3  # of one table, beyond which its rows are easier to read one by one
LEAST_OTHER = 14  # letters that the first column leaves to the others
SEAMS = re.compile(r"(?<=[_\-./:,\[\]])")  # where a name is broken that is longer than its column


def drawn(table: Table, width: int) -> list[RenderableType]:
    """The table for so many letters a line: one, several blocks of its columns, or its rows."""
    cells = [list(column) for column in zip(table.head, *table.rows, strict=True)]
    most = max(width - GAP - LEAST_OTHER, 1) if len(cells) > 1 else width
    left = max(width - GAP - min(_word(cells[0]), most), 1)
    limits = [most, *[left] * (len(cells) - 1)]
    fitting = [
        [broken(cell, limit) for cell in column]
        for column, limit in zip(cells, limits, strict=True)
    ]
    blocks = _blocks([_word(column) for column in fitting], width)
    if len(blocks) > MOST_BLOCKS:
        return [_record(table.head, row, width) for row in table.rows]
    return [
        _block([fitting[i] for i in chosen], [table.right[i] for i in chosen], width)
        for chosen in blocks
    ]


def broken(cell: str, limit: int) -> str:
    """With line ends in each word that is wider than `limit`: at a seam of it where there is one
    in its second half, else anywhere."""
    return " ".join("\n".join(_pieces(word, limit)) for word in cell.split(" "))


def _pieces(word: str, limit: int) -> list[str]:
    from rich.cells import cell_len, chop_cells

    pieces = []
    while cell_len(word) > max(limit, 2):  # a Chinese letter is two wide
        most = len(chop_cells(word, max(limit, 2))[0])
        seams = [seam.start() for seam in SEAMS.finditer(word, 1, most + 1)]
        at = max((seam for seam in seams if 2 * seam >= most), default=most)
        pieces.append(word[:at])
        word = word[at:]
    return [*pieces, word]


def _word(cells: Sequence[str]) -> int:
    """Width of the longest word of a column."""
    from rich.cells import cell_len

    return max(cell_len(word) for cell in cells for word in re.split(r"[ \n]", cell))


def _blocks(words: Sequence[int], width: int) -> list[list[int]]:
    """Numbers of the columns that stand together: the first one always, then as many as fit."""
    blocks, used = [[0]], words[0]
    for column in range(1, len(words)):
        if used + GAP + words[column] > width and len(blocks[-1]) > 1:
            blocks.append([0])
            used = words[0]
        blocks[-1].append(column)
        used += GAP + words[column]
    return blocks


def _widths(cells: Sequence[Sequence[str]], width: int) -> list[int]:
    """Of each column: its longest word, and what is left shared out to those that need more."""
    from rich.cells import cell_len

    whole = [
        max(cell_len(line) for cell in column for line in cell.split("\n")) for column in cells
    ]
    widths = [_word(column) for column in cells]
    left = width - sum(widths) - GAP * (len(widths) - 1)
    while left > 0 and widths != whole:
        needs = [want - have for want, have in zip(whole, widths, strict=True)]
        widths[needs.index(max(needs))] += 1
        left -= 1
    return widths


def _block(cells: Sequence[Sequence[str]], right: Sequence[bool], width: int) -> RichTable:
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    block = RichTable(
        box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, padding=(0, 1, 0, 0),
        collapse_padding=True,
    )  # fmt: skip
    for (head, *_), flush, own in zip(cells, right, _widths(cells, width), strict=True):
        block.add_column(
            Text(head), justify="right" if flush else "left", width=own, overflow="fold"
        )
    for row in zip(*(column[1:] for column in cells), strict=True):
        block.add_row(*map(Text, row))
    return block


def _record(head: Sequence[str], row: Sequence[str], width: int) -> RenderableType:
    """The first cell on a line, and below it a line for each of the others."""
    from rich.cells import cell_len
    from rich.console import Group
    from rich.table import Table as RichTable
    from rich.text import Text

    label = min(max(map(cell_len, head[1:])), width // 2)
    value = max(width - label - 2 * GAP, 1)
    others = RichTable.grid(padding=(0, GAP, 0, 0), collapse_padding=True)
    others.add_column(width=GAP - 1)
    others.add_column(width=label, overflow="fold")
    others.add_column(width=value, overflow="fold")
    for title, cell in zip(head[1:], row[1:], strict=True):
        others.add_row("", Text(broken(title, label)), Text(broken(cell, value)))
    return Group(Text(broken(f"{head[0]}: {row[0]}", width), style="bold"), others)
