"""How figures look: one size, one font, and for each window set the same colour everywhere."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shiplog.machine import files
from shiplog.report.figures import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 7.1  # inches: two columns of a journal's page
COLOURS = {  # Okabe and Ito (2008), safe for colour-blind eyes; their yellow darkened
    "ref": "#000000", "sli2": "#E69F00", "sli10": "#D55E00", "jit2": "#56B4E9",
    "jit10": "#0072B2", "sli2xjit2": "#CC79A7", "sli10xjit10": "#009E73", "d-ref": "#A89A00",
    "validation": "#8C8C8C", "test": "#5E3C99",
}  # fmt: skip
NAMES = {"sli2xjit2": "sli2 × jit2", "sli10xjit10": "sli10 × jit10"}
MEASURED = "#9A9A9A"
RULES: dict[Any, Any] = style.RULES | {
    "font.size": 8.0, "axes.titlesize": 8.0, "axes.titleweight": "normal",
    "axes.titlelocation": "center", "lines.linewidth": 0.9, "legend.fontsize": 7.0,
    "xtick.labelsize": 7.0, "ytick.labelsize": 7.0,
}  # fmt: skip


def named(of: str) -> str:
    """A set's name as it is printed."""
    return NAMES.get(of, of)


@contextmanager
def figure(height: float, path: Path) -> Iterator[Figure]:
    """A figure of a page's width, `height` inches, written as PATH.svg and PATH.png."""
    from matplotlib.figure import Figure

    with style.styled(RULES):
        drawn = Figure(figsize=(WIDTH, height), layout="constrained")
        yield drawn
        for kind in ("svg", "png"):
            facts = {"Date": None} if kind == "svg" else {}
            with files.whole(path.with_suffix(f".{kind}")) as partial:
                drawn.savefig(partial, format=kind, metadata=facts)
            drawn.set_layout_engine("none")  # laid out once, and alike in both files
