"""How pictures look: one size, one font, and the colours of `report.colours`.

A picture is drawn on one pair of axes, as wide as half a page. A page puts two next to each
other; on a phone each has the whole width, and its letters stay as large.
"""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shiplog.machine import files
from shiplog.report import colours

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

WIDTH = 4.0  # inches: at 72 points an inch less than a phone's screen, so letters are no smaller
HEIGHT = 2.75  # inches
POINTS = 900  # of a line: about two for each point of its width on a screen
RULES: dict[Any, Any] = {
    "font.size": 8.5, "font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"],
    "axes.linewidth": 0.6, "axes.titlesize": 9.0, "axes.titleweight": "bold",
    "axes.titlelocation": "left", "axes.spines.top": False, "axes.spines.right": False,
    "axes.edgecolor": colours.web(colours.TEXT), "text.color": colours.web(colours.TEXT),
    "lines.linewidth": 1.2, "legend.frameon": False, "legend.fontsize": 7.5,
    "xtick.labelsize": 7.5, "ytick.labelsize": 7.5, "savefig.dpi": 200.0, "svg.fonttype": "none",
    "svg.hashsalt": "shiplog",  # the same file from the same data
    "path.simplify_threshold": 0.5, "savefig.facecolor": "white", "figure.facecolor": "white",
    "text.parse_math": False,  # a name with two dollar signs is a name
}  # fmt: skip
KINDS = ("svg", "pdf", "png")
# Whatever the reader has: the widths were set with DejaVu Sans, which is wider than most.
FONTS = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', Arial, sans-serif"


@contextmanager
def styled(rules: Mapping[Any, Any] = RULES) -> Iterator[None]:
    """matplotlib with these rules; the host's settings stay. A letter that the font lacks is drawn
    as a box without a warning: in an SVG the reader's own font has it."""
    import matplotlib

    with matplotlib.rc_context(dict(rules)), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")
        yield


def plain_log(axis: Axis) -> None:
    """Labels of a logarithmic axis as 100 and 1000: powers would be formulas, which no text is.

    Between powers of ten there are labels at 2 and 5 where the axis has hardly one power, and at
    every tick where it may have none of these.
    """

    def between(value: float, _: float) -> str:
        low, high = sorted(axis.get_view_interval())
        digit = round(value / 10.0 ** math.floor(math.log10(value)))
        wanted = high < 3.0 * low or (high < 20.0 * low and digit in (2, 5))
        return f"{value:g}" if wanted else ""

    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_formatter(between)


@contextmanager
def drawing(width: float = WIDTH, height: float = HEIGHT) -> Iterator[Figure]:
    """An empty figure in this style, without a window."""
    from matplotlib.figure import Figure

    with styled():
        yield Figure(figsize=(width, height), layout="constrained")


def svg(figure: Figure, prefix: str) -> str:
    """The figure as an element of a page: `<svg …>`, its ids with a prefix of their own.

    Ids of two figures would be alike, since they follow from what is drawn.
    """
    made = io.StringIO()
    with styled():
        arrange(figure)
        figure.savefig(made, format="svg", metadata={"Date": None, "Creator": None})
    return inline(made.getvalue(), prefix)


def arrange(figure: Figure) -> None:
    """Lay it out, once: matplotlib would do so in a drawing before the drawing."""
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)


def inline(text: str, prefix: str) -> str:
    """A file of matplotlib's as such an element."""
    text = text[text.index("<svg") :]
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'<svg ([^>]*?)width="[^"]*" ?', r"<svg \1", text, count=1)
    text = re.sub(r'<svg ([^>]*?)height="[^"]*" ?', r"<svg \1", text, count=1)
    text = re.sub(r"<[^>]+>", lambda tag: _tag(tag[0], prefix), text)  # and no text between tags
    return re.sub(r"\n\s*", "\n", text).strip()


def _tag(tag: str, prefix: str) -> str:
    """An element with ids of its own, and places to a tenth of a point: less cannot be seen."""
    tag = re.sub(r'\bid="', f'id="{prefix}-', tag)
    tag = re.sub(r'href="#', f'href="#{prefix}-', tag)
    tag = re.sub(r"url\(#", f"url(#{prefix}-", tag)
    tag = re.sub(r"(font: [^;\"]*?)'DejaVu Sans'[^;\"]*", rf"\1{FONTS}", tag)
    return re.sub(r'\b(?:d|x|y|points|transform)="[^"]*"', _rounded, tag)


def _rounded(attribute: re.Match[str]) -> str:
    return re.sub(r"(\d\.\d)\d+", r"\1", attribute[0])


def write(figure: Figure, path: Path) -> list[Path]:
    """PATH.svg, PATH.pdf and PATH.png, each whole or not at all."""
    made = []
    with styled():
        arrange(figure)
        for kind in KINDS:
            facts = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind, {})
            to = path.with_name(f"{path.name}.{kind}")
            with files.whole(to) as partial:
                figure.savefig(partial, format=kind, metadata=facts)
            made.append(to)
    return made


def thinned(time: np.ndarray, *values: np.ndarray) -> list[np.ndarray]:
    """Time [n] and values [n], few enough for a picture: of each stretch of the width the rows with
    the least and the largest value stay, so that no peak is lost. Gaps (NaN) stay gaps."""
    count = len(time)
    if count <= POINTS:
        return [time, *values]
    blocks = np.array_split(np.arange(count), POINTS // (2 * len(values)))
    keep: set[int] = {0, count - 1}
    for block in blocks:
        for value in values:
            part = value[block]
            there = np.flatnonzero(np.isfinite(part))
            if len(there) < len(part):
                keep.add(int(block[np.flatnonzero(~np.isfinite(part))[0]]))
            if len(there):
                own = part[there]
                keep |= {int(block[there[own.argmin()]]), int(block[there[own.argmax()]])}
    rows = np.array(sorted(keep))
    return [time[rows], *(value[rows] for value in values)]


def short(name: str, most: int) -> str:
    """So many letters at most; of a long name the middle is left out: recorders' names differ at
    their ends."""
    if len(name) <= most:
        return name
    head = 2 * (most - 1) // 5
    return f"{name[:head]}…{name[head + 1 - most :]}"


def empty(axes: Axes, why: str) -> None:
    """Axes that say why nothing is drawn on them."""
    axes.set_axis_off()
    axes.text(0.5, 0.5, why, ha="center", va="center", wrap=True, transform=axes.transAxes)
