"""Forces of hull and wind: cross flow, linear damping of a published ship, and by hand."""

import math

import numpy as np
import pytest
from mmg_ships import TUNNEL, Ship, estimated
from scipy.integrate import quad

from shiplog.models.mmg.hull import cross_flow
from shiplog.ship_profile import file as profiles

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
