"""Whole voyages apart: the user's split, the paper's, or a sensible one that is said."""

import numpy as np
import pytest
import sailing

from pipelines.split import choose_split
from pipelines.train import train_run
from shiplog.config import Config, Split
from shiplog.exceptions import StoreError
from shiplog.ingest import ingest
from shiplog.store import Store


def store_of(tmp_path, names, seconds=130.0, same=()):
    """Voyages with noise of their own; those in `same` hold the very data of the first."""
    store = Store(tmp_path / "store")
    for number, name in enumerate(names):
        rng = np.random.default_rng(0 if name in same else number)
        parts = sailing.series(seconds)
        for one in parts.values():
            for column, values in one.columns.items():
                one.columns[column] = values + rng.normal(0, 1e-3, len(values))
        path = sailing.write(tmp_path / f"{name}.mcap", parts)
        store.add(ingest(path, sailing.profile()))
    return store


def test_six_voyages_in_order_are_the_papers(tmp_path):
    names = ["f", "e", "d", "c", "b", "a"]
    store = store_of(tmp_path, names, seconds=30.0)
    reference = choose_split(store, names, (), "ref", 20)
    assert reference.training == ("f", "e")
    assert (reference.validation, reference.test) == (("b",), ("a",))
    assert choose_split(store, names, (), "d-ref", 20).training == ("f", "e", "d", "c")


def test_the_users_validation_is_taken_and_never_trained_on(tmp_path):
    store = store_of(tmp_path, ["a", "b", "c"], seconds=30.0)
    split = choose_split(store, (), ("b",), "ref", 20)
    assert split.training == ("a", "c") and split.validation == ("b",)
    with pytest.raises(StoreError, match="also a validation"):
        choose_split(store, ("b",), ("b",), "ref", 20)


@pytest.mark.parametrize("count", [2, 3, 5, 9])
def test_with_no_split_in_mind_every_voyage_is_on_one_side(tmp_path, count):
    names = [f"t{i}" for i in range(count)]
    split = choose_split(store_of(tmp_path, names), (), (), "ref", 40)
    sides = (*split.training, *split.validation, *split.test)
    assert sorted(sides) == names
    assert split.training and split.validation
    assert bool(split.test) == (count > 2)
    assert len(split.training) >= (count - 1) / 2
    assert "order of time" in split.chosen_by


def test_the_same_data_under_two_names_stays_on_one_side(tmp_path):
    names = [f"t{i}" for i in range(6)]
    store = store_of(tmp_path, [*names, "copy_of_t0"], same=("t0", "copy_of_t0"))
    split = choose_split(store, (), (), "ref", 40)
    (side,) = [s for s in (split.training, split.validation, split.test) if "t0" in s]
    assert "copy_of_t0" in side


def test_the_same_data_on_both_sides_is_refused(tmp_path):
    store = store_of(tmp_path, ["t0", "t1"], same=("t0", "t1"))
    split = Split(training=("t0",), validation=("t1",))
    with pytest.raises(StoreError, match=r"t0 and t1 hold 13\d identical seconds"):
        train_run(Config(window=40, split=split), store, tmp_path / "run")
    assert not list(tmp_path.glob("run*"))


def test_one_voyage_cannot_be_split(tmp_path):
    with pytest.raises(StoreError, match="at least two voyages"):
        choose_split(store_of(tmp_path, ["only"]), (), (), "ref", 40)
