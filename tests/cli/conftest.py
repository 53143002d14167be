"""A desk: an ingested store, a good log and profile."""

from __future__ import annotations

import pytest
import sailing
from command_desk import PROFILE, Desk

from shiplog import cli


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """Two voyages of the circling ship, ingested."""
    folder = tmp_path_factory.mktemp("known")
    logs = [sailing.write(folder / f"{n}.mcap", sailing.series(s)) for n, s in
            (("one", 60.0), ("two", 50.0))]  # fmt: skip
    (folder / "circle.toml").write_text(PROFILE)
    arguments = ["ingest", *logs, "--profile", folder / "circle.toml", "--store", folder / "store"]
    assert cli.run([str(a) for a in arguments]) == 0
    return folder


@pytest.fixture
def desk(known, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return Desk(tmp_path, known / "one.mcap", known / "store")
