"""Instruments put right again, and rudders that lag or come late, in closed form."""

import closed
import numpy as np
import pytest
from cause_ships import BY, SHIPS, SINGLE, TWIN, setting, sized
from test_causes import CHANGED

from shiplog.models.causes import CATALOGUE
from shiplog.models.causes.steering import RudderDelay, RudderLag, RudderOffset
from shiplog.voyages.rows.recording import Record

# --- sensors: the test bends them by hand ---------------------------------------------------------


WRONG = {  # label → what the instruments do, the cause's own numbers for it
    "heading_offset": ({"heading": 0.08}, [0.08]),
    "heading_offset:gnss": ({"heading": 0.08, "by_compass": True}, [0.08]),
    "yaw_rate_bias": ({"bias": -0.007}, [-0.007]),
    "yaw_rate_scale": ({"scale": 1.08}, [0.08]),
    "antenna_offset": ({"moved": (0.7, -0.25)}, [0.7, -0.25]),
    "wind_direction_offset": ({"wind_angle": 0.3}, [0.3]),
    "wind_speed_scale": ({"wind_scale": 0.8}, [-0.2]),
    "clock_offset:position": ({"late": {"position": 0.73}}, [0.73]),
    "clock_offset:velocity": ({"late": {"velocity": -0.4}}, [-0.4]),
    "clock_offset:gnss": ({"late": {"position": 0.73, "velocity": 0.73}}, [0.73]),
    "clock_offset:velocity_turned": ({"late": {"velocity": 0.6}, "by_compass": True}, [0.6]),
    "clock_offset:gnss_turned": (
        {"late": {"position": 0.6, "velocity": 0.6}, "by_compass": True}, [0.6],
    ),
    "clock_offset:yaw_rate": ({"late": {"yaw_rate": 1.21}}, [1.21]),
    "clock_offset:wind": ({"late": {"wind": 0.55}}, [0.55]),
}  # fmt: skip
INNER = slice(20, -20)  # rows whose later values a delay still finds


def test_every_sensor_cause_is_bent_here():
    assert set(WRONG) == {c.label for c in CATALOGUE if c.kind == "sensor"}


@SHIPS
@pytest.mark.parametrize("label", WRONG)
def test_bent_instruments_are_put_right(label, profile):
    bent, numbers = WRONG[label]
    if BY[label].missing(setting(profile)):
        pytest.skip("a velocity over ground is turned by nobody")
    was, wrong = closed.record(profile), closed.record(profile, **bent)
    found = BY[label].read(wrong, np.array(numbers))
    # a clock is put right by interpolation: h²/8 times a second derivative of at most 0.06
    close = 1e-4 if label.startswith("clock") else 1e-12
    far = max(np.abs(getattr(wrong, n) - getattr(was, n))[INNER].max() for n in CHANGED)
    assert far > 10.0 * close  # they were bent
    for name in CHANGED:
        right = getattr(found, name)[INNER]
        assert right == pytest.approx(getattr(was, name)[INNER], abs=close), name


@SHIPS
@pytest.mark.parametrize(
    "cause", [c for c in CATALOGUE if c.reads and not c.name.startswith("actuator")],
    ids=lambda c: c.label,
)  # fmt: skip
def test_inverse_undoes_read(cause, profile):
    """What the instruments will show, of what was. A lag forgets nothing but its first seconds; a
    limit or a dead band has no inverse, and none is asked for: it changes no instrument."""
    cause = cause.on(setting(profile))
    observed = closed.record(profile)
    numbers = sized(cause)
    back = cause.read(cause.read(observed, numbers), cause.inverse(numbers))
    rough = cause.label.startswith(("clock", "rudder_delay", "rudder_lag"))
    rows = slice(100, -40) if rough else slice(None)
    for name in CHANGED:
        assert getattr(back, name)[rows] == pytest.approx(
            getattr(observed, name)[rows], abs=2e-3 if rough else 1e-12
        ), name


def test_instruments_are_put_right_one_after_another():
    """Compass, gyro and antenna wrong together: the catalogue's order takes them apart."""
    wrong = closed.record(TWIN, heading=-0.05, bias=0.004, moved=(0.3, 0.1))
    for label, numbers in (
        ("heading_offset", [-0.05]), ("yaw_rate_bias", [0.004]), ("antenna_offset", [0.3, 0.1]),
    ):  # fmt: skip
        wrong = BY[label].read(wrong, np.array(numbers))
    assert wrong.state == pytest.approx(closed.record(TWIN).state, abs=1e-12)


# --- rudders --------------------------------------------------------------------------------------


def steered(values: np.ndarray, starts: tuple[int, ...] = (0,)) -> Record:
    """Both rudders recorded at these values [n], the screw at 5 rev/s."""
    observed = closed.record(TWIN)
    count = len(values)
    actuator = np.stack((values, -2.0 * values, np.full(count, 5.0)), -1)
    begins = np.zeros(count, dtype=bool)
    begins[list(starts)] = True
    return Record(
        TWIN, ("one",), np.zeros(count, dtype=int), 0.1 * np.arange(count), np.zeros(count),
        begins, np.ones(count, dtype=bool), observed.state[:count], actuator, observed.wind[:count],
    )  # fmt: skip


@pytest.mark.parametrize("lag", (0.07, 0.4, 2.5))
def test_lag_of_a_ramp(lag):
    """δ = k (t - T (1 - e^(-t/T))), the first-order answer to a ramp that began at rest."""
    t = 0.1 * np.arange(400)
    found = RudderLag().read(steered(0.03 * t), np.array([lag])).actuator
    answer = 0.03 * (t - lag * (1.0 - np.exp(-t / lag)))
    assert found[:, 0] == pytest.approx(answer, abs=1e-12)
    assert found[:, 1] == pytest.approx(-2.0 * answer, abs=1e-12)
    assert (found[:, 2] == 5.0).all()


def test_lag_of_a_step():
    """1 - e^(-t/T), from the middle of the tenth of a second in which the record shows the step."""
    t = 0.1 * np.arange(300)
    found = RudderLag().read(steered(np.where(t > 9.95, 1.0, 0.0)), np.array([2.0])).actuator[:, 0]
    answer = np.where(t > 9.95, 1.0 - np.exp(-(t - 9.95) / 2.0), 0.0)
    assert found == pytest.approx(answer, abs=2e-4)  # (h/T)²/24, the ramp within that tenth


def test_a_lag_forgets_what_was_before_a_gap():
    values = np.where(np.arange(400) < 200, 0.5, -0.2)
    found = RudderLag().read(steered(values, (0, 200)), np.array([3.0])).actuator[:, 0]
    assert found == pytest.approx(values, abs=1e-12)


def test_delay_of_a_ramp():
    t = 0.1 * np.arange(300)
    found = RudderDelay().read(steered(0.03 * t), np.array([1.27])).actuator
    assert found[:, 0] == pytest.approx(0.03 * np.maximum(t - 1.27, 0.0), abs=1e-12)
    assert (found[:, 2] == 5.0).all()


def test_two_rudders_have_two_offsets_and_one_has_one():
    two, one = RudderOffset().on(setting(TWIN)), RudderOffset().on(setting(SINGLE))
    assert (two.count, one.count) == (2, 1)
    assert list(two.displayed(np.array([0.1, -0.2]))) == ["port", "starboard"]
    assert list(one.displayed(np.array([0.1]))) == ["angle"]
    observed = closed.record(TWIN)
    moved = two.read(observed, np.array([0.1, -0.2])).actuator - observed.actuator
    assert moved == pytest.approx(np.broadcast_to([0.1, -0.2, 0.0], moved.shape), abs=1e-12)
    observed = closed.record(SINGLE)
    moved = one.read(observed, np.array([0.1])).actuator - observed.actuator
    assert moved == pytest.approx(np.broadcast_to([0.1, 0.0], moved.shape), abs=1e-12)


def test_parts_may_differ_in_the_clock_that_position_and_velocity_share():
    """It has no nominal value beside theirs. A rudder's delay, an alias of its lag alone, does not
    vary, either. A line or a tow may be there on some nominal voyages."""
    by = {cause.label: cause for cause in CATALOGUE}
    clocks = [by[f"clock_offset:{channel}"] for channel in ("position", "velocity", "gnss")]
    assert [(clock.nominal, clock.varies) for clock in clocks] == [(True, True)] * 2 + [
        (False, True)
    ]
    turned = [by[f"clock_offset:{channel}_turned"] for channel in ("velocity", "gnss")]
    assert not any(clock.nominal or clock.varies for clock in turned)
    alike = [c for c in CATALOGUE if c.name not in ("clock_offset", "line", "tow")]
    assert all(c.varies == c.nominal for c in alike)
    assert not by["rudder_delay"].varies
