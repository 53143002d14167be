"""What holds for every cause: zero of it changes nothing, its words, its realistic size."""

import math
from dataclasses import replace

import closed
import jax.numpy as jnp
import numpy as np
import pytest
from cause_ships import (
    BY,
    EVERY,
    FERRY,
    SHIPS,
    TWIN,
    acceleration,
    extended,
    network,
    setting,
    sized,
    under_way,
)

from shiplog.models.causes import CATALOGUE
from shiplog.models.causes.environment import Current
from shiplog.models.causes.ship import Payload
from shiplog.voyages.rows.recording import Record

DEGREE = math.pi / 180.0


# --- nothing --------------------------------------------------------------------------------------


def test_labels_are_unique():
    assert len(BY) == len(CATALOGUE)


@EVERY
def test_zero_leaves_an_mmg_as_it_was(cause):
    cause = cause.on(setting())
    model, values = extended([cause])
    state, actuator, wind = under_way()
    found = acceleration(model, values, np.zeros(cause.count), state, actuator, wind)
    plain = model.base.acceleration(jnp.asarray(values), state, actuator[:, :-1], wind)
    assert found == pytest.approx(np.asarray(plain), rel=1e-14, abs=1e-16)


@EVERY
def test_zero_leaves_a_network_as_it_was(cause):
    cause = cause.on(setting())
    model, values = extended([cause], base=network())
    state, actuator, wind = under_way()
    found = acceleration(model, values, np.zeros(cause.count), state, actuator, wind)
    plain = model.base.acceleration(jnp.asarray(values), state, actuator[:, :-1], wind)
    assert found == pytest.approx(np.asarray(plain), rel=1e-14, abs=1e-16)


@EVERY
@pytest.mark.parametrize("base", (None, network()), ids=("mmg", "network"))
def test_what_reads_leaves_the_motion_and_what_moves_does_not(cause, base):
    """A cause has an effect exactly where it says it has one, around either model."""
    cause = cause.on(setting())
    model, values = extended([cause], base=base)
    state, actuator, wind = under_way()
    state[:, 2] = 38.0  # near the bank
    changed = acceleration(model, values, sized(cause), state, actuator, wind)
    plain = acceleration(model, values, np.zeros(cause.count), state, actuator, wind)
    assert np.isfinite(changed).all()
    assert (np.abs(changed - plain).max() > 1e-6) != cause.reads
    observed = closed.record(TWIN)
    hard = observed.actuator.copy()
    hard[600:, :2] += 1.2  # rad, from one row to the next
    observed = replace(observed, actuator=hard)
    after = cause.read(observed, sized(cause))
    same = all(np.array_equal(getattr(after, n), getattr(observed, n)) for n in CHANGED)
    assert same != cause.reads


CHANGED = ("state", "actuator", "wind")


@EVERY
@SHIPS
def test_zero_leaves_a_record_as_it_was(cause, profile):
    cause = cause.on(setting(profile))
    observed = closed.record(profile, heading=0.1, bias=0.01, wind_angle=0.2)
    after = cause.read(observed, np.zeros(cause.count))
    for name in CHANGED:
        assert getattr(after, name) == pytest.approx(getattr(observed, name), abs=1e-12)
    for name in ("time", "starts", "measured", "voyage", "share"):
        assert getattr(after, name) is getattr(observed, name)


# --- words ----------------------------------------------------------------------------------------


# Their number is one over what is displayed, or twice that
INVERSE = ("actuator_limit", "actuator_rate", "actuator_dead_band")


@EVERY
def test_displayed_holds_its_value_and_ninety_percent(cause):
    cause = cause.on(setting())
    numbers = sized(cause)
    spread = 0.1 * cause.sizes(setting())
    reported = cause.estimates(numbers, np.diag(spread**2))
    for one in reported.values():
        assert one.low <= one.value <= one.high
        assert one.high > one.low
    assert cause.sentence(reported).endswith(".")
    if cause.count == 1 and cause.name not in INVERSE:
        (one,) = reported.values()
        unit = DEGREE if one.unit.startswith("deg") else 1.0
        # 1.645 σ on either side; 4000 draws know it to 5 %
        assert (one.high - one.low) * unit == pytest.approx(2.0 * 1.645 * spread[0], rel=0.06)


def test_an_interval_knows_of_how_many_voyages_its_width_is():
    """Student's t: 2.015 standard deviations with 5 degrees of freedom, 2.920 with 2."""
    cause = BY["heading_offset"]
    for freedom, wide in ((5.0, 2.015), (2.0, 2.920)):
        (one,) = cause.estimates(
            np.array([0.05]), np.array([[1e-4]]), freedom, draws=100_000
        ).values()
        half = 0.5 * (one.high - one.low) * DEGREE / 0.01
        assert half == pytest.approx(wide, rel=0.03)
        assert one.low < one.value < one.high


def test_a_direction_near_north_has_a_short_interval():
    """359 deg and 1 deg are two degrees apart: 0.01 m/s across 0.3 m/s is 1.9 deg."""
    cause = Current()
    for east in (-0.001, 0.001):
        reported = cause.estimates(np.array([0.3, east]), np.diag([1e-4, 1e-4]))["direction"]
        assert reported.low <= reported.value <= reported.high
        assert reported.high - reported.low == pytest.approx(
            2 * 1.645 * math.degrees(0.01 / 0.3), rel=0.06
        )
    assert cause.displayed(np.array([0.0, 0.2]))["direction"][0] == pytest.approx(90.0)
    assert cause.displayed(np.array([0.0, 0.2]))["speed"][0] == pytest.approx(0.2)
    assert "towards 180 deg" in cause.sentence(
        cause.estimates(np.array([-0.2, 0.0]), np.diag([1e-6, 1e-6]))
    )


def test_words_speak_degrees_and_factors():
    assert BY["heading_offset"].displayed(np.array([0.1]))["angle"] == (
        pytest.approx(math.degrees(0.1)), "deg",
    )  # fmt: skip
    assert BY["yaw_rate_bias"].displayed(np.array([0.01]))["value"] == (
        pytest.approx(math.degrees(0.01)), "deg/s",
    )  # fmt: skip
    for label in ("yaw_rate_scale", "wind_speed_scale"):
        assert BY[label].displayed(np.array([0.07]))["value"][0] == pytest.approx(1.07)
    for label in ("fouling", "thrust_loss", "cross_flow_drag", "rudder_force"):
        assert BY[label].displayed(np.array([-0.2]))["factor"][0] == pytest.approx(0.8)


@pytest.mark.parametrize(
    ("label", "number"),
    [("current", [0.0, 0.02]), ("heading_offset", [-0.006]), ("rudder_lag", [0.15]),
     ("rudder_offset", [0.0, -0.01]), ("payload", [5.0, 0.0]), ("antenna_offset", [0.05, 0.0]),
     ("shallow_water", [0.1] + [0.0] * 17)],
)  # fmt: skip
def test_small_is_no_matter(label, number):
    cause = BY[label].on(setting())
    assert cause.practical(np.array(number), setting())
    assert not cause.practical(0.2 * np.array(number), setting())


def test_of_a_ferry_the_azimuths_are_late_and_nothing_else():
    """T y' = x - y: the residual is T times how fast it moves."""
    rows, units = 300, len(FERRY.actuators)
    rng = np.random.default_rng(0)
    read = Record(
        profile=FERRY, names=("one",), voyage=np.zeros(rows, int), time=0.1 * np.arange(rows),
        share=np.zeros(rows), starts=np.arange(rows) == 0, measured=np.ones(rows, bool),
        state=np.zeros((rows, 6)), actuator=rng.standard_normal((rows, units)).cumsum(0),
        wind=np.zeros((rows, 2)),
    )  # fmt: skip
    turned = [i for i, a in enumerate(FERRY.actuators) if a.kind == "azimuth"]
    others = [i for i, a in enumerate(FERRY.actuators) if a.kind != "azimuth"]
    late, lagged, misaligned = (
        BY[label].on(setting(FERRY)) for label in ("rudder_delay", "rudder_lag", "rudder_offset")
    )
    numbers = {late: [0.5], lagged: [0.5], misaligned: [0.2, -0.1]}
    acting = {cause: cause.read(read, np.array(p)).actuator for cause, p in numbers.items()}
    for found in acting.values():
        assert np.array_equal(found[:, others], read.actuator[:, others])
    assert acting[late][5:, turned] == pytest.approx(read.actuator[:-5, turned])
    rate = np.gradient(acting[lagged][:, turned], 0.1, axis=0)
    lack = (read.actuator - acting[lagged])[:, turned]
    assert np.corrcoef(rate[5:-5].ravel(), lack[5:-5].ravel())[0, 1] > 0.9
    port = [FERRY.actuators[i].position_m[1] < 0.0 for i in turned]
    assert (acting[misaligned] - read.actuator)[0, turned] == pytest.approx(
        np.where(port, 0.2, -0.1)
    )
    for cause, p in numbers.items():
        output = cause.sentence(cause.estimates(np.array(p), 1e-6 * np.eye(cause.count)))
        assert output.startswith("The azimuths ")


def test_without_its_rudders_a_ship_is_steered_by_its_azimuths():
    both = FERRY.model_copy(update={"actuators": (
        *FERRY.actuators, FERRY.actuators[0].model_copy(update={"name": "aft", "kind": "rudder"}),
    )})  # fmt: skip
    whole, without = setting(both), replace(setting(both), parts=("thruster",))
    assert BY["rudder_lag"].on(whole).what == "rudders"
    lagged = BY["rudder_lag"].on(without)
    assert lagged.what == "azimuths"
    rows = 50
    read = Record(
        profile=both, names=("one",), voyage=np.zeros(rows, int), time=0.1 * np.arange(rows),
        share=np.zeros(rows), starts=np.arange(rows) == 0, measured=np.ones(rows, bool),
        state=np.zeros((rows, 6)), actuator=np.cumsum(np.ones((rows, len(both.actuators))), 0),
        wind=np.zeros((rows, 2)),
    )  # fmt: skip
    moved = (lagged.read(read, np.array([0.5])).actuator != read.actuator).any(0)
    assert moved.tolist() == [a.kind == "azimuth" for a in both.actuators]


def test_two_of_three_clocks_say_it_all():
    """`gnss` is position and velocity together; no cause goes together with itself."""
    by = {cause.label: cause for cause in CATALOGUE}
    both = by["clock_offset:gnss"]
    for channel in ("position", "velocity"):
        assert not both.compatible(f"clock_offset:{channel}")
        assert not by[f"clock_offset:{channel}"].compatible(both.label)
    assert by["clock_offset:position"].compatible("clock_offset:velocity")
    assert by["clock_offset:wind"].compatible(both.label)
    assert both.compatible("current") and not both.compatible(both.label)


# --- realistic sizes ------------------------------------------------------------------------------


def test_sizes_follow_the_ship():
    """Shares of its speed, length and mass; a ship twice as fast meets twice the current."""
    plain = setting()
    fast = replace(plain, scale={**plain.scale, "speed": 1.2, "length": 300.0})
    assert Current().sizes(fast) == pytest.approx(2.0 * Current().sizes(plain))
    antenna = BY["antenna_offset"]
    assert antenna.sizes(fast) == pytest.approx(100.0 * antenna.sizes(plain))
    low, high = Payload().bounds(plain)
    assert low[0] == pytest.approx(-0.5 * 244.6) and high[0] == math.inf


def test_sizes_are_not_the_simulated_ships():
    """The simulated ship draws each cause from a range, and a prior in its middle would hold the
    answer. None stands there; none is so far off that its cause could not be found."""
    middles = {
        "fouling": 0.625, "cross_flow_drag": 0.325, "rudder_force": 0.2, "thrust_loss": 0.19,
        "thrust_drift": 0.235, "rudder_lag": 2.5, "rudder_delay": 1.3,
        "heading_offset": math.radians(3.75), "yaw_rate_bias": math.radians(0.3),
        "yaw_rate_scale": 0.065, "clock_offset:gnss": 0.9, "wind_speed_scale": 0.225,
        "wind_direction_offset": math.radians(16.5), "rudder_offset": math.radians(5.5),
    }  # fmt: skip
    for label, middle in middles.items():
        for size in BY[label].on(setting()).sizes(setting()):
            assert 0.5 < size / middle < 2.0 and abs(size / middle - 1.0) > 0.1, label


def test_foulings_size_is_the_mean_square_of_schultzs_penalties():
    penalties = np.array([0.11, 0.20, 0.34, 0.52, 0.80])  # of resistance at 15 kn, Schultz 2007
    size = BY["fouling"].sizes(setting())[0]
    assert size == pytest.approx(np.sqrt((penalties**2).mean()), rel=0.05)


def test_clocks_size_is_that_of_delays_up_to_a_second():
    assert BY["clock_offset:gnss"].sizes(setting())[0] == pytest.approx(
        1.0 / math.sqrt(3), rel=0.05
    )


@EVERY
def test_every_size_has_its_source(cause):
    """The docstring says where a size is from, or the class it is a part of."""
    assert "Size: " in (type(cause).__doc__ or "")
