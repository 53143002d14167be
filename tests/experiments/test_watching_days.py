"""Days of sailing that are watched leg by leg: what is kept of a kill, and the rates."""

import io
import json
from types import SimpleNamespace as Made
from typing import Any

import numpy as np
import pytest
from scipy.stats import linregress

from pipelines.experiments.watching import (
    days,
    false_alarms,
    rates,
    replayed,
    sailing,
    segments_kept,
)

ALARM = {"segment": 3, "suspect": "current", "nats": 9.0}


def leg(number: int, often: int, seldom: int = 0) -> dict:
    alarms = {"24": [ALARM] * often, "6": [ALARM] * seldom, "1": []}
    return {"ship": "home1", "leg": number, "seconds": 43_200.0, "alarms": alarms}


def test_a_line_that_a_kill_cut_short_is_watched_again(tmp_path):
    out = tmp_path / "legs.jsonl"
    assert false_alarms.done(out) == []
    out.write_text(json.dumps(leg(1, 0)) + "\n" + json.dumps(leg(2, 1))[:40], encoding="utf-8")
    assert [one["leg"] for one in false_alarms.done(out)] == [1]


def test_a_rate_has_the_exact_interval_of_its_count():
    """Garwood (1936): 90 % of a mean of which 3 were counted are 0.818 to 7.754; of 0, 2.996."""
    assert rates.interval(3) == pytest.approx((0.818, 7.754), abs=1e-3)
    assert rates.interval(0) == pytest.approx((0.0, 2.996), abs=1e-3)
    lines = list(false_alarms.report([leg(1, 2, 0), leg(2, 1, 0)]))
    assert lines[0] == "2 legs, 1.00 days"
    assert "| 24 | 24.0 | 3 | 3.00 (0.82 to 7.75) |" in lines
    assert "| 1 | 1.0 | 0 | 0.00 (0.00 to 3.00) |" in lines


def test_what_a_verdict_dates_to_a_voyage_is_found_wherever_it_stands():
    one = {"voyage": "b", "start_s": 3.0, "end_s": 9.4, "sentence": "A force of 18 N astern."}
    intervals = [one | {"voyage": "a"}, one]
    verdict = {"causes": [{"voyages": [{"voyage": "b"}]}], "intervals": intervals}
    assert replayed.diagnosed(verdict, "b") == ["3 to 9 s: A force of 18 N astern."]
    assert replayed.diagnosed(verdict, "c") == [] == replayed.diagnosed(None, "b")


def test_a_slope_of_memory_is_that_of_a_regression_by_scipy():
    at = np.arange(1.0, 31.0)
    memory = 290.0 + 2.5 / 24.0 * at + np.random.default_rng(3).normal(0.0, 0.1, 30)
    memory[:10] -= 40.0  # it fills at first
    found, low, high = days.slope(at, memory)
    scipys: Any = linregress(at[10:] / 24.0, memory[10:])
    assert found == pytest.approx(scipys.slope)
    assert (high - low) / 2.0 == pytest.approx(1.7341 * scipys.stderr, rel=1e-4)  # t of 18, 95 %
    assert np.isnan(days.slope(at[:4], memory[:4])[0])


def test_memory_that_rises_and_falls_with_each_voyage_is_judged_by_its_highest_lines():
    """Voyages of four hours, a line just after each hour; the last one, cut short, has no next."""
    at = np.arange(1.0, 12.0) * 1.001
    memory = np.array([9.0, 8.0, 7.0, 6.0, 9.5, 8.0, 7.0, 6.0, 10.0, 5.0, 4.0])
    hours, most = days.highest(at, memory)
    assert most.tolist() == [9.0, 9.5]
    assert hours.tolist() == at[[0, 4]].tolist()


def test_voyages_with_a_beginning_are_drawn_alike_whichever_ships_are_there(tmp_path):
    """Only of causes in the ship's bank, in sizes of 0.25 to 1; and `rates` reads what is kept."""
    bank = [Made(name=name) for name in ("current", "fouling", "payload", "no such cause")]
    of: Any = Made(campaign=Made(reference=Made(model=Made(causes=bank))), grid=Made(seconds=30.0))
    everyone = segments_kept.half_ways({s: of for s in sailing.FIVE}, 25, 1000)
    assert {one.cause for one in everyone} == {"current", "fouling", "payload"}
    assert all(0.25 <= one.size <= 1.0 for one in everyone)
    home1 = segments_kept.half_ways({sailing.FIVE[0]: of}, 25, 1000)
    sizes = {one.number: one.size for one in everyone}
    assert [one.number for one in home1] == [1000, 1005, 1010, 1015, 1020]
    assert [sizes[one.number] for one in home1] == [one.size for one in home1]
    written = io.BytesIO()
    everyone[3].write(written, np.ones((2, 4, 4)), np.array([30.0, 60.0]), 900.0)
    (tmp_path / "half-1003.npz").write_bytes(written.getvalue())
    (half,) = rates.halves(tmp_path)
    assert (half.ship, half.cause, half.begins) == ("abkowitz", everyone[3].cause, 900.0)
