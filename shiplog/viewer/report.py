"""The tables and findings as text, and how the pictures are to be read."""

from __future__ import annotations

import rerun as rr
import rerun.blueprint as rrb

from shiplog.viewer import display
from shiplog.viewer.display import Drawn

LEGEND = """
## How to read the pictures

- Every window starts at the measured state (dots); from there on a model sees only the measured
  actuators and apparent wind.
- Black is measured. A model has one colour everywhere: its bold line is the seed whose mean error
  is the median of its seeds, the pale lines are the other seeds (on tracks) or the lowest and
  highest of all seeds (along time).
- Hulls are to scale. The earth axes are x₀ north and y₀ east, the wind's angle is where it blows
  from, clockwise from the bow.
- d is the error of Eq. 6; histograms and d are drawn as log10(1 + value).
"""


def blueprint(drawn: Drawn, voyage: str | None) -> rrb.View | None:
    """A tab of its own."""
    return rrb.TextDocumentView(origin="/report", name="Report") if voyage is None else None


def send(recording: rr.RecordingStream, drawn: Drawn) -> None:
    """The summary, under the comparison's title."""
    bold = "\n".join(
        f"- {model}: seed {seed} is drawn boldly."
        for model, seed in display.shown_seeds(drawn).items()
    )
    text = f"# {drawn.title}\n\n{drawn.summary}\n{LEGEND}{bold}\n"
    recording.log("/report", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
