"""Short rollouts: order of the integration, derivatives against differences, what is cut."""

from dataclasses import dataclass, replace

import closed
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from shiplog import profile_file as profiles
from shiplog.diagnosis import likelihood, linearisation, measurement_correction, segments
from shiplog.diagnosis.linear_segments import Path, Wide
from shiplog.diagnosis.segments import Cut
from shiplog.models import mmg
from shiplog.models.causes import Cause, Setting
from shiplog.models.causes.sensors import AntennaOffset, HeadingOffset
from shiplog.models.causes.ship import RudderDelay, RudderLag
from shiplog.voyages.recording import Record
from shiplog.voyages.timescale import KNOT, NODE_ROWS, Timescale

PROFILE = profiles.load("esso-osaka")  # rudder and propeller
SETTING = Setting(PROFILE, {"speed": 0.6, "length": 3.0}, np.zeros((1, 2)), 1.0)
DRAG, TURN, DAMP = 0.05, 0.06, 0.4


@jax.tree_util.register_static
@dataclass(frozen=True)
class Toy:
    """u̇ = -a u |u| + w X_wind, v̇ = -a v - u r, ṙ = b δ - c r; numbers of causes come after."""

    causes: tuple[Cause, ...] = ()
    substeps: int = 1
    smooth: float = 0.0

    @property
    def names(self):
        return ("a", "b", "c", "w")

    def acceleration(self, theta, state, actuator, true_wind):
        u, v, heading, r = (state[..., i] for i in (1, 3, 4, 5))
        ahead = jnp.cos(heading) * true_wind[..., 0] + jnp.sin(heading) * true_wind[..., 1]
        du = -theta[0] * u * jnp.sqrt(u * u + 1e-6) + theta[3] * ahead
        dr = theta[1] * actuator[..., 0] - theta[2] * r
        return jnp.stack((du, -theta[0] * v - u * r, dr), -1)


@jax.tree_util.register_static
@dataclass(frozen=True)
class Coasting:
    """ν̇ = -k ν: straight ahead, u = e^(-kt) and x = (1 - e^(-kt))/k."""

    names: tuple[str, ...] = ("k",)
    substeps: int = 1
    smooth: float = 0.0

    def acceleration(self, theta, state, actuator, true_wind):
        return -theta[0] * state[..., jnp.array([1, 3, 5])]


THETA = np.array([DRAG, TURN, DAMP, 0.02])
SEEN = closed.record(PROFILE)
GRID = segments.grid(SEEN)
ROWS = segments.begins(SEEN)
WIDE = Wide(
    np.array([0.02, 0.01, 0.02, 0.01, 0.003, 0.002]), np.array([1.0, 0.6, 1.0, 0.6, 0.3, 0.2]),
    np.array([0.06, 0.06, 0.02]),
)  # fmt: skip


def test_the_integration_is_of_second_order():
    """Half the step, a quarter of the error, in position and in speed."""
    k, seconds = 0.3, 6.0
    errors = []
    for step in (0.2, 0.1, 0.05):
        nodes = round(seconds / step) + 1
        start = np.array([[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]])
        states = linearisation.states_along(
            Coasting(), np.array([k]), start, np.zeros((1, nodes, 3)), np.zeros((1, nodes, 3)), step
        )
        last = np.asarray(states)[0, -1]
        errors.append([last[0] - (1 - np.exp(-k * seconds)) / k, last[1] - np.exp(-k * seconds)])
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert ratios == pytest.approx(4.0, abs=0.5)
    assert np.abs(errors[-1]).max() < 2e-4


def test_a_push_is_an_acceleration():
    """Constant push of a body without forces: ½ p t², but for the first step, which is Euler's."""
    nodes, step = 61, 0.2
    acceleration = np.tile([0.01, -0.02, 0.0], (1, nodes, 1))
    states = np.asarray(
        linearisation.states_along(
            Coasting(), np.zeros(1), np.zeros((1, 6)), acceleration, np.zeros((1, nodes, 3)), step
        )
    )
    t = step * np.arange(nodes)
    assert states[0, :, 1] == pytest.approx(0.01 * t, abs=1e-12)
    assert states[0, :, 3] == pytest.approx(-0.02 * t, abs=1e-12)
    assert states[0, :, 0] == pytest.approx(0.005 * t**2, abs=0.01 * 0.5 * step**2 + 1e-12)


# --- cutting


def test_segments_lie_end_to_end_within_stretches():
    starts = SEEN.starts.copy()
    starts[500] = True  # 50 s, then 70.1 s: one segment, then two
    found = segments.begins(replace(SEEN, starts=starts))
    assert found.tolist() == [0, 500, 800]
    assert segments.begins(SEEN).tolist() == [0, 300, 600, 900]
    assert len(segments.begins(SEEN.pick(["one"]))) == 4


def test_a_bin_is_the_mean_of_what_was_measured():
    """Of a ramp, its middle; of the heading, closed form: ∫ψ over two seconds."""
    cut = segments.cut(SEEN, ROWS)
    assert cut.y.shape == (4, 15, 6)
    t = 30.0 * np.arange(4)[:, None] + 2.0 * np.arange(15)
    ramp = replace(SEEN, state=np.outer(SEEN.time, np.ones(6)))
    middle = np.repeat((t + 1.0)[..., None], 6, -1)
    assert segments.cut(ramp, ROWS).y == pytest.approx(middle, abs=1e-9)
    whole = 0.4 + 0.02 * (t + 1.0) - 1.2 / 0.05 * (np.cos(0.05 * (t + 2)) - np.cos(0.05 * t)) / 2.0
    assert cut.y[..., 4] == pytest.approx(whole, abs=1e-5)
    assert cut.used.all() and cut.step == pytest.approx(0.2)


def test_bins_that_were_hardly_measured_do_not_count():
    viewed = np.ones(len(SEEN), dtype=bool)
    viewed[302:320] = False  # most of the first bin of the second segment
    viewed[325:330] = False  # a quarter of the next
    used = segments.cut(replace(SEEN, measured=viewed), ROWS).used
    assert not used[1, 0].any()
    assert used.sum() == used.size - 6


def test_what_drives_is_taken_between_nodes_too():
    """Actuators, share and true wind at the nodes, ¼ ½ ¼; a ramp is left as it is."""
    cut = segments.cut(SEEN, ROWS)
    share = SEEN.share[ROWS[1] + NODE_ROWS * np.arange(GRID.nodes)]
    assert cut.driven[1, 1:, 2] == pytest.approx(share[1:], abs=1e-12)
    assert cut.driven[1, :, 3:] == pytest.approx(np.tile(closed.TRUE_WIND, (151, 1)), abs=1e-12)
    spike = np.zeros((len(SEEN), 2))
    spike[11] = 1.0  # between nodes 5 and 6
    found = segments.cut(replace(SEEN, actuator=spike), ROWS).driven[0, :, 0]
    assert found[[4, 5, 6, 7]].tolist() == [0.0, 0.25, 0.25, 0.0]


# --- derivatives


def path() -> Path:
    rng = np.random.default_rng(0)
    start = SEEN.state[ROWS]
    return Path(start, 0.01 * rng.standard_normal((len(ROWS), 3, GRID.knots)))


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
        cut, moved, observed = measurement_correction.read(model, SETTING, SEEN, ROWS, numbers)
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
    record = measurement_correction.corrected(model.causes, SEEN, numbers)
    cut = segments.cut(record, ROWS)
    states = np.asarray(
        linearisation.states_along(model, theta, at.start, at.at_nodes(GRID), cut.driven, cut.step)
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


@pytest.mark.parametrize(("channel", "knot"), [(0, 0), (1, 7), (2, 3), (2, 15)])
def test_columns_of_the_knots(linearised, channel, knot):
    model, numbers, theta, at, found = linearised
    h = np.zeros_like(at.acceleration)
    h[:, channel, knot] = 1e-5
    more, less = (replace(at, acceleration=at.acceleration + s) for s in (h, -h))
    slope = (gap(model, theta, more, numbers) - gap(model, theta, less, numbers)) / 2e-5
    column = found.z[..., 6 + channel * GRID.knots + knot]
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


# --- paths


def simulated(at: Path, theta: np.ndarray = THETA) -> Cut:
    """Segments whose measurements are the toy's own."""
    cut = segments.cut(SEEN, ROWS)
    y, _ = linearisation.simulated(Toy(), theta, cut, at, GRID)
    return replace(cut, y=y)


def test_nothing_is_left_of_what_the_model_made():
    at = replace(path(), acceleration=np.zeros((4, 3, GRID.knots)))
    cut = simulated(at)
    none = np.zeros((*cut.driven.shape, 0)), np.zeros((*cut.y.shape, 0))
    found = linearisation.linear(Toy(), THETA, cut, GRID, at, *none)
    assert np.array_equal(found.e, np.zeros_like(found.e))
    assert found.j.shape[-1] == 4
    picked = found.pick(np.array([False, True, True, False]))
    assert np.array_equal(picked.z, found.z[1:3]) and len(picked.cut) == 2


def test_slopes_of_a_smooth_model_go_straight_between_seconds():
    """One in a second serves the toy, whose rudder goes slowly: what it bends by is within 1 % of
    what every node's slopes say, and what is constant stays exact."""
    at = replace(path(), acceleration=np.zeros((4, 3, GRID.knots)))
    cut = simulated(at)
    none = np.zeros((*cut.driven.shape, 0)), np.zeros((*cut.y.shape, 0))
    exact, found = (
        linearisation.linear(Toy(smooth=smooth), THETA, cut, GRID, at, *none)
        for smooth in (0.0, 1.0)
    )
    assert np.array_equal(found.e, exact.e)
    for one, other in ((found.z, exact.z), (found.j, exact.j)):
        size = np.abs(other).max((0, 1, 3), keepdims=True)
        assert 0.0 < np.abs((one - other) / size).max() < 0.01
    k = np.array([0.3])
    same = [
        linearisation.linear(Coasting(smooth=smooth), k, cut, GRID, at, *none).z
        for smooth in (0.0, 1.0)
    ]
    assert same[0] == pytest.approx(same[1], abs=1e-12)


def test_a_path_is_pulled_onto_a_known_push():
    """Smooth accelerations of 0.02 m/s²: the path goes where they went, and finds them."""
    t = KNOT * np.arange(GRID.knots)
    acceleration = np.stack(
        (0.02 * np.sin(0.2 * t), 0.015 * np.cos(0.25 * t), 0.004 * np.sin(0.3 * t))
    )
    true = Path(SEEN.state[ROWS], np.tile(acceleration, (4, 1, 1)))
    cut = simulated(true)
    found = linearisation.pulled(Toy(), THETA, cut, GRID, replace(WIDE, noise=0.01 * WIDE.noise))
    y, _ = linearisation.simulated(Toy(), THETA, cut, found, GRID)
    assert y == pytest.approx(cut.y, abs=1e-4)
    assert found.start == pytest.approx(true.start, abs=2e-3)
    # within, where bins on both sides see a knot
    assert found.acceleration[..., 1:-1] == pytest.approx(true.acceleration[..., 1:-1], abs=2e-3)


def test_a_path_held_firmly_follows_the_acceleration_that_is_expected_of_it():
    """Held to what is expected, it is the true path at once; held to none, it has no acceleration
    and is off. The same where a linearisation says where it will be."""
    t = KNOT * np.arange(GRID.knots)
    acceleration = np.stack(
        (0.02 * np.sin(0.2 * t), 0.015 * np.cos(0.25 * t), 0.004 * np.sin(0.3 * t))
    )
    true = Path(SEEN.state[ROWS], np.tile(acceleration, (4, 1, 1)))
    cut = simulated(true)
    about = true.acceleration.reshape(4, -1)
    firm = replace(WIDE, acceleration=1e-6 * WIDE.acceleration)
    found = linearisation.pulled(Toy(), THETA, cut, GRID, firm, rounds=3, about=about)
    assert found.acceleration == pytest.approx(true.acceleration, abs=1e-5)
    assert linearisation.simulated(Toy(), THETA, cut, found, GRID)[0] == pytest.approx(
        cut.y, abs=1e-3
    )
    without = linearisation.pulled(Toy(), THETA, cut, GRID, firm, rounds=3)
    assert without.acceleration == pytest.approx(0.0, abs=1e-5)
    off = linearisation.simulated(Toy(), THETA, cut, without, GRID)[0] - cut.y
    assert np.abs(off).max() > 0.02
    none = np.zeros((*cut.driven.shape, 0)), np.zeros((*cut.y.shape, 0))
    linear = linearisation.linear(Toy(), THETA, cut, GRID, without, *none)
    ahead = linearisation.ahead(linear, np.zeros(4), firm, about)
    assert ahead.acceleration == pytest.approx(true.acceleration, abs=1e-5)


def test_a_path_is_pulled_on_a_longer_grid_too():
    """Segments of 60 s with knots of 4 s: the same pushes, found through `reading` and all."""
    viewed = replace(SEEN, timescale=Timescale(60.0, 4.0, 4.0))
    g, rows = segments.grid(viewed), segments.begins(viewed)
    t = g.knot * np.arange(g.knots)
    acceleration = np.stack(
        (0.02 * np.sin(0.1 * t), 0.015 * np.cos(0.12 * t), 0.002 * np.sin(0.15 * t))
    )
    true = Path(SEEN.state[rows], np.tile(acceleration, (2, 1, 1)))
    cut, moved, observed = measurement_correction.read(Toy(), SETTING, viewed, rows)
    assert cut.y.shape == observed.shape[:3] == (2, 15, 6) and moved.shape[1] == 151
    y, _ = linearisation.simulated(Toy(), THETA, cut, true, g)
    cut = replace(cut, y=y)
    tight = replace(WIDE, noise=0.01 * WIDE.noise)
    found = linearisation.pulled(Toy(), THETA, cut, g, tight, rounds=3)
    assert found.acceleration[..., 1:-1] == pytest.approx(true.acceleration[..., 1:-1], abs=2e-3)
    assert not linearisation.linear(Toy(), THETA, cut, g, found, moved, observed, WIDE).lost.any()


def test_what_was_not_used_does_not_pull():
    true = replace(path(), acceleration=np.zeros((4, 3, GRID.knots)))
    cut = simulated(true)
    used = cut.used.copy()
    used[:, 6:8] = False
    wrong = np.where(used, cut.y, 1e3)
    bad = replace(cut, y=wrong, used=used)
    found = linearisation.pulled(Toy(), THETA, bad, GRID, WIDE, true)
    y, _ = linearisation.simulated(Toy(), THETA, bad, found, GRID)
    assert y == pytest.approx(cut.y, abs=1e-6)


def test_a_linearisation_expects_where_its_path_will_be_pulled():
    """Nothing pushes it, but the rudder turns it by a tenth less than the model has it: pulled,
    the path says so by a push. Once the model has it right there is none, and what is expected
    before that is linearised there is off by what is not linear: a tenth of the tenth."""
    true = replace(path(), acceleration=np.zeros((4, 3, GRID.knots)))
    cut = simulated(true)
    wrong, tight = THETA * np.array([1.0, 1.1, 1.0, 1.0]), replace(WIDE, noise=0.01 * WIDE.noise)
    stood = linearisation.pulled(Toy(), wrong, cut, GRID, tight)
    size = np.abs(stood.acceleration[:, 2]).max()
    assert size > 1e-4
    nothing = np.zeros((*cut.driven.shape, 0)), np.zeros((*cut.y.shape, 0))
    linear = linearisation.linear(Toy(), wrong, cut, GRID, stood, *nothing)
    found = linearisation.ahead(linear, THETA - wrong, tight)
    assert np.abs(found.acceleration[:, 2]).max() < 0.1 * size
    assert found.start == pytest.approx(true.start, abs=1e-3)
    stays = linearisation.ahead(linear, np.zeros(4), tight)
    assert stays.acceleration == pytest.approx(stood.acceleration, abs=0.1 * size)
    firm = linearisation.ahead(
        linear, np.zeros(4), replace(tight, acceleration=1e-6 * WIDE.acceleration)
    )
    assert (
        np.abs(firm.acceleration[:, 2]).max() < 0.1 * size
    )  # held about none, not about where it stood


# --- a trap: recorded actuators held instead of interpolated


def weaving(late: float) -> Record:
    """A ship that the toy is exactly, its rudder weaving 0.3 sin(0.8 t), acting `late`:
    ṙ = b δ - c r in closed form; it lies still otherwise."""
    t = SEEN.time
    w, amplitude = 0.8, 0.3
    phase = np.arctan2(w, DAMP)
    size = TURN * amplitude / np.hypot(w, DAMP)
    rate = size * np.sin(w * (t - late) - phase)
    heading = -size / w * np.cos(w * (t - late) - phase)
    state = np.zeros((len(t), 6))
    state[:, 4], state[:, 5] = heading, rate
    actuator = np.stack((amplitude * np.sin(w * t), np.zeros(len(t))), -1)
    wind = np.zeros((len(t), 2))
    return replace(SEEN, state=state, actuator=actuator, wind=wind)


@pytest.mark.parametrize("late", (0.0, 0.3))
def test_a_delay_is_what_it_is_and_zero_is_zero(late):
    """Holding the recorded rudder over a step would show as 0.05 s here."""
    record = weaving(late)
    model = Toy((RudderDelay(),))
    cut, moved, observed = measurement_correction.read(model, SETTING, record, ROWS)
    theta = np.concatenate((THETA, [0.0]))
    at = Path(record.state[ROWS], np.zeros((4, 3, GRID.knots)))
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


# --- ships that need finer steps, and segments in which a model diverges -------------------------


@jax.tree_util.register_static
@dataclass(frozen=True)
class Stiff:
    """ν̇ = -k ν, ten times as much where the first actuator is on; stable in training by
    `substeps` Euler steps a second."""

    substeps: int = 4
    names: tuple[str, ...] = ("k",)
    smooth: float = 0.0

    def acceleration(self, theta, state, actuator, true_wind):
        damping = theta[0] * (1.0 + 9.0 * actuator[..., :1])
        return -damping * state[..., jnp.array([1, 3, 5])]


def coasting(segments_on: tuple[int, ...] = ()) -> tuple[Cut, Path, np.ndarray]:
    """Four segments that begin with 1 m/s ahead and nothing else; measured as k = 7 has it."""
    cut = segments.cut(SEEN, ROWS)
    k, edges = 7.0, 2.0 * np.arange(GRID.bins + 1)
    x = lambda t: t / k - (1.0 - np.exp(-k * t)) / k**2  # noqa: E731  # ∫ of (1 - e^(-kt))/k
    y = np.zeros((4, GRID.bins, 6))
    y[..., 0] = np.diff(x(edges)) / 2.0
    y[..., 1] = np.diff((1.0 - np.exp(-k * edges)) / k) / 2.0
    driven = np.zeros_like(cut.driven)
    driven[list(segments_on), :, 0] = 1.0
    start = np.tile([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], (4, 1))
    return replace(cut, y=y, driven=driven), Path(start, np.zeros((4, 3, GRID.knots))), y


def nothing(cut: Cut) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((*cut.driven.shape, 0)), np.zeros((*cut.y.shape, 0))


@pytest.mark.parametrize(("substeps", "many"), [(1, 1), (2, 1), (4, 2), (8, 4)])
def test_steps_between_nodes_follow_trainings(substeps, many):
    """Stable where training is: |λ| up to 2n a second there, up to one over the step here."""
    assert linearisation.finer(Stiff(substeps), 0.2) == many
    assert 2.0 * substeps * 0.2 / many <= 1.0


def test_what_training_holds_is_held_here():
    """Damping of 7 1/s, stable with four Euler steps a second: u = e^(-7t). With the nodes' step
    alone the speed would grow by half from step to step."""
    cut, at, y = coasting()
    found, columns = linearisation.simulated(Stiff(4), np.array([7.0]), cut, at, GRID)
    assert found[:, 1:] == pytest.approx(y[:, 1:], abs=0.02)  # of the whole way, 1/7 m
    assert np.abs(columns[..., 1]).max() < 1.0
    wild, _ = linearisation.simulated(Stiff(1), np.array([7.0]), cut, at, GRID)
    assert not np.isfinite(wild).all() or np.abs(wild).max() > 1e6


def test_columns_between_nodes_are_derivatives_of_what_was_simulated():
    cut, theta = segments.cut(SEEN, ROWS), THETA
    at, model = path(), Toy(substeps=4)
    none = nothing(cut)
    found = linearisation.linear(model, theta, cut, GRID, at, *none)

    def y(theta, at):
        return linearisation.simulated(model, theta, cut, at, GRID)[0]

    for i in range(4):
        h = 1e-5 * np.eye(4)[i]
        slope = (y(theta + h, at) - y(theta - h, at)) / 2e-5
        assert found.j[..., i] == pytest.approx(slope, rel=1e-5, abs=1e-4)
    for i, h in enumerate(1e-5 * np.eye(6)):
        more, less = (replace(at, start=at.start + s) for s in (h, -h))
        assert found.z[..., i] == pytest.approx((y(theta, more) - y(theta, less)) / 2e-5, abs=2e-6)
    h = np.zeros_like(at.acceleration)
    h[:, 1, 7] = 1e-5
    more, less = (replace(at, acceleration=at.acceleration + s) for s in (h, -h))
    slope = (y(theta, more) - y(theta, less)) / 2e-5
    assert found.z[..., 6 + GRID.knots + 7] == pytest.approx(slope, abs=2e-5)


def test_a_ship_that_needs_no_finer_steps_keeps_its_numbers():
    """The paper's ship at the nodes' own step, bit by bit, with one and with two Euler steps."""
    profile = profiles.load("esso-vectwin")
    ship, main, _ = mmg.geometry_of(profile)
    theta = mmg.estimated(ship, main).values
    record = closed.record(profile)
    rows = segments.begins(record)
    cut, at = segments.cut(record, rows), Path(record.state[rows], np.zeros((4, 3, GRID.knots)))
    model = mmg.MMG(ship)
    # the last row of what drives is the share of the campaign, before the wind
    plain = replace(cut, driven=np.delete(cut.driven, 3, axis=-1))
    ((_, filled),) = linearisation.chunks(4)  # as many at a time, so that rounding is the same
    start, acceleration, driven = map(filled, (at.start, at.at_nodes(GRID), plain.driven))
    states = np.asarray(
        linearisation.states_along(model, theta, start, acceleration, driven, cut.step)
    )[:4]
    pairs = 0.5 * (states[:, 1:] + states[:, :-1])
    wanted = pairs.reshape(4, GRID.bins, -1, 6).mean(2)
    for substeps in (1, 2):
        found, _ = linearisation.simulated(
            replace(model, substeps=substeps), theta, plain, at, GRID
        )
        assert np.array_equal(found, wanted)


@pytest.mark.parametrize("wide", [None, WIDE], ids=("span", "wide"))
def test_a_segment_that_runs_away_is_left_out_and_counted(wide):
    """Where the actuator is on, damping is 70 1/s: no step holds that, and it says nothing."""
    cut, at, _ = coasting(segments_on=(2,))
    theta = np.array([7.0])
    found = linearisation.linear(Stiff(4), theta, cut, GRID, at, *nothing(cut), wide)
    assert found.lost.tolist() == [False, False, True, False]
    assert found.sentence == "1 of 4 segments were left out: the model diverges there."
    for values in (found.e, found.z, found.j):
        assert np.isfinite(values).all() and not values[2].any() and values[[0, 1, 3]].any()
    assert not found.cut.used[2].any() and found.cut.used[[0, 1, 3]].all()
    assert cut.used.all()  # what was cut stays as it was
    others = np.array([True, True, False, True])
    alone = linearisation.linear(
        Stiff(4), theta, cut.pick(others), GRID, Path(at.start[others], at.acceleration[others]),
        *nothing(cut.pick(others)), wide,
    )  # fmt: skip
    assert np.array_equal(found.pick(others).e, alone.e)
    assert not alone.lost.any() and alone.sentence == ""
    assert found.joined(alone).lost.tolist() == [False, False, True, *[False] * 4]


def test_what_was_left_out_carries_no_information():
    cut, at, _ = coasting(segments_on=(2,))
    found = linearisation.linear(Stiff(4), np.array([7.0]), cut, GRID, at, *nothing(cut))
    process_noise = likelihood.ProcessNoise(WIDE.noise, WIDE.acceleration, WIDE.start, 4.0)
    whole = likelihood.weighed(found, process_noise)
    part = likelihood.weighed(found.pick(np.array([True, True, False, True])), process_noise)
    assert not whole.dd[2].any() and not whole.zd[2].any() and not whole.zz[2].any()
    assert whole.dd.sum(0) == pytest.approx(part.dd.sum(0), rel=1e-12)
    assert whole.logdet == pytest.approx(part.logdet, rel=1e-12)


def test_numbers_of_each_segment_are_taken_off_it_alone():
    """Of columns of its own and of pushes at the knots; segments without numbers stay."""
    cut, at, _ = coasting()
    linear = linearisation.linear(Stiff(4), np.array([7.0]), cut, GRID, at, *nothing(cut))
    rng = np.random.default_rng(3)
    accelerations = rng.standard_normal((4, linear.z.shape[-1] - 6, 2))
    numbers = np.array([[0.4, 0.0, 0.0], [0.0, 1.0, -2.0], [0.0, 0.0, 0.0], [0.3, 0.5, 0.0]])
    left = linear.less_numbers(numbers, accelerations)
    for i, (own, one, two) in enumerate(numbers):
        acceleration = accelerations[i, :, 0] * one + accelerations[i, :, 1] * two
        wanted = linear.e[i] - linear.j[i, ..., 0] * own - linear.z[i, ..., 6:] @ acceleration
        assert left.e[i] == pytest.approx(wanted, abs=1e-12)
    assert np.array_equal(left.j, linear.j) and left.cut is linear.cut


def test_a_path_that_runs_away_does_not_move_and_leaves_the_others_alone():
    cut, at, _ = coasting(segments_on=(2,))
    theta = np.array([7.0])
    found = linearisation.pulled(Stiff(4), theta, cut, GRID, WIDE, at)
    assert np.array_equal(found.start[2], at.start[2]) and np.isfinite(found.acceleration).all()
    free, _, _ = coasting()
    alone = linearisation.pulled(Stiff(4), theta, free, GRID, WIDE, at)
    assert found.start[[0, 1, 3]] == pytest.approx(alone.start[[0, 1, 3]], abs=1e-12)
