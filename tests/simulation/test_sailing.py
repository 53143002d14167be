"""Models sailed on orders: against a Nomoto ship's exact zigzag, and the rollouts of windows."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from shiplog.exceptions import ShiplogError
from shiplog.ship_profile import file as profiles
from shiplog.simulation import schedules
from shiplog.simulation.controls import Controls
from shiplog.simulation.helm import OfTables, helm
from shiplog.simulation.sailing import Steps, Water, sail
from shiplog.simulation.schedules import PullOut, Schedule, Spiral, Stop, Turn, Zigzag

K, T, SPEED, LENGTH = 0.08, 12.0, 5.0, 100.0
NAMES = ("rudder", "propeller")
LIMITS = np.array([50.0, 50.0, 1.0])


def nomoto(state, actuator, wind):
    """T ṙ + r = K δ; u̇ = 0.02 (5 n - u)."""
    rate = np.zeros((len(state), 3))
    rate[:, 0] = 0.02 * (SPEED * actuator[:, 1] - state[:, 1])
    rate[:, 2] = (K * actuator[:, 0] - state[:, 5]) / T
    return rate


def controls(rate=1e9):
    return Controls(
        NAMES, np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.array([0.0, -1.0]),
        np.array([-0.7, -1.0]), np.array([0.7, 1.0]), np.array([rate, 1e9]),
    )  # fmt: skip


def start(count=1, u=SPEED):
    state = np.zeros((count, 6))
    state[:, 1] = u
    return state


def sailed(manoeuvre, seconds, step=1.0, count=1, rates=nomoto, rate=1e9, heun=False):
    sticks, first = controls(rate), start(count)
    made = helm(manoeuvre, sticks, first, LENGTH / SPEED)
    return sail(rates, made, sticks, first, Steps(seconds, step, 1, LIMITS, heun))


def exact_overshoot(angle, heading):
    """Of the first order back, deg, in closed form."""
    turning = K * math.radians(angle)

    def psi(t):
        return turning * (t - T * (1.0 - math.exp(-t / T)))

    at = brentq(lambda t: psi(t) - math.radians(heading), 0.0, 1e3)
    r = turning * (1.0 - math.exp(-at / T))
    t = T * math.log((r + turning) / turning)
    return math.degrees((r + turning) * T * (1.0 - math.exp(-t / T)) - turning * t)


def overshoot(angle, heading, step, heun):
    """Of the parabola through the samples about the first peak, deg."""
    of = Zigzag(math.radians(angle), math.radians(heading))
    psi = math.copysign(1.0, angle) * np.degrees(sailed(of, 60.0, step, heun=heun).state[0, :, 4])
    k = int(np.nanargmax(psi))
    before, peak, after = psi[k - 1 : k + 2]
    return peak + (before - after) ** 2 / 8.0 / (2.0 * peak - before - after) - heading


@pytest.mark.parametrize("angle, heading", [(10.0, 10.0), (-20.0, 20.0)])
def test_a_zigzag_comes_to_the_exact_overshoot_as_steps_become_short(angle, heading):
    """Halving Euler's step halves its error: an order's instant is no multiple of the step."""
    wanted = exact_overshoot(abs(angle), heading)
    errors = [overshoot(angle, heading, step, False) - wanted for step in (0.5, 0.25, 0.125)]
    assert abs(errors[2]) < 0.005 * wanted
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.1)
    assert overshoot(angle, heading, 0.25, True) == pytest.approx(wanted, rel=2e-4)


def test_members_are_as_they_are_alone():
    """Each reverses at its own heading."""
    of = Zigzag(math.radians(20.0), math.radians(20.0))
    sticks, first = controls(), start(3)
    first[:, 5] = [0.0, 0.02, -0.02]
    steps = Steps(150.0, 0.5, 1, LIMITS)
    together = sail(nomoto, helm(of, sticks, first, 20.0), sticks, first, steps)
    for k in range(3):
        one = first[k : k + 1]
        alone = sail(nomoto, helm(of, sticks, one, 20.0), sticks, one, steps)
        assert together.ended[k] == alone.ended[0]
        there = np.isfinite(alone.state[0, :, 0])
        assert together.state[k, : len(there)][there] == pytest.approx(alone.state[0][there])


def test_the_rudder_takes_its_time():
    found = sailed(Turn(math.radians(35.0)), 20.0, 1.0, rate=math.radians(5.0))
    angles = np.degrees(found.actuator[0, 1:9, 0])
    assert angles == pytest.approx([5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 35.0])


def test_a_screw_that_is_stopped_stands():
    """To the last bit: what a model divides by is no rounding error."""
    slow = Controls(NAMES, np.array([1.0, 0.0]), np.array([0.0, 0.7]), np.zeros(2),
                    np.array([-0.7, 0.0]), np.array([0.7, 1.0]), np.array([1e9, 0.3]))  # fmt: skip
    now, none = np.array([[0.0, 0.7]]), np.zeros(1)
    for _ in range(4):
        now, mean = slow.moved(now, np.zeros((1, 2)), none, 1.0)
    assert now.tolist() == mean.tolist() == [[0.0, 0.0]]


def test_a_current_carries_the_ship_and_nothing_else():
    of, water = Turn(math.radians(20.0)), Water(current=(0.5, -0.3))
    sticks = controls()
    first = start()
    moved = first.copy()
    moved[:, [1, 3]] += [0.5, -0.3]
    steps = Steps(200.0, 1.0, 1, LIMITS)
    still = sail(nomoto, helm(of, sticks, first, 20.0), sticks, first, steps)
    flowing = sail(nomoto, helm(of, sticks, moved, 20.0), sticks, moved, steps, water=water)
    gone = flowing.state[0, :, [0, 2]] - still.state[0, :, [0, 2]]
    assert gone == pytest.approx(np.array([[0.5], [-0.3]]) * still.time, abs=1e-9)
    assert flowing.state[0, :, 4] == pytest.approx(still.state[0, :, 4])


def test_manoeuvres_end():
    assert math.degrees(sailed(Turn(math.radians(35.0)), 9e3).state[0, -1, 4]) > 719.0
    assert np.isfinite(sailed(Stop(), 900.0).ended[0])
    for of in (PullOut(), Spiral()):
        found = sailed(of, of.duration(LENGTH / SPEED))
        assert np.isfinite(found.ended[0]), of.name
    spiral = sailed(Spiral(), Spiral().duration(20.0))
    held = np.degrees(spiral.actuator[0, 1:, 0])
    assert set(np.round(np.unique(held), 6)) == {-15, -10, -5, -3, -1, 0, 1, 3, 5, 10, 15}


def test_what_diverges_is_said_and_ends():
    def wild(state, actuator, wind):
        rate = nomoto(state, actuator, wind)
        rate[1:, 0] += 5.0
        return rate

    found = sailed(Turn(math.radians(35.0)), 60.0, count=2, rates=wild)
    assert np.isinf(found.diverged[0]) and 5.0 < found.diverged[1] < 15.0
    assert not np.isfinite(found.state[1, -1]).any()
    assert found.frame.filter(member=1).height < found.frame.filter(member=0).height


def test_positions_that_are_known_are_taken_as_they_are():
    time = np.array([0.0, 10.0, 20.0])
    values = np.array([[[0.0, 1.0], [0.35, 1.0], [0.0, 0.5]]])
    sticks, first = controls(0.001), start()
    made = OfTables(time, values, sticks, first, 20.0)
    found = sail(nomoto, made, sticks, first, Steps(20.0, 1.0, 1, LIMITS), measured=True)
    assert found.actuator[0, 6, 0] == pytest.approx(0.35 * 0.5)
    assert found.actuator[0, 16, 1] == pytest.approx(0.75)


# --- schedules -------------------------------------------------------------------------------


@pytest.mark.parametrize("words", ["10", "a/b", "0/10", "10/0", "10/10/10", "nan/10", "100/10"])
def test_no_zigzag(words):
    with pytest.raises(ShiplogError, match="no zigzag"):
        schedules.zigzag(words)


def test_a_zigzag_in_words():
    assert schedules.zigzag("-20/10") == Zigzag(math.radians(-20.0), math.radians(10.0))


def test_a_schedule_is_read_as_it_was_written(tmp_path):
    profile = profiles.load("kvlcc2")
    made = Schedule((0.0, 5.0, 30.0), {"rudder": (0.0, 0.2, -0.2), "propeller": (9.0, 9.0, 9.5)})
    path = tmp_path / "mine.csv"
    path.write_text(schedules.text_of(made, profile))
    read = schedules.read(path, profile)
    assert read.time == made.time and read.name == "mine" and read.seconds == 30.0
    for name, values in made.orders.items():
        assert read.orders[name] == pytest.approx(values, abs=1e-9)
    assert read.at(17.5)["rudder"] == pytest.approx(0.0)


@pytest.mark.parametrize(
    "text, says",
    [
        ("", "no row"), ("time_s,rudder\n", "no row"),
        ("t,rudder\n0,1\n", "no column time_s"),
        ("time_s,ruder_deg\n0,1\n", "did you mean 'rudder'"),
        ("time_s,rudder\n0,1\n1,x\n", "Line 3"),
        ("time_s,rudder\n0,1\n1\n", "Line 3"),
        ("time_s,rudder\n0,nan\n", "Line 2"),
        ("time_s,rudder\n5,1\n1,2\n", "do not rise"),
        ("time_s,rudder\n-5,1\n1,2\n", "do not rise"),
        ("time_s,rudder,rudder_deg\n0,1,1\n", "two columns"),
        ("time_s\n0\n", "no order"),
    ],
)  # fmt: skip
def test_schedules_that_are_none(tmp_path, text, says):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(ShiplogError, match=says):
        schedules.read(path, profiles.load("kvlcc2"))


def test_a_schedule_that_is_not_there(tmp_path):
    with pytest.raises(ShiplogError, match="cannot be read"):
        schedules.read(tmp_path / "none.csv", profiles.load("kvlcc2"))


def test_a_recorded_wind_blows_row_by_row_and_its_mean_after_it():
    """u̇ is the wind's part along x₀, in two Euler steps a row."""

    def pushed(state, actuator, wind):
        return np.stack((wind[:, 0], *np.zeros((2, len(state)))), axis=-1)

    recorded = np.array([[0.1, 0.0], [0.3, 0.0], [-0.2, 0.0]])
    water, of, sticks = Water((0.5, 0.0), recorded=recorded), Turn(math.radians(0.1)), controls()
    made = helm(of, sticks, start(), 20.0)
    found = sail(pushed, made, sticks, start(), Steps(5.0, 1.0, 2, LIMITS), water=water)
    gained = found.state[0, :, 1] - SPEED
    assert gained == pytest.approx([0.0, 0.1, 0.4, 0.2, 0.7, 1.2])
