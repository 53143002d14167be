"""The window that tells most, and how far off the simulation is as a window goes on."""

from __future__ import annotations

from shiplog.report.figures.chart import closeup_window
from shiplog.report.page.blocks import Block, Command, Fold, Gallery, Paragraph, moment
from shiplog.report.page.diagnosis.source import Source

FIRST = ("closeup", "position_error", "heading_error", "channels")
MOST_TRACKS = 6  # voyages with a chart of their own on the page


def blocks(source: Source) -> list[Block]:
    drawn = source.gallery(FIRST)
    if not drawn:
        return [Paragraph(["Nothing was simulated: there is no window to look at."])]
    found: list[Block] = [Gallery(drawn)]
    if (chosen := closeup_window(source.content.data)) is not None:
        voyage, window = chosen
        own = source.content.data.errors.filter(voyage=voyage, window=window).head(1)
        found.append(Paragraph(["See this window in the recording:"]))
        found.append(opening(source, voyage, float(own["time"][0])))
    names = source.content.data.names
    tracks = [d for name in names[:MOST_TRACKS] for d in source.gallery(("track",), name)]
    if tracks:
        title = "Tracks of every voyage" if len(names) <= MOST_TRACKS else "Tracks of six voyages"
        found.append(Fold(title, [Gallery(tracks)]))
    return found


def opening(source: Source, voyage: str, seconds: float) -> Command:
    """The command that opens this run's comparison at a moment."""
    run = source.provenance.get("run_path") or source.subject["run"]
    return moment([run], source.provenance.get("store_path") or "store", voyage, seconds)
