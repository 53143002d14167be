"""Windows in units of the ship: how long `--window auto` makes them, and when 100 s do not suit."""

import numpy as np
import polars as pl
import pytest

from shiplog.voyages.windows import ship_time
from shiplog.voyages.windows.ship_time import ShipTime


@pytest.mark.parametrize(
    ("length", "speed", "seconds"),
    [
        (3.0, 0.40, 100),  # the paper's ship: L/U is 7.5 s
        (2.0, 0.80, 70),  # 2.5 s: the shortest, as of segments
        (30.0, 1.0, 400),  # 30 s
        (100.0, 5.0, 200),  # 20 s
        (305.0, 3.4, 800),  # 90 s: the longest
        (80.0, 0.0, 100),  # at rest
    ],
)
def test_a_window_follows_the_ship_in_steps_of_two(length, speed, seconds):
    assert ShipTime(length, speed).window == seconds


def test_a_short_record_halves_it_until_six_windows_fit():
    ship = ShipTime(30.0, 1.0)  # 400 s
    assert ship.auto(lambda size: 2400 // size) == 400
    assert ship.auto(lambda size: 1199 // size) == 100  # of 200 s there would be five
    assert ship.auto(lambda size: 0) == 100  # the least; what follows says that none fits
    assert ShipTime(2.0, 0.8).auto(lambda size: 0) == 70


def test_the_papers_window_suits_the_papers_ship():
    ship = ShipTime(3.0, 0.4)
    assert ship.words(100) == "13 ship times L/U"  # 100 s / 7.5 s
    assert ship.advice(100) == ""


@pytest.mark.parametrize(
    ("ship", "window", "words"),
    [
        (ShipTime(100.0, 5.0), 100, ("5 times L/U", "100 m at 5 m/s", "auto takes 200 s")),
        (ShipTime(2.0, 2.0), 100, ("100 times L/U", "out of proportion", "auto takes 70 s")),
    ],
)
def test_a_window_that_does_not_suit_is_a_sentence(ship, window, words):
    advice = ship.advice(window)
    assert all(word in advice for word in words), advice


def test_nothing_is_advised_that_is_no_better():
    assert ShipTime(305.0, 3.4).advice(800) == ""  # 9 L/U
    assert ShipTime(2.0, 2.0).advice(70) == ""  # 70 L/U, and there is no shorter one
    assert ShipTime(80.0, 0.0).advice(100) == "" == ShipTime(80.0, 0.0).words(100)


def test_the_speed_is_that_of_the_ship_under_way():
    """Of 100 s, 60 at a berth: 19 of 20 seconds are not faster than 2 m/s, of 5 m at 2 m/s."""
    rows = pl.DataFrame({"surge": np.repeat([0.0, 1.6], [60, 40]), "sway": [0.0] * 60 + [1.2] * 40})
    assert ship_time.of(5.0, rows).speed == pytest.approx(2.0)
    assert ship_time.of(5.0, rows).seconds == pytest.approx(2.5)
