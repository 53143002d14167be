"""Targets of another form: what they would compute, worked out by their published equations."""

import json
from xml.etree import ElementTree as xml

import numpy as np
import pytest
from commands import call
from hybrid_ship import SHIP

from shiplog.export import equations, gazebo, hull_terms, pvs, shipmmg_file, vrx
from shiplog.export.job import Job
from shiplog.export.trial import difference
from shiplog.models.mmg import hull
from shiplog.models.mmg.model import named
from shiplog.training.runs import load_model

assert SHIP


@pytest.fixture(scope="module")
def job(whole):
    return Job(load_model.load(whole))


def plugin_of(path):
    (found,) = xml.fromstring(f"<all>{path.read_text()}</all>").findall("plugin")
    return {one.tag: one.text for one in found}


def gazebo_force(p, state, rate):
    """Force and torque [6] on the link as Hydrodynamics.cc of gz-sim 8 adds them, its Coriolis
    terms switched off; of a state [6] in axes ahead, to port, up."""
    assert p["disable_coriolis"] == "true"
    letters, axes = "xyzkmn", "UVWPQR"
    damping, mass = np.zeros((6, 6)), np.zeros((6, 6))
    for i in range(6):
        for j in range(6):
            name = letters[i] + axes[j]
            coefficient = -float(p.get(name, 0.0))
            for k in range(6):
                coefficient -= float(p.get(f"{name}abs{axes[k]}", 0.0)) * abs(state[k])
                coefficient -= float(p.get(name + axes[k], 0.0)) * state[k]
            damping[i, j] = coefficient
            mass[i, j] = float(p.get(f"{letters[i]}Dot{axes[j]}", 0.0))
    return -(damping @ state - mass @ rate)


def test_gazebos_plugin_pushes_as_the_hull(job, tmp_path):
    """In its own axes and signs, with the added masses' part of turning: over the training data it
    leaves of each force what the file says."""
    gazebo.write(job, tmp_path / "ship.sdf", [])
    p = plugin_of(tmp_path / "ship.sdf")
    model, theta = hull_terms.physics(job)
    u, v, r = w = hull_terms.velocities(job)[::9].T
    states = np.stack((u, -v, 0 * u, 0 * u, 0 * u, -r), 1)
    found = np.array([gazebo_force(p, state, np.zeros(6)) for state in states])[:, [0, 1, 5]]
    x, y, n = np.array(hull.hull(named(model.names, theta), model.geometry, *w)).T
    m_x, m_y = -float(p["xDotU"]), -float(p["yDotV"])
    wanted = np.stack((x + m_y * v * r, -(y - m_x * u * r), -n), 1)
    left = ((found - wanted) ** 2).sum(0) / (wanted**2).sum(0)
    said = 1.0 - np.array(gazebo.fitted(job).explained)
    assert left == pytest.approx(said, rel=0.5) and left.max() < 0.01
    # added mass resists acceleration
    assert gazebo_force(p, np.zeros(6), np.eye(6)[0])[0] == pytest.approx(-m_x)


def test_vrxs_plugin_only_brakes(job, tmp_path):
    """Its drag is positive: -(c + c' |w|) w of each axis."""
    vrx.write(job, tmp_path / "ship.sdf", [])
    p = {k: float(v) for k, v in plugin_of(tmp_path / "ship.sdf").items() if k != "link_name"}
    assert set(p) == {"xDotU", "yDotV", "nDotR", *vrx.TERMS, "max_effort"}
    assert all(value >= 0.0 for value in p.values())
    model, theta = hull_terms.physics(job)
    x, _, _ = np.array(hull.hull(named(model.names, theta), model.geometry, 0.35, 0.0, 0.0))
    assert -(p["xU"] + p["xUU"] * 0.35) * 0.35 == pytest.approx(x, rel=0.3)


@pytest.mark.parametrize("to", ["gazebo", "vrx", pytest.param("pvs", marks=pytest.mark.long)])
def test_what_nothing_loads_says_so_in_its_file(whole, tmp_path, to):
    out, said = tmp_path / "ship.txt", tmp_path / "said.json"
    code, text, _ = call("export", whole, "--to", to, "--out", out, "--json", said)
    answer = json.loads(said.read_text())
    assert code == 0 and not answer["loaded"] and "Not loaded by its consumer" in text
    assert "Not loaded by its consumer" in out.read_text() and len(answer["not_in_it"]) >= 3


@pytest.mark.long
def test_a_vehicle_comes_to_simulate_as_the_sample_time_falls(job, tmp_path):
    """The simulator's own Euler steps of place and heading are of the first order."""
    path = tmp_path / "vehicle.py"
    pvs.write(job, path, [])
    apart = [
        difference(job.trial, pvs.driven(job.ship, job.trial, path, sample)).by_channel["x0"]
        for sample in (1.0, 0.5, 0.25)
    ]
    assert apart[0] / apart[1] == pytest.approx(2.0, abs=0.2)
    assert apart[1] / apart[2] == pytest.approx(2.0, abs=0.2)


def test_a_vehicle_has_what_the_main_loop_asks(job, tmp_path):
    """`simulate(N, sampleTime, vehicle)` of the simulator's mainLoop, its printing included."""
    path = tmp_path / "vehicle.py"
    pvs.write(job, path, [])
    known = {}
    exec(path.read_text(), known)
    for vehicle in (known["whole"](), known["whole"]("headingAutopilot", 20)):
        eta, nu, u = np.zeros(6), vehicle.nu, vehicle.u_actual
        rows = np.empty([0, 12 + 2 * vehicle.dimU])
        assert (vehicle.name, vehicle.L, vehicle.controlDescription) and len(vehicle.controls) == 3
        for i in range(300):
            if vehicle.controlMode == "headingAutopilot":
                control = vehicle.headingAutopilot(eta, nu, 0.5)
            else:
                control = vehicle.stepInput(i * 0.5)
            rows = np.vstack([rows, np.append(np.append(np.append(eta, nu), control), u)])
            nu, u = vehicle.dynamics(eta, nu, u, control, 0.5)
            c, s = np.cos(eta[5]), np.sin(eta[5])
            eta = eta + 0.5 * np.array(
                [c * nu[0] - s * nu[1], s * nu[0] + c * nu[1], 0, 0, 0, nu[5]]
            )
        assert np.isfinite(rows).all() and np.ptp(rows[:, 5]) > 0.1
    assert abs(np.degrees(rows[-1, 5]) - 20.0) < 8.0


def test_shipmmg_refuses_two_rudders(whole, tmp_path):
    code, _, said = call("export", whole, "--to", "shipmmg", "--out", tmp_path / "p.py")
    assert code == 1 and "2 rudders" in said and not (tmp_path / "p.py").exists()


def test_shipmmgs_polynomial_has_a_hull_of_its_own_form(job, monkeypatch):
    """A force that is a polynomial is found again, with the sign of a resistance."""
    wanted = {"R_0_dash": 0.022, "X_vv_dash": -0.04, "Y_v_dash": -0.315, "N_rrr_dash": -0.013}

    def polynomial(p, g, u, v, r):
        speed = np.sqrt(u**2 + (v - r * g.x_g) ** 2)
        q = 0.5 * g.density * g.length * g.draught * speed**2
        a, b = v / speed, r * g.length / speed
        return np.stack(
            (q * (-0.022 - 0.04 * a**2), q * -0.315 * a, q * g.length * -0.013 * b**3), -1
        )

    monkeypatch.setattr(shipmmg_file, "_refuse_other", lambda *_: None)
    monkeypatch.setattr(shipmmg_file.hull, "hull", polynomial)
    found = shipmmg_file.parameters(job)
    for name, value in wanted.items():
        assert found.manoeuvring[name] == pytest.approx(value, abs=1e-6)
    assert min(found.explained) > 1.0 - 1e-9


@pytest.mark.long
def test_equations_of_a_hybrid_are_its_own(tmp_path):
    """Network, fade and azimuths: the numpy that is written against JAX."""
    import jax.numpy as jnp

    from shiplog.export import languages, statements
    from shiplog.machine.jit_cache import double
    from shiplog.models.hybrid import Hybrid, Residual, first_weights
    from shiplog.models.mmg import MMG, estimated, geometry_of
    from shiplog.ship_profile import file as profiles

    path = tmp_path / "ship.toml"
    path.write_text(SHIP)
    geometry, main, _ = geometry_of(profiles.load(str(path)))
    start = estimated(geometry, main)
    rng = np.random.default_rng(0)
    residual = Residual(
        3, np.zeros(7), np.ones(7), np.array([0.1, 0.1, 0.01]), rng.normal(size=(20, 7)), 0.3, 1.0
    )
    model = Hybrid(MMG(geometry), residual)
    theta = np.concatenate((start.values, first_weights(residual, rng)))
    theta[-12:] = rng.normal(size=12)
    made = equations.of_model(model, len(theta), 2, share=False)
    text = statements.written(made, languages.PYTHON, lambda *_: [])
    known = {name: getattr(np, name) for name in dir(np)} | {
        "p": theta,
        "c": [0.0] * text.constants,
    }
    exec("\n".join(text.hoisted), known)
    for _ in range(20):
        x = rng.normal(size=10) * (5, 0.5, 5, 0.2, 2, 0.1, 2, 0.4, 3, 3)
        known["x"] = x
        exec("\n".join(text.varying), known)
        found = [float(eval(one, known)) for one in text.outputs]
        with double():
            wanted = model.acceleration(*map(jnp.asarray, (theta, x[:6], x[6:8], x[8:])))
        assert found == pytest.approx(np.asarray(wanted), rel=1e-11, abs=1e-14)
