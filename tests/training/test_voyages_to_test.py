"""Voyages that a run is tested on: named ones, its own, or all that had no part in its training."""

from pathlib import Path

import pytest
import sailing

from shiplog.exceptions import StoreError
from shiplog.training.run_config import Config
from shiplog.training.run_folder import RunFolder
from shiplog.training.voyages_to_test import held_back
from shiplog.voyages.split_settings import Split


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return sailing.store_of(tmp_path_factory.mktemp("four"), ["a", "b", "c", "d"], seconds=30.0)


def run(**sides) -> RunFolder:
    split = Split(training=("a",), validation=("b",), **sides)
    return RunFolder(Path("runs/mmg"), Config(model="mmg", split=split), sailing.profile())


def test_named_ones_are_taken_and_those_of_its_training_are_reported(store, caplog):
    assert held_back(run(), store, ["c"]) == ["c"] and not caplog.records
    assert held_back(run(), store, ["[abc]"]) == ["a", "b", "c"]
    (line,) = [record.getMessage() for record in caplog.records]
    assert line == "mmg was trained or validated on a, b: its errors there are no test."


def test_its_own_test_voyages_come_before_all_others(store):
    assert held_back(run(test=("d",)), store) == ["d"]
    assert held_back(run(test=("gone",)), store) == ["c", "d"]
    assert held_back(run(), store) == ["c", "d"]


def test_where_all_were_used_none_is_left(tmp_path):
    both = sailing.store_of(tmp_path, ["a", "b"], seconds=30.0)
    with pytest.raises(StoreError, match="was used to train or validate mmg"):
        held_back(run(), both)
