"""Current, wind, banks and shoals: by hand, and where each acts."""

import math
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from cause_ships import (
    BY,
    CALM,
    EAST,
    NORTH,
    PLACES,
    REST,
    TWIN,
    acceleration,
    drifting,
    extended,
    forces,
    network,
    setting,
    under_way,
)

from shiplog.models import mmg
from shiplog.models.causes.environment import Bank, Current, WindForce, nearest_share

# --- current --------------------------------------------------------------------------------------


def test_a_current_a_little_west_of_north_goes_towards_0_deg():
    angle = math.radians(359.7)
    p = 0.2 * np.array([math.cos(angle), math.sin(angle)])
    reported = Current().estimates(p, np.diag([1e-6, 1e-6]))
    assert Current().sentence(reported) == "A steady current of 0.2 m/s towards 0 deg."


def free_body(state: np.ndarray, off: tuple[str, ...] = ("propeller", "rudder", "wind")):
    """Acceleration of a hull that no water holds, in a current, and its masses m_x, m_y, I."""
    model, values = extended([Current()], without=off)
    names = model.base.names
    free = np.array([n.startswith("hull.") for n in names])
    values = np.where(free, 0.0, values)
    found = acceleration(
        model, values, [NORTH, EAST], state, np.zeros((len(state), 4)), np.zeros((len(state), 2))
    )
    g = model.base.geometry
    of = dict(zip(names, values, strict=True))
    unit = 0.5 * g.density * g.length**2 * g.draught
    masses = of["body.m_x"] * unit, of["body.m_y"] * unit, of["body.i_j"] * unit * g.length**2
    return found, masses, g


def test_a_ship_at_rest_in_the_water_drifts_with_the_current():
    """Its hull feels the water and not the ground: adrift it keeps its way, held it does not."""
    heading = np.linspace(-3.0, 3.0, 13)
    model, values = extended([Current()], without=("propeller", "rudder", "wind"))
    still = np.zeros((13, 4)), np.zeros((13, 2))
    found = acceleration(model, values, [NORTH, EAST], drifting(heading, np.zeros(13)), *still)
    assert found == pytest.approx(np.zeros((13, 3)), abs=1e-12)
    held = drifting(heading, np.zeros(13)) * [1, 0, 1, 0, 1, 1]  # over ground at rest
    assert np.abs(acceleration(model, values, [NORTH, EAST], held, *still)).max() > 1e-4


def test_turning_in_a_current_by_hand():
    """The free body moves through the water by its own equations; over ground, the water's
    velocity in body axes turns away under it: d/dt(RᵀV) = r (V_y, -V_x) in body axes."""
    rng = np.random.default_rng(4)
    heading, r = rng.uniform(-3, 3, 20), rng.uniform(-0.2, 0.2, 20)
    u, v = rng.uniform(-0.5, 0.5, 20), rng.uniform(-0.2, 0.2, 20)  # through the water
    state = drifting(heading, r)
    c_u, c_v = state[:, 1].copy(), state[:, 3].copy()
    state[:, 1] += u
    state[:, 3] += v
    found, (m_x, m_y, yaw), g = free_body(state)
    m, x = g.mass, g.x_g
    matrix = np.array([[m + m_x, 0, 0], [0, m + m_y, x * m], [0, x * m, yaw + x * x * m]])
    pull = np.stack(
        ((m + m_y) * v * r + x * m * r * r, -(m + m_x) * u * r, -x * m * u * r), -1
    )  # centripetal and Coriolis terms of Yasukawa & Yoshimura 2015, Eq. 4
    through = np.linalg.solve(matrix, pull.T).T
    over = through + np.stack((r * c_v, -r * c_u, np.zeros(20)), -1)
    assert found == pytest.approx(over, rel=1e-9, abs=1e-12)


def test_wind_over_ground_and_not_over_the_water():
    """A current that carries the ship leaves the wind that it feels over ground as it is."""
    model, values = extended([Current()], without=("propeller", "rudder"))
    heading = np.linspace(-3.0, 3.0, 13)
    wind = np.tile([3.0, 1.0], (13, 1))
    state = drifting(heading, np.zeros(13))
    found = acceleration(model, values, [NORTH, EAST], state, np.zeros((13, 4)), wind)
    # the same apparent wind on a ship at rest in still water, in a true wind that much stronger
    rest = state * [1, 0, 1, 0, 1, 1]
    felt = wind + np.array([NORTH, EAST])
    still = acceleration(model, values, [0.0, 0.0], rest, np.zeros((13, 4)), felt)
    assert np.abs(found).max() > 1e-4
    assert found == pytest.approx(still, abs=1e-12)


# --- wind, banks and shoals -----------------------------------------------------------------------


def test_wind_force_scales_each_force_of_the_wind():
    off = ("propeller", "rudder")
    args = (REST, np.zeros((1, 4)), np.array([[3.0, 2.0]]), off)
    plain = forces("wind_force", np.zeros(3), *args)
    found = forces("wind_force", [0.3, -0.2, 0.5], *args)
    assert np.abs(plain).min() > 0.01
    assert found / plain == pytest.approx(np.array([[1.3, 0.8, 1.5]]), rel=1e-9)


@pytest.mark.parametrize("base", (None, network()), ids=("mmg", "network"))
def test_a_model_without_wind_is_given_that_of_such_a_ship(base):
    """Ones make of it the model with the estimated wind force; each number is an axis' own."""
    ship, main, _ = mmg.geometry_of(TWIN)
    nominal = mmg.estimated(ship, main)
    lacking = {
        n: float(v) for n, v in zip(nominal.names, nominal.values, strict=True) if "wind." in n
    }
    assert len(lacking) == 10
    cause = WindForce().on(replace(setting(), lacking=lacking))
    calm, values = extended([], without=("wind",), base=base)
    windless = replace(calm, causes=(cause,), constants=cause.constants(
        replace(setting(), lacking=lacking)))  # fmt: skip
    state, actuator, wind = under_way()
    args = (state, actuator, wind)
    plain = acceleration(calm, values, [], *args)
    assert acceleration(windless, values, np.zeros(3), *args) == pytest.approx(plain, abs=1e-15)
    whole, _ = extended([])
    felt = acceleration(whole, nominal.values, [], *args)
    still, known = extended([], without=("wind",))
    felt = felt - acceleration(still, known, [], *args)
    found = acceleration(windless, values, np.ones(3), *args) - plain
    assert found == pytest.approx(felt, rel=1e-9, abs=1e-14)
    assert np.abs(found).max(0).min() > 1e-3
    ahead = acceleration(windless, values, [0.5, 0.0, 0.0], *args) - plain
    assert ahead[:, 0] == pytest.approx(0.5 * felt[:, 0], rel=1e-9)
    assert np.abs(ahead[:, 1:]).max() < 1e-14


def test_wind_in_a_model_without_it_is_no_coefficient_that_a_fit_takes_in():
    lacking = replace(setting(), lacking={"wind.x1": -0.7})
    assert WindForce().absorbed and not WindForce().on(lacking).absorbed
    assert WindForce().on(setting()) == WindForce()
    for label in ("wind_direction_offset", "wind_speed_scale", "clock_offset:wind"):
        assert BY[label].missing(lacking) == "the model feels no wind"
    found = WindForce().on(lacking).displayed(np.array([0.9, 1.1, -0.2]))
    assert [v for v, _ in found.values()] == pytest.approx([0.9, 1.1, -0.2])


def test_a_bank_draws_in_and_turns_the_bow_out():
    """Along a wall to starboard: pulled to starboard, turned to port; the mirrored way abeam to
    port; with the square of the speed; and hardly at all a hundred metres off."""
    off = ("propeller", "rudder", "wind")
    still = (np.zeros((1, 4)), CALM, off)

    def pull(heading, u, y0, *form):
        state = np.array([[0.0, u, y0, 0.0, heading, 0.0]])
        one, none = (forces("bank", [p, *(form or (0.0, 0.0))], state, *still) for p in (1.0, 0.0))
        return (one - none)[0]

    north, south = pull(0.0, 0.6, 38.0), pull(math.pi, 0.6, 38.0)
    assert north[1] > 0.1 and north[2] < -0.1
    assert south == pytest.approx(north * [1, -1, -1], abs=1e-9)
    assert pull(0.0, 0.3, 38.0)[1] == pytest.approx(0.25 * north[1], rel=1e-9)
    assert pull(0.0, 0.6, -60.0)[1] < 0.01 * north[1]
    # by hand: 0.15 · ½ρLd u² / (1 + (gap/3L)³), gap 2 m less half a breadth
    gap = (2.0 - 0.5 * 0.489) / 9.0
    q = 0.5 * 1000.0 * 3.0 * 0.201
    assert north[1] == pytest.approx(0.15 * q * 0.36 / (1.0 + gap**3), rel=1e-4)
    # one that reaches half as far, and one that turns the ship twice as much
    short, bent = pull(0.0, 0.6, 38.0, np.log(0.5), 0.0), pull(0.0, 0.6, 38.0, 0.0, np.log(2.0))
    assert short == pytest.approx(north * (1.0 + gap**3) / (1.0 + (2.0 * gap) ** 3), rel=1e-3)
    assert bent == pytest.approx(north * [1, 1, 2], rel=1e-6, abs=1e-9)


def test_a_wall_attracts_as_much_however_many_points_its_line_has():
    """In one piece, in sixty, and abeam of a point that two pieces share; a second wall adds."""
    distance = np.array([5.0, 2.0, 2.0, 3.0])
    one = np.ones((4, 4))
    assert nearest_share(distance, one).tolist() == [0.0, 0.5, 0.5, 0.0]
    two = np.kron(np.eye(2), np.ones((2, 2)))
    assert nearest_share(distance, two).tolist() == [0.0, 1.0, 1.0, 0.0]
    assert nearest_share(np.array([4.0]), np.ones((1, 1))).tolist() == [1.0]

    def pull(points: int) -> np.ndarray:
        wall = tuple((float(x), 40.0) for x in np.linspace(-30.0, 30.0, points))
        here = setting()
        site = here.profile.site.model_copy(update={"banks": (wall,)})
        profile = here.profile.model_copy(update={"site": site})
        at = Bank().constants(replace(here, profile=profile))
        state = np.array([[0.1, 0.6, 38.0, 0.0, 0.0, 0.0]])
        return np.asarray(Bank().force(np.array([1.0, 0.0, 0.0]), state, at))[0]

    whole = pull(2)
    assert whole[0] == pytest.approx(0.0, abs=1e-9)
    for points in (3, 4, 61):
        assert pull(points) == pytest.approx(whole, rel=1e-3, abs=1e-3 * abs(whole[1]))


def test_shallow_water_acts_where_it_is_shallow():
    """One bump of the map: the hull's drag grows there by 1.2 of it, and far away not at all."""
    off = ("propeller", "rudder", "wind")
    still = (np.zeros((1, 4)), CALM, off)
    nothing = np.zeros(BY["shallow_water"].count)
    strength = nothing.copy()
    strength[4] = 0.5

    def drag(at):
        abeam = np.array([[at[0], 0.0, at[1], 0.3, 0.0, 0.0]])
        model, values = extended([BY["shallow_water"]], without=off)
        found = acceleration(model, values, strength, abeam, *still[:2])[0]
        plain = acceleration(model, values, nothing, abeam, *still[:2])[0]
        return found[1] / plain[1]

    near, away = drag(PLACES[4]), drag(PLACES[4] + 200.0)
    model, values = extended([])
    of, g = dict(zip(model.base.names, values, strict=True)), model.base.geometry
    added = of["body.m_y"] * 0.5 * g.density * g.length**2 * g.draught
    # drag up by 1 + 1.2 s, inertia by the added mass's 1 + 0.7 s
    heavier = (g.mass + 1.35 * added) / (g.mass + added)
    assert away == pytest.approx(1.0, abs=1e-9)
    assert near == pytest.approx(1.6 / heavier, rel=0.02)


@pytest.mark.parametrize(("place", "name", "grows"), [
    (12, "hull.x_0f", 0.3), (13, "hull.y_v", 0.8), (14, "hull.n_v", 1.4), (15, "hull.n_r", 0.5),
    (16, "body.m_y", 0.7), (17, "body.i_j", 0.2),
])  # fmt: skip
def test_each_force_grows_with_depth_by_a_factor_of_its_own(place, name, grows):
    """Next to that of the cross-flow drag, which is the map's measure."""
    p = np.zeros(18)
    p[4], p[place] = 0.5, np.log(2.0)
    state = np.array([PLACES[4][0], 0.0, PLACES[4][1], 0.0, 0.0, 0.0])
    at = {"shallow.places": PLACES, "shallow.spacing": 0.1}  # no bump but the one
    plain = {"hull.c_d": 1.0, name: 3.0}
    found = BY["shallow_water"].coefficients(plain, list(p), jnp.asarray(state), 0.0, at)
    assert found["hull.c_d"] == pytest.approx(1.6)
    assert found[name] == pytest.approx(3.0 * (1.0 + 2.0 * grows * 0.5))


def test_no_water_is_deeper_than_deep():
    """A map may be less than none where bumps overlap: the forces there are deep water's, and
    what a first look asks of a flat map is the slope that a shoal has."""
    model, values = extended([BY["shallow_water"]])
    abeam = np.array([[PLACES[4][0], 0.3, PLACES[4][1], 0.2, 0.0, 0.0]])
    still = (np.zeros((1, 4)), CALM)

    def at(strength):
        return acceleration(model, values, np.eye(18)[4] * strength, abeam, *still)

    assert at(-0.3) == pytest.approx(at(0.0), abs=1e-12)
    slope = jax.jacfwd(
        lambda s: model.acceleration(
            jnp.concatenate((jnp.asarray(values), jnp.eye(18)[4] * s)),
            abeam, *still,
        )
    )(0.0)  # fmt: skip
    assert np.asarray(slope) == pytest.approx((at(1e-6) - at(0.0)) / 1e-6, rel=1e-3)
    assert np.abs(slope).max() > 1e-3


def test_wind_forces_that_change_alike_differ_by_a_quarter():
    """Numbers: the share that is added to sway, and the logarithms of the other two over it."""
    one, alike = WindForce().each(setting())
    assert (one, alike) == (WindForce(), WindForce(alike=True))
    assert (one.label, alike.label) == ("wind_force", "wind_force:alike")
    assert not alike.compatible("wind_force") and alike.compatible("wind_speed_scale")
    assert alike.sizes(setting()) == pytest.approx([0.3, 0.25, 0.25])
    low, high = alike.bounds(setting())
    assert (low[0], high[0]) == (-1.0, np.inf)
    assert np.exp([low[1:], high[1:]]) == pytest.approx(np.array([[1 / math.e] * 2, [math.e] * 2]))
    p = np.array([-0.2, math.log(1.25), -math.log(1.25)])
    factors = [float(value) for value, _ in alike.displayed(p).values()]
    assert factors == pytest.approx([0.75, 0.8, 0.84])
    assert alike.scales(p)["wind"] == pytest.approx(factors)
    # the same force as that of three independent numbers
    ship, wind = under_way()[:2], under_way()[2]
    same = extended([one])[0], np.array(factors) - 1.0
    model, values = extended([alike])
    found = acceleration(model, values, p, *ship, wind)
    assert found == pytest.approx(acceleration(same[0], values, same[1], *ship, wind), rel=1e-12)
    assert alike.practical(np.array([0.02, 0.5, 0.0]), setting())  # 0.033 ahead
    assert not alike.practical(np.array([0.02, 0.0, 0.0]), setting())


def test_a_model_without_wind_has_no_wind_force_that_changes_alike():
    (one,) = WindForce().each(replace(setting(), lacking={"wind.x1": -0.7}))
    assert one == WindForce(("wind.x1",))
