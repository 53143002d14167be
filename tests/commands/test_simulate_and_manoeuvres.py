"""`simulate` and `manoeuvres` as a user types them, on the simulated ship's short voyages."""

import math

import polars as pl
import pytest
from commands import call
from mcap.reader import make_reader
from short_voyages import BOTH, STATES, answer, train

import shiplog
from shiplog.simulation import schedules


@pytest.fixture(scope="module")
def whole(store):
    """With propeller and rudders, nothing fitted."""
    out = store.parent / "whole"
    assert train(store, out, "--model", "mmg", "--no-fit", *BOTH)[0] == 0
    return out


def test_a_zigzag_has_its_quantities_and_its_file(whole, tmp_path):
    to, said = tmp_path / "z.parquet", tmp_path / "z.json"
    code, text, _ = call("simulate", whole, "--zigzag", "20/20", "--members", 5, "--out", to,
                         "--json", said)  # fmt: skip
    assert code == 0 and "first overshoot" in text
    found, frame = answer(said), pl.read_parquet(to)
    assert found["members"] == frame["member"].n_unique() and found["diverged_s"] is None
    assert frame.columns[:8] == ["member", "time", *STATES]
    first = frame.filter(pl.col("member") == 0)
    peak = math.degrees(first.filter(pl.col("time") <= found["ended_s"])["heading"].max())
    over = next(q for q in found["quantities"] if q["name"] == "first_overshoot")
    assert over["low"] <= over["value"] <= over["high"]
    assert over["value"] >= 0.0 and peak >= 20.0


@pytest.mark.parametrize(
    "option", [("--turn", -35), ("--stop",), ("--pullout",), ("--turn", 20, "--wind", "3,90"),
               ("--turn", 20, "--current", "0.1,0")]
)  # fmt: skip
def test_what_can_be_sailed(whole, option):
    code, text, _ = call("simulate", whole, *option, "--members", 1, "--seconds", 150)
    assert code == 0 and "sails" in text


@pytest.mark.parametrize("ending", ["csv", "mcap", "rrd"])
def test_files_by_their_ending(whole, tmp_path, ending):
    to = tmp_path / f"t.{ending}"
    assert (
        call("simulate", whole, "--turn", 35, "--members", 2, "--seconds", 20, "--out", to)[0] == 0
    )
    if ending == "csv":
        assert pl.read_csv(to).height >= 21
    if ending == "mcap":
        with open(to, "rb") as stream:
            summary = make_reader(stream).get_summary()
        topics = {channel.topic for channel in summary.channels.values()}
        assert f"/sim/{whole.name}/state" in topics and len(topics) == 4
    assert to.stat().st_size > 500


def test_a_schedule_and_a_voyage(whole, store, tmp_path):
    orders = tmp_path / "mine.csv"
    orders.write_text("time_s,rudder_port_deg\n0,0\n10,0\n12,20\n40,20\n")
    said = tmp_path / "s.json"
    assert call("simulate", whole, "--schedule", orders, "--members", 1, "--json", said)[0] == 0
    assert answer(said)["kind"] == "schedule" and answer(said)["manoeuvre"] == "mine"
    code, text, _ = call("simulate", whole, "--voyage", "trip_3", "--store", store)
    assert code == 0 and "the inputs of trip_3" in text


def test_a_voyages_inputs_give_the_rollout_of_evaluate(whole, store):
    """The same states as a window of that voyage, from its first row on."""
    done = shiplog.simulate(whole, "trip_3", store, members=1)
    rows = shiplog.open_store(store)["trip_3"].rows_1hz
    assert done.frame.height == rows.height or done.notes
    first = done.frame.row(0, named=True)
    for name in STATES:
        assert first[name] == pytest.approx(rows[name][0], abs=1e-9)


def test_frames_in_and_out(whole):
    """Members by their own inputs and starts: as each is alone."""
    run = shiplog.load(whole)
    names = run.profile.actuator_names
    one = pl.DataFrame({"time": [0.0, 5.0, 30.0], **{n: [0.0, 0.2, 0.2] for n in names[:-1]},
                        names[-1]: [8.0, 8.0, 9.0]})  # fmt: skip
    start = pl.DataFrame({"surge": [0.4, 0.5], "yaw_rate": [0.0, 0.01]})
    both = run.simulate(one, start)
    assert both["member"].unique().sort().to_list() == [0, 1]
    for k in range(2):
        alone = run.simulate(one, start[k : k + 1])
        mine = both.filter(pl.col("member") == k)
        assert mine.drop("member").to_numpy() == pytest.approx(alone.drop("member").to_numpy())
    many = run.simulate(schedules.zigzag("10/10"), {"surge": 0.4}, seconds=30.0)
    assert many["time"].to_list() == pytest.approx(list(range(len(many))))


@pytest.mark.parametrize(
    "options, says, code",
    [
        (("--zigzag", "10"), "no zigzag", 1),
        (("--zigzag", "10/10", "--turn", 35), "2 things to sail", 2),
        ((), "0 things to sail", 2),
        (("--turn", 0), "is none", 1),
        (("--turn", 35, "--wind", "x"), "no speed with a direction", 2),
        (("--turn", 35, "--out", "x.txt"), "no kind of file", 1),
        (("--turn", 35, "--speed", -1), "begins ahead", 1),
        (("--voyage", "nothing"), "nothing", 1),
        (("--voyage", "trip_3", "--speed", 1), "its own start", 2),
        (("--schedule", "none.csv"), "cannot be read", 1),
    ],
)  # fmt: skip
def test_what_cannot_be_meant(whole, store, options, says, code):
    found, _, error = call("simulate", whole, "--store", store, *options)
    assert found == code and says in error


def test_inputs_that_are_none(whole):
    run = shiplog.load(whole)
    with pytest.raises(shiplog.ShiplogError, match="lacks"):
        run.simulate(pl.DataFrame({"time": [0.0, 1.0]}))
    with pytest.raises(shiplog.ShiplogError, match="no part of a ship's state"):
        run.simulate(schedules.turn(20.0), {"speed": 1.0})


def test_a_sheet_by_the_model_alone(whole, tmp_path):
    said = tmp_path / "m.json"
    pages = [tmp_path / f"{n}.html" for n in ("sheet", "card", "poster")]
    written = ("--report", pages[0], "--pilot-card", pages[1], "--poster", pages[2])
    code, text, _ = call("manoeuvres", whole, "--alone", "--members", 1, "--json", said, *written)
    assert code == 0 and "Heel is not modelled" in text
    found = answer(said)
    kinds = {one["kind"] for one in found["manoeuvres"]}
    assert {"turn", "zigzag"} <= kinds and all(one["voyage"] is None for one in found["manoeuvres"])
    for one in found["manoeuvres"]:
        for quantity in one["quantities"]:
            assert quantity["measured"] is None and quantity["simulated"]["value"] is not None
    assert all("<script" not in page.read_text() for page in pages)
    assert "A.601(15)" in pages[1].read_text() and "Performance may differ" in pages[2].read_text()


def test_manoeuvres_of_voyages_without_any(store):
    code, text, _ = call("manoeuvres", "--store", store)
    assert code == 0 and "found in 3 voyages" in text
    assert call("manoeuvres", "--alone")[0] == 2


def test_a_scale_that_is_none(whole):
    code, _, error = call("manoeuvres", whole, "--alone", "--scale", 0)
    assert code == 1 and "scale" in error
