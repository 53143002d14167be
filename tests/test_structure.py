"""Features of unknown structures against values written out."""

import numpy as np
import pytest

from shiplog import structure
from shiplog.profile import load
from shiplog.record import Record
from shiplog.structure import Knots, Products


def test_products_of_two_rudders_and_a_screw():
    """n|n|, sin δ |sin δ| and n|n| sin δ of each rudder, in each channel, in units of size."""
    driven = np.zeros((1, 2, 6))
    driven[0, 0, :3] = 0.5, -0.2, 8.0
    driven[0, 1, :3] = -0.1, 0.3, -4.0
    plain = Products(np.array([2.0, 1.0, 1.0]), turning=(0, 1), round=(), driving=(2,))
    found = plain.features(Knots(np.zeros((1, 2, 6)), driven))
    port, starboard, n = np.sin([0.5, -0.1]), np.sin([-0.2, 0.3]), np.array([4.0, -2.0])
    thrust = n * abs(n)
    wanted = [
        thrust,
        port * abs(port),
        starboard * abs(starboard),
        port * thrust,
        starboard * thrust,
    ]
    for channel in range(3):
        own = found[0, :, channel, 5 * channel : 5 * channel + 5]
        assert own == pytest.approx(np.stack(wanted, -1) / np.sqrt(5.0))
    assert np.count_nonzero(found) == 3 * 2 * 5


def test_what_turns_all_the_way_round_pushes_along_its_sine_and_cosine():
    driven = np.array([[[3.0, 2.0, 0.0, 0.0, 0.0]]])  # 3 rad is nearly astern
    plain = Products(np.ones(3), turning=(0,), round=(0,), driving=(1,))
    found = plain.features(Knots(np.zeros((1, 1, 6)), driven))[0, 0, 0, :5] * np.sqrt(5.0)
    s, c = np.sin(3.0), np.cos(3.0)
    assert found == pytest.approx([4.0, s * abs(s), c * abs(c), 4.0 * s, 4.0 * c])


def test_products_know_which_actuators_turn(tmp_path):
    """esso-vectwin: two rudders, one screw; each product of unit size over what was done."""
    rng = np.random.default_rng(1)
    driven = rng.standard_normal((30, 16, 6)) * np.array([0.3, 0.3, 9.0, 0.0, 0.0, 0.0])
    profile = load("esso-vectwin")
    record = Record(
        profile, ("a",), np.zeros(1, int), np.zeros(1), np.zeros(1), np.ones(1, bool),
        np.ones(1, bool), np.zeros((1, 6)), np.zeros((1, 3)), np.zeros((1, 2)), 0.1,
    )  # fmt: skip
    plain = structure.products(record, Knots(np.zeros((30, 16, 6)), driven))
    assert (plain.turning, plain.round, plain.driving) == ((0, 1), (), (2,))
    size = plain.of(Knots(np.zeros((30, 16, 6)), driven)) / plain.scale
    assert (size**2).mean((0, 1)) == pytest.approx(np.ones(3))
