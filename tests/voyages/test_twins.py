"""Two actuators on either side of the centreline: told apart by limits, thrust, or not at all."""

import numpy as np
import pytest
from known_motion import actuator, measured, profile, steered, swinging, table

from shiplog.voyages.contradictions import gross as contradictions
from shiplog.voyages.contradictions import twins

RUDDERS = (
    actuator("port", "rudder", -5.0, -1.0, unit="rad"),
    actuator("starboard", "rudder", -5.0, 1.0, unit="rad"),
    actuator("propeller", "propeller", -4.8, unit="rps", diameter=0.6),
)
PROPELLERS = (
    actuator("port", "propeller", -4.8, -1.0, unit="rps", diameter=0.6),
    actuator("starboard", "propeller", -4.8, 1.0, unit="rps", diameter=0.6),
    actuator("rudder", "rudder", -5.0, unit="rad"),
)
WHICH = "which of port and starboard is which"


def rudders(starboard):
    """Values [n] of the one, a function of those of the other."""
    ship = swinging(turn=7.0)
    helm = ship.drives["rudder"]
    ship.drives = {"port": helm, "starboard": starboard(ship.time, helm),
                   "propeller": ship.drives["propeller"]}  # fmt: skip
    return table(measured(ship), profile(actuators=RUDDERS)), profile(actuators=RUDDERS)


def listed(rows, p):
    return {one.what for one in contradictions.find(rows, p).not_compared}


def test_two_rudders_that_move_apart_are_not_told_from_each_other():
    rows, p = rudders(lambda t, helm: 0.7 * helm + 0.1 * np.sin(0.3 * t))
    assert WHICH in listed(rows, p)


def test_two_rudders_that_always_move_alike_are_of_no_consequence():
    assert WHICH not in listed(*rudders(lambda t, helm: 1.0 * helm))


@pytest.mark.parametrize(("apart", "open_"), [(2.5, False), (0.0, True)])
def test_two_propellers_are_told_apart_by_a_difference_of_thrust(apart, open_):
    """The bow turns to starboard where port pushes more: N = -y X."""
    ship = steered(900.0, lambda t, psi, r, u: 0.02 * apart * np.sin(0.05 * t),
                   lambda t, *_: 5.0 + 0.3 * np.sin(0.013 * t), length=10.0)  # fmt: skip
    t, shaft = ship.time, ship.drives["propeller"]
    apart = apart * np.sin(0.05 * t) + 0.5 * np.sin(0.7 * t)
    ship.drives = {"port": shaft + apart, "starboard": shaft - apart, "rudder": 0.0 * t}
    p = profile(actuators=PROPELLERS)
    assert (WHICH in listed(table(measured(ship), p), p)) is open_


def limited(port, starboard):
    """The two rudders with these limits [rad]."""
    ends = [f", limits = [{low}, {high}] }}" for low, high in (port, starboard)]
    return [one[: one.rindex(" }")] + end for one, end in zip(RUDDERS, ends, strict=False)]


def by_limits(port, starboard, own, other):
    rows, _ = rudders(lambda t, helm: helm)
    t = np.linspace(0.0, 1.0, rows.height)
    rows = rows.with_columns(port=port(t), starboard=starboard(t))
    return twins.find_exchanged(rows, profile(actuators=limited(own, other)))


OUT, IN = (-1.8, 0.6), (-0.6, 1.8)  # rad, of a pair that goes further outboard than inboard


def test_rudders_beyond_their_own_limits_and_within_each_others_are_exchanged():
    (found,) = by_limits(lambda t: 1.5 * t, lambda t: -1.5 * t, OUT, IN)
    assert (found.kind, found.channel, found.reason) == ("contradiction", "port", "swapped")
    assert "`topic`" in found.sentence and "port and starboard" in found.sentence


@pytest.mark.parametrize(
    ("port", "starboard", "own", "other"),
    [
        (lambda t: -1.5 * t, lambda t: 1.5 * t, OUT, IN),  # as the profile has them
        (lambda t: 1.5 * t, lambda t: 0.2 * t, OUT, IN),  # one alone, beyond its limits
        (lambda t: 1.5 * t, lambda t: -1.5 * t, (-0.6, 0.6), (-0.6, 0.6)),  # no limits tell
        (lambda t: 2.5 * t, lambda t: -2.5 * t, OUT, IN),  # nor do these
    ],
)
def test_other_limits_say_nothing_of_which_is_which(port, starboard, own, other):
    assert by_limits(port, starboard, own, other) == []
