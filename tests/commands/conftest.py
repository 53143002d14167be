"""Three short voyages of the simulated ship, ingested, and physical models of two of them."""

from datetime import UTC, datetime

import pytest
from commands import call
from short_voyages import BOTH, HULL, train

from pipelines.experiments import simulated_ship


@pytest.fixture(scope="session")
def logs(tmp_path_factory):
    """Three short voyages of the simulated ship, all on one day."""
    folder = tmp_path_factory.mktemp("logs")
    for number in range(1, 4):
        voyage = simulated_ship.sail(80.0, seed=number, wind=simulated_ship.Wind(3.0, number))
        start = datetime(2026, 5, 1, 10 + number, 0, tzinfo=UTC)
        simulated_ship.write_voyage(
            folder / f"trip_{number}.mcap", voyage, seed=number, start=start
        )
    return folder


@pytest.fixture(scope="session")
def store(logs, tmp_path_factory):
    path = tmp_path_factory.mktemp("work") / "store"
    assert call("ingest", logs, "--store", path)[0] == 0
    return path


@pytest.fixture(scope="session")
def published(store):
    """Nothing fitted: run folder and what was reported of it."""
    out = store.parent / "published"
    code, reported, _ = train(store, out, "--model", "mmg", "--no-fit", *BOTH, *HULL)
    assert code == 0
    return out, reported
