"""`shiplog plan` on a run of short voyages, with a short search."""

import json

import numpy as np
import pytest
from commands import call
from short_voyages import BOTH, train

import shiplog
from shiplog.planning import limits, plan, search
from shiplog.planning.limits import NoRoom
from shiplog.planning.plan import CannotPlan
from shiplog.simulation import schedules
from shiplog.training.runs import load_model, sailing_run
from shiplog.training.runs.load_model import NetworkRun

pytestmark = pytest.mark.long

WATER = (40.0, 30.0)  # m: as the pond of the simulated ship
TIMES = ("--seconds", 140, "--water", "40,30", "--speed", "-0.5,0.6", "--rudder", 30)


@pytest.fixture(scope="module")
def given(store):
    """All forces, nothing fitted: coefficients as uncertain as is plausible."""
    out = store.parent / "whole"
    assert train(store, out, "--model", "mmg", "--no-fit", *BOTH)[0] == 0
    return out


@pytest.fixture(scope="module")
def planned(given, tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(search, "ROUNDS", 2)
        code, said, _ = call(
            "plan", given, *TIMES, "--store", folder / "empty", "--out", folder / "plan",
            "--json", folder / "found.json",
        )  # fmt: skip
    assert code == 0
    return folder / "plan", said, json.loads((folder / "found.json").read_text("utf-8"))


def test_the_manoeuvre_stays_within_its_limits(planned, given):
    """Sailed again from its own file, by `simulate`'s way."""
    folder, _, found = planned
    run = load_model.load(given)
    orders = schedules.read(folder / "schedule.csv", run.profile)
    assert orders.seconds == 140.0 and len(found["plan"]["orders"]) == 14
    for k, row in enumerate(found["plan"]["orders"]):
        assert row["time_s"] == 10.0 * k
        for time in (row["time_s"], row["time_s"] + 9.9):  # held until the next one
            at = {n: float(v) for n, v in orders.at(time).items()}
            assert at == pytest.approx({n: row[n] for n in at}, abs=1e-6)
    rudders = np.array([orders.orders[n] for n in ("rudder_port", "rudder_starboard")])
    assert np.abs(rudders).max() <= np.radians(30.0) + 1e-9
    assert np.abs(np.degrees(rudders) - np.round(np.degrees(rudders))).max() < 1e-6
    sailed, _ = sailing_run.of_run(run).sail(orders, members=1, seconds=140.0)
    state = sailed.state[0]
    assert np.isfinite(state).all()
    assert np.abs(state[:, 0]).max() < 1.1 * WATER[0] and np.abs(state[:, 2]).max() < 1.1 * WATER[1]
    assert state[:, 1].max() < 0.62


def test_it_says_what_to_expect_of_every_coefficient(planned, given):
    folder, said, found = planned
    known = load_model.load(given).identified()
    spread = dict(known.select("name", "spread").iter_rows())
    each = found["plan"]["coefficients"]
    assert [one["name"] for one in each] == [n for n, s in spread.items() if s > 0.0]
    for one in each:
        wide = one["half_width"]
        assert wide["now"] == pytest.approx(1.645 * spread[one["name"]])
        smallest = min(wide["zigzag"], wide["planned"])
        assert one["shown"] == (smallest < plan.SHOWN * wide["now"]) and smallest > 0.0
    ratios = [o["half_width"]["zigzag"] / o["half_width"]["planned"] for o in each if o["shown"]]
    assert found["plan"]["narrower"] == pytest.approx(np.median(ratios))
    assert found["plan"]["narrower"] > 1.0 and "times narrower than after a zigzag" in said
    assert json.loads((folder / "plan.json").read_text("utf-8")) == found
    assert "none of the run's training voyages" in found["notes"][0] and not found["causes"]


def test_the_bridge_gets_a_sheet_of_whole_orders(planned):
    sheet = (planned[0] / "bridge.md").read_text(encoding="utf-8")
    assert sheet.count("| 0:") + sheet.count("| 1:") + sheet.count("| 2:") == 14
    assert "Water it takes" in sheet and "rudder_port [deg]" in sheet and "[rev/s]" in sheet


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--water", "2,50"), "less than the ship's length"),
        (("--speed", "0.9,1.2"), "is not within"),
        (("--seconds", 3), "times L/U"),
    ],
)
def test_limits_that_leave_no_room_are_said(given, tmp_path, options, said):
    code, _, text = call("plan", given, "--store", tmp_path, "--out", tmp_path / "plan", *options)
    assert code == 1 and said in text and not (tmp_path / "plan").exists()


def test_python_gets_the_same_refusals(given, tmp_path):
    with pytest.raises(shiplog.ShiplogError, match="less than the ship's length"):
        shiplog.plan(given, tmp_path, tmp_path / "plan", room=(2.0, 50.0), rudder_deg=20.0)


def test_water_in_which_nothing_can_be_sailed_is_said(given, monkeypatch):
    """The ship does not stop within a length and a tenth of its approach."""
    monkeypatch.setattr(search, "ROUNDS", 1)
    run = plan.refuse_unplannable(load_model.load(given))
    sailor = sailing_run.of_run(run)
    tight = limits.limits(sailor, seconds=280.0, speed=(0.2, 0.6), water=(3.1, 3.1))
    with pytest.raises(NoRoom, match="stays within the limits"):
        search.Search(sailor, plan.instrument_of(run, sailor), tight).run()


def test_what_cannot_be_planned_says_what_can(given):
    run = load_model.load(given)
    network = NetworkRun(run.path, run.config, run.profile)
    with pytest.raises(CannotPlan, match="is a network") as error:
        plan.refuse_unplannable(network)
    assert "--model mmg" in str(error.value.hint) and "--causes-only" in str(error.value.hint)


def test_two_numbers_are_two_numbers(given):
    code, _, said = call("plan", given, "--water", "600")
    assert code == 2 and "not two numbers" in said
