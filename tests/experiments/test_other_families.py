"""Ships of other families: closed forms, what must not be shared with the diagnosis, blind logs."""

import ast
import math
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from pipelines.experiments import other_families
from pipelines.experiments.other_families import cases, effects, water
from pipelines.experiments.other_families.disturbance import CALM, Wind, process_noise
from pipelines.experiments.other_families.effects import RANGES, Effects
from pipelines.experiments.other_families.ship import NO_WINDAGE, WATER
from pipelines.experiments.other_families.voyage import sail
from shiplog.diagnosis.nominal import nominal_fit
from shiplog.models.causes import CATALOGUE, Bank, ShallowWater

pytestmark = pytest.mark.long  # simulators of the experiments; the product has its own tests
FOLDER = Path(other_families.__file__).parent
OWN = ("abkowitz", "linear_dp", "catamaran", "azimuth_ferry")
BREEZE = Wind(3.0, 0.8)


def ship_of(family: str, seed: int = 3):
    if family == "shipmmg":
        pytest.importorskip("shipmmg")
    return cases.FAMILIES[family](seed)


def idle(ship):
    orders = np.zeros(len(ship.actuators))
    return lambda time, state: orders


def energy(ship, v) -> np.ndarray:
    b = ship.body
    return (
        (b.mass + b.m_x) * v.surge**2
        + (b.mass + b.m_y) * v.sway**2
        + 2.0 * (b.mass * b.gravity + b.m_yr) * v.sway * v.yaw_rate
        + (b.inertia + b.j_z) * v.yaw_rate**2
    ) / 2.0


# --- physics --------------------------------------------------------------------------------------


@pytest.mark.parametrize("family", OWN)
@pytest.mark.parametrize("seed", range(3))
def test_without_power_the_kinetic_energy_falls(family, seed):
    ship = ship_of(family, seed)
    speed = ship.speed
    rng = np.random.default_rng(seed)
    motion = rng.uniform((-1.0, -0.5, -0.5), (1.3, 0.5, 0.5)) * (speed, speed, 1 / ship.time_unit)
    v = sail(
        ship, 8.0 * ship.time_unit, seed=0, wind=CALM, quiet=True, helm=idle(ship),
        start=(0.0, 0.0, 1.0, *motion),
    )  # fmt: skip
    stored = energy(ship, v)
    assert np.diff(stored).max() <= 1e-9 * stored[0]
    assert stored[-1] < 0.6 * stored[0]


def steady_speed(ship, power: float) -> float:
    """m/s where thrust is resistance, straight ahead in still air, by each family's formula."""
    c, w = ship.c, ship.windage

    def balance(u: float) -> float:
        air = 0.5 * water.AIR * w.drag_ahead * w.frontal * u * u
        if ship.family == "abkowitz":
            turns = 0.75 * power
            thrust = c.thrust * turns**2 - c.advance * turns * u / c.speed
            hull = 0.25 * WATER * c.length**2 * -c.x_u * c.speed**2
            return thrust - hull * (u / c.speed) ** c.surge_power - air
        if ship.family == "linear_dp":
            turns = math.sqrt(power)
            thrust = 2.0 * (c.screw * turns**c.power - c.advance * turns * u)
            return thrust - c.surge_linear * u - c.surge * u**c.surge_power - air
        if ship.family == "catamaran":
            turns = math.sqrt(0.4 * power)
            thrust = 2.0 * (c.pull * turns**c.power - c.advance * turns * u)
            return thrust - c.surge * u - c.surge_quadratic * u**c.surge_power
        turns, bend = math.sqrt(0.35 * power), (u / c.scale + 1e-9) ** (c.power - 2.0)
        thrust = c.units * (turns**c.thrust_power * c.thrust - c.inflow * turns * u)
        return thrust + (c.x_u + bend * c.x_uu * u + c.x_uuu * u * u) * u - air

    return brentq(balance, 1e-3, 20.0)


@pytest.mark.parametrize("family", OWN)
def test_on_a_straight_course_thrust_is_resistance(family):
    ship, power = ship_of(family), 0.8
    order = ship.mixer(power, 0.0, 0.0)
    expected = steady_speed(ship, power)
    still = replace(ship, windage=ship.windage._replace(lever=0.0)) if ship.winds else ship
    v = sail(
        still, 200.0 * ship.time_unit, seed=0, wind=CALM, quiet=True, helm=lambda *_: order,
        start=(0.0, 0.0, 0.3, 0.7 * expected, 0.0, 0.0),
    )  # fmt: skip
    assert v.surge[-1] == pytest.approx(expected, rel=2e-3)
    assert abs(v.sway[-1]) < 1e-6 * expected


@pytest.mark.parametrize("family", OWN)
def test_an_even_current_is_only_another_place_to_look_from(family):
    """Galilei: a ship without windage has the same path through the water, carried along."""
    ship = replace(ship_of(family), windage=NO_WINDAGE)
    current, psi = complex(0.1, -0.07) * ship.speed, 0.5
    body = current * np.exp(-1j * psi)
    order = ship.mixer(0.5, 0.4, 0.0)
    kept = {"seed": 0, "wind": CALM, "quiet": True, "helm": lambda *_: order}
    u, v, r = 0.5 * ship.speed, 0.05 * ship.speed, 0.0
    still = sail(ship, 6.0 * ship.time_unit, **kept, start=(0, 0, psi, u, v, r))
    flow = Effects(current_north=current.real, current_east=current.imag)
    start = (0, 0, psi, u + body.real, v + body.imag, r)
    carried = sail(ship, 6.0 * ship.time_unit, **kept, start=start, effects=flow)
    assert carried.heading == pytest.approx(still.heading, abs=1e-8)
    assert carried.x0 == pytest.approx(still.x0 + current.real * still.time, abs=1e-6 * ship.length)
    assert carried.y0 == pytest.approx(still.y0 + current.imag * still.time, abs=1e-6 * ship.length)


@pytest.mark.parametrize("family", cases.FAMILIES)
def test_a_drifting_ship_goes_with_the_water(family):
    ship = replace(ship_of(family), windage=NO_WINDAGE)
    flow = Effects(current_north=0.15 * ship.speed)
    v = sail(
        ship, 20.0 * ship.time_unit, seed=0, wind=CALM, quiet=True, helm=idle(ship), effects=flow,
        start=(0, 0, 0.0, 0.15 * ship.speed, 0, 0),
    )  # fmt: skip
    assert v.x0 == pytest.approx(0.15 * ship.speed * v.time, rel=1e-6, abs=1e-6 * ship.length)
    assert np.abs(v.heading).max() < 1e-9


@pytest.mark.parametrize("family", cases.FAMILIES)
def test_a_positive_wheel_turns_the_bow_to_starboard(family):
    ship = ship_of(family)
    order = ship.mixer(0.6, 0.5, 0.0)
    v = sail(ship, 5.0 * ship.time_unit, seed=0, wind=CALM, quiet=True, helm=lambda *_: order,
             start=(0, 0, 0, 0.5 * ship.speed, 0, 0))  # fmt: skip
    assert v.heading[-1] > 0.3


@pytest.mark.parametrize("family", cases.FAMILIES)
@pytest.mark.parametrize("seed", [5, 6])
def test_no_ship_leaves_its_basin(family, seed):
    ship = ship_of(family, seed)
    v = sail(ship, 60.0 * ship.time_unit, seed=seed, wind=BREEZE)
    assert np.hypot(v.x0, v.y0).max() < 1.25 * ship.radius
    assert v.y0.max() < ship.bank_east
    assert np.hypot(v.surge, v.sway).max() < 3.0 * ship.speed
    assert np.ptp(v.heading) > math.pi  # and it does not sail one course


@lru_cache(maxsize=len(OWN))
def unchanged(family: str):
    return gusty(family, Effects())


def gusty(family: str, hidden: Effects):
    """A voyage in gusts, with one order to all actuators."""
    ship = ship_of(family)
    order = ship.mixer(0.7, 0.6, 0.3)
    return sail(
        ship, 60.0 * ship.time_unit, seed=1, wind=BREEZE, effects=hidden, helm=lambda *_: order
    )


@pytest.mark.parametrize("name", sorted({*effects.CATALOGUE, *effects.OUTSIDE}))
def test_every_force_changes_the_path_and_no_instrument_does(name):
    """On the first family that offers it, in the same gusts under the same wheel."""
    family = next(one for one in OWN if name in effects.offered(ship_of(one)))
    ship = ship_of(family)
    sized = effects.CATALOGUE.get(name) or effects.OUTSIDE[name][1]
    changes, reported = sized(np.random.default_rng(1), 1.0, ship)
    assert all(set(value) == {"value", "unit"} for value in reported.values())
    paths = unchanged(family), gusty(family, replace(Effects(), **changes))
    apart = np.hypot(paths[0].x0 - paths[1].x0, paths[0].y0 - paths[1].y0).max()
    observed = {
        "heading_offset", "yaw_rate_bias", "yaw_rate_scale", "clock_offset", "antenna_offset",
        "wind_direction_offset", "wind_speed_scale",
    }  # fmt: skip
    assert apart == 0.0 if name in observed else apart > 0.002 * ship.length


def test_no_unit_that_turns_as_a_whole_has_a_side_force():
    """It would be one whose angle is off, which is in the catalogue: the paths are the same but
    for what flows into the unit."""
    ship = ship_of("azimuth_ferry")
    assert "propeller_side_force" not in effects.offered(ship)
    assert "propeller_side_force" in effects.offered(ship_of("abkowitz"))
    order = ship.mixer(0.7, 0.6, 0.3)
    off = math.atan(0.08)
    plain, aside, turned = (
        sail(ship, 5.0 * ship.time_unit, seed=1, wind=CALM, quiet=True, effects=e,
             helm=lambda *_: order)
        for e in (Effects(), Effects(aside=0.08), Effects(rudder_offset=(off, off)))
    )  # fmt: skip

    def apart(a, b) -> float:
        return float(np.hypot(a.x0 - b.x0, a.y0 - b.y0).max())

    assert apart(aside, turned) < 0.15 * apart(aside, plain)


# --- what must not be shared ----------------------------------------------------------------------


def test_nothing_of_shiplog_is_imported_but_the_writer_of_logs():
    for path in FOLDER.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            for name in names:
                if name.split(".")[0] == "shiplog":
                    assert name == "shiplog.logs.conversion.write", path
                if name.split(".")[0] == "pipelines":
                    assert name.startswith("pipelines.experiments.other_families"), path


def catalogue_growth() -> dict[str, float]:
    """Shares by which the catalogue's shallow water grows each force, in order `water.GROWTHS`."""
    roles = {"surge": "hull.x_0f", "sway": "hull.y_v", "yaw": "hull.n_r",
             "cross_flow": "hull.c_d", "sway_mass": "body.m_y",
             "yaw_inertia": "body.i_j"}  # fmt: skip
    at = {"shallow.places": np.zeros((1, 2)), "shallow.spacing": np.array(10.0)}
    cause = ShallowWater(places=1)
    grown = cause.coefficients(
        dict.fromkeys(("hull.x_0a", *roles.values()), 1.0), list(np.eye(cause.count)[0]),
        np.zeros(6), 0.0, at,
    )  # fmt: skip
    return {role: float(grown[name]) - 1.0 for role, name in roles.items()}


def test_shallow_water_grows_by_another_law_than_the_catalogue_s():
    """Shares over that of sway, so that one strength for all cannot hide the same constants."""
    theirs = np.array(list(catalogue_growth().values()))
    assert theirs == pytest.approx([0.3, 0.8, 0.5, 1.2, 0.7, 0.2])  # or this test compares nothing
    out, ours = np.empty(6), []
    for keel in (0.3, 0.5, 0.8, 1.5):
        water.growth(keel, 2.8, out)
        ours.append((out - 1.0) / (out[1] - 1.0))
    for i, role in enumerate(water.GROWTHS):
        if role != "sway":
            apart = np.abs(np.array(ours)[:, i] / (theirs[i] / theirs[1]) - 1.0)
            assert apart.max() > 0.05, role


def test_the_bank_decays_and_pulls_by_another_law_than_the_catalogue_s():
    length, breadth, draught = 3.0, 0.5, 0.2
    at = {"bank.lines": np.array([[-1e4, 40.0, 1e4, 40.0]]), "bank.same": np.eye(1),
          "bank.ship": np.array([length, breadth, draught, 1000.0])}  # fmt: skip

    def theirs(gap: float, u: float) -> np.ndarray:
        east = 40.0 - 0.5 * breadth - gap
        state = np.array([0.0, u, east, 0.0, 0.0, 0.0])
        return np.asarray(Bank().force([1.0, 0.0, 0.0], state, at))

    def ours(gap: float, u: float, reach: float) -> np.ndarray:
        body, out = ship_of("catamaran").body._replace(length=length, draught=draught), np.zeros(3)
        water.bank_force(body, 1.0, reach, gap, 0.0, u, out)
        return out

    near, far = theirs(1.0, 0.6), theirs(9.0, 0.6)
    for reach in (0.8 * length, 2.0 * length):
        mine, away = ours(1.0, 0.6, reach), ours(9.0, 0.6, reach)
        assert abs(away[1] / mine[1] / (far[1] / near[1]) - 1.0) > 0.05
        assert abs(mine[2] / mine[1] / (near[2] / near[1]) - 1.0) > 0.05
    faster = theirs(1.0, 1.2)[1] / near[1]
    assert faster == pytest.approx(4.0, rel=1e-3)
    assert abs(ours(1.0, 1.2, 3.0)[1] / ours(1.0, 0.6, 3.0)[1] / faster - 1.0) > 0.05


@pytest.mark.parametrize("kind", ["sea", "bursts"])
def test_process_noise_is_no_ornstein_uhlenbeck_process(kind):
    """Its autocorrelation exp(-t/T) is never negative; that of an oscillation is."""
    ship = ship_of("catamaran")
    noise = replace(ship.noise, kind=kind, damping=0.5, period=10.0, burst=0.9)
    times = 0.1 * np.arange(60_000)
    acceleration = process_noise(np.random.default_rng(2), noise, times, 1.0)
    assert acceleration.std(axis=0) == pytest.approx(noise.sigma, rel=0.35)
    one = acceleration[:, 1] / acceleration[:, 1].std()
    lagged = [float(np.mean(one[:-lag] * one[lag:])) for lag in range(10, 120, 5)]
    assert min(lagged) < -0.08
    periods = {cases.FAMILIES[f](s).noise.period for f in OWN for s in range(20)}
    assert nominal_fit.PROCESS_NOISE_TIME_S not in periods
    assert max(periods) > 10.0 * min(periods)


PRIORS = {  # range → cause, number of its parameter, unit of the range in the parameter's
    "current": ("current", 0, 1.0), "wind_force": ("wind_force", 0, 1.0),
    "bank": ("bank", 0, 1.0), "fouling": ("fouling", 0, 1.0), "payload": ("payload", 0, 1.0),
    "cross_flow_drag": ("cross_flow_drag", 0, 1.0), "thrust_loss": ("thrust_loss", 0, 1.0),
    "unit_loss": ("thrust_loss", 0, 1.0), "thrust_drift": ("thrust_drift", 0, 1.0),
    "rudder_force": ("rudder_force", 0, 1.0),
    "heading_offset": ("heading_offset", 0, math.radians(1.0)),
    "yaw_rate_scale": ("yaw_rate_scale", 0, 1.0), "antenna_ahead": ("antenna_offset", 0, 1.0),
    "antenna_aside": ("antenna_offset", 1, 1.0),
    "wind_direction_offset": ("wind_direction_offset", 0, math.radians(1.0)),
    "wind_speed_scale": ("wind_speed_scale", 0, 1.0),
}  # fmt: skip


@pytest.mark.parametrize("name", PRIORS)
def test_the_catalogue_s_priors_do_not_sit_in_the_middle_of_what_is_hidden(name):
    cause, number, unit = PRIORS[name]
    prior = next(c for c in CATALOGUE if c.name == cause).parameters[number].prior
    assert abs(RANGES[name].middle * unit / prior - 1.0) > 0.05
