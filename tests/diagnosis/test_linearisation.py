"""Short rollouts: order of the integration, and derivatives against differences."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from toy_ship import DAMP, GRID, RECORD, ROWS, SETTING, THETA, TURN, Coasting, Toy, path

from shiplog.diagnosis.linear import jax_paths, linearisation, measurement_correction, segments
from shiplog.diagnosis.linear.linear_segments import Path
from shiplog.models.causes import Cause, Parameter
from shiplog.models.causes.sensors import (
    AntennaOffset,
    ClockOffset,
    HeadingOffset,
    WindDirectionOffset,
)
from shiplog.models.causes.steering import RudderDelay, RudderLag, RudderOffset
from shiplog.voyages.rows.recording import Record


def test_the_integration_is_of_second_order():
    """Half the step, a quarter of the error, in position and in speed."""
    k, seconds = 0.3, 6.0
    errors = []
    for step in (0.2, 0.1, 0.05):
        nodes = round(seconds / step) + 1
        start = np.array([[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]])
        states = jax_paths.states_along(
            Coasting(), np.array([k]), start, np.zeros((1, nodes, 3)), np.zeros((1, nodes, 3)), step
        )
        last = np.asarray(states)[0, -1]
        errors.append([last[0] - (1 - np.exp(-k * seconds)) / k, last[1] - np.exp(-k * seconds)])
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert ratios == pytest.approx(4.0, abs=0.5)
    assert np.abs(errors[-1]).max() < 2e-4


def test_an_acceleration_is_added_to_the_models():
    """Constant, of a body without forces: ½ p t², but for the first step, which is Euler's."""
    nodes, step = 61, 0.2
    acceleration = np.tile([0.01, -0.02, 0.0], (1, nodes, 1))
    states = np.asarray(
        jax_paths.states_along(
            Coasting(), np.zeros(1), np.zeros((1, 6)), acceleration, np.zeros((1, nodes, 3)), step
        )
    )
    t = step * np.arange(nodes)
    assert states[0, :, 1] == pytest.approx(0.01 * t, abs=1e-12)
    assert states[0, :, 3] == pytest.approx(-0.02 * t, abs=1e-12)
    assert states[0, :, 0] == pytest.approx(0.005 * t**2, abs=0.01 * 0.5 * step**2 + 1e-12)


# --- derivatives


@pytest.fixture(scope="module")
def linearised():
    """A toy with two causes that read otherwise, about numbers that are not zero."""
    model = Toy((AntennaOffset(), HeadingOffset(), RudderLag()))
    numbers = {
        "antenna_offset": np.array([0.4, -0.2]), "heading_offset": np.array([0.05]),
        "rudder_lag": np.array([1.5]),
    }  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:  # a wider step than a derivative's averages noise
        patch.setattr(measurement_correction, "READ_STEP", 0.02)
        cut, moved, observed = measurement_correction.read(model, SETTING, RECORD, ROWS, numbers)
    theta = np.concatenate((THETA, np.zeros(4)))
    at = path()
    return (
        model,
        numbers,
        theta,
        at,
        linearisation.linear(model, theta, cut, GRID, at, moved, observed),
    )


def gap(model, theta, at: Path, numbers) -> np.ndarray:
    """Measured less simulated [S, B, 6], from the nodes: the trapezium of each two seconds."""
    record = measurement_correction.corrected(model.causes, RECORD, numbers)
    cut = segments.cut(record, ROWS)
    states = np.asarray(
        jax_paths.states_along(model, theta, at.start, at.interpolate(GRID), cut.driven, cut.step)
    )
    pairs = 0.5 * (states[:, 1:] + states[:, :-1])
    return cut.y - pairs.reshape(len(ROWS), GRID.bins, -1, 6).mean(2)


def test_residual_with_the_path_put_back(linearised):
    model, numbers, theta, at, found = linearised
    z = np.concatenate((np.zeros((4, 6)), at.acceleration.reshape(4, -1)), 1)
    back = np.einsum("sbcz,sz->sbc", found.z, z)
    assert found.e == pytest.approx(gap(model, theta, at, numbers) + back, abs=1e-12)


@pytest.mark.parametrize("column", range(6))
def test_columns_of_the_start(linearised, column):
    model, numbers, theta, at, found = linearised
    h = 1e-5 * np.eye(6)[column]
    more, less = (replace(at, start=at.start + s) for s in (h, -h))
    slope = (gap(model, theta, more, numbers) - gap(model, theta, less, numbers)) / 2e-5
    assert found.z[..., column] == pytest.approx(-slope, abs=2e-6)


@pytest.mark.parametrize(("channel", "node"), [(0, 0), (1, 7), (2, 3), (2, 15)])
def test_columns_of_the_nodes(linearised, channel, node):
    model, numbers, theta, at, found = linearised
    h = np.zeros_like(at.acceleration)
    h[:, channel, node] = 1e-5
    more, less = (replace(at, acceleration=at.acceleration + s) for s in (h, -h))
    slope = (gap(model, theta, more, numbers) - gap(model, theta, less, numbers)) / 2e-5
    column = found.z[..., 6 + channel * GRID.nodes + node]
    assert np.abs(column).max() > 0.1
    assert column == pytest.approx(-slope, abs=2e-5)


@pytest.mark.parametrize("column", range(4))
def test_columns_of_the_coefficients(linearised, column):
    model, numbers, theta, at, found = linearised
    h = 1e-5 * np.eye(8)[column]
    slope = (gap(model, theta + h, at, numbers) - gap(model, theta - h, at, numbers)) / 2e-5
    assert np.abs(found.j[..., column]).max() > 0.1
    assert found.j[..., column] == pytest.approx(-slope, rel=1e-5, abs=1e-4)


@pytest.mark.parametrize(
    ("label", "i", "column"),
    [("antenna_offset", 0, 4), ("antenna_offset", 1, 5), ("heading_offset", 0, 6),
     ("rudder_lag", 0, 7)],
)  # fmt: skip
def test_columns_of_causes_that_read(linearised, label, i, column):
    """What they change of the measured, and of what drives, together."""
    model, numbers, theta, at, found = linearised
    sides = []
    for sign in (1.0, -1.0):
        near = numbers[label].copy()
        near[i] += 1e-3 * sign
        sides.append(gap(model, theta, at, numbers | {label: near}))
    slope = (sides[0] - sides[1]) / 2e-3
    assert np.abs(found.j[..., column]).max() > 0.02
    assert found.j[..., column] == pytest.approx(-slope, rel=2e-3, abs=2e-4)


# --- a trap: recorded actuators held instead of interpolated


def weaving(late: float) -> Record:
    """A ship that the toy is exactly, its rudder weaving 0.3 sin(0.8 t), acting `late`:
    ṙ = b δ - c r in closed form; it lies still otherwise."""
    t = RECORD.time
    w, amplitude = 0.8, 0.3
    phase = np.arctan2(w, DAMP)
    size = TURN * amplitude / np.hypot(w, DAMP)
    rate = size * np.sin(w * (t - late) - phase)
    heading = -size / w * np.cos(w * (t - late) - phase)
    state = np.zeros((len(t), 6))
    state[:, 4], state[:, 5] = heading, rate
    actuator = np.stack((amplitude * np.sin(w * t), np.zeros(len(t))), -1)
    wind = np.zeros((len(t), 2))
    return replace(RECORD, state=state, actuator=actuator, wind=wind)


@pytest.mark.parametrize("late", (0.0, 0.3))
def test_a_delay_is_what_it_is_and_zero_is_zero(late):
    """Holding the recorded rudder over a step would show as 0.05 s here."""
    record = weaving(late)
    model = Toy((RudderDelay(),))
    cut, moved, observed = measurement_correction.read(model, SETTING, record, ROWS)
    theta = np.concatenate((THETA, [0.0]))
    at = Path(record.state[ROWS], np.zeros((4, 3, GRID.nodes)))
    found = linearisation.linear(model, theta, cut, GRID, at, moved, observed)
    rows = found.e[..., 4:].ravel()  # heading and yaw rate
    start = found.z[..., 4:, 4:6].reshape(len(rows), 2)
    owned = np.zeros((len(rows), 8))  # each segment has a start of its own
    for s in range(4):
        part = slice(s * 30, s * 30 + 30)
        owned[part, 2 * s : 2 * s + 2] = start[part]
    columns = np.concatenate((found.j[..., 4:, -1].reshape(-1, 1), owned), 1)
    delay = np.linalg.lstsq(columns, rows, rcond=None)[0][0]
    assert delay == pytest.approx(late, abs=0.01)


def test_what_drives_is_kept_as_the_series_that_are_not_zero():
    """An antenna moves no actuator, a rudder's lag no wind: of 5 x 4 series those of the rudder by
    its lag and of the true wind by what turns it or moves it."""
    model = Toy((AntennaOffset(), HeadingOffset(), RudderLag()))
    windy = replace(RECORD, wind=RECORD.wind + np.array([3.0, 1.0]))
    _, moved, _ = measurement_correction.read(model, SETTING, windy, ROWS)
    dense = moved.dense()
    assert dense.shape == moved.shape == (len(ROWS), GRID.instants, 5, 4)
    there = np.argwhere(dense.any((0, 1)))
    assert np.array_equal(moved.pairs, there) and [0, 3] in there.tolist()
    assert len(there) < 8 and not dense[..., 2, :].any()  # the share of the campaign
    assert np.array_equal(dense[1:3], moved.dense(slice(1, 3)))
    # by hand: of the rudder with a lag more and less, averaged about the instants
    step = measurement_correction.READ_STEP * RudderLag().sizes(SETTING)
    late = [RudderLag().read(windy, by).actuator for by in (step, 0.0 * step)]
    by_hand = segments.average_at_instants(windy, ROWS, late[0] - late[1]) / step
    assert dense[..., 0, 3] == pytest.approx(by_hand[..., 0], abs=1e-12)


WINDY = replace(RECORD, wind=RECORD.wind + np.array([3.0, 1.0]))
NUMBERS = (
    {"antenna_offset": np.array([0.4, -0.2]), "rudder_lag": np.array([1.5])},
    {"antenna_offset": np.array([0.1, 0.3]), "rudder_lag": np.array([1.5])},  # actuators as before
    {"clock_offset:wind": np.array([0.7]), "rudder_offset": np.array([0.05])},
    {"clock_offset:position": np.array([-0.4]), "wind_direction_offset": np.array([0.2])},
)


@dataclass(frozen=True)
class Slip(Cause):
    """One of a user's: a rudder that acts less the faster the ship goes, as the log has it."""

    name = "slip"
    kind = "ship"
    user = True
    parameters = (Parameter("share", "1", 0.2, 0.01),)

    def read(self, record, p):
        return replace(record, actuator=record.actuator * (1.0 - p[0] * record.state[:, [1]]))


@pytest.mark.parametrize("own", [(), (Slip(),)], ids=["catalogue", "a user's"])
def test_what_is_passed_over_or_kept_changes_no_column(own):
    """Every cause applied to either end of every difference, and nothing kept: the same to the last
    bit, from one reading to the next."""
    sensors = (
        HeadingOffset(), ClockOffset("position"), ClockOffset("wind"), AntennaOffset(),
        WindDirectionOffset(),
    )  # fmt: skip
    model = Toy((RudderOffset(("rudder",)), RudderLag(), RudderDelay(), *own, *sensors))
    kept = measurement_correction.ActuatorColumns()
    for numbers in (*NUMBERS, NUMBERS[0]):
        given = numbers | {one.label: np.array([0.1]) for one in own}
        _, moved, observed = measurement_correction.read(model, SETTING, WINDY, ROWS, given, kept)
        drives, seen = by_every_cause(model, given)
        assert np.array_equal(moved.dense(), drives)
        assert np.array_equal(observed, seen)
    assert len(kept.series) == (0 if own else 3)


def by_every_cause(model, given):
    """du/dq and dy/dq with all causes behind each one applied to both records."""
    drives, seen, before = [], [], WINDY
    for place, cause in enumerate(model.causes):
        here = given.get(cause.label, np.zeros(cause.count))
        low, high = cause.bounds(SETTING)
        smooth = measurement_correction.AVERAGING_S
        moving = before.smoothed(smooth) if cause.shifts else before
        for i, size in enumerate(cause.sizes(SETTING)):
            step = np.zeros(cause.count)
            step[i] = measurement_correction.READ_STEP * size
            ends = np.minimum(here + step, high), np.maximum(here - step, low)
            apart = ends[0][i] - ends[1][i]
            more, less = (
                measurement_correction.corrected(
                    model.causes[place + 1 :], cause.read(moving, end), given
                )
                for end in ends
            )
            parts = (
                more.actuator - less.actuator, np.zeros((len(WINDY), 1)),
                more.true_wind - less.true_wind,
            )  # fmt: skip
            change = np.concatenate(parts, 1)
            drives.append(segments.average_at_instants(WINDY, ROWS, change) / apart)
            between = replace(more, state=more.state - less.state)
            seen.append(segments.means_of_bins(between, ROWS) / apart)
        before = measurement_correction.corrected((cause,), before, given)
    return np.stack(drives, -1), np.stack(seen, -1)
