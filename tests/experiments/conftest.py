"""Voyages of the simulated ship, made once for a file."""

import pytest
from simulated_voyages import START, topics

from pipelines.experiments.simulated_ship import (
    Wind,
    sail,
    write_voyage,
)
from pipelines.experiments.simulated_ship.sample_logs import voyages


@pytest.fixture(scope="module")
def sailed():
    return voyages()


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Writes a short voyage with something hidden and reads it back."""
    folder = tmp_path_factory.mktemp("logs")

    def log(effects=None, **options):
        voyage = sail(90.0, seed=11, wind=Wind(3.0, 2.0), effects=effects)
        write_voyage(folder / "a.mcap", voyage, seed=2, start=START, **options)
        return voyage, topics(folder / "a.mcap")

    return log
