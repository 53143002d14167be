"""Every cause: nothing where its numbers are zero, and what physics says where they are not."""

import math
from dataclasses import replace

import closed
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from shiplog import profile_file as profiles
from shiplog.models import causes as catalogue
from shiplog.models import mmg
from shiplog.models.causes import CATALOGUE, Setting
from shiplog.models.causes.environment import Current, WindForce
from shiplog.models.causes.ship import Payload, RudderDelay, RudderLag, RudderOffset
from shiplog.models.compiled_network import Network
from shiplog.models.extended import Extended
from shiplog.profile import Profile
from shiplog.voyages.recording import Record

TWIN = profiles.load("esso-vectwin")  # velocity over ground, by an antenna 0.3 m ahead
SINGLE = profiles.load("esso-osaka")  # velocity in body axes, at midship; one rudder
LOG = TWIN.sensors.velocity.model_copy(update={"kind": "body", "lever_arm_m": (0.8, -0.2)})
APART = TWIN.model_copy(  # a speed log of its own: where the antenna stands is no matter to it
    update={"sensors": TWIN.sensors.model_copy(update={"velocity": LOG})}
)
FERRY = profiles.load("milliampere")  # neither rudder nor wind sensor nor gyro
PLACES = np.random.default_rng(3).uniform(-20.0, 20.0, (12, 2))
BY = {cause.label: cause for cause in CATALOGUE}
DEGREE = math.pi / 180.0
EVERY = pytest.mark.parametrize("cause", CATALOGUE, ids=list(BY))
SHIPS = pytest.mark.parametrize(
    "profile", (TWIN, SINGLE, APART), ids=("over ground", "body axes", "log apart")
)


def setting(profile: Profile = TWIN, places: np.ndarray = PLACES) -> Setting:
    scale = {"speed": 0.6, "length": 3.0, "mass": 244.6, "moment": 3.0 * 244.6}
    return Setting(profile, scale, places, 8.0)


def extended(causes, profile: Profile = TWIN, without=(), base=None) -> tuple[Extended, np.ndarray]:
    """Around an MMG with estimated coefficients, or around another base that it stands in for."""
    ship, main, _ = mmg.geometry_of(profile, without)
    model = mmg.MMG(ship)
    values = mmg.estimated(ship, main).values
    constants = {}
    for cause in causes:
        constants |= cause.constants(setting(profile))
    whole = Extended(base or model, tuple(causes), model, values, constants)
    return whole, values if base is None else np.zeros(len(base.names))


def network() -> Network:
    """A network of the paper's form with random weights; wind as components."""
    rng = np.random.default_rng(0)
    inputs, width, bends = 8, 5, 4
    return Network(
        weights=(
            rng.standard_normal((width, inputs)), rng.standard_normal(width),
            rng.standard_normal((3, width)), rng.standard_normal(3),
        ),
        mean=rng.standard_normal(inputs), std=np.full(inputs, 2.0),
        out_mean=np.zeros(3), out_std=np.full(3, 0.05),
        frequency=rng.standard_normal((inputs, bends)), phase=rng.uniform(0.0, 6.0, bends),
        wind=True, components=True, input_tanh=False,
    )  # fmt: skip


def under_way(count: int = 40, actuators: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random states, actuators with a share of the campaign, and winds."""
    rng = np.random.default_rng(1)
    state = rng.uniform((-20, -0.3, -20, -0.3, -3, -0.2), (20, 0.9, 20, 0.3, 3, 0.2), (count, 6))
    low, high = [-1.0] * (actuators - 1) + [0.0, 0.0], [1.0] * (actuators - 1) + [12.0, 1.0]
    actuator = rng.uniform(low, high, (count, actuators + 1))
    return state, actuator, rng.uniform(-3.0, 3.0, (count, 2))


def acceleration(model: Extended, values, numbers, state, actuator, wind) -> np.ndarray:
    theta = jnp.asarray(np.concatenate((values, numbers)))
    return np.asarray(model.acceleration(theta, state, actuator, wind))


def sized(cause) -> np.ndarray:
    """Numbers of half their realistic size, of alternating sign where that has a meaning."""
    low, _ = cause.bounds(setting())
    sign = np.where((low < 0.0) & (np.arange(cause.count) % 2 == 1), -1.0, 1.0)
    return 0.5 * sign * cause.sizes(setting())


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
    was, shown = closed.record(profile), closed.record(profile, **bent)
    found = BY[label].read(shown, np.array(numbers))
    # a clock is put right by interpolation: h²/8 times a second derivative of at most 0.06
    close = 1e-4 if label.startswith("clock") else 1e-12
    far = max(np.abs(getattr(shown, n) - getattr(was, n))[INNER].max() for n in CHANGED)
    assert far > 10.0 * close  # they were bent
    for name in CHANGED:
        right = getattr(found, name)[INNER]
        assert right == pytest.approx(getattr(was, name)[INNER], abs=close), name


@SHIPS
@pytest.mark.parametrize("cause", [c for c in CATALOGUE if c.reads], ids=lambda c: c.label)
def test_inverse_undoes_read(cause, profile):
    """What the instruments will show, of what was. A lag forgets nothing but its first seconds."""
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
    shown = closed.record(TWIN, heading=-0.05, bias=0.004, moved=(0.3, 0.1))
    for label, numbers in (
        ("heading_offset", [-0.05]), ("yaw_rate_bias", [0.004]), ("antenna_offset", [0.3, 0.1]),
    ):  # fmt: skip
        shown = BY[label].read(shown, np.array(numbers))
    assert shown.state == pytest.approx(closed.record(TWIN).state, abs=1e-12)


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


# --- current --------------------------------------------------------------------------------------

NORTH, EAST = 0.11, -0.07


def free_body(state: np.ndarray, off: tuple[str, ...] = ("propeller", "rudder", "wind")):
    """Acceleration of a hull that no water holds, in a current, and its masses m_x, m_y, I."""
    model, values = extended([Current()], without=off)
    names = model.base.names
    free = np.array([n.startswith("hull.") for n in names])
    values = np.where(free, 0.0, values)
    found = acceleration(
        model, values, [NORTH, EAST], state, np.zeros((len(state), 4)), np.zeros((len(state), 2))
    )
    g = model.base.geometry
    of = dict(zip(names, values, strict=True))
    unit = 0.5 * g.density * g.length**2 * g.draught
    masses = of["body.m_x"] * unit, of["body.m_y"] * unit, of["body.i_j"] * unit * g.length**2
    return found, masses, g


def drifting(heading, rate) -> np.ndarray:
    """At rest in the moving water, turning: body velocities over ground."""
    c, s = np.cos(heading), np.sin(heading)
    u, v = c * NORTH + s * EAST, c * EAST - s * NORTH
    zero = np.zeros_like(heading)
    return np.stack((zero, u, zero, v, heading, rate), -1)


def test_a_ship_at_rest_in_the_water_drifts_with_the_current():
    """Its hull feels the water and not the ground: adrift it keeps its way, held it does not."""
    heading = np.linspace(-3.0, 3.0, 13)
    model, values = extended([Current()], without=("propeller", "rudder", "wind"))
    still = np.zeros((13, 4)), np.zeros((13, 2))
    found = acceleration(model, values, [NORTH, EAST], drifting(heading, np.zeros(13)), *still)
    assert found == pytest.approx(np.zeros((13, 3)), abs=1e-12)
    held = drifting(heading, np.zeros(13)) * [1, 0, 1, 0, 1, 1]  # over ground at rest
    assert np.abs(acceleration(model, values, [NORTH, EAST], held, *still)).max() > 1e-4


def test_turning_in_a_current_by_hand():
    """The free body moves through the water by its own equations; over ground, the water's
    velocity in body axes turns away under it: d/dt(RᵀV) = r (V_y, -V_x) in body axes."""
    rng = np.random.default_rng(4)
    heading, r = rng.uniform(-3, 3, 20), rng.uniform(-0.2, 0.2, 20)
    u, v = rng.uniform(-0.5, 0.5, 20), rng.uniform(-0.2, 0.2, 20)  # through the water
    state = drifting(heading, r)
    c_u, c_v = state[:, 1].copy(), state[:, 3].copy()
    state[:, 1] += u
    state[:, 3] += v
    found, (m_x, m_y, yaw), g = free_body(state)
    m, x = g.mass, g.x_g
    matrix = np.array([[m + m_x, 0, 0], [0, m + m_y, x * m], [0, x * m, yaw + x * x * m]])
    pull = np.stack(
        ((m + m_y) * v * r + x * m * r * r, -(m + m_x) * u * r, -x * m * u * r), -1
    )  # centripetal and Coriolis terms of Yasukawa & Yoshimura 2015, Eq. 4
    through = np.linalg.solve(matrix, pull.T).T
    over = through + np.stack((r * c_v, -r * c_u, np.zeros(20)), -1)
    assert found == pytest.approx(over, rel=1e-9, abs=1e-12)


def test_wind_over_ground_and_not_over_the_water():
    """A current that carries the ship leaves the wind that it feels over ground as it is."""
    model, values = extended([Current()], without=("propeller", "rudder"))
    heading = np.linspace(-3.0, 3.0, 13)
    wind = np.tile([3.0, 1.0], (13, 1))
    state = drifting(heading, np.zeros(13))
    found = acceleration(model, values, [NORTH, EAST], state, np.zeros((13, 4)), wind)
    # the same apparent wind on a ship at rest in still water, in a true wind that much stronger
    rest = state * [1, 0, 1, 0, 1, 1]
    felt = wind + np.array([NORTH, EAST])
    still = acceleration(model, values, [0.0, 0.0], rest, np.zeros((13, 4)), felt)
    assert np.abs(found).max() > 1e-4
    assert found == pytest.approx(still, abs=1e-12)


# --- the ship -------------------------------------------------------------------------------------


def test_payload_by_the_rigid_body_equations():
    """Mass, moment and inertia of a point of 30 kg, 0.8 m ahead of midship, written out."""
    model, values = extended([Payload()])
    state, actuator, wind = under_way()
    found = acceleration(model, values, [30.0, 24.0], state, actuator, wind)
    forces = model.base.forces(jnp.asarray(values), state, actuator[:, :-1], wind)
    force = np.asarray(sum(forces.values()))
    g, of = model.base.geometry, dict(zip(model.base.names, values, strict=True))
    unit = 0.5 * g.density * g.length**2 * g.draught
    m_x, m_y = of["body.m_x"] * unit, of["body.m_y"] * unit
    inertia = of["body.i_j"] * unit * g.length**2 + g.mass * g.x_g**2 + 30.0 * 0.8**2
    m, moment = g.mass + 30.0, g.mass * g.x_g + 30.0 * 0.8
    u, v, r = state[:, 1], state[:, 3], state[:, 5]
    du, dv, dr = found.T
    surge = (m + m_x) * du - (m + m_y) * v * r - moment * r * r
    sway = (m + m_y) * dv + (m + m_x) * u * r + moment * dr
    yaw = inertia * dr + moment * (dv + u * r)
    # the module's inertia is smooth where there is no load: 7e-5 of moment²/load
    assert np.stack((surge, sway, yaw), -1) == pytest.approx(force, abs=1e-3)
    assert Payload().displayed(np.array([30.0, 24.0]))["position"][0] == pytest.approx(0.8)


def forces(label: str, numbers, state, actuator, wind, without=()) -> np.ndarray:
    """X, Y, N of a ship that does not turn, from its accelerations: mass times acceleration."""
    cause = BY[label].on(setting())
    model, values = extended([cause], without=without)
    found = acceleration(model, values, numbers, state, actuator, wind)
    g, of = model.base.geometry, dict(zip(model.base.names, values, strict=True))
    unit = 0.5 * g.density * g.length**2 * g.draught
    m, x = g.mass, g.x_g
    m_x, m_y = of["body.m_x"] * unit, of["body.m_y"] * unit
    c = of["body.i_j"] * unit * g.length**2 + m * x * x
    return found @ np.array([[m + m_x, 0, 0], [0, m + m_y, x * m], [0, x * m, c]])


REST = np.zeros((1, 6))
CALM = np.zeros((1, 2))


def test_wind_force_scales_each_force_of_the_wind():
    off = ("propeller", "rudder")
    args = (REST, np.zeros((1, 4)), np.array([[3.0, 2.0]]), off)
    plain = forces("wind_force", np.zeros(3), *args)
    found = forces("wind_force", [0.3, -0.2, 0.5], *args)
    assert np.abs(plain).min() > 0.01
    assert found / plain == pytest.approx(np.array([[1.3, 0.8, 1.5]]), rel=1e-9)


@pytest.mark.parametrize("base", (None, network()), ids=("mmg", "network"))
def test_a_model_without_wind_is_given_that_of_such_a_ship(base):
    """Ones make of it the model with the estimated wind force; each number is an axis' own."""
    ship, main, _ = mmg.geometry_of(TWIN)
    nominal = mmg.estimated(ship, main)
    lacking = {
        n: float(v) for n, v in zip(nominal.names, nominal.values, strict=True) if "wind." in n
    }
    assert len(lacking) == 10
    cause = WindForce().on(replace(setting(), lacking=lacking))
    calm, values = extended([], without=("wind",), base=base)
    windless = replace(calm, causes=(cause,), constants=cause.constants(
        replace(setting(), lacking=lacking)))  # fmt: skip
    state, actuator, wind = under_way()
    args = (state, actuator, wind)
    plain = acceleration(calm, values, [], *args)
    assert acceleration(windless, values, np.zeros(3), *args) == pytest.approx(plain, abs=1e-15)
    whole, _ = extended([])
    felt = acceleration(whole, nominal.values, [], *args)
    still, known = extended([], without=("wind",))
    felt = felt - acceleration(still, known, [], *args)
    found = acceleration(windless, values, np.ones(3), *args) - plain
    assert found == pytest.approx(felt, rel=1e-9, abs=1e-14)
    assert np.abs(found).max(0).min() > 1e-3
    ahead = acceleration(windless, values, [0.5, 0.0, 0.0], *args) - plain
    assert ahead[:, 0] == pytest.approx(0.5 * felt[:, 0], rel=1e-9)
    assert np.abs(ahead[:, 1:]).max() < 1e-14


def test_wind_in_a_model_without_it_is_no_coefficient_that_a_fit_takes_in():
    lacking = replace(setting(), lacking={"wind.x1": -0.7})
    assert WindForce().absorbed and not WindForce().on(lacking).absorbed
    assert WindForce().on(setting()) == WindForce()
    for label in ("wind_direction_offset", "wind_speed_scale", "clock_offset:wind"):
        assert BY[label].missing(lacking) == "the model feels no wind"
    shown = WindForce().on(lacking).displayed(np.array([0.9, 1.1, -0.2]))
    assert [v for v, _ in shown.values()] == pytest.approx([0.9, 1.1, -0.2])


def test_thrust_loss_and_drift_at_the_bollard():
    """At rest the screw alone pushes: by the factor, and by the slope at 40 % of the campaign."""
    off = ("rudder", "wind")
    args = (REST, np.array([[0.0, 0.0, 8.0, 0.4]]), CALM, off)
    plain = forces("thrust_loss", [0.0], *args)[0, 0]
    assert plain > 1.0
    assert forces("thrust_loss", [-0.25], *args)[0, 0] == pytest.approx(0.75 * plain, rel=1e-9)
    assert forces("thrust_drift", [-0.25], *args)[0, 0] == pytest.approx(0.90 * plain, rel=1e-9)


def test_fouling_and_cross_flow_are_what_the_hull_feels_straight_ahead_and_abeam():
    """Towed without screw and rudders: X = ½ρLd X'₀ u² ahead, Y = -½ρLd C_D v |v| abeam."""
    off = ("propeller", "rudder", "wind")
    model, values = extended([], without=off)
    of, g = dict(zip(model.base.names, values, strict=True)), model.base.geometry
    q = 0.5 * g.density * g.length * g.draught
    ahead = np.array([[0.0, 0.7, 0.0, 0.0, 0.2, 0.0]])
    still = (np.zeros((1, 4)), CALM, off)
    x = forces("fouling", [0.6], ahead, *still)[0, 0]
    assert x == pytest.approx(1.6 * q * of["hull.x_0f"] * 0.49, rel=1e-3)
    abeam = np.array([[0.0, 0.0, 0.0, -0.3, 0.2, 0.0]])
    y = forces("cross_flow_drag", [0.35], abeam, *still)[0, 1]
    assert y == pytest.approx(1.35 * q * of["hull.c_d"] * 0.09, rel=1e-9)


def test_rudder_force_scales_what_the_rudders_add():
    without = forces("rudder_force", [0.0], AHEAD, np.array([[0.4, 0.3, 6.0, 0.0]]), CALM,
                     ("rudder", "wind"))  # fmt: skip
    args = (AHEAD, np.array([[0.4, 0.3, 6.0, 0.0]]), CALM, ("wind",))
    plain = forces("rudder_force", [0.0], *args) - without
    found = forces("rudder_force", [-0.2], *args) - without
    assert np.abs(plain).min() > 0.1
    assert found == pytest.approx(0.8 * plain, rel=1e-6)


AHEAD = np.array([[0.0, 0.6, 0.0, 0.0, 0.3, 0.0]])


def test_a_bank_draws_in_and_turns_the_bow_out():
    """Along a wall to starboard: pulled to starboard, turned to port; the mirrored way abeam to
    port; with the square of the speed; and hardly at all a hundred metres off."""
    off = ("propeller", "rudder", "wind")
    still = (np.zeros((1, 4)), CALM, off)

    def pull(heading, u, y0):
        state = np.array([[0.0, u, y0, 0.0, heading, 0.0]])
        one, none = (forces("bank", [p], state, *still) for p in (1.0, 0.0))
        return (one - none)[0]

    north, south = pull(0.0, 0.6, 38.0), pull(math.pi, 0.6, 38.0)
    assert north[1] > 0.1 and north[2] < -0.1
    assert south == pytest.approx(north * [1, -1, -1], abs=1e-9)
    assert pull(0.0, 0.3, 38.0)[1] == pytest.approx(0.25 * north[1], rel=1e-9)
    assert pull(0.0, 0.6, -60.0)[1] < 0.01 * north[1]
    # by hand: 0.15 · ½ρLd u² / (1 + (gap/3L)³), gap 2 m less half a breadth
    gap = (2.0 - 0.5 * 0.489) / 9.0
    q = 0.5 * 1000.0 * 3.0 * 0.201
    assert north[1] == pytest.approx(0.15 * q * 0.36 / (1.0 + gap**3), rel=1e-4)


def test_shallow_water_acts_where_it_is_shallow():
    """One bump of the map: the hull's drag grows there by 1.2 of it, and far away not at all."""
    off = ("propeller", "rudder", "wind")
    still = (np.zeros((1, 4)), CALM, off)
    strength = np.zeros(12)
    strength[4] = 0.5

    def drag(at):
        abeam = np.array([[at[0], 0.0, at[1], 0.3, 0.0, 0.0]])
        model, values = extended([BY["shallow_water"]], without=off)
        found = acceleration(model, values, strength, abeam, *still[:2])[0]
        plain = acceleration(model, values, np.zeros(12), abeam, *still[:2])[0]
        return found[1] / plain[1]

    near, away = drag(PLACES[4]), drag(PLACES[4] + 200.0)
    model, values = extended([])
    of, g = dict(zip(model.base.names, values, strict=True)), model.base.geometry
    added = of["body.m_y"] * 0.5 * g.density * g.length**2 * g.draught
    # drag up by 1 + 1.2 s, inertia by the added mass's 1 + 0.7 s
    heavier = (g.mass + 1.35 * added) / (g.mass + added)
    assert away == pytest.approx(1.0, abs=1e-9)
    assert near == pytest.approx(1.6 / heavier, rel=0.02)


def test_no_water_is_deeper_than_deep():
    """A map may be less than none where bumps overlap: the forces there are deep water's, and
    what a first look asks of a flat map is the slope that a shoal has."""
    model, values = extended([BY["shallow_water"]])
    abeam = np.array([[PLACES[4][0], 0.3, PLACES[4][1], 0.2, 0.0, 0.0]])
    still = (np.zeros((1, 4)), CALM)

    def at(strength):
        return acceleration(model, values, np.eye(12)[4] * strength, abeam, *still)

    assert at(-0.3) == pytest.approx(at(0.0), abs=1e-12)
    slope = jax.jacfwd(
        lambda s: model.acceleration(
            jnp.concatenate((jnp.asarray(values), jnp.eye(12)[4] * s)),
            abeam, *still,
        )
    )(0.0)  # fmt: skip
    assert np.asarray(slope) == pytest.approx((at(1e-6) - at(0.0)) / 1e-6, rel=1e-3)
    assert np.abs(slope).max() > 1e-3


def test_around_a_network_a_cause_adds_what_it_changes_in_the_mmg():
    """ν̇ = f + [g(c') - g(c)], and a current moves the water under either."""
    cause = BY["thrust_loss"]
    model, values = extended([cause], base=network())
    physical, theta = extended([cause])
    args = under_way()
    more = acceleration(model, values, [-0.3], *args) - acceleration(model, values, [0.0], *args)
    of_mmg = acceleration(physical, theta, [-0.3], *args) - acceleration(
        physical, theta, [0.0], *args
    )
    assert more == pytest.approx(of_mmg, abs=1e-12)
    model, values = extended([Current()], base=network())
    heading = np.linspace(-3.0, 3.0, 40)
    state = drifting(heading, np.zeros(40))
    found = acceleration(model, values, [NORTH, EAST], state, args[1], args[2])
    rest = state * [1, 0, 1, 0, 1, 1]
    still = acceleration(
        model, values, [0.0, 0.0], rest, args[1], args[2] + np.array([NORTH, EAST])
    )
    assert found == pytest.approx(still, abs=1e-12)


# --- words ----------------------------------------------------------------------------------------


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
    if cause.count == 1 and cause.label not in ("shallow_water",):
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
     ("shallow_water", [0.1] + [0.0] * 11)],
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
    late, lagged, aslant = (
        BY[label].on(setting(FERRY)) for label in ("rudder_delay", "rudder_lag", "rudder_offset")
    )
    numbers = {late: [0.5], lagged: [0.5], aslant: [0.2, -0.1]}
    acting = {cause: cause.read(read, np.array(p)).actuator for cause, p in numbers.items()}
    for found in acting.values():
        assert np.array_equal(found[:, others], read.actuator[:, others])
    assert acting[late][5:, turned] == pytest.approx(read.actuator[:-5, turned])
    rate = np.gradient(acting[lagged][:, turned], 0.1, axis=0)
    lack = (read.actuator - acting[lagged])[:, turned]
    assert np.corrcoef(rate[5:-5].ravel(), lack[5:-5].ravel())[0, 1] > 0.9
    port = [FERRY.actuators[i].position_m[1] < 0.0 for i in turned]
    assert (acting[aslant] - read.actuator)[0, turned] == pytest.approx(np.where(port, 0.2, -0.1))
    for cause, p in numbers.items():
        output = cause.sentence(cause.estimates(np.array(p), 1e-6 * np.eye(cause.count)))
        assert output.startswith("The azimuths ")


# --- which cannot be tested -----------------------------------------------------------------------

MISSING = {
    "wind_force": "wind", "wind_direction_offset": "wind", "wind_speed_scale": "wind",
    "clock_offset:wind": "wind", "clock_offset:yaw_rate": "yaw rate", "bank": "bank",
    "heading_offset:gnss": "over ground",
    "rudder_force": "rudder", "yaw_rate_bias": "yaw rate", "yaw_rate_scale": "yaw rate",
}  # fmt: skip


@EVERY
def test_what_a_ferry_cannot_be_asked(cause):
    """No rudder, no wind sensor, no gyro, no chart: those causes say why; the others are tested.
    What turns its thrusters may be late or misaligned as a rudder may."""
    output = cause.missing(setting(FERRY))
    if cause.label not in MISSING:
        assert output is None
    else:
        assert output is not None and MISSING[cause.label] in output
    assert cause.missing(setting(SINGLE if "over ground" in (output or "") else TWIN)) is None


def test_a_ship_without_screw_has_no_thrust_to_lose():
    profile = SINGLE.model_copy(update={"actuators": SINGLE.actuators[:1]})
    for label in ("thrust_loss", "thrust_drift"):
        assert "screw" in (BY[label].missing(setting(profile)) or "")


# --- every cause that is called testable changes something ----------------------------------------


def of_its_size(profile: Profile) -> Setting:
    """As `trial.setting_of` makes it, of a ship that goes two thirds of its length in 10 s."""
    ship, main, _ = mmg.geometry_of(profile)
    scale = {"speed": 0.2 * main.length / 3.0, "length": main.length, "mass": main.mass,
             "moment": main.mass * main.length}  # fmt: skip
    return Setting(profile, scale, PLACES * main.length / 3.0, 8.0 * main.length / 3.0,
                   parts=ship.parts)  # fmt: skip


def driven_hard(profile: Profile, scale) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random states at about the ship's speed, actuators up to their limits, a fresh wind."""
    rng = np.random.default_rng(5)
    count, speed, length = 60, scale["speed"], scale["length"]
    size = np.array((7.0 * length, speed, 7.0 * length, 0.4 * speed, 3.0, 0.4 * speed / length))
    state = size * rng.uniform(-1.0, 1.0, (count, 6))
    full = {"rudder": 0.6, "azimuth": 3.0, "propeller": 10.0, "thruster": 1.0}
    top = {t.column: t.full for t in mmg.geometry_of(profile)[0].thrusters}
    each = [top.get(i, full[a.kind]) for i, a in enumerate(profile.actuators)]
    actuator = np.append(each, 1.0) * rng.uniform(-1.0, 1.0, (count, len(each) + 1))
    return state, np.abs(actuator), rng.uniform(-6.0, 6.0, (count, 2))


def reading(profile: Profile) -> Record:
    """Ten seconds in which all moves and turns."""
    rng = np.random.default_rng(6)
    rows = 100
    return Record(
        profile=profile, names=("one",), voyage=np.zeros(rows, int), time=0.1 * np.arange(rows),
        share=np.zeros(rows), starts=np.arange(rows) == 0, measured=np.ones(rows, bool),
        state=rng.standard_normal((rows, 6)).cumsum(0),
        actuator=rng.standard_normal((rows, len(profile.actuators))).cumsum(0),
        wind=rng.standard_normal((rows, 2)),
    )  # fmt: skip


SHIPPED = pytest.mark.parametrize("name", profiles.shipped())


def inert(cause, profile: Profile, at: Setting) -> bool:
    """Whether its realistic numbers change neither the record nor the accelerations by more than
    a thousandth of what the ship has."""
    numbers = cause.sizes(at)
    before = reading(profile)
    after = cause.read(before, numbers)
    if any(not np.allclose(getattr(after, n), getattr(before, n), atol=1e-9) for n in CHANGED):
        return False
    ship, main, _ = mmg.geometry_of(profile)
    values = mmg.estimated(ship, main).values
    model = Extended(mmg.MMG(ship), (cause,), mmg.MMG(ship), values, cause.constants(at))
    batch = driven_hard(profile, at.scale)
    plain = acceleration(model, values, np.zeros(cause.count), *batch)
    changed = acceleration(model, values, numbers, *batch)
    assert np.isfinite(changed).all()
    return bool((np.abs(changed - plain) < 1e-3 * np.abs(plain).max(0)).all())


@SHIPPED
def test_no_cause_that_is_called_testable_is_inert(name):
    profile = profiles.load(name)
    at = of_its_size(profile)
    chosen, untested = catalogue.testable(at)
    labels = [cause.label for cause in chosen]
    assert len(labels) == len(set(labels)) and not set(labels) & set(untested)
    assert {label.partition(":")[0] for label in (*labels, *untested)} == {
        cause.name for cause in CATALOGUE
    }
    assert [cause.label for cause in chosen if inert(cause, profile, at)] == []


@pytest.mark.parametrize(
    ("name", "units"),
    [
        ("esso-vectwin", []),
        ("kvlcc2", []),
        ("blueboat", ["thruster_port", "thruster_starboard"]),
        ("milliampere", [f"thruster_{i}" for i in range(1, 5)]),
    ],
)
def test_of_several_units_each_can_lose_its_thrust(name, units):
    labels = [c.label for c in catalogue.testable(of_its_size(profiles.load(name)))[0]]
    found = [label for label in labels if label.startswith("thrust_loss")]
    assert found == ["thrust_loss", *(f"thrust_loss:{unit}" for unit in units)]


def test_what_the_model_leaves_out_cannot_be_tested():
    """Trained with `--without rudder`, it has no rudder force to scale and none to turn."""
    plain = of_its_size(TWIN)
    without = replace(plain, parts=tuple(p for p in plain.parts if p != "rudder"))
    untested = catalogue.testable(without)[1]
    for label in ("rudder_force", "rudder_offset", "rudder_lag", "rudder_delay"):
        assert label not in catalogue.testable(plain)[1]
        assert untested[label] == "the ship has no rudder"
    bare = catalogue.testable(replace(plain, parts=("hull",)))[1]
    assert "screw" in bare["thrust_loss"] and "screw" in bare["thrust_drift"]


def test_fitted_to_the_voyages_in_question_a_model_has_absorbed_its_coefficients():
    at = of_its_size(profiles.load("blueboat"))
    for fitted, word in (("physics", None), ("network", "network")):
        chosen, untested = catalogue.testable(at, fitted=fitted)
        assert "absorbs" in untested["thrust_loss"] and "absorbs" in untested["fouling"]
        assert "absorbs" in untested["thrust_loss:thruster_port"]
        assert "current" in {c.label for c in chosen}
        assert (word or "") in untested.get("antenna_offset", "")


# --- thrust lost ----------------------------------------------------------------------------------

TWO_SCREWS = TWIN.model_copy(  # a pair instead of the one on the centreline
    update={
        "actuators": (
            *TWIN.actuators[:2],
            *(
                TWIN.actuators[2].model_copy(
                    update={"name": f"screw_{side}", "position_m": (-1.4, across)}
                )
                for side, across in (("port", -0.09), ("starboard", 0.09))
            ),
        )
    }
)


def parts_of(profile: Profile, c, actuator) -> dict[str, np.ndarray]:
    ship, _, _ = mmg.geometry_of(profile)
    state = jnp.asarray([0.0, 0.4, 0.0, 0.02, 0.3, 0.01])
    found = mmg.MMG(ship).forces_of(c, state, jnp.asarray(actuator), jnp.zeros(2))
    return {part: np.asarray(force) for part, force in found.items()}


def plain_coefficients(profile: Profile) -> dict[str, float]:
    ship, main, _ = mmg.geometry_of(profile)
    p = mmg.estimated(ship, main)
    return dict(zip(p.names, p.values.tolist(), strict=True))


def test_one_thruster_of_four_loses_its_own_thrust_alone():
    """Each alone running: 0.7 of its force if it is the one, all of it if not."""
    c = plain_coefficients(FERRY)
    weaker = replace(BY["thrust_loss"], actuator="thruster_2").coefficients(c, (-0.3,), 0, 0, {})
    together = BY["thrust_loss"].coefficients(c, (-0.3,), 0, 0, {})
    for i, a in enumerate(FERRY.actuators):
        if a.kind != "thruster":
            continue
        for command in (15.0, -15.0):
            running = np.where(np.arange(len(FERRY.actuators)) == i, command, 0.2)
            running[
                [j for j, b in enumerate(FERRY.actuators) if b.kind == "thruster" and j != i]
            ] = 0
            before = parts_of(FERRY, c, running)["thruster"]
            assert np.abs(before[:2]).max() > 10.0
            share = 0.7 if a.name == "thruster_2" else 1.0
            assert parts_of(FERRY, weaker, running)["thruster"] == pytest.approx(share * before)
            assert parts_of(FERRY, together, running)["thruster"] == pytest.approx(0.7 * before)


def test_one_screw_of_two_loses_its_own_thrust_alone():
    """The screws' coefficients are one set: at rest the pair's thrust falls by half of the loss,
    and the yaw moment is that of what the one screw lacks."""
    c = plain_coefficients(TWO_SCREWS)
    weaker = replace(BY["thrust_loss"], actuator="screw_port").coefficients(c, (-0.3,), 0, 0, {})
    rest = {"state": jnp.zeros(6)}
    ship, _, _ = mmg.geometry_of(TWO_SCREWS)

    def thrust(p, port, starboard):
        orders = jnp.asarray([0.0, 0.0, port, starboard])
        return np.asarray(
            mmg.MMG(ship).forces_of(p, rest["state"], orders, jnp.zeros(2))["propeller"]
        )

    one = thrust(c, 8.0, 0.0)[0]
    assert one > 0.0
    assert thrust(weaker, 8.0, 0.0)[0] == pytest.approx(0.7 * one)
    assert thrust(weaker, 0.0, 8.0) == pytest.approx(thrust(c, 0.0, 8.0))
    assert thrust(weaker, 8.0, 8.0)[0] == pytest.approx(1.7 * one)
    # 0.3 of the port screw's thrust is missing 0.09 m to port: the bow goes to port
    lost = thrust(weaker, 8.0, 8.0)[2] - thrust(c, 8.0, 8.0)[2]
    assert lost == pytest.approx(-0.3 * one * 0.09)
    both = replace(BY["thrust_loss"], actuator="screw_starboard").coefficients(
        weaker, (-0.3,), 0, 0, {}
    )
    assert thrust(both, 8.0, -8.0) == pytest.approx(
        thrust(BY["thrust_loss"].coefficients(c, (-0.3,), 0, 0, {}), 8.0, -8.0)
    )


def test_thrust_that_drifts_drifts_on_thrusters_too():
    c = plain_coefficients(FERRY)
    at_end = BY["thrust_drift"].coefficients(c, (-0.2,), 0, 1.0, {})
    halfway = BY["thrust_drift"].coefficients(c, (-0.2,), 0, 0.5, {})
    running = np.full(len(FERRY.actuators), 10.0)
    before = parts_of(FERRY, c, running)["thruster"]
    assert parts_of(FERRY, at_end, running)["thruster"] == pytest.approx(0.8 * before)
    assert parts_of(FERRY, halfway, running)["thruster"] == pytest.approx(0.9 * before)


def test_a_lost_units_words_name_it():
    one = replace(BY["thrust_loss"], actuator="bow_1")
    reported = one.estimates(np.array([-0.25]), np.diag([1e-6]))
    assert (one.name, one.label) == ("thrust_loss", "thrust_loss:bow_1")
    assert one.sentence(reported) == "The thrust of bow_1 is 0.75 times the model's."
    assert set(reported) == {"factor"}
    assert one.compatible("thrust_loss:bow_2") and one.compatible("fouling")
    assert not one.compatible("thrust_loss") and not one.compatible("thrust_loss:bow_1")
    assert not BY["thrust_loss"].compatible("thrust_loss:bow_1")
    assert BY["thrust_loss"].compatible("thrust_drift")


def test_a_ship_that_stays_has_no_map_of_the_bottom():
    one = setting(TWIN, PLACES[:3])
    assert "place" in (BY["shallow_water"].missing(one) or "")


def test_sizes_follow_the_ship():
    """Shares of its speed, length and mass; a ship twice as fast meets twice the current."""
    plain = setting()
    fast = replace(plain, scale={**plain.scale, "speed": 1.2, "length": 300.0})
    assert Current().sizes(fast) == pytest.approx(2.0 * Current().sizes(plain))
    antenna = BY["antenna_offset"]
    assert antenna.sizes(fast) == pytest.approx(100.0 * antenna.sizes(plain))
    low, high = Payload().bounds(plain)
    assert low[0] == pytest.approx(-0.5 * 244.6) and high[0] == math.inf


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


def test_sizes_are_not_the_simulated_ships():
    """The simulated ship draws each cause from a range, and a prior in its middle would be told the
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
