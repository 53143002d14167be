"""Tables of a verdict for a paper: CSV and LaTeX."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import polars as pl

from shiplog.machine import files
from shiplog.report.evaluation.text_table import one_line
from shiplog.report.figures import bars, timeline
from shiplog.report.figures.content import Content

PARAMETERS = {
    "cause": pl.String, "parameter": pl.String, "value": pl.Float64, "low": pl.Float64,
    "high": pl.Float64, "unit": pl.String,
}  # fmt: skip


def parameters(content: Content) -> pl.DataFrame:
    """A row a number of a named cause, with its 90 % interval."""
    rows = [
        (bars.spoken(cause["name"]), name, one["value"], one["low"], one["high"], one["unit"])
        for cause in content.verdict["causes"]
        for name, one in cause["parameters"].items()
        if not isinstance(one["value"], str)
    ]
    return pl.DataFrame(rows, PARAMETERS, orient="row")


TABLES: Mapping[str, Callable[[Content], pl.DataFrame]] = {
    "parameters": parameters,
    "ranking": bars.ranking_table,
    "limits": bars.limits_table,
    "channels": bars.channels_table,
    "stretches": timeline.table,
}


def save(content: Content, folder: Path) -> list[Path]:
    """Each table that has rows, as NAME.csv and NAME.tex."""
    made = []
    for name, table_of in TABLES.items():
        table = table_of(content)
        if table.is_empty():
            continue
        files.write_text(folder / f"{name}.csv", table.write_csv())
        files.write_text(folder / f"{name}.tex", latex(table))
        made += [folder / f"{name}.csv", folder / f"{name}.tex"]
    return made


def latex(table: pl.DataFrame) -> str:
    """A `tabular` with the rules of booktabs; what LaTeX would take as its own is escaped."""
    from tabulate import tabulate

    rows = [[_cell(value) for value in row] for row in table.iter_rows()]
    head = [name.replace("_", " ") for name in table.columns]
    return tabulate(rows, head, tablefmt="latex_booktabs", disable_numparse=True) + "\n"


def _cell(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else one_line(str(value))
