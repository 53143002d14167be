"""What a watch needs of its run is worked out in a child the first time, and read after that."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from shiplog.live import nominal, preparation

RUN: Any = "run"  # that nobody looks into
STORE: Any = SimpleNamespace(path=Path("store"))
PLACE = Path("runs/mmg")


@pytest.fixture
def asked(monkeypatch):
    """What was asked for, in order; nothing is fitted."""
    found: list[str] = []
    kept = {"there": False}

    class Whole:
        def without_segments(self):
            found.append("without segments")
            return "small"

    def child(path, store):
        found.append(f"child of {path} and {store}")
        kept["there"] = True

    monkeypatch.setattr(preparation, "_in_child", child)
    monkeypatch.setattr(nominal, "is_kept", lambda run, store: kept["there"])
    monkeypatch.setattr(nominal, "nominal", lambda run, store: Whole())
    monkeypatch.setattr(preparation.calibration, "calibrated", lambda of: "thresholds")
    monkeypatch.setattr(preparation.memory, "give_back", lambda: found.append("given back"))
    return found


def test_the_first_watch_of_a_run_has_its_campaign_fitted_by_a_child(asked):
    first = preparation.campaign_of(RUN, PLACE, STORE)
    again = preparation.campaign_of(RUN, PLACE, STORE)
    assert first == again == ("small", "thresholds")
    assert asked == [
        "child of runs/mmg and store", "without segments", "given back", "without segments",
        "given back",
    ]  # fmt: skip


def test_a_child_that_ends_is_no_fault(monkeypatch):
    """The watch then does it itself, where an error is said."""

    class Gone:
        def send(self, what):
            raise BrokenPipeError

        def close(self):
            pass

        def join(self, seconds):
            pass

    monkeypatch.setattr(preparation.child, "spawn", lambda serve, environment: (Gone(), Gone()))
    preparation._in_child(PLACE, STORE.path)
