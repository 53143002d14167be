"""Recordings are written whole, and the viewer shows them, on this machine only."""

import sys
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from shiplog.exceptions import ShiplogError
from shiplog.report import viewer
from shiplog.report.viewer import (
    histogram,
    native,
)

ROOT = Path(__file__).parents[2]


def test_what_cannot_be_written_whole_is_not_there(compared, tmp_path, monkeypatch):
    def fails(recording, comparison):
        raise RuntimeError("the disk is full")

    monkeypatch.setattr(histogram, "send", fails)
    with pytest.raises(RuntimeError, match="disk"):
        viewer.save(compared, tmp_path / "compare.rrd")
    assert not list(tmp_path.iterdir())


def test_a_disk_that_is_full_is_reported_and_leaves_no_half_a_recording(compared, tmp_path):
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        with pytest.raises(ShiplogError, match="could not be written"):
            viewer.save(compared, tmp_path / "compare.rrd")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not list(tmp_path.iterdir())


def test_without_a_display_the_viewer_says_what_to_do(saved, monkeypatch):
    monkeypatch.setattr(native.sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(ShiplogError, match="No display") as output:
        viewer.open_viewer(saved)
    assert "--save" in output.value.hint and "--web" in output.value.hint


def test_a_recording_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ShiplogError, match=r"missing\.rrd"):
        viewer.serve(tmp_path / "missing.rrd")


@pytest.mark.parametrize("how", ["window", "web"])
def test_every_program_is_made_to_listen_on_this_machine_only(saved, monkeypatch, how):
    started = []

    class Program:
        def __init__(self, command, **_settings):
            started.append(command)
            raise RuntimeError("not started")

    monkeypatch.setattr(native.subprocess, "Popen", Program)
    monkeypatch.setenv("DISPLAY", ":0")
    with pytest.raises(RuntimeError, match="not started"):
        viewer.open_viewer(saved) if how == "window" else viewer.serve(saved, port=0)
    ((*_, option, address),) = started
    assert (option, address) == ("--bind", "127.0.0.1")


def test_a_server_that_does_not_start_names_a_viewer_of_this_machine_only(saved, monkeypatch):
    monkeypatch.setattr(native, "_program", lambda: Path(sys.executable))  # reads no recording
    with pytest.raises(ShiplogError, match="did not start") as output:
        viewer.serve(saved, port=0)
    assert "`rerun --bind 127.0.0.1 FILE.rrd`" in output.value.hint


@pytest.mark.viewer
def test_a_letter_that_the_font_lacks_is_said_in_a_sentence(compared, tmp_path, no_viewer):
    from shiplog.report.viewer.screenshot import screenshot

    named = compared.measured.with_columns(pl.col("voyage").replace("harbour", "船"))
    path = tmp_path / "ship.rrd"
    viewer.save(replace(compared, measured=named), path)
    with pytest.raises(ShiplogError) as error:
        screenshot(path, tmp_path / "ship.png")
    if "did not start" in error.value.message:
        no_viewer(f"no headless viewer here: {error.value.message}")
    assert "has no letter '船'" in error.value.message
    assert not (tmp_path / "ship.png").exists()


@pytest.mark.long
@pytest.mark.viewer
def test_the_viewer_shows_every_view_without_complaint(saved, tmp_path, no_viewer):
    from shiplog.report.viewer.screenshot import screenshot

    try:
        state = screenshot(saved, tmp_path / "viewer.png", time_s=100.0)
    except ShiplogError as error:
        no_viewer(f"no headless viewer here: {error.message}")
    names = {view.name for view in state.views}
    for name in (
        "position error [m], dots: window starts", "heading error [deg]", "surge u [m/s]",
        "sway v_m [m/s]", "yaw rate r [deg/s]", "heading ψ [deg]", "rudder [deg]",
        "propeller [rev/s]", "apparent wind speed U_A [m/s]", "Report",
        "Apparent wind, training [rows, log scale]", "Apparent wind, test [rows, log scale]",
        "surge u [m/s]: log10(1 + rows)",
    ):  # fmt: skip
        assert name in names, name
    assert any(name.startswith("Track [m], hull every") for name in names)
    assert not [report for view in state.views for report in view.reports]
    (recording,) = [r for r in state.recordings if r.timelines]
    (time,) = [t for t in recording.timelines if t.name == "sim_time"]
    assert (time.start, time.end) == (0, 200_000_000_000)
    assert (tmp_path / "viewer.png").stat().st_size > 50_000
