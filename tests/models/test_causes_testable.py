"""Which causes a ship and its instruments can be asked, and that each then changes something."""

from dataclasses import replace

import numpy as np
import pytest
from cause_ships import BY, EVERY, FERRY, PLACES, SINGLE, TWIN, acceleration, setting
from test_causes import CHANGED

from shiplog.models import causes as catalogue
from shiplog.models import mmg
from shiplog.models.causes import CATALOGUE, Setting
from shiplog.models.extended import Extended
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.recording import Record

# --- which cannot be tested -----------------------------------------------------------------------


MISSING = {
    "wind_force": "wind", "wind_direction_offset": "wind", "wind_speed_scale": "wind",
    "clock_offset:wind": "wind", "clock_offset:yaw_rate": "yaw rate", "bank": "bank",
    "contact": "bank",
    "heading_offset:gnss": "over ground", "clock_offset:velocity_turned": "over ground",
    "clock_offset:gnss_turned": "over ground",
    "rudder_force": "rudder", "yaw_rate_bias": "yaw rate", "yaw_rate_scale": "yaw rate",
}  # fmt: skip


@EVERY
def test_what_a_ferry_cannot_be_asked(cause):
    """No rudder, no wind sensor, no gyro, no chart: those causes say why; the others are tested.
    What turns its thrusters may be late or misaligned as a rudder may."""
    output = cause.missing(setting(FERRY))
    if cause.label not in MISSING:
        assert output is None
    else:
        assert output is not None and MISSING[cause.label] in output
    assert cause.missing(setting(SINGLE if "over ground" in (output or "") else TWIN)) is None


def test_a_ship_without_screw_has_no_thrust_to_lose():
    profile = SINGLE.model_copy(update={"actuators": SINGLE.actuators[:1]})
    for label in ("thrust_loss", "thrust_drift"):
        assert "propeller" in (BY[label].missing(setting(profile)) or "")


# --- every cause that is called testable changes something ----------------------------------------


def of_its_size(profile: Profile) -> Setting:
    """As `trial.setting_of` makes it, of a ship that goes two thirds of its length in 10 s."""
    ship, main, _ = mmg.geometry_of(profile)
    scale = {"speed": 0.2 * main.length / 3.0, "length": main.length, "mass": main.mass,
             "moment": main.mass * main.length}  # fmt: skip
    return Setting(profile, scale, PLACES * main.length / 3.0, 8.0 * main.length / 3.0,
                   parts=ship.parts, to_wall=7.0 * main.length)  # fmt: skip


def driven_hard(profile: Profile, scale) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random states at about the ship's speed, actuators up to their limits, a fresh wind."""
    rng = np.random.default_rng(5)
    count, speed, length = 60, scale["speed"], scale["length"]
    size = np.array((7.0 * length, speed, 7.0 * length, 0.4 * speed, 3.0, 0.4 * speed / length))
    state = size * rng.uniform(-1.0, 1.0, (count, 6))
    full = {"rudder": 0.6, "azimuth": 3.0, "propeller": 10.0, "thruster": 1.0}
    top = {t.column: t.full for t in mmg.geometry_of(profile)[0].thrusters}
    each = [top.get(i, full[a.kind]) for i, a in enumerate(profile.actuators)]
    actuator = np.append(each, 1.0) * rng.uniform(-1.0, 1.0, (count, len(each) + 1))
    return state, np.abs(actuator), rng.uniform(-6.0, 6.0, (count, 2))


def reading(profile: Profile) -> Record:
    """Ten seconds in which all moves and turns."""
    rng = np.random.default_rng(6)
    rows = 100
    return Record(
        profile=profile, names=("one",), voyage=np.zeros(rows, int), time=0.1 * np.arange(rows),
        share=np.zeros(rows), starts=np.arange(rows) == 0, measured=np.ones(rows, bool),
        state=rng.standard_normal((rows, 6)).cumsum(0),
        actuator=rng.standard_normal((rows, len(profile.actuators))).cumsum(0),
        wind=rng.standard_normal((rows, 2)),
    )  # fmt: skip


SHIPPED = pytest.mark.parametrize("name", profiles.shipped())


def inert(cause, profile: Profile, at: Setting) -> bool:
    """Whether its realistic numbers change neither the record nor the accelerations by more than
    a thousandth of what the ship has."""
    numbers = cause.sizes(at)
    before = reading(profile)
    after = cause.read(before, numbers)
    if any(not np.allclose(getattr(after, n), getattr(before, n), atol=1e-9) for n in CHANGED):
        return False
    ship, main, _ = mmg.geometry_of(profile)
    values = mmg.estimated(ship, main).values
    model = Extended(mmg.MMG(ship), (cause,), mmg.MMG(ship), values, cause.constants(at))
    batch = driven_hard(profile, at.scale)
    plain = acceleration(model, values, np.zeros(cause.count), *batch)
    changed = acceleration(model, values, numbers, *batch)
    assert np.isfinite(changed).all()
    return bool((np.abs(changed - plain) < 1e-3 * np.abs(plain).max(0)).all())


@SHIPPED
def test_no_cause_that_is_called_testable_is_inert(name):
    profile = profiles.load(name)
    at = of_its_size(profile)
    chosen, untested = catalogue.testable(at)
    labels = [cause.label for cause in chosen]
    assert len(labels) == len(set(labels)) and not set(labels) & set(untested)
    assert {label.partition(":")[0] for label in (*labels, *untested)} == {
        cause.name for cause in CATALOGUE
    }
    assert [cause.label for cause in chosen if inert(cause, profile, at)] == []


@pytest.mark.parametrize(
    ("name", "units"),
    [
        ("esso-vectwin", []),
        ("kvlcc2", []),
        ("blueboat", ["thruster_port", "thruster_starboard"]),
        ("milliampere", [f"thruster_{i}" for i in range(1, 5)]),
    ],
)
def test_of_several_units_each_can_lose_its_thrust(name, units):
    labels = [c.label for c in catalogue.testable(of_its_size(profiles.load(name)))[0]]
    found = [label for label in labels if label.startswith("thrust_loss")]
    assert found == ["thrust_loss", *(f"thrust_loss:{unit}" for unit in units)]


def test_what_the_model_leaves_out_cannot_be_tested():
    """Trained with `--without rudder`, it has no rudder force to scale and none to turn."""
    plain = of_its_size(TWIN)
    without = replace(plain, parts=tuple(p for p in plain.parts if p != "rudder"))
    untested = catalogue.testable(without)[1]
    for label in ("rudder_force", "rudder_offset", "rudder_lag", "rudder_delay"):
        assert label not in catalogue.testable(plain)[1]
        assert untested[label] == "the ship has no rudder"
    bare = catalogue.testable(replace(plain, parts=("hull",)))[1]
    assert "propeller" in bare["thrust_loss"] and "propeller" in bare["thrust_drift"]


def test_fitted_to_the_voyages_in_question_a_model_has_absorbed_its_coefficients():
    at = of_its_size(profiles.load("blueboat"))
    for fitted, word in (("physics", None), ("network", "network")):
        chosen, untested = catalogue.testable(at, fitted=fitted)
        assert "absorbs" in untested["thrust_loss"] and "absorbs" in untested["fouling"]
        assert "absorbs" in untested["thrust_loss:thruster_port"]
        assert "current" in {c.label for c in chosen}
        assert (word or "") in untested.get("antenna_offset", "")


def test_a_ship_that_stays_has_no_map_of_the_bottom():
    one = setting(TWIN, PLACES[:3])
    assert "place" in (BY["shallow_water"].missing(one) or "")
