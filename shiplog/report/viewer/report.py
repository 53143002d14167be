"""The tables and findings as text, and how the pictures are to be read."""

from __future__ import annotations

import rerun as rr
import rerun.blueprint as rrb

from shiplog.report.evaluation.text_table import inert
from shiplog.report.viewer import display, forces
from shiplog.report.viewer.display import Drawn

LEGEND = """
## How to read the pictures

- Every window starts at the measured state (dots); from there on a model sees only the measured
  actuators and apparent wind.
- Black is measured. A run has one colour in every picture, and one that a diagnosis extended is
  always vermillion. A bold line is the seed whose mean error is the median of its seeds, the pale
  lines are the other seeds (on tracks) or the lowest and highest of all seeds (along time). Of a
  model that knows its doubt the pale lines along time are the 90 % band of its bold line instead,
  except for the errors.
- Errors are how far the simulated ship is from the measured one [m], and how far its heading is
  off, positive to starboard [deg]. The axis of positions ends where the measured track is as wide.
- Hulls are to scale. The earth axes are x₀ north and y₀ east. The arrows are means of the voyage:
  the true wind as it blows, named by where it comes from, and a named current as it sets. The
  apparent wind's angle is where it blows from, clockwise from the bow.
- Headings begin anew at 180 or 360 deg, and so do their lines.
- Histograms are drawn as log10(1 + rows).
"""
FORCES = """- Forces are what {model} says each part exerts, along the measured voyage: surge
  positive ahead, sway to starboard, yaw bow to starboard. The wide dark line is their total.
  Axes leave out spikes: 0.5 % of a part's seconds at either end.
"""


def blueprint(drawn: Drawn, voyage: str | None) -> rrb.View | None:
    """A tab of its own."""
    return rrb.TextDocumentView(origin="/report", name="Report") if voyage is None else None


def send(recording: rr.RecordingStream, drawn: Drawn) -> None:
    """The summary, under the comparison's title."""
    bold = "\n".join(
        f"- {model}: seed {seed} is drawn boldly."
        for model, seed in display.drawn_seeds(drawn).items()
    )
    physical = forces.of_first_model(drawn)["model"].unique().to_list()
    legend = "".join(FORCES.format(model=model) for model in physical)
    text = f"# {drawn.title}\n\n{drawn.summary}\n{LEGEND}{legend}{bold}\n"
    recording.log(
        "/report", rr.TextDocument(inert(text), media_type=rr.MediaType.MARKDOWN), static=True
    )
