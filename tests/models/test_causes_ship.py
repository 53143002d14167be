"""Payload, screws, hull and rudders: by the rigid body's equations, and unit by unit."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from cause_ships import (
    BY,
    CALM,
    EAST,
    FERRY,
    NORTH,
    REST,
    TWIN,
    acceleration,
    drifting,
    extended,
    forces,
    network,
    under_way,
)

from shiplog.models import mmg
from shiplog.models.causes.environment import Current
from shiplog.models.causes.ship import Payload
from shiplog.ship_profile.profile import Profile

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
    # of a ship whose resistance is in part proportional to its speed, too
    hull = {"hull.x_0f": -0.02, "hull.x_0a": -0.03, "hull.x_u": -0.01, "hull.c_d": 0.5}
    fouled = BY["fouling"].coefficients(hull, [0.6], None, None, {})
    assert fouled == pytest.approx(
        {"hull.x_0f": -0.032, "hull.x_0a": -0.048, "hull.x_u": -0.016, "hull.c_d": 0.5}
    )
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


def test_a_ships_load_is_written_out():
    """1234.5 t, 2 m ahead of midship: no power of ten in a sentence."""
    reported = BY["payload"].estimates(np.array([1.2345e6, 2.469e6]), np.diag([1e6, 1e6]))
    assert BY["payload"].sentence(reported) == "A load of 1230000 kg, 2.00 m ahead of midship."
