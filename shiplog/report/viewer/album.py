"""Pictures and a text as one recording: all at a glance, and a tab each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from shiplog.report.evaluation.text_table import inert
from shiplog.report.viewer import style
from shiplog.report.viewer.recording import whole

WHITE = [255, 255, 255, 255]  # the ground of the pictures


def write(title: str, text: str, pictures: Mapping[str, Path], path: Path) -> None:
    """An .rrd with the Markdown `text` and all pictures, name → PNG file, and a tab for each."""
    with whole(title, blueprint(list(pictures)), path) as recording:
        recording.log("text", rr.TextDocument(inert(text), media_type="text/markdown"), static=True)
        for number, picture in enumerate(pictures.values()):
            recording.log(f"figure/{number}", rr.EncodedImage(path=picture), static=True)


def blueprint(names: list[str]) -> rrb.Blueprint:
    """The text left and the pictures right, as a reader compares them; then each in full size."""

    def pictures() -> list[rrb.View]:
        return [
            rrb.Spatial2DView(origin=f"figure/{number}", name=name, background=WHITE)
            for number, name in enumerate(names)
        ]

    text = rrb.TextDocumentView(origin="text", name="summary")
    first: rrb.View | rrb.Container = text
    if names:
        grid = rrb.Grid(*pictures(), grid_columns=1 if len(names) == 1 else 2)
        first = rrb.Horizontal(text, grid, column_shares=[1.0, 1.6], name="overview")
    return rrb.Blueprint(
        rrb.Tabs(first, *pictures(), active_tab=0),
        rrb.TimePanel(state="hidden", timeline=style.TIMELINE),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )
