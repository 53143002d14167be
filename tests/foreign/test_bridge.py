"""The child of a simulator: what it may not do, and what is said of one that fails."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from shiplog.foreign import source
from shiplog.foreign.bridge import Bridge, Ship
from shiplog.foreign.source import SimulatorError

ODD = Path(__file__).parent / "odd.py"


def rows(count=9):
    rng = np.random.default_rng(0)
    return np.concatenate((rng.uniform(0.1, 1.0, (count, 8)), np.zeros((count, 3))), 1)


@pytest.fixture
def opened():
    made = []

    def of(function):
        found = Bridge(source.read(f"{ODD}:{function}"), Ship(("delta", "n"), False), {}, rows())
        made.append(found)
        return found

    yield of
    for one in made:
        one.close()


def test_a_process_that_ends_costs_its_window_only(opened):
    of = opened("ending")
    driven = np.tile([0.0, 1.0, 0.0, 0.0], (3, 4, 1))
    begin = np.array([0.0, 28.0, 10.0])
    found, troubles = of.roll(np.zeros((3, 6)), driven, np.ones((3, 3)), begin)
    (one,) = troubles
    assert (one.row, one.words) == (1, "ended its process")
    assert one.second == pytest.approx(30.0, abs=1e-6)
    assert np.isfinite(found[[0, 2]]).all() and np.isnan(found[1]).all()


@pytest.mark.skipif(sys.platform != "linux", reason="the filter is Linux's")
def test_there_is_no_network_in_the_child(opened):
    with pytest.raises(SimulatorError, match="PermissionError"):
        _ = opened("calling").facts


def test_the_child_has_its_own_output(opened, capfd):
    assert opened("rows").rates(rows()).shape == (9, 3)
    assert capfd.readouterr().out == ""


def test_a_child_is_ended_by_its_bridge(opened):
    of = opened("rows")
    _ = of.facts
    number = of._children[0].process.pid
    of.close()
    with pytest.raises(ProcessLookupError):
        os.kill(number, 0)
