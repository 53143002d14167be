"""Laws of blind ships: drawn by the seed alone, and independent of the catalogue."""

import math
from collections.abc import Callable
from dataclasses import fields, replace

import jax.numpy as jnp
import numpy as np
import pytest
from simulated_laws import TERMS, of, state

from pipelines.experiments.simulated_ship import (
    Laws,
    Ship,
    cases,
)
from pipelines.experiments.simulated_ship.laws import (
    drawn,
)
from shiplog.diagnosis.nominal.nominal_fit import PROCESS_NOISE_TIME_S
from shiplog.models.causes import CATALOGUE, Setting
from shiplog.models.causes.environment import Bank as CatalogueBank
from shiplog.models.causes.environment import ShallowWater
from shiplog.ship_profile import file as profiles

SEEDS = range(300)
PROFILE = profiles.load("esso-vectwin")
SPEED = 0.27  # m/s, root mean square of a campaign


def test_laws_follow_from_the_seed_alone():
    assert of(3) == of(3) != of(4)
    hidden = cases.draw(3, cause="bank+fouling", size=1.0, seconds=500)
    assert hidden.laws == of(3)
    assert drawn(np.random.default_rng(5)) == drawn(np.random.default_rng(5))
    kinds = {(of(s).shallow.bed, of(s).bank.fading) for s in range(60)}
    assert len(kinds) == 6


def test_both_campaigns_of_a_case_obey_its_laws():
    """The same leg under the sample logs' laws goes another way, hidden or not."""
    case = cases.draw(8, cause="none")
    for leg in (case.nominal[0], case.trial[0]):
        short = replace(case, nominal=(replace(leg, seconds=100.0),), trial=())
        own, plain = (
            cases.voyage(replace(short, laws=laws), short.nominal[0]) for laws in (of(8), Laws())
        )
        assert np.abs(state(own) - state(plain))[-1, [0, 2]].max() > 0.02
    assert case.laws.noise.damping is not None  # no Ornstein-Uhlenbeck process on any day


def _shallow_share(name: str) -> float:
    """What the catalogue's shallow water adds to a coefficient where its map says one."""
    at = {"shallow.places": jnp.zeros((1, 2)), "shallow.spacing": jnp.array(1.0)}
    ones = dict.fromkeys([*TERMS.values(), "hull.x_0a"], jnp.array(1.0))
    cause = ShallowWater(places=1)
    numbers = tuple(jnp.eye(cause.count)[0])
    grown = cause.coefficients(ones, numbers, jnp.zeros(6), 0.0, at)
    return float(grown[TERMS[name]]) - 1.0


def _bank_force(gap: float, speed: float) -> np.ndarray:
    """X, Y, N of the catalogue's bank of strength 1, on a course along it."""
    cause = CatalogueBank()
    at = {k: jnp.array(v) for k, v in cause.constants(_setting()).items()}
    ship = Ship()
    at["bank.lines"] = jnp.array([[-1e3, 40.0, 1e3, 40.0]])
    at["bank.ship"] = jnp.array([ship.length, ship.breadth, ship.draught, 998.0])
    at["bank.same"] = jnp.eye(1)
    east = 40.0 - ship.breadth / 2 - gap
    return np.asarray(
        cause.force((1.0, 0.0, 0.0), jnp.array([0.0, speed, east, 0.0, 0.0, 0.0]), at)
    )


def _setting() -> Setting:
    mass = Ship().mass
    scale = {"speed": SPEED, "length": 3.0, "mass": mass, "moment": 3.0 * mass}
    return Setting(PROFILE, scale, np.zeros((12, 2)), 1.0)


def constants() -> dict[str, tuple[float, Callable[[Laws], float]]]:
    """Role → the catalogue's number in it, asked of its functions, and where laws have theirs."""
    unit = 0.5 * 998.0 * 3.0 * Ship().draught
    touching, fast = _bank_force(0.0, 0.3), _bank_force(0.0, 30.0)
    near, far = (_bank_force(gap, 0.3)[1] / touching[1] for gap in (9.0, 18.0))
    slow = abs(_bank_force(0.0, 0.01)[2] / _bank_force(0.0, 0.01)[1])
    arm = abs(fast[2] / fast[1]) / 3.0
    share = slow / (3.0 * arm)  # of the lever that is left at 0.01 m/s: u/√(u² + e²)
    found: dict[str, tuple[float, Callable[[Laws], float]]] = {
        "bank suction": (touching[1] / (unit * 0.3**2), lambda laws: laws.bank.suction),
        "bank lever": (arm, lambda laws: laws.bank.moment_arm),
        "bank power of speed": (
            math.log(fast[1] / touching[1], 100.0), lambda laws: laws.bank.speed_power,
        ),
        "bank power of the gap": (
            math.log2((1 / far - 1) / (1 / near - 1)), lambda laws: laws.bank.power,
        ),
        "bank speed of lead": (
            0.01 * math.sqrt(1 / share**2 - 1), lambda laws: laws.bank.lead_speed,
        ),
        "process noise, time": (PROCESS_NOISE_TIME_S, lambda laws: laws.noise.time[0]),
        "process noise, time in sway": (PROCESS_NOISE_TIME_S, lambda laws: laws.noise.time[1]),
        "process noise, time in yaw": (PROCESS_NOISE_TIME_S, lambda laws: laws.noise.time[2]),
    }  # fmt: skip
    for name in TERMS:
        found[f"shallow {name}"] = (
            _shallow_share(name), lambda laws, n=name: getattr(laws.shallow, n).share,
        )  # fmt: skip
    return found


def test_no_constant_of_the_catalogue_stands_in_a_blind_ship():
    many = [of(seed) for seed in SEEDS]
    shared = []
    for role, (number, where) in constants().items():
        drawn_numbers = np.array([where(laws) for laws in many])
        assert np.abs(drawn_numbers - number).min() > 1e-6 * max(abs(number), 0.1), role
        assert len(set(drawn_numbers)) == len(many), role  # each ship has one of its own
        if math.isclose(where(Laws()), number, rel_tol=1e-4, abs_tol=1e-9):
            shared.append(role)
    # the comparison finds what the sample logs do share, so it would find it in a blind ship
    # (of shallow water all but two)
    assert set(shared) == set(constants()) - {"shallow yaw_drift", "shallow yaw_damping"}


def test_no_blind_ship_is_near_the_catalogue_in_all_of_a_cause():
    """Within a tenth in one number by chance, but never in all numbers of one cause."""
    table = constants()
    for kind in ("shallow", "bank", "process noise"):
        rows = [row for role, row in table.items() if role.startswith(kind) and abs(row[0]) > 1e-9]
        assert len(rows) >= 3
        for seed in SEEDS:
            laws = of(seed)
            away = [abs(where(laws) / number - 1.0) for number, where in rows]
            assert max(away) > 0.1, (kind, seed)


PRIORS = {  # cause → what is drawn for its first parameter [SI], without its sign
    "current": lambda p: p["speed"] * math.cos(math.radians(p["direction"])),
     "wind_force": lambda p: p["surge_factor"] - 1.0,
    "fouling": lambda p: p["factor"] - 1.0, "cross_flow_drag": lambda p: p["factor"] - 1.0,
    "rudder_force": lambda p: p["factor"] - 1.0, "thrust_loss": lambda p: p["factor"] - 1.0,
    "thrust_drift": lambda p: p["slope"], "payload": lambda p: p["mass"],
    "rudder_lag": lambda p: p["time"], "rudder_delay": lambda p: p["time"],
    "heading_offset": lambda p: math.radians(p["angle"]), "bank": lambda p: p["strength"],
    "yaw_rate_bias": lambda p: math.radians(p["value"]),
    "yaw_rate_scale": lambda p: p["value"] - 1.0, "clock_offset": lambda p: p["time"],
    "antenna_offset": lambda p: p["x"], "wind_speed_scale": lambda p: p["value"] - 1.0,
    "wind_direction_offset": lambda p: math.radians(p["angle"]),
    "rudder_offset": lambda p: math.radians(p["port"] or p["starboard"]),
}  # fmt: skip


@pytest.mark.parametrize("name", PRIORS)
def test_a_prior_is_not_the_middle_of_what_is_hidden(name):
    """A prior at the median of what is drawn would be the generator's own number."""
    rng, hide = np.random.default_rng(0), cases.CATALOGUE[name]
    sizes = []
    for _ in range(4000):
        reported = {k: v["value"] for k, v in hide(rng, 1.0)[1].items()}
        sizes.append(abs(PRIORS[name](reported)))
    cause = next(one for one in CATALOGUE if one.name == name)
    prior = cause.on(_setting()).sizes(_setting())[0]
    assert not 0.45 < np.mean(np.array(sizes) < prior) < 0.55


def test_every_number_of_the_laws_is_drawn():
    """None of a blind ship's numbers is the sample logs': whoever adds one must draw it."""
    for part in ("shallow", "bank", "hull", "air", "noise"):
        ordinary = getattr(Laws(), part)
        for one in fields(ordinary):
            if one.name in ("bed", "fading"):
                continue
            mine = [getattr(getattr(of(seed), part), one.name) for seed in range(40)]
            assert getattr(ordinary, one.name) not in mine, f"{part}.{one.name}"
