"""Features of a model's discrepancy, of states and controls that are written out by hand."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import straight

from shiplog.diagnosis.linear.segment_nodes import Nodes
from shiplog.diagnosis.noise import discrepancy
from shiplog.diagnosis.noise.discrepancy import MODELLED, OMITTED, WAVES
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Profile

ACCELERATION = np.array([0.08, 0.05, 0.03])
NO_GRID: Any = None  # the nodes are given: nobody asks where they stand
TWIN = straight.PROFILE  # two rudders at -1.5 m, one screw


def profile(actuators: str, wind: bool = True) -> Profile:
    """A ship of 3 m with these [[actuators]]."""
    blows = '[sensors.wind]\ntopic = "/w"\nfields = ["speed", "angle"]\nunits = ["m/s", "deg"]\n'
    return profiles.parse(
        f"""
[ship]
name = "fair"
length_m = 3.0
[sensors.position]
kind = "local"
topic = "/p"
fields = ["x", "y"]
unit = "m"
[sensors.velocity]
kind = "body"
topic = "/v"
fields = ["u", "v"]
units = ["m/s", "m/s"]
[sensors.heading]
topic = "/h"
field = "heading"
unit = "deg"
{blows if wind else ""}
{actuators}
""",
        "fair.toml",
    )


def actuator(name: str, kind: str, place=None, limits=None) -> str:
    unit = "deg" if kind in ("rudder", "azimuth") else "rpm"
    at = "" if place is None else f"position_m = [{place[0]}, {place[1]}]\n"
    at += "" if limits is None else f"limits = {limits}\n"
    return (
        f'[[actuators]]\nname = "{name}"\nkind = "{kind}"\ntopic = "/{name}"\n'
        f'field = "x"\nunit = "{unit}"\n{at}'
    )


def nodes(state=None, controls=None, share=None, wind=None, seed: int = 0) -> Nodes:
    """Four segments of five nodes; drawn where nothing is given."""
    rng = np.random.default_rng(seed)
    state = rng.standard_normal((4, 5, 6)) if state is None else np.asarray(state, dtype=float)
    shape = state.shape[:2]
    controls = rng.standard_normal((*shape, 3)) if controls is None else controls
    share = rng.uniform(size=(*shape, 1)) if share is None else share
    wind = rng.standard_normal((*shape, 2)) if wind is None else wind
    return Nodes(state, np.concatenate((controls, share, wind), -1))


def segments_of(factors: dict) -> Any:
    """Segments of which only these factors are asked for."""
    return SimpleNamespace(factors=factors)


def products(name: str, of: Profile, at: Nodes) -> np.ndarray:
    """[S, J, F] of the products alone, before they are scaled."""
    return np.concatenate(discrepancy.PRODUCTS[name](of, at), -1)


def one(name: str, of: Profile, *at: Nodes) -> discrepancy.Family:
    (family,) = discrepancy.build(of, ACCELERATION, 0, (name,), *at).families
    return family


# --- products of ship hydrodynamics


def test_products_of_the_motion_by_hand():
    state = np.zeros((1, 1, 6))
    state[..., [1, 3, 5]] = (0.5, -0.2, 0.1)  # surge, sway, yaw rate
    u, v, r = 0.5, -0.2, 0.1
    wanted = [
        u, v, r, 0.25, -0.04, 0.01, u * v, u * r, v * r, 0.5 * v, 0.5 * r, 0.2 * r, 0.1 * v,
    ]  # fmt: skip
    assert products("motion", TWIN, nodes(state))[0, 0] == pytest.approx(wanted)


def test_a_screw_and_a_rudder_at_another_place_by_hand():
    """The rudder turns the screw's jet, though it stands behind it."""
    of = profile(actuator("rudder", "rudder", (-1.5, 0.0)) + actuator("screw", "propeller"))
    state = np.zeros((1, 1, 6))
    state[..., 1] = -0.5
    angle, n = 0.3, -4.0
    at = nodes(state, np.array([[[angle, n]]]))
    bent = math.sin(math.pi * angle / math.radians(35.0))
    wanted = [
        -16.0, 4.0 * -0.5, -64.0,
        math.sin(angle) * -0.25, 1.0 - math.cos(angle),
        -16.0 * math.sin(angle), -16.0 * (1.0 - math.cos(angle)),
        -16.0 * bent, bent * -0.25,
    ]  # fmt: skip
    assert products("controls", of, at)[0, 0] == pytest.approx(wanted)


def test_a_rudder_is_hard_over_at_the_larger_of_its_limits():
    of = profile(
        actuator("one", "rudder", limits=[-45.0, 40.0]) + actuator("other", "rudder")
        + actuator("screw", "propeller")
    )  # fmt: skip
    assert discrepancy.largest_angle(of.actuators[0]) == pytest.approx(math.radians(45.0))
    assert discrepancy.largest_angle(of.actuators[1]) == pytest.approx(math.radians(35.0))


def test_a_rudder_that_stops_short_is_a_function_of_its_angle():
    """Of a rudder that moves from hard over to hard over but acts up to 13 degrees only, what is
    left of its force lies in the family's columns; sin δ alone leaves a tenth of it."""
    of = profile(actuator("rudder", "rudder") + actuator("screw", "propeller"))
    angle = np.linspace(-1.0, 1.0, 41) * math.radians(35.0)
    at = nodes(np.ones((1, 41, 6)), np.stack((angle, np.full(41, 5.0)), -1)[None])
    acts = np.sin(np.clip(angle, *np.radians([-13.0, 13.0])))

    def left(columns: np.ndarray) -> float:
        rest = acts - columns @ np.linalg.lstsq(columns, acts)[0]
        return float(rest @ rest / (acts @ acts))

    known = products("controls", of, at)[0]
    assert left(known) < 0.02
    assert left(np.sin(angle)[:, None]) > 0.08


def test_an_azimuth_turns_the_thruster_at_its_own_place():
    """Two pods, their angles and thrusts in any order; a tunnel thruster is turned by neither."""
    of = profile(
        actuator("bow_angle", "azimuth", (1.5, 0.0))
        + actuator("aft", "thruster", (-1.5, 0.0))
        + actuator("aft_angle", "azimuth", (-1.5, 0.0))
        + actuator("bow", "thruster", (1.5, 0.0))
        + actuator("tunnel", "thruster", (1.0, 0.0))
    )
    assert discrepancy.driving_units(of, 0, [1, 3, 4]) == [3]
    assert discrepancy.driving_units(of, 2, [1, 3, 4]) == [1]
    given = np.array([[[0.5, 2.0, -0.7, 3.0, 1.0]]])
    found = products("controls", of, nodes(np.zeros((1, 1, 6)), given))[0, 0]
    # three thrusters of three products each, then six of each angle
    assert found[[0, 3, 6]] == pytest.approx([4.0, 9.0, 1.0])
    assert found[[2, 5, 8]] == pytest.approx([8.0, 27.0, 1.0])
    bow, aft = found[9:15], found[15:21]
    assert len(found) == 21
    turned = np.array([math.sin(0.5), 1.0 - math.cos(0.5)])
    assert bow[2:] == pytest.approx([*9.0 * turned, *27.0 * turned])
    turned = np.array([math.sin(-0.7), 1.0 - math.cos(-0.7)])
    assert aft[2:] == pytest.approx([*4.0 * turned, *8.0 * turned])


def test_a_thrust_that_grows_otherwise_than_with_its_square_is_a_function_of_the_order():
    """A screw that turns no faster than half of what is recorded, and one with a dead zone of a
    tenth: what their thrust is off by lies in the family's columns. Without the cube of the order
    a sixth and more of it remains."""
    of = profile(actuator("screw", "propeller"))
    n = np.linspace(0.0, 10.0, 41)
    at = nodes(np.zeros((1, 41, 6)), n[None, :, None])
    known = products("controls", of, at)[0]

    def left(thrust: np.ndarray, columns: np.ndarray) -> float:
        off = thrust - n**2
        off = off - columns[:, :2] @ np.linalg.lstsq(columns[:, :2], off)[0]
        rest = off - columns @ np.linalg.lstsq(columns, off)[0]
        return float(rest @ rest / (off @ off))

    for thrust in (np.minimum(n, 5.0) ** 2, np.maximum(n - 1.0, 0.0) ** 2):
        assert left(thrust, known) < 0.2


def test_a_rudder_turns_two_screws_at_most():
    of = profile(
        "".join(actuator(f"screw_{i}", "propeller", (0.0, i)) for i in (1, 2, 3))
        + actuator("rudder", "rudder", (-1.5, 0.0))
    )
    assert discrepancy.driving_units(of, 3, [0, 1, 2]) == [0, 1]


def test_wind_goes_with_its_square_and_harmonics_of_its_angle():
    """A ship that heads east at 1 m/s with the wind at 2 m/s from the north: 2 m/s from port and
    1 m/s from ahead are felt."""
    state = np.zeros((1, 1, 6))
    state[..., 1], state[..., 4] = 1.0, 0.5 * math.pi
    at = nodes(state, wind=np.array([[[2.0, 0.0]]]))
    assert discrepancy.apparent_flow(at)[0, 0] == pytest.approx([1.0, -2.0])
    angle = math.atan2(-2.0, 1.0)
    wanted = [5.0 * f(k * angle) for k in (1, 2, 3) for f in (math.cos, math.sin)]
    assert products("wind", TWIN, at)[0, 0] == pytest.approx(wanted)


# --- families


def test_features_have_unit_size_together_in_each_channel():
    """Weights of unit variance make an acceleration of unit variance, on average over nodes: a
    family's size is in units of the process noise."""
    at = nodes(seed=1)
    for name in (*MODELLED, *OMITTED):
        family = one(name, TWIN, at)
        features = family.features(at)
        assert features.shape == (4, 5, 3, len(family.columns))
        features = features[..., 3 * discrepancy.EVEN.get(name, 0) :]  # those are each of that size
        if name == "position":
            features = features[..., 2:, :]  # two of the channels are turned into each other
        assert (features**2).sum(-1).mean((0, 1)) == pytest.approx(np.ones(features.shape[2]))


def test_weights_are_channel_by_channel():
    at = nodes(seed=2)
    family = one("motion", TWIN, at)
    features, each = family.features(at), len(family.columns) // 3
    for channel in range(3):
        own = features[..., channel, :]
        assert (own[..., channel * each : (channel + 1) * each] != 0.0).any()
        assert np.delete(own, np.arange(channel * each, (channel + 1) * each), -1).max() == 0.0


def test_only_what_no_model_has_is_taken_from_its_mean():
    at = nodes(seed=3)
    for name in MODELLED:
        assert (one(name, TWIN, at).level == 0.0).all()
    for name in OMITTED:
        family = one(name, TWIN, at)
        features = discrepancy.features(name, TWIN, family.waves, at)
        even = discrepancy.EVEN[name]
        assert (family.level[:even] == 0.0).all()
        assert family.level[even:] == pytest.approx(features.mean((0, 1))[even:])


def test_an_even_force_is_steady_or_grows_with_place_or_time_along_the_earths_axes():
    """Weights of the first features: a steady one, then one a metre north and east of the middle,
    or one with time; not divided among the smooth features, and no steady moment."""
    at = nodes(seed=6)
    c, s = np.cos(at.state[..., 4]), np.sin(at.state[..., 4])
    for name, inputs in (
        ("position", at.state[..., [0, 2]]), ("heading", np.zeros((*at.state.shape[:2], 0))),
        ("time", at.driven[..., [-3]]),
    ):  # fmt: skip
        features, even = one(name, TWIN, at).features(at), discrepancy.EVEN[name]
        spread = (inputs - inputs.mean((0, 1))) / inputs.std((0, 1))
        growing = [np.ones(c.shape), *np.moveaxis(spread, -1, 0)]
        assert len(growing) == even
        for k, size in enumerate(growing):
            assert features[..., :, k] == pytest.approx(
                np.stack((c * size, -s * size, 0.0 * size), -1), abs=1e-12
            )
            assert features[..., :, even + k] == pytest.approx(
                np.stack((s * size, c * size, 0.0 * size), -1), abs=1e-12
            )
            moment = features[..., 2, 2 * even + k]
            assert moment == pytest.approx(size * (k > 0), abs=1e-12)


def test_headings_features_are_harmonics_of_the_angle():
    """cos kψ and sin kψ, k up to half their number: whatever was sailed, and the same after a
    turn."""
    headings = np.linspace(-3.0, 3.0, 20).reshape(4, 5)
    state = np.zeros((4, 5, 6))
    state[..., 4] = headings
    waves = one("heading", TWIN, nodes(state)).waves
    scale = math.sqrt(2.0 / WAVES["heading"])
    for psi in (0.0, 0.4, 2.5):
        wanted = [scale * f(k * psi) for k in (1, 2, 3) for f in (math.cos, math.sin)]
        assert waves(np.array([psi])) == pytest.approx(wanted, abs=1e-12)
        assert waves(np.array([psi + 2.0 * math.pi])) == pytest.approx(wanted, abs=1e-9)


def test_a_pull_towards_the_north_turns_with_the_heading():
    """Four headings at one place: the same force along the earth's axes, whichever way a ship
    lies. North: ahead, then to port, astern, to starboard."""
    around = nodes(seed=4)
    family = one("position", TWIN, around)
    state = np.zeros((4, 1, 6))
    state[..., 0], state[..., 2] = 0.7, -0.3
    state[..., 0, 4] = 0.5 * np.pi * np.arange(4)
    at = Nodes(state, around.driven[:, :1])
    features = family.features(at)
    features = features[..., 3 * discrepancy.EVEN["position"] :]
    each = features.shape[-1] // 3
    north, east, turn = (features[:, 0][..., c * each : (c + 1) * each] for c in range(3))
    pull = north[0, 0]
    assert np.abs(pull).max() > 0.01
    for s, (ahead, starboard) in enumerate(((1, 0), (0, -1), (-1, 0), (0, 1))):
        assert north[s, 0] == pytest.approx(ahead * pull, abs=1e-12)
        assert north[s, 1] == pytest.approx(starboard * pull, abs=1e-12)
        assert east[s, 0] == pytest.approx(-starboard * pull, abs=1e-12)
        assert east[s, 1] == pytest.approx(ahead * pull, abs=1e-12)
        assert turn[s, 2] == pytest.approx(pull, abs=1e-12)
        assert np.abs(north[s, 2]).max() == np.abs(turn[s, :2]).max() == 0.0


def test_families_whose_inputs_do_not_vary_are_absent():
    rng = np.random.default_rng(5)
    still = np.zeros((4, 5, 6))
    still[..., 1] = 0.5
    calm = nodes(still, np.full((4, 5, 3), 0.2), np.full((4, 5, 1), 0.5), np.full((4, 5, 2), 1.5))
    assert discrepancy.build(TWIN, ACCELERATION, 0, (*MODELLED, *OMITTED), calm).families == ()
    # what varies between campaigns is there, though each by itself is still
    later = Nodes(calm.state + 0.1, calm.driven)
    found = discrepancy.build(TWIN, ACCELERATION, 0, (*MODELLED, *OMITTED), calm, later)
    assert [f.name for f in found.families] == [
        "motion", "controls", "wind", "position", "heading"
    ]  # fmt: skip
    moving = nodes(rng.standard_normal((4, 5, 6)))
    whole = discrepancy.build(TWIN, ACCELERATION, 0, (*MODELLED, *OMITTED), moving)
    assert [f.name for f in whole.families] == [*MODELLED, *OMITTED]


def test_a_ship_without_a_wind_sensor_has_no_family_of_the_wind():
    of = profile(actuator("screw", "propeller"), wind=False)
    at = nodes(controls=np.random.default_rng(6).standard_normal((4, 5, 1)))
    names = [f.name for f in discrepancy.build(of, ACCELERATION, 0, MODELLED, at).families]
    assert names == ["motion", "controls"]


def test_a_feature_that_hardly_varies_is_not_blown_up():
    state = np.random.default_rng(7).standard_normal((4, 5, 6))
    state[..., 5] *= 1e-9  # it hardly turns
    family = one("motion", TWIN, nodes(state))
    assert np.isfinite(family.features(nodes(state))).all()
    assert family.scale.min() >= 0.999e-3 * family.scale.max()


def test_columns_follow_and_accelerations_are_in_units_of_the_process_noise(monkeypatch):
    at = nodes(seed=8)
    found = discrepancy.build(TWIN, ACCELERATION, 7, MODELLED, at)
    columns = np.concatenate([f.columns for f in found.families])
    assert columns.tolist() == list(range(7, 7 + found.count))

    monkeypatch.setattr(discrepancy.segment_nodes, "conditions_at_nodes", lambda cut, g: at)
    accelerations = found.accelerations(segments_of({}), NO_GRID)
    assert accelerations.shape == (4, 15, found.count)
    features = np.concatenate([f.features(at) for f in found.families], -1)
    for channel in range(3):
        own = accelerations[:, 5 * channel : 5 * channel + 5]
        assert own == pytest.approx(ACCELERATION[channel] * features[..., channel, :])


def test_a_wind_force_of_another_size_and_an_anemometer_of_another_scale_are_one_error(monkeypatch):
    """A wind that is 1.2 times weaker has 1/1.2² of the force, and so of each product of U_A² with
    an angle: what the model gets wrong must not tell the two apart."""
    at = nodes(state=np.zeros((4, 5, 6)), seed=8)
    found = discrepancy.build(TWIN, ACCELERATION, 0, MODELLED, at)
    driven = at.driven.copy()
    driven[..., -2:] /= 1.2

    def of(there: Nodes, factors: dict) -> np.ndarray:
        monkeypatch.setattr(discrepancy.segment_nodes, "conditions_at_nodes", lambda cut, g: there)
        return found.accelerations(segments_of(factors), NO_GRID)

    scale = of(Nodes(at.state, driven), {})
    force = of(at, {"wind": np.full(3, 1.2**-2)})
    (wind,) = (f for f in found.families if f.name == "wind")
    features = len(wind.columns) // 3
    products = [k for k in range(len(wind.columns)) if k % features < features - WAVES["wind"]]
    own = wind.columns[products]
    assert force[..., own] == pytest.approx(scale[..., own], rel=1e-9)
    assert np.abs(scale[..., own]).max() > 0.1 * ACCELERATION.min()

    one_channel, plain = of(at, {"wind": np.array([1.0, 1.5, 1.0])}), of(at, {})
    for channel, factor in enumerate((1.0, 1.5, 1.0)):
        rows = slice(5 * channel, 5 * channel + 5)
        assert one_channel[:, rows, wind.columns] == pytest.approx(
            factor * plain[:, rows, wind.columns]
        )
    others = np.setdiff1d(np.arange(found.count), wind.columns)
    assert (one_channel[..., others] == plain[..., others]).all()


def test_the_same_ship_has_the_same_features_every_time():
    at = nodes(seed=9)
    for name in (*MODELLED, *OMITTED):
        one_time, another = one(name, TWIN, at), one(name, TWIN, at)
        assert (one_time.features(at) == another.features(at)).all()
    motion, controls = one("motion", TWIN, at), one("controls", TWIN, at)
    assert motion.waves.phase[:5].tolist() != controls.waves.phase[:5].tolist()
