"""A model is one file and one line: the example of docs/develop, the whole way."""

import importlib
import json
import re
import sys
from datetime import UTC, datetime
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from commands import call

import shiplog.models
from pipelines.experiments import simulated_ship
from shiplog.models import MODELS
from shiplog.ship_profile import file as profiles
from shiplog.training.runs import load_model
from shiplog.training.settings.run_config import Physics

DOCS = Path(__file__).parents[2] / "docs" / "develop"
LINE = re.compile(r'^\+ +("kt": Kind\(.*\),)$', re.MULTILINE)


@pytest.fixture
def kt(monkeypatch):
    """The example's file under the name that the example's line gives it."""
    monkeypatch.syspath_prepend(DOCS / "examples")
    module = importlib.import_module("kt")
    monkeypatch.setitem(sys.modules, "shiplog.models.kt", module)
    (line,) = LINE.findall((DOCS / "extending_models.md").read_text(encoding="utf-8"))
    row = eval(f"{{{line}}}", vars(shiplog.models).copy())
    monkeypatch.setitem(MODELS, "kt", row["kt"])
    return module


@pytest.fixture
def esso(kt):
    """Equations and starting values of the Esso Osaka."""
    model, start, _ = MODELS["kt"].equations.begin(profiles.load("esso-osaka"), Physics(), None)

    def acceleration(u, v, r, rudder=0.0, propeller=0.0):
        state = jnp.array([0.0, u, 0.0, v, 0.0, r])
        at = jnp.array([rudder, propeller])
        return np.asarray(model.acceleration(jnp.asarray(start.values), state, at, jnp.zeros(2)))

    return model, start, acceleration


def test_a_steady_turn_has_nomotos_rate_and_the_pivot_points_drift(esso):
    """r = K' U_R² sin δ / (L U), with U_R = u while the screw stands; v = -x_P r."""
    model, start, acceleration = esso
    c = dict(zip(start.names, start.values, strict=True))
    length, u, order = model.geometry.length, 0.8, 0.2
    r = v = 0.0
    for _ in range(50):
        v = -c["sway.x_p"] * length * r
        speed = np.sqrt(u**2 + v**2 + 1e-4 * 9.80665 * length)
        r = c["steering.k"] * u**2 * np.sin(order) / (length * speed)
    v = -c["sway.x_p"] * length * r
    _, sway, yaw = acceleration(u, v, r, order)
    assert r > 0.0 and v < 0.0
    assert sway == pytest.approx(0.0, abs=1e-9) and yaw == pytest.approx(0.0, abs=1e-9)


def test_at_rest_nothing_moves_and_the_rudder_steers_in_the_slipstream(esso):
    _, _, acceleration = esso
    assert acceleration(0.0, 0.0, 0.0).tolist() == [0.0, 0.0, 0.0]
    assert acceleration(0.0, 0.0, 0.0, 0.3)[2] == 0.0
    ahead = acceleration(0.0, 0.0, 0.0, 0.3, 10.0)
    astern = acceleration(0.0, 0.0, 0.0, 0.3, -10.0)
    assert ahead[0] > 0.0 and ahead[2] > 0.0 and astern[0] < 0.0 and astern[2] == 0.0


@pytest.mark.nightly
def test_it_is_trained_evaluated_compared_and_diagnosed(kt, tmp_path):
    """Nothing but the file and the line; what its coefficients cannot distinguish is reported."""
    for number in range(1, 4):
        voyage = simulated_ship.sail(270.0, seed=number, wind=simulated_ship.Wind(0.0, 0.0))
        start = datetime(2026, 5, 1, 10 + number, 0, tzinfo=UTC)
        path = tmp_path / "logs" / f"trip_{number}.mcap"
        path.parent.mkdir(exist_ok=True)
        simulated_ship.write_voyage(path, voyage, seed=number, start=start)
    store, run = tmp_path / "store", tmp_path / "run"
    assert call("ingest", tmp_path / "logs", "--store", store)[0] == 0
    both = ("--voyages", "trip_1", "--voyages", "trip_2")
    code, reported, _ = call("train", "--model", "kt", "--store", store, "--out", run, *both,
                         "--window", 25, "--folds", 2)  # fmt: skip
    assert code == 0 and "kt identified on ref" in reported
    assert "turning ability" in (run / "training.md").read_text(encoding="utf-8")
    code, _, reported = call("train", "--model", "kt", "--store", store, "--out", tmp_path / "w",
                         "--width", 8)  # fmt: skip
    assert code == 2 and "says nothing to a physical model" in reported
    opened = load_model.load(run)
    assert opened.identified()["name"].to_list() == list(opened.simulator(0).model.names)
    test = ("--store", store, "--voyages", "trip_3")
    code, reported, _ = call("compare", run, *test, "--save", tmp_path / "kt.rrd")
    assert code == 0 and "kt identified on ref" in reported and (tmp_path / "kt.rrd").is_file()
    to = tmp_path / "d.json"
    code, reported, _ = call("diagnose", run, *test, "--out", tmp_path / "d", "--json", to)
    assert code == 0 and "causes that change forces cannot be identified" in reported
    answer = json.loads(to.read_text(encoding="utf-8"))
    forces = {c["name"] for c in answer["unavailable"] if c["reason"].startswith("a K-T model")}
    assert {"fouling", "current"} <= forces and "heading_offset" not in forces
