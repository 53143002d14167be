"""The current that a comparison draws is the one that a diagnosis named."""

from types import SimpleNamespace

import numpy as np
import pytest

from shiplog.commands import compare


def run(**causes):
    return SimpleNamespace(extension_numbers=lambda: {k: np.array(v) for k, v in causes.items()})


def test_it_sets_to_where_its_numbers_point():
    """0.3 m/s to the south and 0.4 m/s to the west: 0.5 m/s towards 233.13 deg."""
    named = compare._named_current([run(), run(rudder_lag=[1.0]), run(current=[-0.3, -0.4])])
    assert named.speed == pytest.approx(0.5)
    assert np.degrees(named.direction) % 360.0 == pytest.approx(233.1301)


def test_without_one_there_is_none():
    assert compare._named_current([run(), run(fouling=[1.2])]) is None
