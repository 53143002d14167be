"""A line, a tow and a wall's contact: by hand, where each has its place, and when it has none."""

import math
from dataclasses import asdict, replace

import numpy as np
import pytest
from cause_ships import BY, CALM, PLACES, TWIN, forces, setting

from shiplog.models.causes import CATALOGUE
from shiplog.models.causes.contact import Contact
from shiplog.models.causes.environment import to_wall
from shiplog.models.causes.lines import Line, Tow

OFF = ("propeller", "rudder", "wind")
LINE = BY["line"].on(setting())
MIDDLE = PLACES.mean(0)
REACH = math.sqrt(((PLACES - MIDDLE) ** 2).sum(1).mean())


def at(north: float, east: float) -> np.ndarray:
    """A place, from the middle of where the ship was."""
    return MIDDLE + np.array([north, east])


def added(label: str, numbers, place, heading=0.0, u=0.0, v=0.0, share=0.0) -> np.ndarray:
    """X, Y, N that the numbers add."""
    state = np.array([[place[0], u, place[1], v, heading, 0.0]])
    driven = np.array([[0.0, 0.0, 0.0, share]])
    one, none = (
        forces(label, p, state, driven, CALM, OFF) for p in (numbers, np.zeros(len(numbers)))
    )
    return (one - none)[0]


# --- a line ---------------------------------------------------------------------------------------


def test_without_bend_a_line_is_a_spring_to_its_point():
    """By hand: stiffness times the way to the point, turned into the ship's axes."""
    k, point, place, heading = 0.08, at(9.0, -4.0), at(3.0, 4.0), 0.7
    found = added("line", [*k * (point - MIDDLE), k, 0.0, 0.0], place, heading)
    north, east = k * 6.0, -k * 8.0
    c, s = math.cos(heading), math.sin(heading)
    assert found == pytest.approx([c * north + s * east, c * east - s * north, 0.0], abs=1e-9)
    assert np.hypot(*found[:2]) == pytest.approx(0.8)


def test_with_full_bend_its_pull_is_the_same_at_every_distance():
    """But near its point, where it hangs slack."""
    k, point = 0.08, at(9.0, -4.0)
    numbers = [*k * (point - MIDDLE), k, 1.0, 0.0]
    pull = math.hypot(*numbers[:2], k * REACH)
    for far in (8.0, 20.0, 60.0):
        found = added("line", numbers, point + far * np.array([0.6, 0.8]))
        assert found[:2] == pytest.approx(pull * np.array([-0.6, -0.8]), rel=0.03)
    near = added("line", numbers, point + np.array([0.05, 0.0]))
    assert abs(near[0]) < 0.1 * pull


def test_where_it_is_made_fast_it_turns_the_ship():
    numbers = np.array([0.5, 1.0, 0.0, 0.0, 0.0])
    for ahead in (1.2, -1.4):
        found = added("line", [*numbers[:4], ahead], MIDDLE)
        assert found == pytest.approx([0.5, 1.0, ahead], abs=1e-9)


def test_it_pulls_from_where_it_is_made_fast():
    """Right over its point the ship is pulled by its bow, which is 1.2 m beyond."""
    k, heading = 0.5, 0.7
    found = added("line", [0.0, 0.0, k, 0.0, 1.2], MIDDLE, heading)
    assert found == pytest.approx([-k * 1.2, 0.0, 0.0], abs=1e-9)
    abeam = at(0.6 * -math.sin(heading), 0.6 * math.cos(heading))  # 0.6 m to starboard of it
    found = added("line", [0.0, 0.0, k, 0.0, 1.2], abeam, heading)
    assert found == pytest.approx([-k * 1.2, -k * 0.6, -k * 0.6 * 1.2], abs=1e-9)


def test_far_away_its_pull_is_the_same_everywhere_and_bends_nothing():
    for bend in (-1.0, 0.0, 1.0):
        for place in (MIDDLE, at(30.0, -20.0)):
            found = added("line", [0.3, 0.4, 0.0, bend, 0.0], place)
            assert found == pytest.approx([0.3, 0.4, 0.0], rel=0.01, abs=1e-9)


def test_its_place_has_the_interval_of_its_stiffness():
    """With the pull known, x₀ is x_c + a/k: its ends are at k ∓ 1.645 σ."""
    a, k, sigma = 0.9, 0.06, 0.004
    found = LINE.estimates(np.array([a, 0.0, k, 0.0, 0.5]), np.diag([0, 0, sigma**2, 0, 0]))
    assert found["x0"].value == pytest.approx(MIDDLE[0] + a / k)
    assert found["x0"].low == pytest.approx(MIDDLE[0] + a / (k + 1.645 * sigma), abs=0.1)
    assert found["x0"].high == pytest.approx(MIDDLE[0] + a / (k - 1.645 * sigma), abs=0.1)
    ends = [found["y0"].low, found["y0"].high]
    assert ends == pytest.approx([MIDDLE[1]] * 2, abs=1e-6)
    assert "direction" not in found and "x0 = " in LINE.sentence(found)
    assert found["stiffness"].value == pytest.approx(k) and found["position"].value == 0.5


def test_whose_stiffness_may_be_none_has_a_direction_and_no_place():
    """A stiffness of one standard deviation is as good as none."""
    variance = np.array([1e-3, 1e-3, 0.01, 0.0, 0.0]) ** 2
    found = LINE.estimates(np.array([-0.3, 0.3, 0.01, 0.0, -0.5]), np.diag(variance))
    assert set(found) == {"direction", "pull", "position"}
    assert found["direction"].value == pytest.approx(135.0)
    assert found["direction"].high - found["direction"].low < 1.0
    text = LINE.sentence(found)
    assert "towards 135 deg" in text and "0.50 m abaft midship" in text
    assert all(np.isfinite([v.low, v.high]).all() for v in found.values())


def test_a_pull_matters_by_its_size_whichever_number_makes_it():
    least = 3e-4 * 244.6
    for numbers in ([least, 0, 0], [0, 0, least / REACH]):
        for factor, matters in ((1.01, True), (0.5, False)):
            p = factor * np.array([*numbers, 0.0, 5.0])
            assert bool(LINE.practical(p, setting())) == matters
    assert LINE.sizes(setting())[2] == pytest.approx(LINE.sizes(setting())[0] / REACH)


def test_a_ship_that_stays_has_no_place_to_tell():
    one = setting(TWIN, 0.01 * PLACES)
    assert Line().missing(one) == "the ship stayed in one place"
    assert Line().missing(setting()) is None and Tow().missing(one) is None


def test_kept_with_a_run_it_still_knows_its_middle():
    """Ships share one kernel, whatever the middle: it is no part of what tells two lines apart."""
    made = {k: tuple(v) if isinstance(v, list) else v for k, v in asdict(LINE).items()}
    again = replace(next(c for c in CATALOGUE if c.label == "line"), **made)
    p = np.array([0.5, 0.2, 0.05, 0.1, 0.0])
    assert again.displayed(p)["x0"] == LINE.displayed(p)["x0"] == (MIDDLE[0] + 10.0, "m")
    assert again == Line() and repr(again) == repr(Line()) and hash(again) == hash(Line())


# --- a tow ----------------------------------------------------------------------------------------


def test_a_tow_that_turns_half_round_pulls_alike_all_the_while():
    """North at the begin, east in the middle, south at the end: the direction is π τ."""
    numbers = [1.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0]
    for share in (0.0, 0.2, 0.5, 0.77, 1.0):
        found = added("tow", numbers, (3.0, 5.0), share=share)
        wanted = [math.cos(math.pi * share), math.sin(math.pi * share), 0.0]
        assert found == pytest.approx(wanted, abs=1e-9)
    shown = {k: float(v) for k, (v, _) in Tow().displayed(np.array(numbers)).items()}
    assert shown == pytest.approx({"pull": 1.0, "direction": 90.0, "turn": 180.0, "position": 0.0})


def test_a_tow_that_does_not_turn_is_a_constant_force():
    for share in (0.0, 0.3, 1.0):
        found = added("tow", [0.3, 0.4] * 3 + [1.5], (0.0, 0.0), share=share)
        assert found == pytest.approx([0.3, 0.4, 0.6], abs=1e-9)
    shown = Tow().displayed(np.array([0.3, -0.4] * 3 + [1.5]))
    assert float(shown["turn"][0]) == pytest.approx(0.0)
    assert "towards 307 deg, and turns by 0 deg" in Tow().sentence(
        Tow().estimates(np.array([0.3, -0.4] * 3 + [1.5]), 1e-8 * np.eye(7))
    )


def test_a_line_and_a_tow_are_not_weighed_together():
    assert not Line().compatible("tow") and not Tow().compatible("line")
    assert Line().compatible("current") and Tow().compatible("current")


# --- a wall ---------------------------------------------------------------------------------------

WALL, BREADTH, LENGTH = 40.0, 0.489, 3.0  # the profile's wall along y₀ = 40 m


def test_a_wall_alongside_pushes_off_and_holds_back():
    """By hand, parallel to it: R e^(-gap/δ) off the wall, and friction against the motion."""
    gap = 0.2
    place = (0.0, WALL - 0.5 * BREADTH - gap)
    force = 2.0 * math.exp(-gap / (0.1 * LENGTH))
    for heading, off in ((0.0, -1.0), (math.pi, 1.0)):
        found = added("contact", [2.0, 0.3, 0.0], place, heading, u=0.6)
        assert found == pytest.approx([-0.3 * force, off * force, 0.0], rel=2e-3, abs=1e-3)
        astern = added("contact", [2.0, 0.3, 0.0], place, heading, u=-0.6)
        assert astern == pytest.approx(found * [-1, 1, 1], abs=1e-3)
    wider = added("contact", [2.0, 0.0, math.log(2.0)], place)
    assert wider[1] == pytest.approx(-2.0 * math.exp(-gap / (0.2 * LENGTH)), rel=2e-3)


def test_a_wall_turns_the_end_that_is_nearer_to_it_off():
    place, numbers = (0.0, WALL - 1.0), [2.0, 0.0, 0.0]
    bow, stern = (added("contact", numbers, place, heading) for heading in (0.3, -0.3))
    assert bow[2] < -0.1 and stern == pytest.approx(bow * [-1, 1, -1], abs=1e-9)


def test_a_wall_pushes_no_harder_than_where_it_touches_and_hardly_from_afar():
    numbers = [2.0, 0.0, 0.0]
    touching, beyond = (added("contact", numbers, (0.0, WALL - d))[1] for d in (0.5 * BREADTH, 0.1))
    assert touching == pytest.approx(-2.0, rel=5e-3) and beyond == pytest.approx(-2.0, rel=1e-3)
    assert abs(added("contact", numbers, (0.0, WALL - 10.0))[1]) < 1e-9


def test_beyond_the_wall_s_line_it_touches_and_on_the_other_side_it_is_free():
    """A chart's line is metres wrong; off its end the gap is as much longer."""
    numbers = [2.0, 0.0, 0.0]
    assert added("contact", numbers, (0.0, WALL + 0.4))[1] == pytest.approx(-2.0, rel=1e-3)
    assert added("contact", numbers, (0.0, WALL + 1.6)) == pytest.approx([0.0] * 3, abs=1e-9)
    ends = [x for x, _ in TWIN.site.banks[0]]
    found = added("contact", numbers, (max(ends) + 0.3, WALL - 0.5 * BREADTH))
    assert found[1] == pytest.approx(-2.0 * math.exp(-0.3 / (0.1 * LENGTH)), rel=1e-2)


def test_a_ship_that_came_near_no_wall_touched_none():
    """A ship of three metres, 4 m and 2 m from the wall."""
    track = np.zeros((3, 6))
    track[:, 2] = 36.0, 30.0, 35.0
    near = to_wall(track, TWIN.site.banks)
    assert near == pytest.approx(WALL - 36.0, rel=1e-3)
    assert "alongside no wall" in (Contact().missing(replace(setting(), to_wall=near)) or "")
    assert Contact().missing(replace(setting(), to_wall=2.0)) is None
    assert to_wall(track, ()) == math.inf
    shown = Contact().on(setting()).displayed(np.array([3.0, 0.2, 0.0]))
    assert shown["reach"] == (pytest.approx(0.1 * LENGTH), "m")
