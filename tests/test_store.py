"""The store: by content, by name, whole or not at all."""

import shutil

import polars as pl
import pytest
import sailing

from shiplog.exceptions import StoreError
from shiplog.ingest import ingest
from shiplog.store import Store


@pytest.fixture
def voyage(tmp_path):
    def build(name="one", seconds=30.0, text=sailing.PROFILE):
        path = sailing.write(tmp_path / f"{name}.mcap", sailing.series(seconds))
        return ingest(path, sailing.profile(text))

    return build


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_the_same_log_twice_changes_nothing(tmp_path, voyage):
    store = Store(tmp_path / "store")
    assert store.add(voyage()) == "added"
    before = files(store.path)
    assert store.add(voyage()) == "unchanged"
    assert files(store.path) == before


def test_another_profile_replaces_the_table_in_place(tmp_path, voyage):
    store = Store(tmp_path / "store")
    store.add(voyage())
    moved = sailing.PROFILE.replace("lever_arm_m = [0.7, -0.2]", "lever_arm_m = [0.0, 0.0]")
    assert store.add(voyage(text=moved)) == "replaced"
    assert len(store.entries()) == 1
    assert store.profile(["one"]).sensors.position.lever_arm_m == (0.0, 0.0)


def test_a_taken_name_is_refused_and_the_store_stays_as_it_was(tmp_path, voyage):
    store = Store(tmp_path / "store")
    store.add(voyage())
    before = files(store.path)
    with pytest.raises(StoreError, match="already holds another log as the voyage 'one'"):
        store.add(voyage(seconds=40.0))
    assert files(store.path) == before


def test_a_failed_write_leaves_no_voyage(tmp_path, voyage, monkeypatch):
    store = Store(tmp_path / "store")
    store.add(voyage())
    before = files(store.path)

    def full(*_args, **_kwargs):
        raise OSError("No space left on device")

    taken = voyage("two")
    monkeypatch.setattr(pl.DataFrame, "write_parquet", full)
    with pytest.raises(OSError, match="No space"):
        store.add(taken)
    assert files(store.path) == before
    assert [e.name for e in Store(store.path).entries()] == ["one"]


def test_a_lost_catalogue_is_made_again_from_the_folders(tmp_path, voyage):
    store = Store(tmp_path / "store")
    store.add(voyage())
    store.add(voyage("two", 40.0))
    entries = store.entries()
    (store.path / "catalogue.parquet").unlink()
    shutil.copytree(store.path / "voyage=one", store.path / "voyage=three.99.partial")
    assert store.entries() == entries


def test_patterns_choose_in_their_order_and_a_miss_names_the_nearest(tmp_path, voyage):
    store = Store(tmp_path / "store")
    for name in ("trial_1", "trial_2", "base"):
        store.add(voyage(name))
    assert store.select(["trial_*", "base"]) == ["trial_1", "trial_2", "base"]
    assert store.select() == ["base", "trial_1", "trial_2"]
    with pytest.raises(StoreError, match="did you mean 'trial_1'"):
        store.select(["trail_1"])


def test_names_that_look_like_numbers_or_hold_signs_stay_what_they_are(tmp_path, voyage):
    store = Store(tmp_path / "store")
    for name in ("00000216", "06-Aug 16=24%"):
        store.add(voyage(name))
    rows = pl.concat(store.tables(store.select())).collect()
    assert set(rows["voyage"]) == {"00000216", "06-Aug 16=24%"}


def test_two_ships_are_not_mixed(tmp_path, voyage):
    store = Store(tmp_path / "store")
    store.add(voyage())
    store.add(voyage("two", text=sailing.PROFILE.replace('name = "circle"', 'name = "other"')))
    with pytest.raises(StoreError, match="different ships"):
        store.profile(store.select())


def test_an_empty_store_says_what_to_do(tmp_path):
    with pytest.raises(StoreError, match="shiplog ingest"):
        Store(tmp_path / "nothing").select()


def test_what_was_found_comes_back_with_the_voyage(tmp_path, voyage):
    store = Store(tmp_path / "store")
    taken = voyage()
    store.add(taken)
    assert store.report("one") == taken.report
    assert store.holds("one", taken.contents.sha256, taken.profile)
    assert not store.holds("one", "0" * 64, taken.profile)
    assert not store.holds("two", taken.contents.sha256, taken.profile)
