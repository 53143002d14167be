"""The reliability diagram: how often what is stated with a probability is true.

Murphy & Winkler 1977. Drawn as SVG, which a browser and a repository's page show as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from pipelines.experiments.hidden_effects.goals import cell
from pipelines.experiments.hidden_effects.score import BINS, Statement, bin_of, clopper_pearson
from shiplog.report.evaluation import tables

SIDE, MARGIN, GAP = 240, 50, 40  # px of a panel, around it, and between two


@dataclass(frozen=True, slots=True)
class Bin:
    """Statements of nearly the same probability."""

    low: float
    high: float
    mean: float  # probability
    hits: tuple[bool, ...]

    @property
    def share(self) -> float:
        return sum(self.hits) / len(self.hits)


def bins(statements: Iterable[Statement]) -> list[Bin]:
    """Ten of equal width, as the expected calibration error has them; empty ones are left out."""
    within: dict[int, list[Statement]] = {}
    for probability, right in statements:
        within.setdefault(bin_of(probability), []).append((probability, right))
    return [
        Bin(at / BINS, (at + 1) / BINS, sum(p for p, _ in one) / len(one), tuple(r for _, r in one))
        for at, one in sorted(within.items())
    ]


def table(places: Mapping[str, Sequence[Statement]]) -> str:
    """The same bins in words."""
    rows = [
        (place, f"{one.low:.1f} to {one.high:.1f}", f"{one.mean:.3f}", cell(one.hits))
        for place, statements in places.items()
        for one in bins(statements)
    ]
    return tables.table(("", "reported with", "mean", "true"), rows)


def svg(places: Mapping[str, Sequence[Statement]]) -> str:
    """A panel a place: share true over mean probability, with 90 % intervals and counts."""
    width = 2 * MARGIN + len(places) * SIDE + (len(places) - 1) * GAP
    height = 2 * MARGIN + SIDE
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" height="{height}" font-family="sans-serif" font-size="11">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    for number, (place, statements) in enumerate(places.items()):
        parts += _panel(MARGIN + number * (SIDE + GAP), place, bins(statements))
    return "\n".join([*parts, "</svg>", ""])


def _panel(left: float, title: str, found: Sequence[Bin]) -> list[str]:
    def x(share: float) -> str:
        return f"{left + share * SIDE:.1f}"

    def y(share: float) -> str:
        return f"{MARGIN + (1.0 - share) * SIDE:.1f}"

    def line(a: tuple[float, float], b: tuple[float, float], style: str) -> str:
        return (
            f'<line x1="{x(a[0])}" y1="{y(a[1])}" x2="{x(b[0])}" y2="{y(b[1])}" {style}/>'
        )  # fmt: skip

    def text(at: tuple[str, str], words: str, anchor: str = "middle") -> str:
        return f'<text x="{at[0]}" y="{at[1]}" text-anchor="{anchor}">{words}</text>'

    below, above = f"{MARGIN + SIDE + 16:.1f}", f"{MARGIN - 18:.1f}"
    parts = [
        f'<rect x="{x(0)}" y="{y(1)}" width="{SIDE}" height="{SIDE}" fill="none" stroke="#444"/>',
        line((0, 0), (1, 1), 'stroke="#999" stroke-dasharray="4 3"'),
        text((x(0.5), above), f"{title}: {sum(len(one.hits) for one in found)} statements"),
        text((x(0.5), f"{MARGIN + SIDE + 32:.1f}"), "reported probability"),
        f'<g transform="translate({left - 26:.1f} {y(0.25)}) rotate(-90)">'
        f"{text(('0', '0'), 'share true')}</g>",
    ]
    for tick in (0.0, 0.5, 1.0):
        parts.append(text((x(tick), below), f"{tick:g}"))
        parts.append(text((f"{left - 6:.1f}", y(tick - 0.015)), f"{tick:g}", "end"))
    for one in found:
        low, high = clopper_pearson(sum(one.hits), len(one.hits))
        parts.append(line((one.mean, low), (one.mean, high), 'stroke="#1f5fa8"'))
        parts.append(f'<circle cx="{x(one.mean)}" cy="{y(one.share)}" r="4" fill="#1f5fa8"/>')
        middle = 0.5 * (one.low + one.high)  # two means may meet at an edge
        parts.append(text((x(middle), f"{MARGIN - 4:.1f}"), str(len(one.hits))))
    return parts
