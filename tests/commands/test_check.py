"""One reading of a log gives what a reading of every field and an ingest give."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sailing

from shiplog.commands.prepare import check_logs, expand
from shiplog.logs.reading.check import check, expected_s, health_of
from shiplog.logs.reading.read import read
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest.ingest import consistency_of, ingest

SAMPLES = Path(__file__).parents[2] / "sample_logs"


def cut(folder: Path) -> Path:
    raw = (SAMPLES / "voyage_1.mcap").read_bytes()
    (folder / "cut.mcap").write_bytes(raw[: len(raw) // 2])
    return folder / "cut.mcap"


def late(folder: Path) -> Path:
    """Stamps that step back and repeat, messages that come late, a silence, and a velocity that is
    0.4 s late."""
    parts = sailing.series(400.0)
    time = parts["/velocity"].time
    parts["/velocity"] = replace(parts["/velocity"], time=time + 400_000_000, log_time=time)
    gyro, rudder = parts["/gyro"], parts["/rudder"]
    kept = np.r_[0:100, 300 : len(rudder.time)]
    parts["/rudder"] = replace(
        rudder, time=rudder.time[kept], columns={n: c[kept] for n, c in rudder.columns.items()}
    )
    stamps = gyro.time.copy()
    stamps[50], stamps[70] = stamps[49], stamps[60]
    delay = np.where(np.arange(len(stamps)) % 7 == 0, 2_000_000_000, 80_000_000)
    parts["/gyro"] = replace(gyro, time=stamps, log_time=gyro.time + delay)
    return sailing.write(folder / "late.mcap", parts)


def whole(_folder: Path) -> Path:
    return SAMPLES / "voyage_1.mcap"


SHIPPED = SAMPLES.parent / "shiplog" / "profiles" / "esso-vectwin.toml"
MOVED = SHIPPED.read_text().replace("lever_arm_m = [0.3, 0.0]", "lever_arm_m = [0.8, 0.0]", 1)


@pytest.mark.parametrize(
    ("make", "text", "kinds"),
    [
        (whole, None, set()), (cut, None, {"truncated"}), (whole, MOVED, {"antenna_offset"}),
        (late, sailing.PROFILE, {"gap", "clock_offset", "out_of_order"}),
    ],
)  # fmt: skip
def test_a_check_finds_what_reading_everything_and_ingesting_find(tmp_path, make, text, kinds):
    path, chosen = make(tmp_path), None
    if text is not None:
        chosen = str(tmp_path / "mine.toml")
        Path(chosen).write_text(text)
    (report,) = check_logs([path], chosen).reports
    everything = health_of(read(path))
    assert check(path) == everything
    profile = profiles.load(chosen or "esso-vectwin")
    voyage = ingest(path, profile)
    consistency = consistency_of(read(path, profile.wanted(), others=True), profile, {}).findings
    assert {*consistency} <= {*voyage.report.findings}
    assert report == replace(
        everything,
        findings=(*everything.findings, *consistency),
        not_compared=voyage.report.not_compared,
    )
    assert {finding.kind for finding in report.findings} >= kinds


def test_hidden_files_of_a_folder_are_no_logs(tmp_path):
    """macOS leaves `._a.mcap` next to `a.mcap` on a memory stick."""
    for name in ("b.mcap", "._a.mcap", "a.mcap"):
        (tmp_path / name).write_bytes(b"")
    assert expand([tmp_path]) == [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    (tmp_path / "none").mkdir()
    (tmp_path / "none" / ".mcap").write_bytes(b"")
    assert expand([tmp_path / "none"]) == [tmp_path / "none"]


def test_the_time_that_a_check_takes_is_expected_from_what_the_log_says(tmp_path):
    """Of a log without a summary, and of none, too."""
    sample = SAMPLES / "voyage_2.mcap"  # 106 307 messages: 0.2 s of decoding after the start
    assert 1.0 < expected_s(SAMPLES / "voyage_1.mcap") < expected_s(sample) < 5.0
    assert expected_s(cut(tmp_path)) > 1.0
    assert expected_s(tmp_path / "none.mcap") == 1.0
