"""The laws that blind cases draw: closed forms, and nothing in common with the catalogue."""

import math
from dataclasses import replace

import numpy as np
import pytest
from simulated_laws import TERMS, of, state

from pipelines.experiments.simulated_ship import (
    CALM,
    Effects,
    Laws,
    Ship,
    Wind,
    physics,
    sail,
    varied,
)
from pipelines.experiments.simulated_ship.laws import (
    BEDS,
    Air,
    Bank,
    Growth,
    Hull,
    Noise,
    Shallow,
)
from pipelines.experiments.simulated_ship.noise import oscillator, process_noise

STILL = np.zeros(2)


# --- the sample logs' laws --------------------------------------------------------------------


WITHOUT_LAWS = {  # where it ended after 120 s when forces had no `Laws`
    "everything": (
        Effects(
            turbulence=1.0, shallow_water=1.1, shoal_length=6.0, shoal_north=3.0, shoal_east=-2.0,
            shoal_towards=0.7, bank=1.4, bank_length=9.0, wind_force=(0.3, -0.2, 0.4),
        ),
        (-6.557985543477091, 0.20974748207634691, -3.437858056509101,
         0.023307998791913562, 2.5181693604378417, 0.010399526166303585),
    ),
    "nothing": (
        Effects(),
        (-8.224559543348754, 0.1952455969283276, -6.409385080577184,
         0.052680917592847896, 2.4094444355238993, 0.009010054839745527),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("effects", "end"), WITHOUT_LAWS.values(), ids=WITHOUT_LAWS)
def test_without_laws_of_her_own_she_sails_as_she_did(effects, end):
    sailed = sail(120.0, seed=9, wind=Wind(3.0, 1.0), effects=effects)
    assert state(sailed)[-1] == pytest.approx(end, rel=1e-9, abs=1e-10)
    given = sail(120.0, seed=9, wind=Wind(3.0, 1.0), effects=effects, laws=Laws())
    assert np.array_equal(state(given), state(sailed))


# --- closed forms -----------------------------------------------------------------------------


def test_each_term_grows_over_a_shoal_by_its_own_share_and_power():
    """At T/h half of the crest's, (h₀/h)² = 1/4: share · strength · (1/2)^power."""
    ship, shares = Ship(), {}
    for i, name in enumerate(TERMS):
        shares[name] = Growth(0.1 + 0.1 * i, 1.5 + 0.3 * i)
    laws = replace(Laws(), shallow=Shallow(**shares))
    c = physics.coefficients(ship, laws)
    h = physics.hidden(Effects(shallow_water=0.8), (0.0, 1.0), 1.0)

    def more(name: str) -> float:
        return 1.0 + shares[name].share * 0.8 * 0.5 ** shares[name].power

    def grown(i: int, *motion: float) -> float:
        deep, here = (physics.hull(c, h, *motion, s)[i] for s in (0.0, 0.25))
        return here / deep

    assert grown(0, 0.4, 0.0, 0.0) == pytest.approx(more("resistance"))
    assert grown(1, 0.0, 0.2, 0.0) == pytest.approx(more("cross_flow"))
    q = 0.5 * 998.0 * ship.length * ship.draught
    tiny = 1e-7  # m/s: cross-flow drag, of its square, is nothing next to the linear terms
    _, y, n = physics.hull(c, h, 0.4, tiny, 0.0, 0.25)
    assert y == pytest.approx(q * ship.sway_damping * more("sway_damping") * 0.4 * tiny, rel=1e-5)
    drift = q * ship.length * ship.yaw_drift * more("yaw_drift") * 0.4 * tiny
    assert n == pytest.approx(drift, rel=1e-5)
    _, y, n = physics.hull(c, h, 0.4, 0.0, tiny, 0.25)
    turn = q * ship.sway_turning * more("sway_turning") * 0.4 * tiny * ship.length
    damping = q * ship.yaw_damping * more("yaw_damping") * 0.4 * tiny * ship.length**2
    assert (y, n) == (pytest.approx(turn, rel=1e-5), pytest.approx(damping, rel=1e-5))

    # and the masses: accelerated from rest at a place where (h₀/h)² = 1/4
    h = physics.hidden(Effects(shallow_water=0.8, shoal_length=1.0), (0.0, 1.0), 1.0)
    at_rest, out = np.zeros(physics.STATES), np.empty(physics.STATES)
    at_rest[2] = math.sqrt(3.0)
    force = np.array([2.0, 0.0, 0.0, 0.0])
    physics.rates(c, h, at_rest, 0.0, 0.0, 0.0, np.zeros(3), STILL, force, 0.0, out)
    lever = ship.mass * ship.gravity_ahead
    mass = ship.mass + ship.added_sway * more("added_sway")
    inertia = ship.inertia * more("added_inertia")
    expected = np.linalg.solve([[mass, lever], [lever, inertia]], [2.0, 2.0 * 1.3])
    assert out[[3, 5]] == pytest.approx(expected)


@pytest.mark.parametrize("bed", BEDS)
def test_beds_are_shallow_where_they_say(bed):
    """Depths over that of the crest, by hand: h/h₀ at s = 0, ± l and ± 40 l across the line."""
    c = physics.coefficients(Ship(), replace(Laws(), shallow=Shallow(bed=bed, edge=0.25)))
    h = physics.hidden(Effects(shallow_water=1.0, shoal_length=5.0), (0.0, 1.0), 1.0)
    half, top = 1.0 + math.log(2.0), 1.0 + math.log1p(math.exp(-4.0))
    depths = {  # the line runs north: s is east
        "ridge": (math.sqrt(1601.0), math.sqrt(2.0), 1.0, math.sqrt(2.0), math.sqrt(1601.0)),
        "slope": (1.0, 1.0 + math.log1p(math.exp(-1.0)), half, 1.0 + math.log1p(math.e), 41.0),
        "plateau": (1.0 + 39 / 0.25, half, top, half, 1.0 + 39 / 0.25),
    }[bed]
    for s, depth in zip((-200.0, -5.0, 0.0, 5.0, 200.0), depths, strict=True):
        assert physics.shoal(c, h, 17.0, s) == pytest.approx(depth**-2)


@pytest.mark.parametrize(
    ("law", "shares"),
    [  # of the suction at the wall, at a gap of 6 and 12 m with a length of 6 m
        (Bank(power=1.0), (1 / 2, 1 / 3)),
        (Bank(power=2.5), (1 / 2, 1 / (1 + 2**2.5))),
        (Bank(fading="exponential", power=2.5), (1 / 2, 1 / 4)),
    ],
)
def test_a_bank_fades_by_its_own_law(law, shares):
    ship = Ship()
    c = physics.coefficients(ship, replace(Laws(), bank=law))
    h = physics.hidden(Effects(bank=1.0, bank_length=6.0), (0.0, 1.0), 1.0)
    wall = 40.0 - ship.breadth / 2
    touching = physics.bank(c, h, wall, 0.5, 0.0)[1]
    for gap, share in zip((6.0, 12.0), shares, strict=True):
        assert physics.bank(c, h, wall - gap, 0.5, 0.0)[1] == pytest.approx(share * touching)


def test_suction_lever_and_power_of_speed_are_the_banks():
    ship = Ship()
    law = Bank(suction=0.1, moment_arm=0.3, speed_power=1.7, lead_speed=1e-9)
    c = physics.coefficients(ship, replace(Laws(), bank=law))
    h = physics.hidden(Effects(bank=2.0, bank_length=6.0), (0.0, 1.0), 1.0)
    wall = 40.0 - ship.breadth / 2
    unit = 0.5 * 998.0 * ship.length * ship.draught
    x, y, n = physics.bank(c, h, wall, 0.3, 0.0)  # where every power is the square
    assert (x, y) == (0.0, pytest.approx(2.0 * 0.1 * unit * 0.3**2))
    assert n == pytest.approx(-0.3 * ship.length * y)
    assert physics.bank(c, h, wall, -0.6, 0.0)[1] / y == pytest.approx(2**1.7)
    assert physics.bank(c, h, wall, -0.6, 0.0)[2] > 0.0  # astern: the other end leads


def test_cross_flow_drag_follows_its_powers():
    """∫|2ξ|^m dξ over the hull is 1/(m + 1); a skewed end growth turns it in pure sway."""
    ship = Ship()
    law = Hull(cross_flow_power=1.8, end_growth=1.4, end_power=3.0, end_skew=0.4)
    c = physics.coefficients(ship, replace(Laws(), hull=law))
    h = physics.hidden(Effects(), (0.0, 1.0), 1.0)
    drag = 0.5 * 998.0 * ship.length * ship.draught * ship.cross_flow
    _, y, n = physics.hull(c, h, 0.0, 0.1, 0.0, 0.0)  # where every power is the square
    ends = ship.cross_flow_ends * 1.4
    assert y == pytest.approx(-drag * 0.1**2 * (1.0 + ends / 4.0), rel=1e-3)
    # ∫ |2ξ|³ · 0.4 · 2ξ · ξ L dξ = 0.2 L ∫ |2ξ|⁵ dξ = 0.4 L / 12
    assert n == pytest.approx(-drag * 0.1**2 * ends * 0.4 * ship.length / 12.0, rel=1e-3)
    assert physics.hull(c, h, 0.0, -0.2, 0.0, 0.0)[1] / y == pytest.approx(-(2**1.8))


def test_damping_stays_linear_below_the_low_speed():
    ship = Ship()
    c = physics.coefficients(ship, replace(Laws(), hull=Hull(low_speed=0.04)))
    h = physics.hidden(Effects(), (0.0, 1.0), 1.0)
    q = 0.5 * 998.0 * ship.length * ship.draught
    tiny = 1e-7
    assert physics.hull(c, h, tiny, 0.0, 0.0, 0.0)[0] == pytest.approx(
        -q * ship.resistance_ahead * 0.04 * tiny, rel=1e-5
    )
    assert physics.hull(c, h, 0.03, tiny, 0.0, 0.0)[1] == pytest.approx(
        q * ship.sway_damping * tiny * 0.05, rel=1e-5
    )


def test_an_oblique_wind_pushes_as_blendermann_says():
    ship = Ship()
    air = Air(cross_force=0.5, surge_0=0.05, surge_2=0.1, sway_2=0.04, yaw_3=0.02)
    h = physics.hidden(Effects(), (0.0, 1.0), 1.0)
    for degrees in (0.0, 30.0, 45.0, 120.0, -75.0):
        a = math.radians(degrees)
        wind = 6.0 * math.cos(a), 6.0 * math.sin(a)
        plain = physics.wind_force(physics.coefficients(ship), h, *wind)
        found = physics.wind_force(physics.coefficients(ship, replace(Laws(), air=air)), h, *wind)
        q = 0.5 * 1.225 * 36.0
        along, across = 0.80 * ship.frontal_area, 1.02 * ship.lateral_area
        oblique = 1.0 - 0.25 * (1.0 - along / across) * math.sin(2 * a) ** 2
        more = (
            -q * ship.frontal_area * (0.05 + 0.1 * math.cos(2 * a)),
            -q * ship.lateral_area * 0.04 * math.sin(2 * a),
            -q * ship.lateral_area * ship.length * 0.02 * math.sin(3 * a),
        )
        for was, now, added in zip(plain, found, more, strict=True):
            assert now == pytest.approx(was / oblique + added, abs=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_drawn_laws_give_her_no_energy_without_power(seed):
    ship, rng = varied(seed), np.random.default_rng(seed)
    u = rng.uniform((-0.5, -0.3, -0.15), (0.6, 0.3, 0.15))
    voyage = sail(
        60.0, seed=0, wind=CALM, ship=ship, laws=of(seed), helm=lambda time, now: (0.0, 0.0, 0.0),
        start=(0, u[0], 0, u[1], 1, u[2]),
    )  # fmt: skip
    energy = (
        (ship.mass + ship.added_surge) * voyage.surge**2
        + (ship.mass + ship.added_sway) * voyage.sway**2
        + 2 * ship.mass * ship.gravity_ahead * voyage.sway * voyage.yaw_rate
        + ship.inertia * voyage.yaw_rate**2
    ) / 2
    assert np.diff(energy).max() <= 1e-12
    assert energy[-1] < 0.7 * energy[0]


# --- process noise ----------------------------------------------------------------------------


@pytest.mark.parametrize(("time", "damping"), [(2.0, 0.3), (6.0, 0.8)])
def test_an_oscillator_has_the_correlation_of_the_book(time, damping):
    """Crandall & Mark (1963): e^(-ζωt) (cos ω_d t + ζω/ω_d sin ω_d t)."""
    count, step = 400_000, 0.1
    found = oscillator(np.random.default_rng(3), count, step, time, damping)
    turning = math.sqrt(1.0 - damping**2) / (damping * time)
    for lag in (0.0, 0.5 * time, time, 2.0 * time):
        rows = round(lag / step)
        measured = np.mean(found[rows:] * found[: count - rows])
        expected = math.exp(-lag / time) * (
            math.cos(turning * lag) + math.sin(turning * lag) / (time * turning)
        )
        assert measured == pytest.approx(expected, abs=0.05)


def test_noise_has_its_variance_its_bursts_and_its_slow_part():
    noise = Noise(
        sigma=(3e-4, 2e-4, 1e-4), time=(0.5, 1.0, 1.5), damping=(0.5, 0.5, 0.5),
        slow_share=0.25, slow_time=200.0, burst=0.5, burst_time=20.0,
    )  # fmt: skip
    times = np.arange(0.0, 60_000.0, 0.5)
    found = process_noise(noise, times[-1], times, np.random.default_rng(1))
    assert found.std(0) == pytest.approx(noise.sigma, rel=0.08)
    steady = process_noise(replace(noise, burst=0.0), times[-1], times, np.random.default_rng(1))
    # of a quick part with kurtosis 3 exp(4 · burst²) and three quarters of the variance:
    # 3 (0.75² e + 2 · 0.75 · 0.25 + 0.25²)
    for series, kurtosis in ((found, 3 * (0.5625 * math.e + 0.4375)), (steady, 3.0)):
        measured = (series**4).mean(0) / (series**2).mean(0) ** 2
        assert measured == pytest.approx(kurtosis, rel=0.25)
    slow = found.reshape(-1, 40, 3).mean(1)  # means of 20 s
    assert slow.var(0) / found.var(0) == pytest.approx(0.25, abs=0.08)
