"""Forces of screws, rudders and thrusters: by hand, at their limits, and of a pair."""

import math

import pytest
from mmg_ships import TUNNEL, TWIN, Ship, estimated

from shiplog.exceptions import ProfileError
from shiplog.models.mmg import parameters
from shiplog.models.mmg.geometry import geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.ship_profile import file as profiles

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
    thrust = 20.0 * (1 - 0.5 * 0.26)
    assert pod == pytest.approx((thrust, 0.0, -0.4 * thrust))


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
