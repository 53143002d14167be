"""The MMG forces: published states, closed forms, mirror images, and the balance of momentum."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from shiplog.models.mmg import body
from shiplog.models.mmg.geometry import Geometry, geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.ship_profile import file as profiles

# ---------------------------------------------------------------- published states


INPUTS = {  # u, v, r, heading, propeller [rev/s], rudder, U_T, γ_T
    "ahead": (0.3, -0.05, 0.03, 0.4, 10.0, 0.35, 0.0, 0.0),
    "ahead in wind": (0.3, -0.05, 0.03, 0.4, 10.0, 0.35, 2.0, 1.2),
    "braking astern": (-0.06, 0.03, -0.02, 2.0, 8.0, -0.6, 0.0, 0.0),
    "crash stop": (0.15, 0.02, 0.01, 0.0, -8.0, 0.2, 0.0, 0.0),
    "astern in wind": (-0.08, -0.02, 0.015, 0.0, -10.0, -0.3, 1.5, 4.0),
    "coasting": (0.25, 0.0, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0),
    "bollard": (0.0, 0.0, 0.0, 0.0, 10.0, 0.3, 0.0, 0.0),
}
FORCES = {  # X, Y, N of each part [N, N m]
    "ahead": {
        "hull": (-5.9185e-01, 4.1999e00, 2.6272e-01), "propeller": (9.5212e-01, 0, 0),
        "rudder": (-8.9681e-02, -4.2251e-01, 6.1589e-01),
        "wind": (-5.6633e-03, 4.8300e-03, 2.5029e-03),
    },
    "ahead in wind": {
        "hull": (-5.9185e-01, 4.1999e00, 2.6272e-01), "propeller": (9.5212e-01, 0, 0),
        "rudder": (-8.9681e-02, -4.2251e-01, 6.1589e-01),
        "wind": (-2.8489e-01, -1.0313e00, -3.7433e-01),
    },
    "braking astern": {
        "hull": (4.1161e-02, -6.9641e-01, 6.0683e-01),
        "propeller": (8.8358e-01, 5.5954e-02, 8.2777e-03),
        "rudder": (-2.2501e-02, 5.6563e-02, -8.2451e-02),
        "wind": (2.7783e-04, -6.6594e-04, 4.2126e-04),
    },
    "crash stop": {
        "hull": (-1.5069e-01, -3.9649e-01, -6.6291e-01),
        "propeller": (-7.9074e-01, -2.5325e-01, 3.0292e-01),
        "rudder": (8.5327e-04, 7.2390e-03, -1.0552e-02),
        "wind": (-1.3954e-03, -9.5866e-04, -5.0094e-04),
    },
    "astern in wind": {
        "hull": (6.3915e-02, 3.5980e-01, -4.7445e-01),
        "propeller": (-7.1337e-01, -1.1855e-01, 1.4341e-01),
        "rudder": (-1.4150e-03, 7.8665e-03, -1.1467e-02),
        "wind": (1.2592e-01, 6.2217e-01, -2.9841e-01),
    },
    "coasting": {
        "hull": (-4.0254e-01, 0, 0), "propeller": (0, 0, 0),
        "rudder": (-7.2659e-03, -4.0395e-02, 5.8883e-02), "wind": (-3.7726e-03, 0, 0),
    },
    "bollard": {
        "hull": (0, 0, 0), "propeller": (1.2704e00, 0, 0),
        "rudder": (-2.9975e-02, -1.6664e-01, 2.4291e-01), "wind": (0, 0, 0),
    },
}  # fmt: skip
ACCELERATIONS = {
    "ahead": (-1.50223e-03, 2.38835e-03, 2.64415e-03),
    "ahead in wind": (-2.47587e-03, 2.85848e-04, 1.24330e-03),
    "braking astern": (2.17980e-03, -2.05754e-03, 2.35538e-03),
    "crash stop": (-2.94356e-03, -2.17552e-03, -1.51534e-03),
    "astern in wind": (-2.31210e-03, 2.68288e-03, -2.87595e-03),
    "coasting": (-1.44212e-03, -9.70646e-05, 2.60400e-04),
    "bollard": (4.32538e-03, -4.00426e-04, 1.07424e-03),
}


def motion(name):
    u, v, r, heading, n, angle, speed, origin = INPUTS[name]
    wind = (speed * math.cos(origin), speed * math.sin(origin))
    return (u, v, r), {"heading": heading, "wind": wind, "actuator": (angle, n)}


@pytest.mark.parametrize("name", INPUTS)
def test_the_published_parameters_give_the_reference_forces(esso, name):
    velocity, rest = motion(name)
    found = esso.forces(*velocity, **rest)
    assert found.keys() == FORCES[name].keys()
    for part, wanted in FORCES[name].items():
        assert found[part] == pytest.approx(wanted, rel=2e-4, abs=1e-5), part


@pytest.mark.parametrize("name", INPUTS)
def test_the_published_parameters_give_the_reference_accelerations(esso, name):
    velocity, rest = motion(name)
    found = esso.acceleration(*velocity, **rest)
    assert found == pytest.approx(ACCELERATIONS[name], abs=5e-6)


# ---------------------------------------------------------------- body


def test_accelerations_satisfy_the_equations_of_motion(esso):
    g = esso.model.geometry
    unit = 0.5 * 998.0 * 3.0**2 * 0.20114
    m, x_g = 244.6, 0.0936
    m_x, m_y, yaw = 0.0467 * unit, 0.2579 * unit, 0.0286 * unit * 9.0
    p = dict(zip(esso.parameters.names, esso.parameters.values, strict=True))
    assert [float(value) for value in body.masses(p, g)] == pytest.approx([m_x, m_y, yaw])
    rng = np.random.default_rng(0)
    for _ in range(5):
        (u, v, r), force = rng.normal(size=3), rng.normal(size=3) * 50.0
        du, dv, dr = np.asarray(body.accelerations(p, g, u, v, r, force)).tolist()
        x = (m + m_x) * du - (m + m_y) * v * r - x_g * m * r**2
        y = (m + m_y) * dv + (m + m_x) * u * r + x_g * m * dr
        n = (yaw + x_g**2 * m) * dr + x_g * m * (dv + u * r)
        assert (x, y, n) == pytest.approx(force.tolist(), rel=1e-10)


def test_the_force_of_an_acceleration_gives_it_back(esso):
    """From rest, where no Coriolis force stands between the two."""
    p = dict(zip(esso.parameters.names, esso.parameters.values, strict=True))
    g, wanted = esso.model.geometry, np.array([0.01, -0.02, 0.003])
    force = body.forces_of(p, g, wanted)
    found = body.accelerations(p, g, 0.0, 0.0, 0.0, force)
    assert np.asarray(found) == pytest.approx(wanted, rel=1e-12)
    assert float(force[0]) == pytest.approx(0.01 * (244.6 + 0.0467 * 0.5 * 998.0 * 9.0 * 0.20114))


def test_the_acceleration_is_that_of_the_sum_of_forces(twin):
    motion = dict(u=0.4, v=0.1, r=-0.05, actuator=(0.2, 5.0, -0.1, 3.0))
    total = sum(twin.forces(**motion).values())
    p = dict(zip(twin.parameters.names, twin.parameters.values, strict=True))
    wanted = body.accelerations(p, twin.model.geometry, 0.4, 0.1, -0.05, total)
    assert twin.acceleration(**motion) == pytest.approx(np.asarray(wanted), rel=1e-12)


def test_many_states_at_once_are_each_alone(esso):
    states = np.random.default_rng(1).normal(size=(2, 3, 6)) * 0.1
    actuator, wind = np.full((2, 3, 2), (0.1, 8.0)), np.full((2, 3, 2), (1.0, -2.0))
    arguments = (jnp.array(a) for a in (esso.parameters.values, states, actuator, wind))
    together = np.asarray(jax.jit(esso.model.acceleration)(*arguments))
    assert together.shape == (2, 3, 3)
    _, u, _, v, heading, r = states[1, 2].tolist()
    alone = esso.acceleration(u, v, r, heading=heading, wind=(1.0, -2.0), actuator=(0.1, 8.0))
    assert together[1, 2] == pytest.approx(alone, rel=1e-10)


# ---------------------------------------------------------------- mirror images


def mirrored(ship, u, v, r, heading, wind, actuator, other):
    """Forces of a motion, and of its mirror image along x₀."""
    here = ship.forces(u, v, r, heading=heading, wind=wind, actuator=actuator)
    there = ship.forces(u, -v, -r, heading=-heading, wind=(wind[0], -wind[1]), actuator=other)
    return here, there


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("n", [10.0, -10.0, 0.0])
def test_a_symmetric_ship_in_a_mirror(esso, seed, n):
    even = esso.changed(
        rudder__gamma_n=0.4, rudder__gamma_p=0.4, rudder__f_3=0.3, rudder__f_t=0.8,
        **{f"propeller__{c}{i}": 0.0 for c in "ab" for i in range(1, 9)},
    )  # fmt: skip
    u, v, r, heading, north, east, angle = np.random.default_rng(seed).normal(size=7).tolist()
    state = (0.3 * u, 0.1 * v, 0.05 * r, heading, (2 * north, 2 * east))
    here, there = mirrored(even, *state, (0.4 * angle, n), (-0.4 * angle, n))
    for part, force in here.items():
        assert there[part] == pytest.approx(force * [1, -1, -1], rel=1e-9, abs=1e-12), part


@pytest.mark.parametrize("seed", range(4))
def test_twin_rudders_in_a_mirror_change_places_and_sign(vectwin, seed):
    u, v, r, heading, port, starboard = np.random.default_rng(seed).normal(size=6).tolist()
    state = (abs(0.3 * u), 0.1 * v, 0.05 * r, heading, (1.0, -2.0))
    here, there = mirrored(vectwin, *state, (port, starboard, 10.0), (-starboard, -port, 10.0))
    for part, force in here.items():
        assert there[part] == pytest.approx(force * [1, -1, -1], rel=1e-9, abs=1e-12), part


@pytest.mark.parametrize(("u", "n"), [(0.3, -8.0), (0.05, -8.0), (-0.1, -8.0), (-0.1, 8.0)])
def test_a_pair_of_screws_turns_against_each_other(twin, u, n):
    """Astern or braking, either alone pushes the stern its own way; both together, straight."""
    port, starboard, both = (
        twin.forces(u, actuator=(0.0, left, 0.0, right))["propeller"]
        for left, right in ((n, 0.0), (0.0, n), (n, n))
    )
    assert port == pytest.approx(starboard * [1, -1, -1], rel=1e-12)
    assert abs(starboard[1]) > 1e-3
    assert both == pytest.approx((2 * starboard[0], 0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize("n", [8.0, -8.0])
def test_twin_screws_and_rudders_in_a_mirror_change_places(twin, n):
    """δ port and starboard change places and sign, the screws their places alone."""
    even = twin.changed(rudder__gamma_n=0.4, rudder__gamma_p=0.4)
    state = (0.3, 0.05, -0.02, 0.4, (0.0, 0.0))
    here, there = mirrored(even, *state, (0.2, n, -0.1, 0.6 * n), (0.1, 0.6 * n, -0.2, n))
    for part, force in here.items():
        assert there[part] == pytest.approx(force * [1, -1, -1], rel=1e-9, abs=1e-12), part


# ---------------------------------------------------------------- parameters


def test_a_model_is_hashable_so_that_it_is_compiled_once():
    one, other = (MMG(geometry_of(profiles.load("esso-osaka"))[0]) for _ in range(2))
    assert one == other and hash(one) == hash(other) and isinstance(one.geometry, Geometry)
