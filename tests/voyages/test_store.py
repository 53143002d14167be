"""The store: by content, by name, whole or not at all."""

import contextlib
import shutil
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
import sailing

from shiplog.exceptions import StoreError
from shiplog.voyages.ingest import ingest
from shiplog.voyages.store import Store, fingerprint_of


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
    with pytest.raises(StoreError, match="No space"):
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


class Killed(BaseException):
    """Stands for SIGKILL: no handler runs that could put anything in order."""


@pytest.fixture
def killed_at(monkeypatch):
    """Calls that change the disk, of which the k-th and all later ones end the process."""

    def arm(k):
        count = 0

        def dying(call):
            def change(*args, **kwargs):
                nonlocal count
                count += 1
                if count >= k:
                    raise Killed
                return call(*args, **kwargs)

            return change

        for owner, name in (
            (Path, "mkdir"), (Path, "rename"), (Path, "replace"), (Path, "write_text"),
            (pl.DataFrame, "write_parquet"), (shutil, "rmtree"),
        ):  # fmt: skip
            monkeypatch.setattr(owner, name, dying(getattr(owner, name)))

    yield arm
    monkeypatch.undo()


@pytest.mark.parametrize("k", range(1, 12))
def test_wherever_an_ingest_is_killed_the_next_one_lists_the_voyage(
    tmp_path, voyage, killed_at, monkeypatch, k
):
    store = Store(tmp_path / "store")
    store.add(voyage())
    two = voyage("two", 40.0)
    killed_at(k)
    with contextlib.suppress(Killed):
        store.add(two)
    monkeypatch.undo()
    there = {e.name for e in Store(store.path).entries()}  # readers see what is in its place
    assert there == {p.name.removeprefix("voyage=") for p in store.path.glob("voyage=*")}
    again = Store(store.path)
    again.mend()
    if not again.holds("two", two.contents.sha256, two.profile):
        again.add(two)
    catalogue = pl.read_parquet(store.path / "catalogue.parquet")
    assert catalogue["name"].to_list() == ["one", "two"]
    assert not list(store.path.glob(".voyage=*"))


@pytest.mark.parametrize("k", range(1, 14))
def test_a_killed_replacement_never_loses_the_voyage(tmp_path, voyage, killed_at, monkeypatch, k):
    store = Store(tmp_path / "store")
    first = voyage()
    store.add(first)
    moved = sailing.PROFILE.replace("lever_arm_m = [0.7, -0.2]", "lever_arm_m = [0.0, 0.0]")
    other = voyage(text=moved)
    killed_at(k)
    with contextlib.suppress(Killed):
        store.add(other)
    monkeypatch.undo()
    again = Store(store.path)
    (entry,) = again.entries()  # whole, the one or the other, and what is reported of it is true
    assert again.tables(["one"])[0].collect().height == entry.rows
    arm = again.profile(["one"]).sensors.position.lever_arm_m
    held = again.holds("one", other.contents.sha256, other.profile)
    assert held == (arm == (0.0, 0.0))
    now = other if held else first
    assert entry.fingerprint == fingerprint_of(now.contents.sha256, now.profile)
    again.add(other)
    assert pl.read_parquet(store.path / "catalogue.parquet")["fingerprint"].to_list() == [
        fingerprint_of(other.contents.sha256, other.profile)
    ]
    assert not list(store.path.glob(".voyage=*"))


def test_a_catalogue_of_two_writers_that_lacks_a_voyage_is_not_believed(tmp_path, voyage):
    """As an ingest leaves it that scanned the folders before the other's voyage was there."""
    store = Store(tmp_path / "store")
    store.add(voyage())
    stale = (store.path / "catalogue.parquet").read_bytes()
    store.add(voyage("two", 40.0))
    (store.path / "catalogue.parquet").write_bytes(stale)
    assert [e.name for e in Store(store.path).entries()] == ["one", "two"]


def test_a_spoilt_voyage_does_not_hide_the_others(tmp_path, voyage):
    store = Store(tmp_path / "store")
    store.add(voyage())
    (store.path / "voyage=one" / "voyage.json").write_text("{}")
    assert store.add(voyage("two", 40.0)) == "added"
    assert [e.name for e in store.entries()] == ["two"]
    assert store.add(voyage()) == "replaced"  # ingested again, it is whole again
    assert [e.name for e in store.entries()] == ["one", "two"]


def test_a_spoilt_table_is_noticed_and_mended(tmp_path, voyage):
    store = Store(tmp_path / "store")
    taken = voyage()
    store.add(taken)
    table = store.path / "voyage=one" / "table.parquet"
    whole = table.read_bytes()
    table.write_bytes(whole[:200])
    with pytest.raises(StoreError, match="spoilt"):
        store.tables(["one"])
    assert not store.holds("one", taken.contents.sha256, taken.profile)
    assert store.add(taken) == "replaced"
    assert table.read_bytes() == whole


@pytest.mark.parametrize("name", ["x.partial", "x.new", "..", "%2e%2e"])
def test_names_like_the_stores_own_are_listed(tmp_path, voyage, name):
    store = Store(tmp_path / "store")
    store.add(voyage(name))
    assert [e.name for e in store.entries()] == [name]


def test_a_name_that_no_folder_can_have_is_refused(tmp_path, voyage):
    store = Store(tmp_path / "store")
    long = replace(voyage(), name="航海" * 30)  # nine letters of a folder's name each
    with pytest.raises(StoreError, match="too long"):
        store.add(long)
    assert store.entries() == []


def test_a_store_that_is_a_file_or_rubbish(tmp_path, voyage):
    (tmp_path / "file").write_text("x")
    for call in (Store(tmp_path / "file").entries, lambda: Store(tmp_path / "file").add(voyage())):
        with pytest.raises(StoreError):
            call()
    store = Store(tmp_path / "store")
    store.add(voyage())
    (store.path / "catalogue.parquet").write_bytes(b"x")
    assert [e.name for e in store.entries()] == ["one"]
