"""The MMG forces: published states, closed forms, mirror images, and the balance of momentum."""

import math
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from shiplog import profile_file as profiles
from shiplog.exceptions import ProfileError
from shiplog.models.mmg import body, parameters
from shiplog.models.mmg.geometry import Geometry, geometry_of, joined, split
from shiplog.models.mmg.hull import cross_flow
from shiplog.models.mmg.model import MMG
from shiplog.models.mmg.parameters import Parameters
from shiplog.profile import Profile

SENSORS = """
[ship]
name = "made up"
length_m = 4.0
breadth_m = 1.0
draught_m = 0.3
mass_kg = 700.0
[sensors.position]
kind = "local"
topic = "/p"
fields = ["x", "y"]
[sensors.velocity]
kind = "body"
topic = "/p"
fields = ["u", "v"]
[sensors.heading]
topic = "/p"
field = "heading"
"""
TWIN = SENSORS + "".join(
    f"""
[[actuators]]
name = "rudder_{side}"
kind = "rudder"
topic = "/a"
field = "rudder_{side}"
unit = "deg"
limits = [-35.0, 35.0]
position_m = [-1.9, {across}]
area_m2 = 0.02
span_m = 0.2
[[actuators]]
name = "screw_{side}"
kind = "propeller"
topic = "/a"
field = "screw_{side}"
unit = "rps"
position_m = [-1.8, {across}]
diameter_m = 0.15
"""
    for side, across in (("port", -0.3), ("starboard", 0.3))
)
TUNNEL = (
    SENSORS
    + """
[[actuators]]
name = "bow"
kind = "thruster"
topic = "/a"
field = "bow"
limits = [-50.0, 100.0]
position_m = [1.5, 0.0]
direction_deg = 90.0
[[actuators]]
name = "pod"
kind = "thruster"
topic = "/a"
field = "pod"
position_m = [-1.0, 0.4]
"""
)


@dataclass(frozen=True)
class Ship:
    """A model with its coefficients, asked with plain numbers."""

    model: MMG
    parameters: Parameters

    def changed(self, **values: float) -> "Ship":
        """Other coefficients: part__key=value."""
        new = {name.replace("__", ".", 1): value for name, value in values.items()}
        assert new.keys() <= set(self.parameters.names)
        pairs = zip(self.parameters.names, self.parameters.values, strict=True)
        array = np.array([new.get(name, value) for name, value in pairs])
        return replace(self, parameters=self.parameters.with_values(array))

    def __getitem__(self, name: str) -> float:
        return float(self.parameters.values[self.parameters.names.index(name)])

    def _arguments(self, u, v, r, heading, wind, actuator):
        still = (0.0,) * self.model.geometry.actuators
        state = (7.0, u, -3.0, v, heading, r)  # the place of a ship drives nothing
        arrays = (self.parameters.values, state, actuator or still, wind)
        return tuple(jnp.array(a, dtype=float) for a in arrays)

    def forces(self, u=0.0, v=0.0, r=0.0, *, heading=0.0, wind=(0.0, 0.0), actuator=None):
        found = self.model.forces(*self._arguments(u, v, r, heading, wind, actuator))
        return {part: np.asarray(force) for part, force in found.items()}

    def acceleration(self, u=0.0, v=0.0, r=0.0, *, heading=0.0, wind=(0.0, 0.0), actuator=None):
        arguments = self._arguments(u, v, r, heading, wind, actuator)
        return np.asarray(self.model.acceleration(*arguments))


def estimated(profile: Profile, without=()) -> Ship:
    g, main, _ = geometry_of(profile, without)
    return Ship(MMG(g), parameters.estimated(g, main))


@pytest.fixture(scope="module")
def esso() -> Ship:
    g, _, _ = geometry_of(profiles.load("esso-osaka"))
    return Ship(MMG(g), parameters.load(parameters.published_file("esso-osaka"), g))


@pytest.fixture(scope="module")
def vectwin() -> Ship:
    return estimated(profiles.load("esso-vectwin"))


@pytest.fixture(scope="module")
def twin() -> Ship:
    return estimated(profiles.parse(TWIN, "twin.toml"))


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


# ---------------------------------------------------------------- hull


def integrals(v, a):
    """By quadrature, split where the flow turns round."""
    corner = [-v / a] if a and abs(v / a) < 0.5 else None
    return tuple(
        quad(lambda x, k=k: abs(v + a * x) * (v + a * x) * x**k, -0.5, 0.5, points=corner)[0]
        for k in (0, 1)
    )


@pytest.mark.parametrize(
    ("v", "a"),
    [
        *[(v, a) for v in (0.3, -0.3) for a in (0.1, -0.1, 0.59, 0.6, 0.61, -0.6, 5.0, -5.0)],
        *np.random.default_rng(2).normal(size=(12, 2)).tolist(),
    ],
)
def test_cross_flow_integrals_are_the_quadratures(v, a):
    assert [float(x) for x in cross_flow(v, a)] == pytest.approx(integrals(v, a), abs=1e-12)


def test_cross_flow_has_its_limits():
    """v|v| of a pure drift; a|a|/32 of a pure turn, twice ∫ a²ξ³ from 0 to ½; nothing at rest."""
    assert [float(x) for x in cross_flow(-0.2, 0.0)] == [-0.2 * 0.2, 0.0]
    assert [float(x) for x in cross_flow(0.0, -0.4)] == pytest.approx([0.0, -0.16 / 32], abs=1e-15)
    assert [float(x) for x in cross_flow(0.0, 0.0)] == [0.0, 0.0]


@pytest.mark.parametrize("v", [0.25, -0.25])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_cross_flow_is_continuous_where_the_stern_stands(v, sign):
    a = sign * 2.0 * v
    inside, outside = cross_flow(v, a * (1 - 1e-9)), cross_flow(v, a * (1 + 1e-9))
    for near, far in zip(inside, outside, strict=True):
        assert float(near) == pytest.approx(float(far), rel=1e-7)


@pytest.mark.parametrize("size", [0.02, 0.5])
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_hull_takes_energy_out_of_every_plain_motion(esso, vectwin, size, axis, sign):
    velocity = np.zeros(3)
    velocity[axis] = sign * size
    for ship in (esso, vectwin):
        force = ship.forces(*velocity)["hull"]
        assert velocity @ force < 0.0
        assert np.delete(force, axis) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_astern_the_cross_terms_change_sign_and_the_damping_does_not(esso):
    """Without drag: Y = q (Y_v v |u| + Y_r L r u), N = q L (N_v v u + N_r L r |u|)."""
    plain = esso.changed(hull__c_d=0.0)
    q, v, lr = 0.5 * 998.0 * 3.0 * 0.20114, 0.04, 3.0 * 0.02
    for u in (0.3, -0.3):
        _, y, n = plain.forces(u, v, 0.02)["hull"]
        assert y == pytest.approx(q * (-0.3728 * v * 0.3 + 0.116 * lr * u))
        assert n == pytest.approx(q * 3.0 * (-0.1458 * v * u - 0.04849 * lr * 0.3))


# ---------------------------------------------------------------- linear damping at low speed

# The supply vessel of Fossen, Sagatun & Sorensen 1996, Bis system: D'' with length L, mass m and
# speed sqrt(gL) as units; D = m sqrt(g/L) T D'' T with T = diag(1, 1, L) and forces -D v.
SUPPLY = """
[ship]
name = "supply vessel"
length_m = 76.2
breadth_m = 18.8
draught_m = 6.25
mass_kg = 6.0e6
""" + TUNNEL[TUNNEL.index("[sensors.position]") :]
DAMPING = np.array([[0.0358, 0.0, 0.0], [0.0, 0.1183, -0.0124], [0.0, -0.0041, 0.0308]])
LINEAR = ("x_u", "y_vl", "y_rl", "n_vl", "n_rl")


@pytest.fixture(scope="module")
def supply() -> Ship:
    """With no other hull force than the published linear damping."""
    ship = estimated(profiles.parse(SUPPLY, "supply.toml"))
    m_nd = supply_mass_nd()
    of = dict(zip(LINEAR, -m_nd * DAMPING[[0, 1, 1, 2, 2], [0, 1, 2, 1, 2]], strict=True))
    none = dict.fromkeys(("x_0f", "x_0a", "x_vr", "y_v", "y_r", "n_v", "n_r", "c_d"), 0.0)
    return ship.changed(**{f"hull__{key}": value for key, value in (of | none).items()})


@pytest.mark.parametrize("velocity", [(0.5, 0, 0), (0, -0.2, 0), (0, 0, 0.01), (-1.0, 0.3, -0.02)])
def test_linear_damping_is_that_of_the_published_supply_vessel(supply, velocity):
    arm = np.diag([1.0, 1.0, 76.2])
    wanted = -6.0e6 * math.sqrt(9.80665 / 76.2) * arm @ DAMPING @ arm @ np.array(velocity)
    assert supply.forces(*velocity)["hull"] == pytest.approx(wanted, rel=1e-12, abs=1e-6)


def test_a_drifting_supply_vessel_loses_speed_as_its_published_time_constant_says(supply):
    """m_x = 0.1274 m in surge: u falls by e in (1.1274/0.0358) sqrt(L/g) = 87.8 s."""
    slow = supply.changed(body__m_x=0.1274 * supply_mass_nd())
    assert slow.acceleration(0.1)[0] == pytest.approx(-0.1 / 87.78, rel=1e-3)


def supply_mass_nd() -> float:
    return 6.0e6 / (0.5 * 1025.0 * 76.2**2 * 6.25)


def test_linear_damping_is_neutral_unless_a_file_or_a_fit_says_otherwise(esso, vectwin):
    for ship in (esso, vectwin):
        assert [ship[f"hull.{key}"] for key in LINEAR] == [0.0] * 5
    at = [vectwin.parameters.names.index(f"hull.{key}") for key in LINEAR]
    published = 0.3226 * np.array([0.0358, 0.1183, 0.0124, 0.0041, 0.0308])
    # an estimated ship may well have the damping of the supply vessel, and not ten times as much
    assert (vectwin.parameters.spread[at] >= published).all()
    assert (vectwin.parameters.spread[at] < 0.1).all()
    assert (vectwin.parameters.high[at][[0, 1, 4]] <= 0.11 * published[[0, 1, 4]]).all()


# ---------------------------------------------------------------- wind


def test_wind_from_each_side_pushes_as_worked_by_hand(esso):
    """q_A = ½ 1.225 2² = 2.45 Pa. From starboard g = -90°: sin g = -1, sin 3g = 1, sin 5g = -1."""
    x0, x1, x3, x5 = (esso[f"wind.x{i}"] for i in (0, 1, 3, 5))
    y1, y3, y5 = (esso[f"wind.y{i}"] for i in (1, 3, 5))
    n1, n3 = esso["wind.n1"], esso["wind.n3"]
    ahead = (2.45 * 0.13544 * (x0 + x1 + x3 + x5), 0.0, 0.0)
    assert esso.forces(wind=(2.0, 0.0))["wind"] == pytest.approx(ahead, abs=1e-12)
    astern = (2.45 * 0.13544 * (x0 - x1 - x3 - x5), 0.0, 0.0)
    assert esso.forces(wind=(-2.0, 0.0))["wind"] == pytest.approx(astern, abs=1e-12)
    area = 2.45 * 0.52038
    aside = (2.45 * 0.13544 * x0, area * (-y1 + y3 - y5), area * 3.0 * (-n1 + n3))
    assert esso.forces(wind=(0.0, 2.0))["wind"] == pytest.approx(aside, abs=1e-12)
    assert ahead[0] < 0.0 < astern[0]
    assert aside[1] < 0.0


def test_wind_harmonics_at_any_angle(esso):
    u_a, angle = 3.0, 2.2
    g, q = -angle, 0.5 * 1.225 * 9.0
    x, y, n = (
        [esso[f"wind.{letter}{i}"] for i in orders]
        for letter, orders in (("x", (0, 1, 3, 5)), ("y", (1, 3, 5)), ("n", (1, 2, 3)))
    )
    wanted = (
        q * 0.13544 * sum(c * math.cos(i * g) for c, i in zip(x, (0, 1, 3, 5), strict=True)),
        q * 0.52038 * sum(c * math.sin(i * g) for c, i in zip(y, (1, 3, 5), strict=True)),
        q * 0.52038 * 3.0 * sum(c * math.sin(i * g) for c, i in zip(n, (1, 2, 3), strict=True)),
    )
    wind = (u_a * math.cos(angle), u_a * math.sin(angle))
    assert esso.forces(wind=wind)["wind"] == pytest.approx(wanted)


def test_the_apparent_wind_is_felt_by_a_ship_that_turns_and_moves(esso):
    north = (2.0, 0.0)
    east = math.pi / 2
    assert esso.forces(wind=north, heading=east)["wind"][1] > 0.0  # it comes from port
    assert esso.forces(u=1.0)["wind"] == pytest.approx(esso.forces(wind=(1.0, 0.0))["wind"])
    assert esso.forces(v=1.0)["wind"] == pytest.approx(esso.forces(wind=(0.0, 1.0))["wind"])
    drifting = esso.forces(u=-2.0, wind=north)["wind"]
    assert drifting == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)  # it runs with the wind


# ---------------------------------------------------------------- propeller


@pytest.mark.parametrize("u", [0.3, 0.0, -0.3])
def test_a_stopped_screw_does_nothing(esso, u):
    assert esso.forces(u, 0.02, 0.01, actuator=(0.3, 0.0))["propeller"].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("u", [-0.1, 0.0, 0.1])
def test_a_screw_pushes_the_way_it_turns(esso, u):
    assert esso.forces(u, actuator=(0.0, 10.0))["propeller"][0] > 0.0
    assert esso.forces(u, actuator=(0.0, -10.0))["propeller"][0] < 0.0


def test_wake_follows_the_drift_at_the_screw(esso):
    """v'_P = v' + x'_P r' with x_P = -1.551 m; w_P = w_P0 - τ |v'_P| - C_P v'_P²."""
    u, v, r, n, d = 0.3, 0.02, -0.01, 10.0, 0.084
    aside = (v - 1.551 * r) / math.hypot(u, v)
    arriving = 1.0 - (0.614 - 0.871 * aside + 0.359 * aside**2)  # aside > 0
    j = u / (n * d) * arriving
    thrust = 998.0 * d**4 * n**2 * 0.78 * (0.3278 - 0.3323 * j - 0.156 * j**2)
    found = esso.forces(u, v, r, actuator=(0.0, n))["propeller"]
    assert found == pytest.approx((thrust, 0.0, 0.0))


def test_in_a_hard_drift_the_whole_flow_arrives_and_never_more(esso):
    """1 - w_P would be 0.386 + 0.871 · 0.98 - 0.359 · 0.96 < 1; with τ = 3 it is held at 1."""
    found = esso.changed(propeller__tau=3.0).forces(0.1, 0.5, actuator=(0.0, 10.0))["propeller"][0]
    j = 0.1 / 0.84
    wanted = 998.0 * 0.084**4 * 100.0 * 0.78 * (0.3278 - 0.3323 * j - 0.156 * j**2)
    assert found == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("u", "thrust", "side", "moment"),
    [  # n = -5: nD = -0.42 m/s, branches of J_s by hand
        (0.21, -0.251, -4.93e-3 + 5.87e-3 * 0.5, 1.96e-3 - 2.33e-3 * 0.5),
        (0.105, -0.251, -7.90e-5 - 7.99e-3 * 0.25, 3.50e-5 + 3.17e-3 * 0.25),
        (0.084, -0.175 - 0.33 * 0.2, -7.90e-5 - 7.99e-3 * 0.2, 3.50e-5 + 3.17e-3 * 0.2),
        (0.0042, -0.175 - 0.33 * 0.01, -5.58e-4, 2.25e-4),
        (-0.084, -0.175 + 0.33 * 0.2, -5.58e-4, 2.25e-4),
    ],
)
def test_every_branch_of_a_reversed_screw(esso, u, thrust, side, moment):
    q, nd = 0.5 * 998.0 * 3.0 * 0.20114, 0.42
    wanted = (998.0 * 0.084**2 * nd**2 * thrust, q * nd**2 * side, q * 3.0 * nd**2 * moment)
    assert esso.forces(u, actuator=(0.0, -5.0))["propeller"] == pytest.approx(wanted)


def test_a_screw_off_the_centreline_turns_the_ship_away_from_its_side(twin):
    plain = twin.changed(**{f"propeller__{c}{i}": 0.0 for c in "ab" for i in range(1, 9)})
    x, y, n = plain.forces(actuator=(0.0, 8.0, 0.0, 0.0))["propeller"]
    assert x == pytest.approx(998.0 * 0.15**4 * 64.0 * (1 - plain["propeller.t"]) * 0.33)
    assert (y, n) == pytest.approx((0.0, 0.3 * x))  # the port screw, 0.3 m to port: to starboard
    both = plain.forces(actuator=(0.0, 8.0, 0.0, 8.0))["propeller"]
    assert both == pytest.approx((2.0 * x, 0.0, 0.0))


# ---------------------------------------------------------------- rudder


@pytest.mark.parametrize("u", [0.0, 0.3])
def test_positive_rudder_in_the_slipstream_turns_to_starboard(esso, twin, u):
    for ship, actuator in ((esso, (0.3, 10.0)), (twin, (0.3, 8.0, 0.3, 8.0))):
        x, y, n = ship.forces(u, actuator=actuator)["rudder"]
        assert x < 0.0 and y < 0.0 and n > 0.0  # it brakes, pushes the stern to port
        assert ship.acceleration(u, actuator=actuator)[2] > 0.0


@pytest.mark.parametrize("u", [-0.2, 0.0, 0.2])
def test_a_rudder_amidships_in_straight_flow_carries_nothing(esso, u):
    found = esso.forces(u, actuator=(0.0, 10.0))["rudder"]
    assert found == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_a_rudder_at_rest_has_the_force_of_the_jet(esso):
    """u_P = 0: u_R = k_x √η √(8 K_T/π) nD, K_T = k₀, η = D/h."""
    n, angle = 10.0, 0.3
    u_r = 0.288 * math.sqrt(0.084 / 0.1279 * 8.0 * 0.3278 / math.pi) * n * 0.084
    normal = 0.5 * 998.0 * 0.01063 * u_r**2 * esso["rudder.f_alpha"] * math.sin(angle)
    wanted = (
        -0.81 * normal * math.sin(angle),
        -1.393 * normal * math.cos(angle),
        (1.5 + 0.393 * 0.45 * 3.0) * normal * math.cos(angle),
    )
    assert esso.forces(actuator=(angle, n))["rudder"] == pytest.approx(wanted)


@pytest.mark.parametrize(("u", "n"), [(1.5, 2.0), (1.5, -3.0), (0.1, -10.0)])
def test_a_braking_screw_holds_the_flow_back_and_may_turn_it_round(esso, u, n):
    """K_T < 0 ahead, too: u_a = u_b ± k_xr √(8|K_T|/π) nD. In a crash stop, from astern."""
    angle, d, eta = 0.2, 0.084, 0.084 / 0.1279
    advance = u / (n * d)
    j = advance * (1 - 0.614)
    k_t = 0.3278 - 0.3323 * j - 0.156 * j**2 if n > 0 else max(-0.175 + 0.33 * advance, -0.251)
    assert k_t < 0.0
    u_b = 1.42 * u * (1 - 0.614)
    u_a = u_b + 0.144 * n * d * math.sqrt(8.0 * abs(k_t) / math.pi)
    square = eta * abs(u_a) * u_a + (1 - eta) * u_b**2 - 0.176 * u**2
    assert (square < 0.0) == (u_a < 0.0) == (n == -10.0)
    normal = 0.5 * 998.0 * 0.01063 * square * esso["rudder.f_alpha"] * math.sin(angle)
    found = esso.forces(u, actuator=(angle, n))["rudder"]
    assert found[0] == pytest.approx(-0.81 * normal * math.sin(angle))
    assert found[1] == pytest.approx(-1.393 * normal * math.cos(angle))


def test_the_flow_past_the_stern_comes_in_at_the_straightened_angle(esso):
    """Rudder amidships without a screw; γ_P where v + x_R r ≥ 0, else γ_N. f₃ steepens it."""
    g, _, _ = geometry_of(profiles.load("esso-osaka"), without=["propeller"])
    published = parameters.load(parameters.published_file("esso-osaka"), g, without=["propeller"])
    bare = Ship(MMG(g), published).changed(rudder__f_3=0.5)
    u, r = 0.4, 0.03
    for v, gamma in ((0.1, 0.3506), (0.02, 0.4406)):
        u_r, v_r = 1.42 * u, -gamma * (v - 1.08 * 3.0 * r)
        attack = -math.atan2(v_r, u_r)
        slope = esso["rudder.f_alpha"] * (1 + 0.5 * math.sin(attack) ** 2)
        normal = 0.5 * 998.0 * 0.01063 * (u_r**2 + v_r**2) * slope * math.sin(attack)
        x, y, n = bare.forces(u, v, r, actuator=(0.0, 10.0))["rudder"]
        assert (x, y) == pytest.approx((0.0, -1.393 * normal), abs=1e-12)
        assert n == pytest.approx((1.5 + 0.393 * 0.45 * 3.0) * normal)


@pytest.mark.parametrize("degrees", [20.0, -35.0, 75.0, 105.0, -105.0])
def test_a_fish_tail_turns_the_jet_along_its_chord(vectwin, degrees):
    """The jet J comes in along (-1, 0) and leaves along the chord (-cos δ, sin δ) [positive δ:
    to starboard]. The ship is pushed by what the water loses: J ((-1, 0) - (-cos δ, sin δ))."""
    ship = vectwin.changed(rudder__t_r=0.0, rudder__a_h=0.0)
    assert ship["rudder.f_t"] == ship["rudder.f_alpha"]  # estimated for blades of such limits
    n, d = 10.0, 0.1
    u_r2 = 0.55**2 * d / 0.130 * 8.0 * 0.33 / math.pi * (n * d) ** 2
    jet = 0.5 * 1.0 * 998.0 * 0.0103 * u_r2 * ship["rudder.f_alpha"]
    angle = math.radians(degrees)
    x, y, moment = ship.forces(actuator=(angle, 0.0, n))["rudder"]
    assert x == pytest.approx(jet * (-1.0 + math.cos(angle)))
    assert y == pytest.approx(-jet * math.sin(angle))
    assert moment == pytest.approx(-1.5 * y + 0.075 * x)  # x Y - y X at (-1.5, -0.075)


def test_each_rudder_stands_in_the_slipstream_of_its_own_screw(twin):
    rudders, screws = twin.model.geometry.rudders, twin.model.geometry.propellers
    for blade in rudders:
        assert blade.behind is not None
        assert screws[blade.behind].name.removeprefix("screw_") in blade.name
    order = ("rudder_port", "screw_port", "rudder_starboard", "screw_starboard")
    assert profiles.parse(TWIN, "twin.toml").actuator_names == order
    away = twin.forces(actuator=(0.3, 0.0, 0.0, 8.0))["rudder"]
    assert away == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    behind = twin.forces(actuator=(0.3, 8.0, 0.0, 0.0))["rudder"]
    other = twin.forces(actuator=(0.0, 0.0, 0.3, 8.0))["rudder"]
    assert behind[:2] == pytest.approx(other[:2])
    assert behind[1] < -0.1
    assert behind[2] - other[2] == pytest.approx(2 * 0.3 * behind[0])  # -y X of each


def test_of_two_screws_that_reach_it_the_nearer_is_a_rudders_own():
    reaching = TWIN.replace("diameter_m = 0.15", "diameter_m = 0.7")  # 0.6 m between the shafts
    found, _, _ = geometry_of(profiles.parse(reaching, "reaching.toml"))
    assert [blade.behind for blade in found.rudders] == [0, 1]


@pytest.mark.parametrize("first", [-1.8, 1.8])
def test_of_two_screws_on_the_centreline_the_one_along_the_ship_is_a_rudders_own(first):
    """A double-ender: one screw at each end, given in either order; the rudders stand aft."""
    ends = TWIN.replace("[-1.8, -0.3]", f"[{first}, 0.0]").replace(
        "[-1.8, 0.3]", f"[{-first}, 0.0]"
    )
    ends = ends.replace("[-1.9, -0.3]", "[-1.9, 0.0]").replace("[-1.9, 0.3]", "[-1.9, 0.0]")
    found, _, _ = geometry_of(profiles.parse(ends, "ends.toml"))
    assert {found.propellers[blade.behind].ahead for blade in found.rudders} == {-1.8}


def test_a_rudder_aside_of_every_screw_meets_the_free_stream():
    aside = TWIN.replace("[-1.8, 0.3]", "[-1.8, 0.0]")  # one screw 0.3 m from either rudder
    found, _, _ = geometry_of(profiles.parse(aside.replace("[-1.8, -0.3]", "[-1.8, 0.0]"), "aside"))
    assert [blade.behind for blade in found.rudders] == [None, None]
    ship = estimated(profiles.parse(TWIN, "twin.toml"), without=["propeller"])
    assert "propeller" not in ship.forces()
    normal = 0.5 * 998.0 * 0.02 * (1.1 * 0.5) ** 2 * ship["rudder.f_alpha"] * math.sin(0.2)
    x, y, _ = ship.forces(0.5, actuator=(0.2, 8.0, 0.2, 8.0))["rudder"]
    assert x == pytest.approx(-2 * (1 - ship["rudder.t_r"]) * normal * math.sin(0.2))
    assert y == pytest.approx(-2 * (1 + ship["rudder.a_h"]) * normal * math.cos(0.2))


# ---------------------------------------------------------------- thruster


@pytest.mark.parametrize("degrees", [0.0, 60.0, 90.0, -135.0])
@pytest.mark.parametrize("number", [1, 3])
def test_an_azimuth_pushes_where_it_points(number, degrees):
    """Full thrust at the limit of 1300 rpm, 65/3 rev/s."""
    ship = estimated(profiles.load("milliampere"))
    g = ship.model.geometry
    ahead, starboard = {1: (1.8, -0.8), 3: (-1.8, 0.8)}[number]
    unit = g.thrusters[number - 1]
    assert (unit.ahead, unit.starboard) == (ahead, starboard)
    assert unit.full == pytest.approx(65.0 / 3.0)
    actuator = [0.0] * 8
    actuator[2 * number - 2], actuator[2 * number - 1] = math.radians(degrees), 65.0 / 3.0
    x, y, n = ship.forces(actuator=tuple(actuator))["thruster"]
    size = ship[f"thruster.thruster_{number}_ahead"]
    assert x == pytest.approx(size * math.cos(math.radians(degrees)))
    assert y == pytest.approx(size * math.sin(math.radians(degrees)))
    assert n == pytest.approx(ahead * y - starboard * x)


def test_a_fixed_thruster_pushes_its_way_with_the_square_of_its_command():
    """At [1.5, 0], to starboard, full at 100: 40 is 0.16 T₊; -40 is -0.16 T₋."""
    ship = estimated(profiles.parse(TUNNEL, "tunnel.toml"))
    ship = ship.changed(thruster__bow_ahead=50.0, thruster__bow_astern=30.0)
    to_starboard = ship.forces(actuator=(40.0, 0.0))["thruster"]
    assert to_starboard == pytest.approx((0.0, 8.0, 12.0), abs=1e-12)
    to_port = ship.forces(actuator=(-40.0, 0.0))["thruster"]
    assert to_port == pytest.approx((0.0, -4.8, -7.2), abs=1e-12)


def test_a_thruster_loses_thrust_to_the_flow_along_it():
    """ℓ_T = 0.5 s/m; the flow along the bow tunnel is v + 1.5 r, along the pod u - 0.4 r."""
    ship = estimated(profiles.parse(TUNNEL, "tunnel.toml")).changed(
        thruster__bow_ahead=50.0, thruster__bow_astern=50.0, thruster__bow_loss=0.5,
        thruster__pod_ahead=20.0, thruster__pod_loss=0.5,
    )  # fmt: skip
    across = ship.forces(0.0, 0.2, 0.1, actuator=(100.0, 0.0))["thruster"]
    assert across[1] == pytest.approx(50.0 * (1 - 0.5 * 0.35))
    against = ship.forces(0.0, 0.2, 0.1, actuator=(-100.0, 0.0))["thruster"]
    assert against[1] == pytest.approx(-50.0 * (1 + 0.5 * 0.35))
    pod = ship.forces(0.3, 0.0, 0.1, actuator=(0.0, 1.0))["thruster"]
    push = 20.0 * (1 - 0.5 * 0.26)
    assert pod == pytest.approx((push, 0.0, -0.4 * push))


def test_revolutions_without_limits_do_not_say_what_full_thrust_is():
    text = TUNNEL.replace('field = "pod"', 'field = "pod"\nunit = "rpm"')
    ship = profiles.parse(text, "tunnel.toml")
    with pytest.raises(ProfileError, match="no limits for the thruster 'pod'") as error:
        geometry_of(ship)
    assert "in rpm" in str(error.value) and "--without thruster" in error.value.hint
    assert geometry_of(ship, without=["thruster"])[0].parts == ("hull",)
    limited = text.replace('unit = "rpm"', 'unit = "rpm"\nlimits = [-600.0, 300.0]')
    bow, pod = geometry_of(profiles.parse(limited, "tunnel.toml"))[0].thrusters
    assert (bow.full, pod.full) == (100.0, 10.0)  # the larger side, in rev/s


# ---------------------------------------------------------------- mirror images


def mirrored(ship, u, v, r, heading, wind, actuator, other):
    """Forces of a motion, and of the motion seen in a mirror along x₀."""
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


# ---------------------------------------------------------------- geometry


def test_ships_of_the_same_actuators_share_what_is_compiled(twin):
    """Sizes and places are its arguments, in the order that gives them back; which blade stands
    behind which screw, what an azimuth is turned by and the number of actuators are not."""
    numbers, shape = split(twin.model.geometry)
    assert joined(shape, iter(numbers)) == twin.model.geometry
    larger = TWIN.replace("length_m = 4.0", "length_m = 9.0").replace(
        "area_m2 = 0.02", "area_m2 = 0.05"
    )
    other = estimated(profiles.parse(larger, "larger.toml"))
    assert split(other.model.geometry)[0] != numbers
    assert jax.tree.structure(other.model) == jax.tree.structure(twin.model)
    assert hash(jax.tree.structure(other.model)) == hash(jax.tree.structure(twin.model))
    aside = TWIN.replace("position_m = [-1.8, 0.3]", "position_m = [-1.8, -0.31]")
    swapped = estimated(profiles.parse(aside, "aside.toml"))
    assert [blade.behind for blade in swapped.model.geometry.rudders] != [
        blade.behind for blade in twin.model.geometry.rudders
    ]
    assert jax.tree.structure(swapped.model) != jax.tree.structure(twin.model)


def test_the_profile_says_which_blades_are_wide(esso, vectwin):
    assert [blade.wide for blade in esso.model.geometry.rudders] == [False]
    assert [blade.wide for blade in vectwin.model.geometry.rudders] == [True, True]
    assert [blade.behind for blade in vectwin.model.geometry.rudders] == [0, 0]
    assert esso["rudder.f_t"] == 0.0  # an ordinary blade's


def test_a_blade_is_as_wide_whichever_way_its_sensor_counts():
    """sign = -1 turns limits of -105 to 35 round; an ordinary blade stays one. Offsets count."""
    wide = profiles.load("esso-vectwin")

    def blades(**update):
        """Which are wide, with every rudder's profile changed so."""
        changed = tuple(
            a.model_copy(update=update) if a.kind == "rudder" else a for a in wide.actuators
        )
        return [
            b.wide for b in geometry_of(wide.model_copy(update={"actuators": changed}))[0].rudders
        ]

    for sign in (1.0, -1.0):
        assert blades(sign=sign) == [True, True]
        assert blades(sign=sign, limits=(-105.0, 35.0)) == [True, True]
        assert blades(sign=sign, limits=(-35.0, 35.0)) == [False, False]
        assert blades(sign=sign, limits=(55.0, 125.0), offset=90.0) == [False, False]
    assert blades(limits=None) == [False, False]


@pytest.mark.parametrize(
    ("key", "actuator", "part"),
    [
        ("diameter_m", "propeller", "propeller"),
    ],
)
def test_a_size_that_is_missing_is_asked_for_by_name(key, actuator, part):
    ship = profiles.load("esso-osaka")
    lacking = tuple(
        a.model_copy(update={key: None}) if a.name == actuator else a for a in ship.actuators
    )
    with pytest.raises(ProfileError) as error:
        geometry_of(ship.model_copy(update={"actuators": lacking}))
    assert f"no {key}" in str(error.value) and repr(actuator) in str(error.value)
    assert f"--without {part}" in error.value.hint
    geometry_of(ship.model_copy(update={"actuators": lacking}), without=[part])


def test_forces_can_be_left_out(esso):
    ship = profiles.load("esso-osaka")
    assert esso.model.geometry.parts == ("hull", "propeller", "rudder", "wind")
    for part in ("propeller", "rudder", "wind"):
        found, _, _ = geometry_of(ship, without=[part])
        assert part not in found.parts and len(found.parts) == 3
        assert not any(name.startswith(part) for name in parameters.names(found))
    tunnel = profiles.parse(TUNNEL, "tunnel.toml")
    assert geometry_of(tunnel)[0].parts == ("hull", "thruster")  # no sensor of the wind
    assert geometry_of(tunnel, without=["thruster"])[0].parts == ("hull",)


@pytest.mark.parametrize("part", ["hull", "winds"])
def test_what_cannot_be_left_out_is_refused(part):
    with pytest.raises(ProfileError, match=f"no force '{part}'") as error:
        geometry_of(profiles.load("esso-osaka"), without=[part])
    assert "propeller, rudder, thruster, wind" in error.value.hint
    assert ("did you mean 'wind'" in str(error.value)) == (part == "winds")


# ---------------------------------------------------------------- parameters


def test_parameters_survive_a_file(esso, tmp_path):
    moved = esso.parameters.with_values(esso.parameters.values * 0.999, source="made up")
    path = tmp_path / "ship.mmg.toml"
    path.write_text(moved.to_toml(), encoding="utf-8")
    again = parameters.load(path, esso.model.geometry)
    assert again.names == moved.names and again.source == "made up"
    assert again.values.tolist() == moved.values.tolist()


def test_published_values_have_half_the_spread_of_estimated_ones(esso):
    """30 % of a hull coefficient or its least, and twice that."""
    found = dict(zip(esso.parameters.names, esso.parameters.spread, strict=True))
    assert found["hull.y_v"] == pytest.approx(0.3 * 0.3728)
    assert found["hull.x_vr"] == 0.08
    assert found["rudder.f_t"] == 0.3
    guess = estimated(profiles.load("esso-osaka"))
    wide = dict(zip(guess.parameters.names, guess.parameters.spread, strict=True))
    assert wide["hull.y_v"] == pytest.approx(-2 * 0.3 * guess["hull.y_v"])
    assert (guess.parameters.low <= guess.parameters.values).all()
    assert (guess.parameters.values <= guess.parameters.high).all()


def test_names_follow_the_parts_and_a_thrusters_are_its_own(esso):
    assert esso.model.names == esso.parameters.names
    assert len(esso.model.names) == 3 + 15 + 27 + 13 + 10
    assert esso.model.names[:4] == ("body.m_x", "body.m_y", "body.i_j", "hull.x_0f")
    tunnel, _, _ = geometry_of(profiles.parse(TUNNEL, "tunnel.toml"))
    wanted = [f"thruster.{n}_{k}" for n in ("bow", "pod") for k in ("ahead", "astern", "loss")]
    assert list(parameters.names(tunnel)[18:]) == wanted
    assert esso.parameters.entry("hull.y_v").symbol == "Y'_v"
    assert estimated(profiles.parse(TUNNEL, "t")).parameters.entry(wanted[5]).unit == "s/m"


def edited(tmp_path, old, new):
    text = parameters.published_file("esso-osaka").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "edited.mmg.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("y_v = -0.3728", "y_v = 0.3728", ["hull.y_v", "Y'_v", "0.3728", "-3 to 0"]),
        ("c_d = 0.9665", "c_d = -0.9665", ["hull.c_d", "C_D", "-0.9665", "0 to 4"]),
        ("m_x = 0.0467", "m_x = nan", ["body.m_x", "nan"]),
        ("k0 = 0.3278", "k0 = 0.3278\nk_0 = 1", ["propeller.k_0", "did you mean 'k0'"]),
        ("[wind]", "[winds]", ["[winds]", "did you mean 'wind'", "sections are"]),
        ("a_h = 0.393", "", ["lacks rudder.a_h", "--without rudder"]),
        ("eps = 1.42", "eps = 1.42 eps", ["not valid TOML"]),
        ("eps = 1.42", 'eps = "1.42"', ["rudder.eps", "'1.42'", "not a number"]),
        ("eps = 1.42", "eps = true", ["rudder.eps", "True", "not a number"]),
        ("eps = 1.42", "eps = [1.42]", ["rudder.eps", "not a number"]),
        ("eps = 1.42", "eps = 1" + 400 * "0", ["rudder.eps", "inf", "0.2 to 3"]),
        ("eps = 1.42", "eps = 1" + 6000 * "0", ["not valid TOML"]),
        ("eps = 1.42", "eps = " + 20_000 * "[", ["not valid TOML"]),
    ],
    ids=[
        "high",
        "low",
        "nan",
        "key",
        "section",
        "missing",
        "syntax",
        "string",
        "bool",
        "array",
        "400 digits",
        "6000 digits",
        "nested",
    ],
)
def test_a_file_that_cannot_be_is_refused_with_its_name(esso, tmp_path, old, new, words):
    path = edited(tmp_path, old, new)
    with pytest.raises(ProfileError) as error:
        parameters.load(path, esso.model.geometry)
    for word in [str(path), *words]:
        assert word in str(error.value)


def test_a_number_where_a_section_belongs_is_refused(esso, tmp_path):
    text = parameters.published_file("esso-osaka").read_text(encoding="utf-8")
    path = tmp_path / "scalar.mmg.toml"
    path.write_text("wind = 0.3\n" + text[: text.index("[wind]")], encoding="utf-8")
    with pytest.raises(ProfileError, match=r"scalar\.mmg\.toml: wind is 0\.3, not") as error:
        parameters.load(path, esso.model.geometry)
    assert "[wind]" in error.value.hint


def test_a_file_that_is_not_utf_8_is_refused(esso, tmp_path):
    path = tmp_path / "latin.mmg.toml"
    path.write_bytes('source = "Universität"'.encode("latin-1"))
    with pytest.raises(ProfileError, match=r"latin\.mmg\.toml is not valid TOML"):
        parameters.load(path, esso.model.geometry)


def test_a_missing_hull_is_not_advised_to_be_left_out(esso, tmp_path):
    """There is no --without hull, nor --without body."""
    for old in ("y_v = -0.3728", "m_y = 0.2579"):
        with pytest.raises(ProfileError, match="lacks") as error:
            parameters.load(edited(tmp_path, old, ""), esso.model.geometry)
        assert error.value.hint == "add them."
    text = parameters.published_file("esso-osaka").read_text(encoding="utf-8")
    both = text.replace("y_v = -0.3728", "").replace("a_h = 0.393", "")
    path = tmp_path / "both.mmg.toml"
    path.write_text(both, encoding="utf-8")
    with pytest.raises(ProfileError, match=r"lacks hull\.y_v, rudder\.a_h") as error:
        parameters.load(path, esso.model.geometry)
    assert error.value.hint == "add them, or leave the force out with --without rudder."


def test_a_thruster_that_the_ship_lacks_is_refused(tmp_path):
    g, main, _ = geometry_of(profiles.parse(TUNNEL, "tunnel.toml"))
    text = parameters.estimated(g, main).to_toml()
    path = tmp_path / "tunnel.mmg.toml"
    path.write_text(text, encoding="utf-8")
    assert parameters.load(path, g).names == parameters.names(g)
    path.write_text(text.replace("bow_loss", "bow_lost"), encoding="utf-8")
    with pytest.raises(ProfileError, match=r"thruster\.bow_lost is not a coefficient") as error:
        parameters.load(path, g)
    assert "did you mean 'bow_loss'" in str(error.value)
    assert "pod_astern" in error.value.hint and "hull" not in error.value.hint


def test_a_whole_part_that_is_missing_is_named_and_can_be_left_out(tmp_path):
    text = parameters.published_file("esso-osaka").read_text(encoding="utf-8")
    path = tmp_path / "calm.mmg.toml"
    path.write_text(text[: text.index("[wind]")], encoding="utf-8")
    ship = profiles.load("esso-osaka")
    with pytest.raises(ProfileError, match=r"lacks wind\.n1") as error:
        parameters.load(path, geometry_of(ship)[0])
    assert "--without wind" in error.value.hint
    calm = geometry_of(ship, without=["wind"])[0]
    assert parameters.load(path, calm).names == parameters.names(geometry_of(ship)[0])[:58]
    with pytest.raises(ProfileError, match="cannot be read"):
        parameters.load(tmp_path / "nowhere.toml", geometry_of(ship)[0])


def test_a_section_of_a_force_that_the_ship_lacks_is_refused_unless_it_was_left_out():
    path = parameters.published_file("esso-osaka")
    calm = geometry_of(profiles.load("esso-osaka"), without=["wind"])[0]
    with pytest.raises(ProfileError, match="has a wind force") as error:
        parameters.load(path, calm)
    assert "no [sensors.wind]" in str(error.value) and "--without wind" in error.value.hint
    assert not any("wind" in name for name in parameters.load(path, calm, without=["wind"]).names)


def test_published_values_lie_next_to_their_profile(tmp_path):
    assert parameters.published_file("esso-osaka").name == "esso-osaka.mmg.toml"
    assert (
        parameters.published_file("esso-vectwin") is None and parameters.published_file("") is None
    )
    own = tmp_path / "own.toml"
    assert parameters.published_file(str(own)) is None
    (tmp_path / "own.mmg.toml").write_text("", encoding="utf-8")
    assert parameters.published_file(str(own)) == tmp_path / "own.mmg.toml"


def test_a_model_is_hashable_so_that_it_is_compiled_once():
    one, other = (MMG(geometry_of(profiles.load("esso-osaka"))[0]) for _ in range(2))
    assert one == other and hash(one) == hash(other) and isinstance(one.geometry, Geometry)
