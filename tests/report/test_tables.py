"""What a log's health is in a few lines."""

from shiplog.logs.health.health_report import Finding, VoyageReport
from shiplog.report.evaluation import tables


def test_counts_are_no_seconds():
    """Four stretches of 10 s, and twelve brief ones, of which the finding is a number of times."""
    held = [
        Finding("held", "gyro", f"gyro repeats for 10.0 s from {t:.1f} s.", t, t + 10.0, 10.0,
                unit="s")
        for t in (0.0, 50.0, 100.0, 150.0)
    ]  # fmt: skip
    brief = Finding("held", "gyro", "gyro repeats itself briefly.", value=12.0, unit="times")
    report = VoyageReport("trip", 10, 0, 1, 200.0, (*held, brief))
    lines = tables.voyage_lines(report)
    assert lines[1].startswith("  held: gyro, 40.0 s in all; most: gyro repeats for 10.0 s")


def test_one_line_more_is_one_line():
    findings = [Finding("spike", f"sensor {i}", "One spike.") for i in range(17)]
    lines = tables.voyage_lines(VoyageReport("trip", 1, 0, 1, 200.0, tuple(findings)))
    assert lines[0].startswith("trip: 1 message read, 0 lost; ")
    assert lines[-2:] == ["  and 1 more line.", "  all of them, one by one, with --json."]
