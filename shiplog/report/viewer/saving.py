"""What `compare --save FILE` writes: what the file's ending says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from shiplog.exceptions import ShiplogError
from shiplog.report.viewer.comparison_data import ComparisonData

Writer = Callable[[ComparisonData, Path], None]


def _recording(comparison: ComparisonData, path: Path) -> None:
    from shiplog.report.viewer import recording

    recording.write(comparison, path)


def _picture(comparison: ComparisonData, path: Path) -> None:
    from shiplog.report.viewer import still

    still.write(comparison, path)


PAGE = ".html"  # which `report/page/` makes of an evaluation
WRITERS: dict[str, Writer] = {".rrd": _recording, ".png": _picture, ".svg": _picture}
NAMES = {".rrd": "Recording", ".png": "Picture", ".svg": "Picture", PAGE: "Page"}


def check(path: Path) -> None:
    """Raises ShiplogError for an ending that nothing is written as, before the work."""
    if path.suffix.lower() not in NAMES:
        endings = ", ".join(NAMES)
        what = f"ends in {path.suffix!r}" if path.suffix else "has no ending"
        raise ShiplogError(
            f"--save {path} {what}, which says of no kind of file.",
            hint=f"end its name in one of {endings}: a recording, a picture or a page.",
        )


def write(comparison: ComparisonData, path: Path) -> None:
    """Whole or not at all. Raises ShiplogError where the file cannot be written."""
    check(path)
    try:
        WRITERS[path.suffix.lower()](comparison, path)
    except OSError as error:
        raise ShiplogError(
            f"{path} could not be written: {error.strerror or error}.",
            hint="is the disk full, is the folder writable?",
        ) from error
