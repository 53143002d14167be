"""The store: by content, by name, whole or not at all."""

import contextlib
import logging
import multiprocessing
import shutil
import time
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
import sailing
from filelock import FileLock

from shiplog.exceptions import StoreError
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store import catalogue
from shiplog.voyages.store import store as stores
from shiplog.voyages.store.store import Store, fingerprint_of


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


@pytest.mark.parametrize(
    "full",
    [
        OSError(28, "No space left on device"),
        pl.exceptions.ComputeError("No space left on device (os error 28): ...table.parquet"),
    ],
    ids=["of the system", "of polars"],
)
def test_a_failed_write_leaves_no_voyage(tmp_path, voyage, monkeypatch, full):
    store = Store(tmp_path / "store")
    store.add(voyage())
    before = files(store.path)

    def refuse(*_args, **_kwargs):
        raise full

    taken = voyage("two")
    monkeypatch.setattr(pl.DataFrame, "write_parquet", refuse)
    with pytest.raises(StoreError) as raised:
        store.add(taken)
    assert str(raised.value) == (
        f"The voyage 'two' cannot be written into the store {store.path}: No space left on device."
        "\n  give a --store on a disk with room that you may write to; what is in the store is as "
        "it was."
    )
    assert files(store.path) == before
    assert [e.name for e in Store(store.path).entries()] == ["one"]


def test_only_whole_folders_are_listed(tmp_path, voyage):
    store = Store(tmp_path / "store")
    store.add(voyage())
    entries = store.entries()
    shutil.copytree(store.path / "voyage=one", store.path / ".voyage=two.new")
    (store.path / "voyage=three").mkdir()
    (store.path / "catalogue.parquet").write_bytes(b"of an earlier version")
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
            (Path, "mkdir"), (Path, "rename"), (Path, "write_text"),
            (pl.DataFrame, "write_parquet"), (shutil, "rmtree"),
        ):  # fmt: skip
            monkeypatch.setattr(owner, name, dying(getattr(owner, name)))

    yield arm
    monkeypatch.undo()


@pytest.mark.parametrize("k", range(1, 9))
def test_wherever_an_ingest_is_killed_the_next_one_completes_it(
    tmp_path, voyage, killed_at, monkeypatch, k
):
    store = Store(tmp_path / "store")
    store.add(voyage())
    two = voyage("two", 40.0)
    killed_at(k)
    with contextlib.suppress(Killed):
        store.add(two)
    monkeypatch.undo()
    there = {e.name for e in Store(store.path).entries()}
    assert there in ({"one"}, {"one", "two"})
    again = Store(store.path)
    assert again.holds("two", two.contents.sha256, two.profile) == ("two" in there)
    again.add(two)
    assert [e.name for e in again.entries()] == ["one", "two"]
    assert sorted(p.name for p in store.path.iterdir()) == [".lock", "voyage=one", "voyage=two"]


@pytest.mark.parametrize("k", range(1, 12))
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
    (entry,) = again.entries()
    assert entry.fingerprint == fingerprint_of(other.contents.sha256, other.profile)
    assert sorted(p.name for p in store.path.iterdir()) == [".lock", "voyage=one"]


def test_readers_do_not_wait_for_a_replacement(tmp_path, voyage):
    """As a process finds the store that reads while another one is between two renames."""
    store = Store(tmp_path / "store")
    taken = voyage("a b")
    store.add(taken)
    (entry,) = store.entries()
    (place,) = store.path.glob("voyage=*")
    place.rename(store.path / f".{place.name}.old")
    with FileLock(store.path / ".lock"):
        assert store.entries() == [entry]
        assert store.select(["a*"]) == ["a b"]
        assert store.report("a b") == taken.report
        assert store.profile(["a b"]).ship == taken.profile.ship
        assert store.tables(["a b"])[0].collect().height == entry.rows
        assert not place.exists()
    assert store.entries() == [entry]  # nobody writes now: the next call puts it in order
    assert [p.name for p in store.path.glob("*voyage=*")] == [place.name]


@pytest.mark.parametrize("moved_at", [1, 2])
@pytest.mark.parametrize("what", ["entries", "tables"])
def test_a_voyage_that_is_moved_while_it_is_looked_up_is_found(
    tmp_path, voyage, monkeypatch, what, moved_at
):
    """Another process begins to replace it right after its folder was looked up."""
    store = Store(tmp_path / "store")
    store.add(voyage())
    calls, whole = [], catalogue.whole

    def looked_up(place):
        found = whole(place)
        calls.append(place)
        if len(calls) == moved_at:
            place.rename(catalogue.hidden(place, catalogue.OLD))
        return found

    monkeypatch.setattr(catalogue, "whole", looked_up)
    if what == "entries":
        assert [entry.name for entry in catalogue.entries(store.path)] == ["one"]
    else:
        assert store.tables(["one"])[0].collect().height > 0
    assert len(calls) > moved_at


def test_what_an_interrupted_ingest_left_waits_for_no_new_voyage(tmp_path, voyage):
    store = Store(tmp_path / "store")
    store.add(voyage())
    shutil.copytree(store.path / "voyage=one", store.path / ".voyage=two.new")
    store.mend()
    assert sorted(p.name for p in store.path.iterdir()) == [".lock", "voyage=one"]


def hold_open(log, store, held, go):
    """In another process: takes a log, and stops just before the voyage gets its name."""
    rename = Path.rename

    def slow(path, target):
        held.touch()
        while not go.exists():
            time.sleep(0.01)
        return rename(path, target)

    Path.rename = slow  # type: ignore[method-assign]
    Store(store).add(ingest(log, sailing.profile()))


@pytest.mark.parametrize("second", ["another log", "the same log", "another log of that name"])
def test_two_ingests_at_once(tmp_path, voyage, monkeypatch, caplog, second):
    """The first is held open until the second says that it waits."""
    store = Store(tmp_path / "store")
    held, go = tmp_path / "held", tmp_path / "go"
    (tmp_path / "logs").mkdir()
    log = sailing.write(tmp_path / "logs" / "one.mcap", sailing.series(30.0))
    first = multiprocessing.get_context("spawn").Process(
        target=hold_open, args=(log, store.path, held, go)
    )
    other = voyage(
        "two" if second == "another log" else "one",
        40.0 if second == "another log of that name" else 30.0,
    )
    logged = []

    class Release(logging.Handler):
        def emit(self, record):
            logged.append(record.getMessage())
            go.touch()

    monkeypatch.setattr(stores, "SILENT_WAIT_S", 0.05)
    monkeypatch.setattr(stores.log, "handlers", [Release()])
    # by the logger itself: it remembers which levels an earlier test had asked for in vain
    caplog.set_level(logging.INFO, stores.log.name)
    first.start()
    try:
        while not held.exists() and first.is_alive():
            time.sleep(0.01)
        assert Store(store.path).entries() == []  # whoever reads does not wait
        if second == "another log of that name":
            with pytest.raises(StoreError, match="already holds another log as the voyage 'one'"):
                store.add(other)
        else:
            state = store.add(other)
            assert state == ("added" if second == "another log" else "unchanged")
    finally:
        go.touch()
        first.join()
    assert first.exitcode == 0
    assert logged == [f"waiting for another process that writes into the store {store.path}"]
    names = ["one", "two"] if second == "another log" else ["one"]
    assert [e.name for e in store.entries()] == names
    assert store.tables(["one"])[0].collect().height == store.report("one").rows
    assert not list(store.path.glob(".voyage=*"))


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
    with pytest.raises(StoreError, match="too long for a folder: 547 letters, where 240"):
        store.add(long)
    with pytest.raises(StoreError, match=r"'\\udcff' of the log is not text"):
        store.add(replace(voyage(), name="\udcff"))
    assert store.entries() == []


def test_a_store_that_is_a_file(tmp_path, voyage):
    (tmp_path / "file").write_text("x")
    for call in (Store(tmp_path / "file").entries, lambda: Store(tmp_path / "file").add(voyage())):
        with pytest.raises(StoreError):
            call()


def test_voyages_of_two_lever_arms_or_lengths_are_not_one_ship(tmp_path, voyage):
    store = Store(tmp_path / "store")
    store.add(voyage(name="one"))
    moved = sailing.PROFILE.replace("lever_arm_m = [0.7, -0.2]", "lever_arm_m = [0.0, 0.0]")
    store.add(voyage(name="two", text=moved))
    with pytest.raises(StoreError, match=r"one and two were .* two profiles") as refused:
        store.profile(["one", "two"])
    assert "one profile" in refused.value.hint
    assert store.profile(["two", "two"]).sensors.position.lever_arm_m == (0.0, 0.0)


def test_a_field_that_two_voyages_read_otherwise_is_said(tmp_path, voyage, caplog):
    """An instrument may have been changed between them: it is no refusal."""
    store = Store(tmp_path / "store")
    store.add(voyage(name="one"))
    store.add(voyage(name="two", text=sailing.PROFILE.replace("sign = -1.0", "sign = 1.0")))
    store.profile(["one", "two"])
    assert (
        "one and two were read with another unit, sign, zero or order of actuators.rudder"
        in caplog.text
    )
    caplog.clear()
    store.profile(["two", "two"])
    assert not caplog.text
