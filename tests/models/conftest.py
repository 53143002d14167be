"""The ships of the MMG's tests, each made once for a file."""

import pytest
from mmg_ships import TWIN, Ship, estimated

from shiplog.models.mmg import parameters
from shiplog.models.mmg.geometry import geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.ship_profile import file as profiles


@pytest.fixture(scope="module")
def esso() -> Ship:
    g, _, _ = geometry_of(profiles.load("esso-osaka"))
    return Ship(MMG(g), parameters.load(parameters.published_file("esso-osaka"), g))


@pytest.fixture(scope="module")
def vectwin() -> Ship:
    return estimated(profiles.load("esso-vectwin"))


@pytest.fixture(scope="module")
def twin() -> Ship:
    return estimated(profiles.parse(TWIN, "twin.toml"))
