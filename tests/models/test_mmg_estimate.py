"""Estimates against the Esso Osaka's published coefficients, and on ships unlike any other."""

from dataclasses import replace
from math import isfinite

import pytest

from shiplog.models.mmg import estimate, parameters
from shiplog.models.mmg.estimate import Particulars
from shiplog.models.mmg.geometry import geometry_of
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Actuator, Ship, Site

ESSO = Particulars(
    length=3.0,
    breadth=0.48925,
    draught=0.20114,
    mass=244.6,
    block=0.830,
    x_g=0.0936,
    density=998.0,
    frontal_area=0.13544,
    lateral_area=0.52038,
)
PUBLISHED_WIND = {
    "x0": -0.010466204998895,
    "x1": -0.821991956431999,
    "x3": 0.060273613257498,
    "x5": 0.044558221361039,
    "y1": 1.058172082517226,
    "y3": 0.002321463294909,
    "y5": -0.015293451706739,
    "n1": -0.030727798087410,
    "n2": 0.104116370350922,
    "n3": -8.803014758436215e-04,
}


def box(length, breadth, draught, block):
    """A fresh-water ship of these dimensions, its areas in the Esso Osaka's proportions."""
    mass = 998.0 * block * length * breadth * draught
    areas = 0.57 * breadth**2, 0.355 * length * breadth
    return Particulars(length, breadth, draught, mass, block, 0.0, 998.0, *areas)


SHIPS = [
    box(length, ratio * length, thin * ratio * length, block)
    for length in (1.0, 30.0, 300.0)
    for ratio in (0.08, 0.2, 0.35, 0.8)
    for thin in (0.05, 0.4, 0.8)
    for block in (0.35, 0.7, 1.0)
]


def named(site=None, **ship):
    """The shipped Esso Osaka profile with another ship in it."""
    base = profiles.load("esso-osaka")
    return base.model_copy(update={"ship": Ship(name="s", **ship), "site": site or Site()})


@pytest.mark.parametrize("key", PUBLISHED_WIND)
def test_the_wind_regression_gives_the_published_coefficients(key):
    found = estimate.fujiwara(
        a_t=0.13544,
        a_l=0.52038,
        a_od=0.1423,
        c=-0.01299,
        c_br=-0.06209,
        h_br=0.294,
        h_c=0.10359,
        length=3.0,
        breadth=0.48925,
    )
    assert found[key] == pytest.approx(PUBLISHED_WIND[key], abs=1e-12)


def test_wind_without_a_known_superstructure_stays_near_the_published():
    assert estimate.wind(ESSO) == pytest.approx(PUBLISHED_WIND, abs=0.01)


@pytest.mark.parametrize(
    ("key", "published", "share"),
    [
        ("y_v", -0.3728, 0.10),
        ("y_r", 0.116, 0.15),
        ("n_v", -0.1458, 0.10),
        ("n_r", -0.04849, 0.15),
        ("x_0f", -0.02139, 0.20),
        ("x_0a", -0.03189, 0.20),
        ("c_d", 0.9665, 0.05),
    ],
)
def test_hull_is_near_the_published(key, published, share):
    assert estimate.hull(ESSO)[key] == pytest.approx(published, rel=share)


@pytest.mark.parametrize(
    ("key", "published", "share"),
    [("m_x", 0.0467, 0.35), ("m_y", 0.2579, 0.05), ("i_j", 0.0286, 0.10)],
)
def test_inertia_is_near_the_published(key, published, share):
    assert estimate.inertia(ESSO)[key] == pytest.approx(published, rel=share)


def test_kijimas_derivatives_worked_by_hand():
    # k = 2·5/100 = 0.1, C_b B/L = 0.8·15/100 = 0.12
    found = estimate.hull(box(100.0, 15.0, 5.0, 0.8))
    assert found["y_v"] == pytest.approx(-(0.15707963 + 0.168))
    assert found["n_v"] == pytest.approx(-0.1)
    assert found["n_r"] == pytest.approx(-0.044)
    # m' = 2·0.12; ∇ = 6000 m³, m'_x = 2.7·6000^(5/3) / 100² / 25000
    assert found["y_r"] == pytest.approx(0.24 + 2.7 * 1.98116e6 / 1e4 / 2.5e4 - 0.18, rel=1e-5)


def test_propeller_and_rudder_are_near_the_published():
    propeller = estimate.propeller(ESSO)
    assert propeller["t"] == pytest.approx(0.22, abs=0.02)
    assert propeller["k0"] == pytest.approx(0.3278, abs=0.02)
    assert propeller["w_p0"] == pytest.approx(0.365)  # a ship's; the model's 0.614 is thicker
    rudder = estimate.rudder(ESSO, area=0.01063, span=0.1279)
    assert rudder["f_alpha"] == pytest.approx(2.490, abs=0.002)
    assert rudder["t_r"] == pytest.approx(0.19, abs=0.04)
    assert rudder["a_h"] == pytest.approx(0.393, abs=0.04)
    assert rudder["gamma_n"] == rudder["gamma_p"] == pytest.approx(0.3956, abs=0.04)


def test_more_draught_damps_more_and_more_block_drags_more():
    shallow, deep = ESSO, replace(ESSO, draught=0.3, mass=244.6 * 0.3 / 0.20114)
    for key in ("y_v", "n_v", "n_r"):
        assert estimate.hull(deep)[key] < estimate.hull(shallow)[key]
    assert estimate.inertia(deep)["m_y"] > estimate.inertia(shallow)["m_y"]
    assert estimate.propeller(replace(ESSO, block=0.5))["w_p0"] < 0.3


def test_a_full_scale_ship_has_less_friction_but_the_same_shape():
    scale = 325.0 / 3.0
    ship = replace(
        ESSO,
        length=325.0,
        breadth=ESSO.breadth * scale,
        draught=ESSO.draught * scale,
        mass=ESSO.mass * scale**3,
        frontal_area=ESSO.frontal_area * scale**2,
        lateral_area=ESSO.lateral_area * scale**2,
    )
    model, full = estimate.hull(ESSO), estimate.hull(ship)
    assert 0.3 < full["x_0f"] / model["x_0f"] < 0.5
    for key in ("y_v", "y_r", "n_v", "n_r"):
        assert full[key] == pytest.approx(model[key])
    assert estimate.inertia(ship) == pytest.approx(estimate.inertia(ESSO))
    assert estimate.wind(ship) == pytest.approx(estimate.wind(ESSO))


@pytest.mark.parametrize("ship", SHIPS, ids=lambda p: f"{p.length}-{p.breadth:.3g}-{p.draught:.3g}")
def test_no_ship_gets_a_coefficient_of_the_wrong_sign_or_size(ship):
    hull, inertia, wind = estimate.hull(ship), estimate.inertia(ship), estimate.wind(ship)
    propeller, rudder = estimate.propeller(ship), estimate.rudder(ship, 0.1, 0.4)
    every = {**hull, **inertia, **propeller, **rudder, **wind}
    assert all(isfinite(value) for value in every.values())
    for key in ("x_0f", "x_0a"):
        assert -0.5 < hull[key] < 0.0
    assert -3.0 < hull["y_v"] < 0.0
    assert -1.0 < hull["y_r"] < ship.mass_nd + inertia["m_x"]  # turning keeps its centrifugal force
    assert hull["n_r"] < 0.0
    assert 0.01 < inertia["m_y"] < 2.0
    assert 0.0 < inertia["m_x"] <= 0.2 * ship.mass_nd
    assert ship.mass_nd / 16.0 < inertia["i_j"] < 0.2
    assert 0.0 < propeller["t"] < propeller["w_p0"] < 0.5
    assert 0.0 <= rudder["a_h"] <= 1.0
    assert 0.1 <= rudder["gamma_n"] <= 1.0
    assert wind["x1"] < 0.0 < wind["y1"]


def test_a_complete_profile_needs_no_estimate():
    given = dict(length_m=3.0, breadth_m=0.48925, draught_m=0.20114, mass_kg=244.6, x_g_m=0.0936)
    areas = dict(frontal_area_m2=0.13544, lateral_area_m2=0.52038)
    whole = named(Site(density=998.0), **given, **areas, block_coefficient=0.83)
    assert estimate.particulars(whole) == (ESSO, ())


def test_a_bare_profile_says_every_estimate():
    found, reported = estimate.particulars(named(length_m=30.0))
    words = "breadth 5, density 1025, draught 2, block 0.7, mass, centre, frontal, lateral"
    assert len(reported) == len(words.split(", "))
    for sentence, wanted in zip(reported, words.split(", "), strict=True):
        assert all(word in sentence for word in wanted.split())
    assert (found.breadth, found.draught, found.block) == pytest.approx((5.0, 2.0, 0.7))
    assert found.mass == pytest.approx(1025.0 * 30.0 * 5.0 * 2.0 * 0.7)


@pytest.mark.parametrize(("length", "density"), [(3.0, 998.0), (30.0, 1025.0)])
def test_small_boats_float_in_fresh_water(length, density):
    assert estimate.particulars(named(length_m=length))[0].density == density


def test_a_known_mass_floats_the_ship():
    found, reported = estimate.particulars(named(length_m=5.0, breadth_m=2.8, mass_kg=1800.0))
    assert found.draught == pytest.approx(1800.0 / (998.0 * 5.0 * 2.8 * 0.7))
    assert found.block == pytest.approx(0.7)
    assert any("mass afloat" in sentence for sentence in reported)


def test_mass_and_draught_give_the_block_within_its_limits():
    ship = dict(length_m=5.0, breadth_m=2.0, draught_m=0.5)
    found, _ = estimate.particulars(named(**ship, mass_kg=0.6 * 998.0 * 5.0))
    assert found.block == pytest.approx(0.6)
    light, reported = estimate.particulars(named(**ship, mass_kg=0.1 * 998.0 * 5.0))
    assert light.block == 0.35
    assert any("limited from 0.1" in sentence for sentence in reported)


def test_a_catamarans_draught_has_a_floor():
    found, reported = estimate.particulars(named(length_m=1.2, breadth_m=0.93, mass_kg=15.0))
    assert found.draught == pytest.approx(0.0465)
    assert any("twentieth" in sentence for sentence in reported)


def test_masses_of_a_catamaran_are_within_their_spreads():
    """The Otter of Fossen 2021: 2 m by 1.08 m, 55 kg on two pontoons of 0.25 m and a block
    coefficient of 0.4; added sway mass 1.5 m, yaw inertia 2.7 m (0.25 L)²."""
    draught = 55.0 / 998.0 / (2.0 * 0.4 * 0.25 * 2.0)
    otter = Particulars(2.0, 1.08, draught, 55.0, 0.35, 0.0, 998.0, 0.3, 0.5)
    start, spread = estimate.inertia(otter), estimate.inertia_spread(otter)
    m_y = 1.5 * 55.0 / (0.5 * 998.0 * 2.0**2 * draught)
    i_j = 2.7 * 55.0 * 0.5**2 / (0.5 * 998.0 * 2.0**4 * draught)
    for key, known in (("m_y", m_y), ("i_j", i_j)):
        assert 0.3 * spread[key] < known - start[key] < 2.0 * spread[key]
    made = parameters.estimated(geometry_of(named(length_m=2.0))[0], otter)
    at = [made.names.index(f"body.{key}") for key in ("m_y", "i_j")]
    assert made.spread[at] == pytest.approx([spread["m_y"], spread["i_j"]])


@pytest.mark.parametrize("ratio", [0.1, 0.2])
def test_masses_of_a_slender_ship_are_as_the_regressions_say(ratio):
    found = estimate.inertia_spread(box(3.0, 3.0 * ratio, 0.1, 0.7))
    assert list(found.values()) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_spreads_of_the_masses_grow_with_the_breadth():
    found = [estimate.inertia_spread(box(3.0, 3.0 * ratio, 0.1, 0.7)) for ratio in (0.2, 0.3, 0.4)]
    for key in ("m_y", "i_j"):
        narrow, middle, broad = (one[key] for one in found)
        assert narrow + 1e-4 < middle < broad - 1e-4


def test_an_outline_gives_breadth_and_areas():
    outline = ((5.0, 0.0), (3.0, 1.5), (-5.0, 1.5), (-5.0, -1.5), (3.0, -1.5))
    found, reported = estimate.particulars(named(length_m=9.0, outline=outline))
    assert found.breadth == pytest.approx(3.0)
    assert found.frontal_area == pytest.approx(0.57 * 9.0)
    assert found.lateral_area == pytest.approx(0.355 * 10.0 * 3.0)
    assert "outline" in reported[0]


def test_kijimas_formula_is_held_where_its_ships_end():
    light = replace(ESSO, breadth=2.0, mass=1.0)  # C_b B/L = 0.55
    assert estimate.hull(light)["y_r"] == pytest.approx(-1.5 * 0.2, abs=0.01)
    assert estimate.hull(box(10.0, 6.0, 2.0, 1.0))["y_r"] == 0.9  # m' alone is 1.2


def test_a_rudder_without_sizes_is_a_rudder_of_the_rules():
    """DNV by hand: 3.0 · 0.20114/100 · (1 + 25 · (0.48925/3)²) = 0.010046 m², shared by two."""
    two, bare = profiles.load("esso-vectwin"), {"area_m2": None, "span_m": None}
    lacking = tuple(a.model_copy(update=bare) if a.kind == "rudder" else a for a in two.actuators)
    found, _, reported = geometry_of(two.model_copy(update={"actuators": lacking}))
    area = 3.0 * 0.201 / 100.0 * (1.0 + 25.0 * (0.489 / 3.0) ** 2)
    assert [r.area for r in found.rudders] == pytest.approx([area / 2.0] * 2)
    assert [r.span for r in found.rudders] == pytest.approx([(1.5 * area / 2.0) ** 0.5] * 2)
    assert sum("rudder_port: area" in sentence for sentence in reported) == 1
    single = profiles.load("esso-osaka")  # whose own rudder is 0.0106 m²
    lacking = tuple(
        a.model_copy(update=bare) if a.kind == "rudder" else a for a in single.actuators
    )
    (rudder,) = geometry_of(single.model_copy(update={"actuators": lacking}))[0].rudders
    own = next(a for a in single.actuators if a.kind == "rudder")
    assert rudder.area == pytest.approx(own.area_m2, rel=0.25)
    assert rudder.span == pytest.approx(own.span_m, rel=0.25)


def test_a_rudder_of_known_span_has_the_common_chord():
    ship = profiles.load("esso-osaka")
    lacking = tuple(
        a.model_copy(update={"area_m2": None, "span_m": 0.15}) if a.kind == "rudder" else a
        for a in ship.actuators
    )
    (rudder,) = geometry_of(ship.model_copy(update={"actuators": lacking}))[0].rudders
    assert (rudder.area, rudder.span) == pytest.approx((0.15**2 / 1.5, 0.15))


def test_the_bow_thruster_of_a_tanker_is_one_that_can_be_built():
    """A twentieth of 312 000 t would be 150 MN; tunnel thrusters of ships have some 0.5 MN."""
    tanker = profiles.load("kvlcc2-full-scale")
    bow = Actuator(
        name="bow",
        kind="thruster",
        topic="/bow",
        field="share",
        unit="1",
        position_m=(150.0, 0.0),
        diameter_m=None,
    )
    ship = tanker.model_copy(update={"actuators": (*tanker.actuators, bow)})
    main = Particulars(
        320.0, 58.0, 20.8, 312.4e6, 0.81, 11.2, 1025.0, frontal_area=1161.0, lateral_area=4259.0
    )
    found = parameters.estimated(geometry_of(ship)[0], main)
    force = found.values[found.names.index("thruster.bow_ahead")]
    assert 1e5 < force <= 2e6
