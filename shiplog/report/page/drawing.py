"""Pictures of a result as blocks of its page."""

from __future__ import annotations

from collections.abc import Sequence

from shiplog.report.figures import pictures, style
from shiplog.report.figures.content import Content
from shiplog.report.page.blocks import Drawn


def gallery(content: Content, names: Sequence[str], voyage: str | None = None) -> list[Drawn]:
    """Those of these pictures that have something to draw; of one voyage, with its name."""
    found = []
    own = content if voyage is None else pictures.of_voyage(content, voyage)
    place = "" if voyage is None else f"-{content.data.names.index(voyage) + 1}"
    for name in names:
        picture = pictures.PICTURES[name]
        table = picture.table(own)
        if table.is_empty():
            continue
        svg = style.svg(pictures.figure(name, own), f"{name}{place}")
        caption = picture.title if voyage is None else f"{picture.title}, {voyage}"
        found.append(Drawn(svg, picture.words(table, own), caption))
    return found
