"""Measured against simulated in Rerun. Only this package imports Rerun, when it is needed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from shiplog.report.viewer.comparison_data import ComparisonData, DrawnActuator
from shiplog.report.viewer.diagnosis_data import Exhibit
from shiplog.report.viewer.native import RERUN, Served, open_viewer, serve

__all__ = [
    "RERUN",
    "ComparisonData",
    "DrawnActuator",
    "Exhibit",
    "Served",
    "open_viewer",
    "save",
    "save_album",
    "save_diagnosis",
    "serve",
]  # fmt: skip


def save(comparison: ComparisonData, path: str | Path) -> None:
    """Write the comparison as an .rrd, under a temporary name until it is whole."""
    from shiplog.report.viewer import (
        recording,  # half a second of imports that most commands never need
    )

    recording.write(comparison, Path(path))


def save_album(title: str, text: str, pictures: Mapping[str, Path], path: str | Path) -> None:
    """Write a text and pictures, name → PNG file, as an .rrd with a tab each."""
    from shiplog.report.viewer import album

    album.write(title, text, pictures, Path(path))


def save_diagnosis(exhibit: Exhibit, path: str | Path) -> None:
    """Write the pictures of a diagnosis as an .rrd."""
    from shiplog.report.viewer import recording

    recording.write_diagnosis(exhibit, Path(path))
