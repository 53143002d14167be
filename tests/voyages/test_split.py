"""Whole voyages apart: the user's split, the paper's, or a sensible one that is reported."""

import numpy as np
import pytest
import sailing

from shiplog.commands.train_networks import train_run
from shiplog.exceptions import StoreError
from shiplog.training.settings.run_config import Config
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store.parts import overlap, parse
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split import choose_physical_split, choose_split
from shiplog.voyages.windows.split_settings import Split


def test_six_voyages_in_order_are_the_papers(tmp_path):
    names = ["f", "e", "d", "c", "b", "a"]
    store = sailing.store_of(tmp_path, names, seconds=30.0)
    reference = choose_split(store, names, (), "ref", 20)
    assert reference.training == ("f", "e")
    assert (reference.validation, reference.test) == (("b",), ("a",))
    assert choose_split(store, names, (), "d-ref", 20).training == ("f", "e", "d", "c")


def test_the_users_validation_is_taken_and_never_trained_on(tmp_path):
    store = sailing.store_of(tmp_path, ["a", "b", "c"], seconds=30.0)
    split = choose_split(store, (), ("b",), "ref", 20)
    assert split.training == ("a", "c") and split.validation == ("b",)
    with pytest.raises(StoreError, match="also a validation"):
        choose_split(store, ("b",), ("b",), "ref", 20)


@pytest.mark.parametrize("count", [2, 3, 5, 9])
def test_with_no_split_in_mind_every_voyage_is_on_one_side(tmp_path, count):
    names = [f"t{i}" for i in range(count)]
    split = choose_split(sailing.store_of(tmp_path, names), (), (), "ref", 40)
    sides = (*split.training, *split.validation, *split.test)
    assert sorted(sides) == names
    assert split.training and split.validation
    assert bool(split.test) == (count > 2)
    assert len(split.training) >= (count - 1) / 2
    assert "order of time" in split.chosen_by


def test_the_same_data_under_two_names_stays_on_one_side(tmp_path):
    names = [f"t{i}" for i in range(6)]
    store = sailing.store_of(tmp_path, [*names, "copy_of_t0"], same=("t0", "copy_of_t0"))
    split = choose_split(store, (), (), "ref", 40)
    (side,) = [s for s in (split.training, split.validation, split.test) if "t0" in s]
    assert "copy_of_t0" in side


def test_the_same_data_on_both_sides_is_refused(tmp_path):
    store = sailing.store_of(tmp_path, ["t0", "t1"], same=("t0", "t1"))
    split = Split(training=("t0",), validation=("t1",))
    with pytest.raises(StoreError, match=r"t0 and t1 hold 13\d identical seconds"):
        train_run(Config(window=40, split=split), store, tmp_path / "run")
    assert not list(tmp_path.glob("run*"))


def test_one_voyage_is_split_in_time(tmp_path):
    """130 s: the first 70 % train, the last 15 % test, and no second is on two sides."""
    store = sailing.store_of(tmp_path, ["only"])
    split = choose_split(store, (), (), "ref", 10)
    sides = [*split.training, *split.validation, *split.test]
    found = [parse(name) for name in sides]
    assert [p.whole for p in found] == ["only"] * 3 and "one voyage" in split.chosen_by
    assert found[0].begin == 0 and found[2].end >= 129
    assert [a.end for a in found[:2]] == [b.begin for b in found[1:]]
    assert [found[0].end, found[1].end] == pytest.approx([91, 111], abs=2)
    rows = store.seconds(sides, store.profile(sides))
    assert set(rows["voyage"]) == set(sides)
    assert rows["time"].is_unique().all()
    whole = store.seconds(["only"], store.profile(["only"]))
    assert whole.height - 3 <= rows.height <= whole.height  # a second at each seam may be cut


def test_a_part_of_the_only_voyage_is_split_into_parts_of_the_voyage(tmp_path):
    """From 100 s on 200 s: 70 % of them train, up to 240 s; the last 15 % begin at 270 s."""
    store = sailing.store_of(tmp_path, ["trip"], seconds=320.0)
    split = choose_split(store, ["trip[100:300]"], (), "ref", 20)
    parts = [parse(side) for (side,) in (split.training, split.validation, split.test)]
    assert {part.whole for part in parts} == {"trip"}
    bounds = [parts[0].begin, *(part.end for part in parts)]
    assert bounds == pytest.approx([100, 240, 270, 300], abs=2) and bounds[-1] <= 300
    assert store.profile([str(part) for part in parts]).ship.name == "circle"


def test_parts_in_time_count_from_the_voyages_first_row(tmp_path):
    """300 s without a velocity in the first 100: of the other 200, 70 % train and 15 % test."""
    logged = sailing.series(300.0)
    logged["/velocity"].columns["sog_kn"][:1000] = np.nan
    store = Store(tmp_path / "store")
    store.add(ingest(sailing.write(tmp_path / "only.mcap", logged), sailing.profile()))
    split = choose_split(store, (), (), "ref", 10)
    sides = [*split.training, *split.validation, *split.test]
    found = [parse(name) for name in sides]
    assert [found[0].end, found[1].end, found[2].end] == pytest.approx([240, 270, 300], abs=2)
    rows = store.seconds(sides, store.profile(sides))
    lengths = dict(rows.group_by("voyage").len().iter_rows())
    assert [lengths[name] for name in sides] == pytest.approx([140, 30, 30], abs=2)


@pytest.mark.parametrize(("size", "left"), ((40, 19), (100, 19)))
def test_one_voyage_that_is_too_short_says_which_window_fits(tmp_path, size, left):
    with pytest.raises(StoreError, match="the only voyage") as caught:
        choose_split(sailing.store_of(tmp_path, ["only"]), (), (), "ref", size)
    window = int(caught.value.hint.split("--window ")[1].split(" ")[0])
    assert window == pytest.approx(left, abs=1)
    split = choose_split(Store(tmp_path / "store"), (), (), "ref", window - 2)
    assert len(split.training) == len(split.validation) == len(split.test) == 1


def test_no_window_is_proposed_that_would_be_refused(tmp_path):
    """A voyage of 30 s is split into 20, 4 and 4 s, which no window fits into."""
    with pytest.raises(StoreError, match="the only voyage") as caught:
        choose_split(sailing.store_of(tmp_path, ["only"], seconds=30.0), (), (), "ref", 10)
    assert caught.value.hint == "ingest a second voyage."


def test_voyages_without_a_window_are_named_and_a_shorter_one_is_proposed(tmp_path, caplog):
    store = sailing.store_of(tmp_path, ["a", "b", "c"])
    short = sailing.store_of(tmp_path, ["d"], seconds=35.0)
    assert short.path == store.path
    caplog.set_level("INFO")
    split = choose_split(store, (), (), "ref", 40)
    assert "d" not in [*split.training, *split.validation, *split.test]
    assert "left out, without a window of 40 s: d" in caplog.text
    assert "1 of 4 voyages are shorter than 40 s; `--window 30` uses all" in caplog.text


def test_no_voyage_long_enough_is_reported_with_what_would_do(tmp_path):
    store = sailing.store_of(tmp_path, ["a", "b"], seconds=35.0)
    with pytest.raises(StoreError, match="No voyage has a window of 100 s") as caught:
        choose_split(store, (), (), "ref", 100)
    assert "`--window 30` uses all" in caught.value.hint


@pytest.mark.parametrize(
    ("one", "other", "shared"),
    [
        ("a", "a", True), ("a", "b", False), ("a", "a[0:10]", True), ("a[0:10]", "a", True),
        ("a[0:10]", "a[10:20]", False), ("a[0:11]", "a[10:20]", True),
        ("a[0:10]", "b[0:10]", False), ("a[0:10]", "b", False), ("a[5:5]", "a", False),
    ],
)  # fmt: skip
def test_parts_share_seconds_where_they_meet(one, other, shared):
    assert overlap(one, other) is shared


def test_a_name_that_looks_like_a_part_is_itself_where_it_is_stored(tmp_path):
    store = sailing.store_of(tmp_path, ["trip", "trip[0:50]"])
    assert set(store.select(["trip[[]0:50]"])) == {"trip[0:50]"}
    (frame,) = store.tables(["trip[0:50]"])
    assert frame.collect().height > 1000  # 130 s of it, not 50
    assert store.select(["trip[0:60]"]) == ["trip[0:60]"]
    (frame,) = store.tables(["trip[0:60]"])
    assert frame.collect().height == 600
    hashes = store.hashes(["trip[0:60]", "trip"])
    assert hashes["trip[0:60]"] == hashes["trip"] is not None
    with pytest.raises(StoreError):
        store.select(["other[0:60]"])


def test_a_part_beyond_the_end_of_its_voyage_is_refused(tmp_path):
    store = sailing.store_of(tmp_path, ["trip"], seconds=30.0)
    assert store.select(["trip[29:100]"]) == ["trip[29:100]"]
    with pytest.raises(StoreError, match="after the end of trip, which is 30 s long") as caught:
        store.select(["trip[30:100]"])
    assert caught.value.hint == "choose seconds from 0 to 30."


# --- of a physical model: no voyage is needed to stop its training

SIX = [f"voyage_{i}" for i in range(1, 7)]


@pytest.fixture(scope="module")
def seven(tmp_path_factory):
    """The names of the sample logs, and one voyage more."""
    return sailing.store_of(tmp_path_factory.mktemp("seven"), [*SIX, "voyage_7"], seconds=30.0)


def test_named_voyages_are_all_trained_on(seven):
    for named in (SIX, ["voyage_7", "voyage_2"], ["voyage_[1-6]"]):
        split = choose_physical_split(seven, named, (), "ref", 20)
        assert set(split.training) == set(seven.select(named))
        assert (split.validation, split.test) == ((), ())
        assert "held out in turn" in split.chosen_by


@pytest.mark.parametrize(("data", "count"), [("ref", 2), ("d-ref", 4)])
def test_the_sample_logs_keep_the_papers_split(seven, data, count):
    split = choose_physical_split(seven, (), (), data, 20)
    assert split.training == tuple(SIX[:count])
    assert (split.validation, split.test) == (("voyage_5",), ("voyage_6",))


def test_the_users_validation_is_kept_apart(seven):
    split = choose_physical_split(seven, ("voyage_[1-3]",), ("voyage_3", "voyage_7"), "ref", 20)
    assert split.training == ("voyage_1", "voyage_2")
    assert split.validation == ("voyage_3", "voyage_7") and split.test == ()
    rest = choose_physical_split(seven, (), ("voyage_7",), "ref", 20)
    assert rest.training == tuple(SIX) and rest.validation == ("voyage_7",)


def test_with_nothing_named_a_share_is_left_for_testing(tmp_path):
    store = sailing.store_of(tmp_path, [f"trip_{i}" for i in (1, 2, 3)], seconds=80.0)
    split = choose_physical_split(store, (), (), "ref", 25)
    assert split.validation == () and len(split.test) == 1
    assert sorted((*split.training, *split.test)) == ["trip_1", "trip_2", "trip_3"]
