"""Voyages that a run is tested on: named ones, its own, or all that had no part in its training."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import sailing

from shiplog.exceptions import StoreError
from shiplog.training.runs.run_folder import RunFolder
from shiplog.training.runs.voyages_to_test import held_back, say_twins
from shiplog.training.settings.run_config import Config
from shiplog.voyages.rows import one_hertz
from shiplog.voyages.windows.split_settings import Split


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return sailing.store_of(tmp_path_factory.mktemp("four"), ["a", "b", "c", "d"], seconds=30.0)


def run(**sides) -> RunFolder:
    split = Split(training=("a",), validation=("b",), **sides)
    return RunFolder(Path("runs/mmg"), Config(model="mmg", split=split), sailing.profile())


def test_named_ones_are_taken_and_those_of_its_training_are_reported(store, caplog):
    assert held_back([run()], store, ["c"]) == ["c"] and not caplog.records
    assert held_back([run()], store, ["[abc]"]) == ["a", "b", "c"]
    (line,) = [record.getMessage() for record in caplog.records]
    assert line == "mmg was trained or validated on a, b: its errors there are no test."


def test_its_own_test_voyages_come_before_all_others(store):
    assert held_back([run(test=("d",))], store) == ["d"]
    assert held_back([run(test=("gone",))], store) == ["c", "d"]
    assert held_back([run()], store) == ["c", "d"]


def test_where_all_were_used_none_is_left(tmp_path):
    both = sailing.store_of(tmp_path, ["a", "b"], seconds=30.0)
    with pytest.raises(StoreError, match="was used to train or validate mmg"):
        held_back([run()], both)


@dataclass(frozen=True)
class Fitted(RunFolder):
    """A run whose extension was fitted to voyage c, and whose training rows are given."""

    rows: pl.DataFrame | None = None

    @property
    def fitted_to(self) -> tuple[str, ...]:
        return (*self.trained_on, "c")

    def training(self) -> pl.DataFrame:
        assert self.rows is not None
        return self.rows


def fitted(rows: pl.DataFrame | None = None, name: str = "extended") -> Fitted:
    split = Split(training=("a",), validation=("b",))
    return Fitted(
        Path("runs") / name, Config(model="mmg", split=split), sailing.profile(), rows=rows
    )


def test_what_any_run_was_fitted_to_tests_none_of_them(store, caplog):
    """The first run's own test voyage is one that the second one's extension was fitted to."""
    assert held_back([run(test=("c",))], store) == ["c"]
    assert held_back([run(test=("c",)), fitted()], store) == ["d"]
    assert held_back([run(), fitted()], store, ["c", "d"]) == ["c", "d"]
    (line,) = [record.getMessage() for record in caplog.records]
    assert line.startswith("extended was trained or validated on c:")


def test_training_data_under_another_name_are_no_test(caplog):
    def voyage(name: str, seed: int) -> pl.DataFrame:
        rng = np.random.default_rng(seed)
        return pl.DataFrame({"voyage": [name] * 30} | {
            c: rng.standard_normal(30) for c in one_hertz.COMPARED})  # fmt: skip

    one = fitted(rows=pl.concat((voyage("a", 1), voyage("b", 2))))
    say_twins(one, pl.concat((voyage("d", 3), voyage("a", 1))))
    assert not caplog.records  # a by its own name is reported where it is chosen
    say_twins(one, pl.concat((voyage("d", 3), voyage("again", 2))))
    (line,) = [record.getMessage() for record in caplog.records]
    assert line == "extended was trained or validated on again: its errors there are no test."
