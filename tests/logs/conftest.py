"""A whole log, and readers that give every log to Rerun."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_logs import protobuf_log

from shiplog.logs.reading import preflight, rerun_route
from shiplog.logs.reading.read import read


@pytest.fixture(scope="module")
def good(tmp_path_factory) -> Path:
    return protobuf_log(tmp_path_factory.mktemp("logs") / "good.mcap")


@pytest.fixture
def by_rerun(monkeypatch):
    """Every log that may is given to Rerun, however small; says which topics it then gave."""
    given: list[str] = []
    whole = rerun_route.read_most

    def watched(*arguments):
        done = whole(*arguments)
        given.extend(done)
        return done

    monkeypatch.setattr(rerun_route, "LEAST_MESSAGES", 0)
    monkeypatch.setattr(rerun_route, "LEAST_WARM", 0)
    monkeypatch.setattr(rerun_route, "read_most", watched)
    monkeypatch.setattr(preflight, "candidates", lambda tables: [])  # none is decoded before
    return given


@pytest.fixture
def reading(tmp_path):
    """Reads bytes as a log."""

    def build(data: bytes, name: str = "log.mcap"):
        path = tmp_path / name
        path.write_bytes(data)
        return read(path)

    return build
