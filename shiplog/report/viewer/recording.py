"""One comparison as one Rerun recording: what every view sends, and how they share the screen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from shiplog.exceptions import ShiplogError
from shiplog.machine import files
from shiplog.report.viewer import (
    diagnosis,
    display,
    forces,
    histogram,
    report,
    style,
    timeline,
    trajectory,
)
from shiplog.report.viewer.comparison_data import ComparisonData
from shiplog.report.viewer.diagnosis_data import Exhibit
from shiplog.report.viewer.display import Drawn

# A view sends entities and names its place: with the others of a voyage, or, called without
# a voyage, on a tab of its own.
VIEWS = {
    "trajectory": trajectory,
    "timeline": timeline,
    "forces": forces,
    "histogram": histogram,
    "report": report,
}
LEFT = "trajectory"  # of a voyage's tab


def write(comparison: ComparisonData, path: Path) -> None:
    """The comparison as an .rrd."""
    picture = display.drawn(comparison)
    with whole(comparison.title, layout(picture), path) as recording:
        for view in VIEWS.values():
            view.send(recording, picture)


def write_diagnosis(exhibit: Exhibit, path: Path) -> None:
    """The pictures of a diagnosis as an .rrd."""
    picture = diagnosis.pictured(exhibit)
    with whole(exhibit.title, screen(diagnosis.blueprint(picture)), path) as recording:
        diagnosis.send(recording, picture)


@contextmanager
def whole(title: str, blueprint: rrb.Blueprint, path: Path) -> Iterator[rr.RecordingStream]:
    """Write what is sent meanwhile, whole or not at all.

    It is made in memory: Rerun's own file sink waits for ever on a disk that is full.
    """
    rr.set_strict_mode(True)  # else what Rerun cannot draw is left out with a warning
    recording = rr.RecordingStream("shiplog")
    made = recording.binary_stream()
    recording.send_recording_name(title)
    recording.send_blueprint(blueprint)
    yield recording
    content = made.read() or b""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with files.whole(path) as partial:
            partial.write_bytes(content)
    except OSError as error:
        raise ShiplogError(
            f"The recording {path} could not be written: {error}.",
            hint="is the disk full, is the folder writable?",
        ) from error


def layout(picture: Drawn) -> rrb.Blueprint:
    """A tab a voyage, the track left and time right, then what belongs to no voyage alone. In
    front is the first, or that of the moment at which the recording is opened."""
    tabs: list[rrb.View | rrb.Container] = []
    voyages = picture.voyages
    if (moment := picture.moment) is not None and moment.voyage in voyages[display.MOST_TABS :]:
        voyages = [moment.voyage, *voyages]
    voyages = voyages[: display.MOST_TABS]
    for voyage in voyages:
        parts = {name: view.blueprint(picture, voyage) for name, view in VIEWS.items()}
        track = parts.pop(LEFT)
        assert track is not None
        right = [part for part in parts.values() if part is not None]
        tabs.append(rrb.Horizontal(track, *right, column_shares=[1.0, 1.45], name=voyage))
    own = (view.blueprint(picture, None) for view in VIEWS.values())
    tabs += [part for part in own if part is not None]
    front = voyages.index(moment.voyage) if moment and moment.voyage in voyages else 0
    return screen(tabs, front)


def screen(tabs: Sequence[rrb.View | rrb.Container], front: int = 0) -> rrb.Blueprint:
    """Nothing but these tabs, that one in front, and the time below."""
    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=front),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=style.TIMELINE, play_state="paused"),
        auto_views=False,
        auto_layout=False,
    )
