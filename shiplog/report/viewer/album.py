"""Pictures and a text as one recording, a tab each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from shiplog.report.evaluation.text_table import inert
from shiplog.report.viewer.recording import whole


def write(title: str, text: str, pictures: Mapping[str, Path], path: Path) -> None:
    """An .rrd with a tab for the Markdown `text` and one for each picture, name → PNG file."""
    tabs: list[rrb.View] = [rrb.TextDocumentView(origin="text", name="summary")]
    tabs += [
        rrb.Spatial2DView(origin=f"figure/{number}", name=name)
        for number, name in enumerate(pictures)
    ]
    blueprint = rrb.Blueprint(
        rrb.Tabs(*tabs), rrb.TimePanel(state="hidden"), rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
    )  # fmt: skip
    with whole(title, blueprint, path) as recording:
        recording.log("text", rr.TextDocument(inert(text), media_type="text/markdown"), static=True)
        for number, picture in enumerate(pictures.values()):
            recording.log(f"figure/{number}", rr.EncodedImage(path=picture), static=True)
